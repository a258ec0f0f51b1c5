//! `swell inspect` as a user reads it.

use std::fs;

use crate::support::job::{Job, assert_has};

#[test]
fn inspect_shows_plan_and_frames() {
    let job = Job::new();
    let shown = |words: &str| String::from_utf8(job.run(words).stdout).unwrap();
    let plan = shown("inspect small.toml");
    assert!(
        plan.contains("effects/viscosity_gather") && plan.contains("solid_distance"),
        "{plan}"
    );
    assert!(!plan.contains("vorticity"), "{plan}");
    job.expect(0, "bake small.toml -o cache --frames 1-2");
    let frames = shown("inspect cache");
    assert!(
        frames.lines().filter(|line| line.contains("m/s")).count() >= 2,
        "{frames}"
    );
    let adapters = shown("inspect --adapters");
    assert!(adapters.contains("max_storage_buffer_binding_size"));
    assert!(
        adapters.contains("two words keep what one loses: yes"),
        "{adapters}"
    );
}

/// The purposes of passes and buffers: counts and bytes without running a device, milliseconds with
/// it; an effect that the scene does not name has no line.
#[test]
fn inspect_says_what_each_part_takes() {
    let job = Job::new();
    let shown = |words: &str| String::from_utf8(job.run(words).stdout).unwrap();
    let rows = |shown: &str| -> Vec<Vec<String>> {
        let rows = shown.lines().skip_while(|line| !line.starts_with("for  "));
        let words = rows.skip(1).map(|line| line.split_whitespace());
        let rows = words.map(|words| words.map(str::to_owned).collect());
        rows.collect()
    };
    let of = |rows: &[Vec<String>], part: &str| rows.iter().find(|row| row[0] == part).cloned();
    let planned = rows(&shown("inspect small.toml"));
    let viscosity = of(&planned, "viscosity").expect("a line");
    assert!(viscosity.len() == 3 && viscosity[1] == "2", "{viscosity:?}");
    assert!(viscosity[2].parse::<u64>().unwrap() > 0, "{viscosity:?}");
    let bare = rows(&shown("inspect small.toml --set effects={}"));
    assert_eq!(of(&bare, "viscosity"), None);
    assert_eq!(bare.len(), planned.len() - 1);
    let said = shown("inspect small.toml --time 2");
    assert!(
        said.contains("s a frame") && said.contains("over 2 frames after the first"),
        "{said}"
    );
    let timed = rows(&said);
    let parts: f64 = timed.iter().map(|row| row[4].parse::<f64>().unwrap()).sum();
    assert!(
        (parts - 100.0).abs() < 0.1 * timed.len() as f64,
        "{timed:?}"
    );
    let milliseconds = of(&timed, "viscosity").expect("a line")[3].clone();
    assert!(milliseconds.parse::<f64>().unwrap() > 0.0, "{milliseconds}");
    assert!(
        job.expect(2, "inspect look.toml --time 2")
            .contains("--time")
    );
    assert!(
        job.expect(2, "inspect small.toml --time 0")
            .contains("--time")
    );
    // Of 8 frames; 7, the largest valid count, was not refused above.
    let said = job.expect(2, "inspect small.toml --time 8");
    let expected = "--time 8: small.toml has 8 frames, and the first is not timed: \
        up to 7 are possible; raise shot.frames";
    assert!(said.contains(expected), "{said}");
    shown("inspect small.toml --time 7");
}

/// Names in the first column of the table that begins with `heading`.
fn column(shown: &str, heading: &str) -> Vec<String> {
    let rows = shown.lines().skip_while(|line| !line.starts_with(heading));
    let rows = rows.skip(1).take_while(|line| !line.is_empty());
    rows.map(|line| line.split(' ').next().unwrap().to_owned())
        .collect()
}

