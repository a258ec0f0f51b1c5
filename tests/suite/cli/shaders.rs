//! `--shaders DIR`: an edited shader has its effect and is recorded; the shipped shaders
//! count as unedited.

use std::fs;

use serde_json::Value;
use swell::render::image::read_png_attributes;

use crate::support::job::{Job, LOOK, assert_has};

/// A job with a copy of the shipped shaders in each of `folders`.
fn job(folders: &[&str]) -> Job {
    let job = Job::new();
    for folder in folders {
        job.copy_shaders(folder);
    }
    job
}

/// A word that changes nothing but the text.
fn comment(job: &Job, folder: &str) {
    job.edit(
        &format!("{folder}/pbf/predict.wgsl"),
        "// Explicit step",
        "// An explicit step",
    );
}

/// Makes a substep too long for the particles.
fn overshoot(job: &Job, folder: &str) {
    job.edit(
        &format!("{folder}/pbf/predict.wgsl"),
        "let free = start + params.time_step * v;",
        "let free = start + 1.01 * params.time_step * v;",
    );
}

fn recorded(job: &Job, cache: &str) -> Option<String> {
    let text = fs::read_to_string(job.path(cache).join("manifest.json")).unwrap();
    let manifest: Value = serde_json::from_str(&text).unwrap();
    manifest["shaders"].as_str().map(str::to_owned)
}

#[test]
fn a_bake_by_edited_shaders_is_recorded_and_not_resumed_by_others() {
    let job = job(&["same", "comment", "edit"]);
    comment(&job, "comment");
    overshoot(&job, "edit");
    job.expect(0, "bake small.toml --frames 1-2 -o plain");
    for folder in ["same", "comment", "edit"] {
        let said = job.expect(
            0,
            &format!("bake small.toml --frames 1-2 -o by-{folder} --shaders {folder}"),
        );
        let is_flagged = said.contains("not the shipped ones");
        assert_eq!(is_flagged, folder != "same", "{folder}: {said}");
        let shown = job.expect(0, &format!("inspect by-{folder}"));
        assert_eq!(
            shown.contains("not the shipped ones"),
            is_flagged,
            "{shown}"
        );
    }
    // The shipped shaders, read from a folder, are the shipped program.
    assert_eq!(job.hash("plain"), job.hash("by-same"));
    assert_eq!(recorded(&job, "plain"), None);
    let (comment, edit) = (recorded(&job, "by-comment"), recorded(&job, "by-edit"));
    assert!(comment.is_some() && edit.is_some() && comment != edit);
    // A comment changes only the record, an edit also the water.
    assert_ne!(job.hash("plain"), job.hash("by-comment"));
    assert_eq!(job.hash("plain/frames"), job.hash("by-comment/frames"));
    assert_ne!(job.hash("plain/frames"), job.hash("by-edit/frames"));
    // Only the same shaders can resume a bake.
    for (cache, shaders, words) in [
        ("by-edit", "", 2),
        ("by-edit", "--shaders comment", 1),
        ("plain", "--shaders edit", 2),
    ] {
        let before = job.hash(cache);
        let said = job.expect(
            4,
            &format!("bake small.toml --frames 1-3 -o {cache} --resume {shaders}"),
        );
        assert_has(
            &said,
            &["was baked with shaders = ", "the shipped ones"][..words],
        );
        assert_eq!(job.hash(cache), before);
    }
    job.expect(
        0,
        "bake small.toml --frames 1-3 -o by-edit --resume --shaders edit",
    );
    job.expect(
        0,
        "bake small.toml --frames 1-3 -o plain --resume --shaders same",
    );
}

#[test]
fn a_check_says_whose_shaders_it_ran() {
    let job = job(&["same", "edit"]);
    overshoot(&job, "edit");
    let same = job.json(0, "check small.toml --progress none --shaders same");
    assert_eq!(same["shaders"], Value::Null);
    let edited = job.json(1, "check small.toml --progress none --shaders edit");
    assert_eq!(edited["shaders"].as_str().unwrap().len(), 64);
    assert_eq!(edited["first_over"]["pass"], "pbf/predict");
    let said = job.expect(1, "check small.toml --shaders edit");
    assert_has(&said, &["not the shipped ones"]);
}