#[test]
fn inspect_shows_the_passes_that_render_runs() {
    let job = Job::new();
    let bare = job.expect(0, "inspect look.toml");
    assert!(
        !bare.contains("ssfr/solid") && !bare.contains("triangles"),
        "{bare}"
    );
    let of_scene = job.expect(0, "inspect look.toml --scene small.toml");
    job.expect(0, "bake small.toml -o cache --frames 1-2");
    let of_cache = job.expect(0, "inspect look.toml --scene cache");
    let (passes, buffers) = (column(&of_cache, "pass "), column(&of_cache, "buffer "));
    for (found, wanted) in [
        (&passes, "ssfr/solid"),
        (&passes, "ssfr/shade_aovs"),
        (&buffers, "triangles"),
        (&buffers, "particles"),
    ] {
        assert!(found.iter().any(|name| name == wanted), "{of_cache}");
    }
    assert_eq!(column(&of_scene, "pass "), passes);
    assert_ne!(column(&bare, "pass "), passes, "the control");
    assert!(column(&of_cache, "texture ").contains(&"shadow_map".to_owned()));

    // The timed passes are the planned ones, and timing changes no picture.
    let render = "render cache --look look.toml --progress none";
    let timed = job.expect(0, &format!("{render} -o timed --time-passes"));
    assert_eq!(column(&format!("pass \n{timed}"), "pass "), passes);
    assert!(
        !job.expect(0, &format!("{render} -o plain"))
            .contains("ssfr/")
    );
    for name in ["small.0002.png", "small.0002.exr"] {
        let bytes = |folder: &str| fs::read(job.path(folder).join(name)).unwrap();
        assert!(bytes("timed") == bytes("plain"), "{name}");
    }

    for words in [
        "inspect small.toml --scene small.toml",
        "inspect look.toml --set shot.frames=2",
        "inspect look.toml --scene cache --solver flip",
        "inspect look.toml --scene look.toml",
    ] {
        job.expect(2, words);
    }
    job.expect(4, "inspect look.toml --scene missing");
}

/// The runs of a study and the contents of a single file, for people and for programs; a torn
/// file is reported.
#[test]
fn inspect_knows_studies_frames_meshes_grids_and_pictures() {
    let job = Job::new();
    job.expect(0, "bake small.toml -o cache --frames 1-1 --device cpu");
    job.expect(0, "export cache --vdb g.%04d.vdb --mesh m.%04d.ply");
    job.expect(0, "render cache --look look.toml -o day");
    let object = |file: &str| job.json(0, &format!("inspect {file}"));

    let study = object("study.toml");
    assert_eq!(
        (&study["kind"], &study["points"]),
        (&"study".into(), &2.into())
    );
    assert_eq!(study["study"], "solver_comparison");
    assert_has(
        &job.expect(0, "inspect study.toml"),
        &["pbf", "flip", "frames 1-6, pictures 3-6x3"],
    );

    let frame = object("cache/frames/small.0001.ply");
    let listed = object("cache");
    assert_eq!(frame["kind"], "frame");
    assert_eq!(frame["particles"], listed["frames"][1]["particles"]);
    // Within the domain, from one side's wave maker on.
    let corner = |end: &str| frame["bounds"][end].as_array().unwrap().clone();
    for (axis, [low, high]) in [[-1.0, 1.0], [0.5, 2.5], [0.25, 1.25]]
        .into_iter()
        .enumerate()
    {
        let (min, max) = (
            corner("min")[axis].as_f64().unwrap(),
            corner("max")[axis].as_f64().unwrap(),
        );
        assert!(low < min && min < max && max < high, "{frame}");
    }
    assert_has(
        &job.expect(0, "inspect cache/frames/small.0001.ply"),
        &["a frame of", "shot small", "frame 1", "velocity, id"],
    );

    job.expect(
        0,
        "bake small.toml -o packed --frames 1-1 --device cpu --set keep={compression=\"zstd\"}",
    );
    let mut packed = object("packed/frames/small.0001.ply.zst");
    let comments = packed["comments"].as_array_mut().unwrap();
    assert_eq!(comments.pop(), Some("differences 131072".into()));
    assert_eq!(packed, frame);

    let mesh = object("m.0001.ply");
    assert_eq!(
        (&mesh["kind"], &mesh["open_edges"]),
        (&"mesh".into(), &0.into())
    );
    let solid = object("box.obj");
    assert_eq!(
        (&solid["triangles"], &solid["vertices"]),
        (&12.into(), &8.into())
    );
    assert_eq!(
        solid["bounds"]["max"],
        serde_json::json!([0.7, 1.0, 0.9]),
        "{solid}"
    );

    let grids = object("g.0001.vdb");
    let surface = grids["grids"]
        .as_array()
        .unwrap()
        .iter()
        .find(|it| it["grid"] == "surface");
    let surface = surface.expect("a surface");
    assert_eq!(surface["class"], "level set");
    assert!(surface["voxels"].as_u64().unwrap() > 100, "{grids}");
    assert!(surface["voxel_size"][0].as_f64().unwrap() > 0.0, "{grids}");

    let look = object("look.toml");
    assert_eq!(
        (&look["renderer"], &look["formats"]),
        (&"ssfr".into(), &serde_json::json!(["png", "exr"]))
    );
    for (file, channels) in [("day/small.0001.png", 3), ("day/small.0001.exr", 5)] {
        let picture = object(file);
        assert_eq!(
            (&picture["kind"], &picture["width"], &picture["height"]),
            (&"picture".into(), &64.into(), &36.into())
        );
        assert_eq!(
            (&picture["frame"], &picture["shot"]),
            (&1.into(), &"small".into())
        );
        assert_eq!(picture["scene"], listed["scene"]);
        assert_eq!(
            picture["channels"].as_array().unwrap().len(),
            channels,
            "{picture}"
        );
    }

    for file in [
        "cache/frames/small.0001.ply",
        "packed/frames/small.0001.ply.zst",
        "g.0001.vdb",
        "m.0001.ply",
        "day/small.0001.png",
        "day/small.0001.exr",
    ] {
        job.expect(2, &format!("inspect {file} --solver flip"));
        let path = job.path(file);
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() - bytes.len() / 3]).unwrap();
        let said = job.expect(4, &format!("inspect {file}"));
        assert_eq!(said.trim_end().lines().count(), 1, "{said}");
        assert_has(&said, &[file.rsplit('/').next().unwrap()]);
    }
    job.expect(4, "inspect missing.ply");
    job.expect(2, "inspect study.toml --time 1");
    job.edit("study.toml", "pbf", "sph");
    assert_has(
        &job.expect(2, "inspect study.toml"),
        &["study.toml", "solvers"],
    );
}

/// Names of USD and glTF objects that a look and a scene may use; unread parts are reported.
#[test]
fn inspect_names_cameras_and_what_moves() {
    let job = Job::of(&[]);
    let write = |name: &str, text: &str| fs::write(job.path(name), text).unwrap();
    let door = include_str!("../../../src/files/solid_track/door.usda");
    let lens = include_str!("../../../src/files/look/usd_camera/blender_lens.usda");
    write("door.usda", door);
    write("lens.usda", lens);
    let taken = "def Xform \"set\" (\n    references = @set.usda@\n)\n{\n}\n";
    write("taken.usda", &format!("{lens}\n{taken}"));
    write(
        "eye.gltf",
        "{\"asset\":{\"version\":\"2.0\"},\"cameras\":[{\"type\":\"perspective\",\
         \"perspective\":{\"yfov\":0.5,\"znear\":0.1}}],\
         \"nodes\":[{\"name\":\"shot\",\"camera\":0},{\"name\":\"set\"}]}",
    );
    let object = |file: &str| job.json(0, &format!("inspect {file}"));
    let list = |of: &[&str]| serde_json::json!(of);
    let found = object("door.usda");
    assert_eq!(found["kind"], "usd");
    assert_eq!(found["cameras"], list(&[]));
    assert_eq!(found["animated"], list(&["/root/cart/door", "/root/cart"]));
    let found = object("lens.usda");
    assert_eq!(found["cameras"], list(&["/root/shot_020/lens"]));
    assert_eq!(found["animated"], list(&[]));
    assert_eq!(found["warnings"], list(&[]));
    let found = object("eye.gltf");
    assert_eq!(found["kind"], "gltf");
    assert_eq!(found["cameras"], list(&["shot"]));
    let said = job.expect(0, "inspect taken.usda");
    assert_has(
        &said,
        &[
            "USD, 1 camera",
            "/root/shot_020/lens",
            "warning: prim /set takes parts from elsewhere",
        ],
    );
    // A look states where in such a file its camera comes from.
    let plate = include_str!("../../../src/files/look/usd_camera/plate.usda");
    write("plate.usda", plate);
    for (start, words) in [
        (
            "start = 1001",
            "camera from plate.usda, whose frame 1001 is frame 1, a pinhole",
        ),
        ("", "camera from plate.usda, a pinhole"),
    ] {
        let camera = format!("[camera]\nfile = \"plate.usda\"\n{start}\n");
        let rest = "[image]\nwidth = 160\nheight = 90\n[sky]\nmodel = \"hosek_wilkie\"\n";
        write("plate.toml", &(camera + rest));
        assert_has(&job.expect(0, "inspect plate.toml"), &[words]);
        assert_eq!(
            format!(
                "camera {}",
                object("plate.toml")["camera"].as_str().unwrap()
            ),
            words
        );
    }
    write("torn.usda", &door[..door.len() / 2]);
    for (file, words) in [
        ("torn.usda", "ends too early"),
        ("none.glb", "cannot read none.glb"),
    ] {
        let said = job.expect(4, &format!("inspect {file}"));
        assert!(
            said.contains(words) && said.trim_end().lines().count() == 1,
            "{said}"
        );
    }
}