/// Rays have a pass mark, splats are measured; depths that are a tenth too large fail.
#[test]
fn surfaces_in_pictures_are_held_against_rays_in_f64() {
    let job = job(&["edit"]);
    job.edit(
        "edit/rays/aovs.wgsl",
        "store_under(over, out, found.t / along, normal",
        "store_under(over, out, 1.1 * found.t / along, normal",
    );
    job.expect(0, "bake small.toml --frames 1-2 -o cache");
    let check = "check cache --render --look look.toml";
    let found = job.json(0, check);
    let rows = found["rows"].as_array().unwrap();
    let depth = |row: &Value| row["surface"]["depth"][1].as_f64().unwrap();
    assert_eq!([&rows[0]["method"], &rows[1]["method"]], ["ssfr", "ray"]);
    assert!(depth(&rows[1]) < depth(&rows[0]), "{found}");
    assert!(rows[1]["surface"]["pixels"].as_u64().unwrap() > 100);
    let spoiled = job.json(1, &format!("{check} --shaders edit"));
    assert_eq!(spoiled["within"], false);
    assert_has(
        &job.expect(1, "check cache --render --look look.toml --shaders edit"),
        &["OUT"],
    );
    // With an open shutter, rays are compared at their own times too.
    let open = LOOK.replace("samples = 1", "samples = 1\nshutter = 0.5");
    fs::write(job.path("open.toml"), open).unwrap();
    let check = "check cache --render --look open.toml";
    let [found, spoiled] = [(0, ""), (1, " --shaders edit")]
        .map(|(code, more)| job.json(code, &format!("{check}{more}"))["rows"][2].clone());
    assert_eq!(found["method"], "open");
    assert!(found["surface"]["pixels"].as_u64().unwrap() > 10, "{found}");
    assert!(depth(&spoiled) > depth(&found) + 0.25, "{spoiled}");
    for (words, said) in [
        ("check cache --render", "--look"),
        (
            "check small.toml --render --look look.toml",
            "--render is for caches",
        ),
        (
            "check cache --render --look look.toml --substep 2",
            "--substep, --solver or --set is for checks of passes",
        ),
        ("check cache --render --look no.toml", "no.toml"),
    ] {
        assert_has(&job.expect(2, words), &[said]);
    }
    assert_has(
        &job.expect(4, "check cache --render --look look.toml --frames 9"),
        &["9"],
    );
}

/// Outlines, colour and flicker of both methods, each with a shader that spoils it.
#[test]
fn outlines_colour_and_flicker_of_pictures_are_told() {
    let job = job(&["wide", "dim", "flashing"]);
    job.edit(
        "wide/shared/ssfr_ellipsoid.wgsl",
        "let d = shape.diagonal;",
        "let d = 0.06 + shape.diagonal;",
    );
    job.edit(
        "dim/ssfr/shade.wgsl",
        "store_light(out, vec4f(colour, alpha)",
        "store_light(out, vec4f(0.2 * colour, alpha)",
    );
    // Frames are a sixtieth of a second apart.
    job.edit(
        "flashing/ssfr/shade.wgsl",
        "store_light(out, vec4f(colour, alpha)",
        "store_light(out, vec4f(colour * (1.0 + 0.5 * cos(188.5 * camera.clock)), alpha)",
    );
    job.expect(0, "bake small.toml --frames 1-3 -o cache");
    let check = "check cache --render --look look.toml";
    let plain = job.json(0, check);
    for key in ["score", "flicker"] {
        assert_eq!(plain["rows"][0][key], Value::Null, "not asked for");
    }
    let asked = format!("{check} --colour --flicker");
    for frame in [0, 3] {
        let said = job.expect(4, &format!("{asked} --frames {frame}"));
        let refusal = format!("and frame {frame} lacks one of them");
        assert!(said.contains(&refusal), "{said}");
    }
    // The frame before the last one, which has neighbours.
    let found = job.json(0, &asked);
    assert_eq!(found["frames"], serde_json::json!([2]));
    let of = |found: &Value, row: usize, key: &str| found["rows"][row][key].as_f64().unwrap();
    let offset = |found: &Value| {
        let surface = &found["rows"][0]["surface"];
        surface["silhouette"]["offset"].as_f64().unwrap()
    };
    assert!(of(&found, 1, "score") > of(&found, 0, "score"), "{found}");
    assert!(found["truth_residual"].as_f64().unwrap() > 0.0, "{found}");
    let spoiled = |folder: &str| job.json(0, &format!("{asked} --shaders {folder}"));
    let wide = spoiled("wide");
    assert!(offset(&wide) > offset(&found) + 0.3, "{wide}");
    let dim = spoiled("dim");
    assert!(of(&dim, 0, "score") < of(&found, 0, "score") - 5.0, "{dim}");
    assert_eq!(
        of(&dim, 1, "score"),
        of(&found, 1, "score"),
        "rays have no part in it"
    );
    let flashing = spoiled("flashing");
    assert!(
        of(&flashing, 0, "flicker") > 3.0 * of(&found, 0, "flicker"),
        "{flashing}"
    );
    assert_eq!(of(&flashing, 1, "flicker"), of(&found, 1, "flicker"));
    // A flashing picture is off the mean of its neighbours by the flash, whatever the truth does.
    assert!(of(&flashing, 0, "residual") > 3.0 * of(&found, 0, "residual"));
    assert_eq!(of(&flashing, 1, "residual"), of(&found, 1, "residual"));
    let said = job.expect(0, &asked);
    assert_has(
        &said,
        &[
            "silhouette",
            "waterline",
            "SSIMULACRA 2",
            "flicker",
            "% of white",
        ],
    );
    assert_has(&job.expect(2, "check cache --flicker"), &["--render"]);
}

/// `check` draws pictures from the same frames as `render`: one more frame in the cache changes
/// what is spray, and changes nothing where there is no spray.
#[test]
fn checked_pictures_are_drawn_from_the_frames_around_them() {
    let job = job(&[]);
    let spray = "[water]\nspray = { density_per_metre = 24.0, speed_m_per_s = 0.1 }\n\n[output]";
    job.write("spray.toml", &LOOK.replace("[output]", spray));
    let measured = |frames: &str| {
        job.expect(
            0,
            &format!("bake small.toml --frames {frames} -o of-{frames}"),
        );
        ["look.toml", "spray.toml"].map(|look| {
            let check = format!("check of-{frames} --render --colour --frames 2 --look {look}");
            let found = job.json(0, &check);
            [0, 1].map(|row| found["rows"][row]["score"].as_f64().unwrap())
        })
    };
    let [before, after] = ["1-3", "1-4"].map(measured);
    assert_eq!(before[0], after[0], "no spray");
    assert!(
        before[1][0] != after[1][0] && before[1][1] != after[1][1],
        "{before:?} {after:?}"
    );
}

#[test]
fn a_picture_by_edited_shaders_says_so_and_stays_apart() {
    let job = job(&["same", "edit"]);
    job.edit(
        "edit/shared/ssfr_water.wgsl",
        "let n = shading.index;",
        "let n = 1.2 * shading.index;",
    );
    job.expect(0, "bake small.toml --frames 1-2 -o cache");
    let render = "render cache --look look.toml --frames 2";
    job.expect(0, &format!("{render} -o plain"));
    job.expect(0, &format!("{render} -o same --shaders same"));
    let said = job.expect(0, &format!("{render} -o edited --shaders edit"));
    assert_has(&said, &["not the shipped ones"]);
    let picture = |folder: &str| job.path(folder).join("small.0002.png");
    let bytes = |folder: &str| fs::read(picture(folder)).unwrap();
    assert!(bytes("plain") == bytes("same"));
    assert!(bytes("plain") != bytes("edited"));
    let software = |folder: &str| read_png_attributes(&picture(folder)).unwrap().software;
    assert!(!software("plain").contains("shaders"));
    assert_has(
        &software("edited"),
        &["with shaders ", "not the shipped ones"],
    );
    let said = job.expect(4, &format!("{render} -o plain --shaders edit"));
    assert_has(&said, &["another set of shaders"]);
}

#[test]
fn a_folder_that_is_not_whole_or_does_not_compile_is_refused_with_its_place() {
    let job = job(&["torn", "broken"]);
    fs::remove_file(job.path("torn/shared/walls.wgsl")).unwrap();
    job.edit(
        "broken/pbf/predict.wgsl",
        "let x = confine(free);",
        "let x = confined(free);",
    );
    let text = fs::read_to_string(job.path("broken/pbf/predict.wgsl")).unwrap();
    let before = (text.lines()).take_while(|line| !line.contains("confined("));
    let place = format!("pbf/predict.wgsl:{}:", before.count() + 1);
    for (shaders, words) in [
        ("torn", &["torn", "lack shared/walls.wgsl"][..]),
        ("nowhere", &["cannot read the shaders in nowhere"]),
        ("broken", &["edited shader pbf/predict", &place, "confined"]),
        ("torn --device cpu", &["--shaders run on a GPU"]),
    ] {
        let said = job.expect(
            2,
            &format!("bake small.toml --frames 1-1 -o cache --shaders {shaders}"),
        );
        assert_has(&said, words);
        assert!(!job.path("cache").exists());
    }
    job.expect(0, "bake small.toml --frames 1-1 -o cache");
    job.edit(
        "broken/shared/ssfr_water.wgsl",
        "let n = shading.index;",
        "let n = shading.no_such;",
    );
    let said = job.expect(
        2,
        "render cache --look look.toml -o pictures --shaders broken",
    );
    assert_has(&said, &["edited shader ssfr/shade", "no_such"]);
}

/// The program fixes bindings and layouts: an edit that changes them is refused before
/// anything is written.
#[test]
fn an_edit_that_the_program_cannot_bind_or_compose_is_refused_with_its_place() {
    let job = job(&["name", "layout", "shared", "import"]);
    for (from, to) in [
        ("> velocity:", "> velocities:"),
        ("velocity[thread]", "velocities[thread]"),
    ] {
        job.edit("name/pbf/predict.wgsl", from, to);
    }
    job.edit(
        "layout/shared/pbf_params.wgsl",
        "    time_step: f32,",
        "    more: vec4f,\n    time_step: f32,",
    );
    job.edit(
        "shared/shared/confine.wgsl",
        "fn confine(",
        "fn confine_not(a: f32) -> f32 { return b; }\nfn confine(",
    );
    job.edit(
        "import/pbf/predict.wgsl",
        "shared/confine.wgsl",
        "shared/confined.wgsl",
    );
    let line = |folder: &str, file: &str, words: &str| {
        let text = fs::read_to_string(job.path(folder).join(file)).unwrap();
        let line = text.lines().position(|line| line.contains(words)).unwrap();
        format!("{file}:{}", line + 1)
    };
    let confine = line("shared", "shared/confine.wgsl", "return b;");
    let import = line("import", "pbf/predict.wgsl", "confined");
    for (shaders, words) in [
        (
            "name",
            &[
                "edited shader pbf/predict",
                "`velocities` is not a buffer of the program",
            ][..],
        ),
        ("layout", &["`params` is", "and the program has"]),
        ("shared", &[&confine, "`b`"]),
        (
            "import",
            &["edited shader shared/confined.wgsl: no such file", &import],
        ),
    ] {
        let said = job.expect(
            2,
            &format!("bake small.toml --frames 1-1 -o cache --shaders {shaders}"),
        );
        assert_has(&said, words);
        assert!(!job.path("cache").exists());
    }
}

/// A branch of such a cache by the shipped shaders records whose frames it began from, and so do
/// pictures of both.
#[test]
fn what_follows_from_frames_of_edited_shaders_says_so() {
    let job = job(&["edit"]);
    overshoot(&job, "edit");
    job.expect(0, "bake small.toml --frames 1-2 -o plain");
    job.expect(0, "bake small.toml --frames 1-2 -o edited --shaders edit");
    let hash = recorded(&job, "edited").unwrap();
    for (from, is_edited) in [("plain", false), ("edited", true)] {
        let branch = format!("from-{from}");
        let said = job.expect(
            0,
            &format!("bake small.toml --frames 1-3 --from {from}:2 -o {branch}"),
        );
        assert_eq!(said.contains(&hash), is_edited, "{said}");
        let said = job.expect(0, &format!("inspect {branch}"));
        assert_eq!(said.contains(&hash), is_edited, "{said}");
        for cache in [from, &branch] {
            let pictures = format!("pictures-{cache}");
            let said = job.expect(
                0,
                &format!("render {cache} --look look.toml --frames 2 -o {pictures}"),
            );
            assert_eq!(said.contains(&hash), is_edited, "{said}");
            let picture = job.path(&pictures).join("small.0002.png");
            let software = read_png_attributes(&picture).unwrap().software;
            assert_eq!(software.contains(&hash), is_edited, "{software}");
        }
    }
}
