//! The whole program as a user runs it: bake, resume, verify, render; exit codes; which
//! files stay untouched.

use std::{
    fs,
    path::Path,
    process::{Command, Stdio},
    time::{Duration, Instant},
};

use crate::support::job::Job;

/// `other` is a setting that changes the physics.
fn same_bytes_twice_and_after_any_stop(solver: &str, other: &str) {
    let job = Job::new();
    let bake = format!("bake small.toml --solver {solver} -o");
    job.expect(0, &format!("{bake} whole"));
    job.expect(0, &format!("{bake} again"));
    assert_eq!(job.hash("whole"), job.hash("again"));
    job.expect(0, "verify whole");
    for stops in [&["1"][..], &["1-3", "1-4"], &["1-7"]] {
        let cache = format!("stop{}", stops[0]);
        for stop in stops {
            job.expect(0, &format!("{bake} {cache} --frames {stop} --resume"));
            assert_ne!(job.hash("whole"), job.hash(&cache));
        }
        job.expect(0, &format!("{bake} {cache} --resume"));
        assert_eq!(job.hash("whole"), job.hash(&cache), "{stops:?}");
    }
    // A finished bake has nothing to resume, and does not change.
    job.expect(0, &format!("{bake} whole --resume"));
    assert_eq!(job.hash("whole"), job.hash("again"));
    // Negative control: other physics, other bytes.
    job.expect(0, &format!("{bake} other --set {other}"));
    assert_ne!(job.hash("whole"), job.hash("other"));
}

#[test]
fn bakes_are_the_same_bytes_twice_and_after_any_stop() {
    same_bytes_twice_and_after_any_stop("pbf", "solver.pbf.iterations=5");
}

#[test]
fn flip_bakes_are_the_same_bytes_twice_and_after_any_stop() {
    same_bytes_twice_and_after_any_stop("flip", "solver.flip.pic_blend=0.06");
}

#[test]
fn one_scene_bakes_with_either_solver_and_caches_stay_apart() {
    let job = Job::new();
    let said = job.expect(0, "bake small.toml --solver flip --frames 1-2");
    assert!(
        said.contains("flip on") && said.contains("residual"),
        "{said}"
    );
    const ALONE: &str = "--set solver.pbf.grid_projection=false";
    job.expect(0, &format!("bake small.toml --frames 1-2 {ALONE}"));
    for solver in ["flip", "pbf"] {
        job.expect(0, &format!("verify cache/small/{solver}"));
        job.expect(
            0,
            &format!("render cache/small/{solver} --look look.toml -o {solver} --frames 2"),
        );
    }
    let png = |solver: &str| fs::read(job.path(solver).join("small.0002.png")).unwrap();
    assert_ne!(png("flip"), png("pbf"));

    let before = job.hash("cache/small/pbf");
    let said = job.expect(
        4,
        "bake small.toml --solver flip -o cache/small/pbf --resume",
    );
    assert!(
        said.contains("solver.method was \"pbf\", is now \"flip\""),
        "{said}"
    );
    assert_eq!(job.hash("cache/small/pbf"), before);

    let shown = |words: &str| String::from_utf8(job.run(words).stdout).unwrap();
    let frames = shown("inspect cache/small/flip");
    assert!(
        frames.contains("residual") && frames.contains("missed"),
        "{frames}"
    );
    assert!(!shown("inspect cache/small/pbf").contains("residual"));
    let plan = shown("inspect small.toml --solver flip");
    assert!(
        plan.contains("flip/") && plan.contains("pressure/"),
        "{plan}"
    );
    assert!(
        !plan.contains("pbf/") && !plan.contains("effects/"),
        "{plan}"
    );
    assert!(!shown(&format!("inspect small.toml {ALONE}")).contains("flip/"));
    // PBF with its projection runs passes of both.
    let both = shown("inspect small.toml");
    assert!(
        both.contains("pbf/") && both.contains("flip/aim") && !both.contains("flip/advect"),
        "{both}"
    );
}

#[test]
fn a_missed_projection_is_told_and_past_its_limit_ends_the_bake() {
    let job = Job::new();
    let one = "--solver flip --set solver.flip.pressure.max_iterations=1 \
               --set solver.flip.pressure.preconditioner=none";
    let never = "--set budget.residual=false";
    let said = job.expect(
        0,
        &format!("bake small.toml -o told {one} {never} --frames 1-2"),
    );
    assert!(said.contains("missed their tolerance"), "{said}");
    let said = job.expect(5, &format!("bake small.toml -o ended {one} --frames 1-2"));
    assert!(
        said.contains("frame 1") && said.contains("residual"),
        "{said}"
    );
    job.expect(0, "verify ended");
}

/// A study resumes from existing results, and its page needs no other files.
#[test]
fn a_study_bakes_renders_measures_and_tells() {
    let job = Job::new();
    let said = job.expect(0, "study study.toml -o out");
    assert!(said.contains("The paper says pbf"), "{said}");
    let read = |name: &str| fs::read_to_string(job.path("out").join(name)).unwrap();
    let csv = read("results.csv");
    assert_eq!(csv.lines().count(), 1 + 2 * 6);
    let page = read("index.html");
    assert_eq!(page.matches("data:image/png;base64,").count(), 4);
    assert_eq!(page.matches("<svg").count(), 7);
    assert!(page.contains("swell study study.toml -o out"), "{page}");
    for outside in ["src=\"/", "href=", "<script", "src=\"http"] {
        assert!(!page.contains(outside), "{outside}");
    }
    for solver in ["pbf", "flip"] {
        job.expect(0, &format!("verify out/cache/{solver}"));
    }
    // Again: nothing is baked or rendered twice, and the output is the same.
    let said = job.expect(0, "study study.toml -o out");
    assert!(said.contains("nothing left to bake"), "{said}");
    assert!(
        said.contains("already exists") && !said.contains("substeps"),
        "{said}"
    );
    assert_eq!((read("results.csv"), read("index.html")), (csv, page));
    // Damage in its caches ends the study with the file's name, and so does another look.
    let assets = job.path("out/cache/pbf/assets");
    let mesh = fs::read_dir(&assets).unwrap().next().unwrap().unwrap();
    for file in [
        mesh.path(),
        job.path("out/cache/flip/frames/small.0003.ply"),
    ] {
        let sound = fs::read(&file).unwrap();
        let mut bytes = sound.clone();
        bytes[sound.len() / 2] ^= 1;
        fs::write(&file, bytes).unwrap();
        let said = job.expect(4, "study study.toml -o out");
        let name = file.file_name().unwrap().to_string_lossy();
        assert!(said.contains(&*name), "{said}");
        fs::write(&file, sound).unwrap();
    }
    job.edit("look.toml", "35.0", "24.0");
    let said = job.expect(4, "study study.toml -o out");
    assert!(said.contains("another look"), "{said}");
    job.edit("look.toml", "24.0", "35.0");
    // A cache of another scene is left untouched.
    job.edit("small.toml", "cell_size = 0.2", "cell_size = 0.25");
    let said = job.expect(4, "study study.toml -o out");
    assert!(said.contains("solver.flip.cell_size"), "{said}");
    job.edit("study.toml", "3-6x3", "9");
    let said = job.expect(2, "study study.toml -o new");
    assert!(
        said.contains("study.toml:7") && !job.path("new").exists(),
        "{said}"
    );
}

/// Long enough to be interrupted while it runs.
const LONG: &str = "--set shot.frames=400";

#[cfg(unix)]
#[test]
fn signals_end_resumably() {
    let job = Job::new();
    let mut child = job
        .command(&format!("bake small.toml -o cache {LONG}"))
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let ledger = job.path("cache/frames.jsonl");
    let begin = Instant::now();
    while fs::read_to_string(&ledger).map_or(0, |text| text.lines().count()) < 4 {
        assert!(begin.elapsed() < Duration::from_secs(60), "no frames");
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(
        Command::new("kill")
            .arg(child.id().to_string())
            .status()
            .unwrap()
            .success()
    );
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let lines = fs::read_to_string(&ledger).unwrap().lines().count() as u32;
    assert!((4..400).contains(&lines));
    job.expect(0, "verify cache");
    let last = lines + 1;
    job.expect(
        0,
        &format!("bake small.toml -o cache {LONG} --frames 1-{last} --resume"),
    );
    job.expect(
        0,
        &format!("bake small.toml -o unbroken {LONG} --frames 1-{last}"),
    );
    assert_eq!(job.hash("cache"), job.hash("unbroken"));
}

#[test]
fn a_cache_of_another_scene_is_left_alone() {
    let job = Job::new();
    job.expect(0, "bake small.toml -o cache --frames 1-2");
    let before = job.hash("cache");
    assert!(
        job.expect(4, "bake small.toml -o cache")
            .contains("--resume")
    );
    job.edit(
        "small.toml",
        "particle_spacing = 0.1",
        "particle_spacing = 0.09",
    );
    let said = job.expect(4, "bake small.toml -o cache --resume");
    assert!(
        said.contains("solver.pbf.particle_spacing") && said.contains("0.09"),
        "{said}"
    );
    job.edit(
        "small.toml",
        "particle_spacing = 0.09",
        "particle_spacing = 0.1",
    );
    job.edit("box.obj", "v 0.3 1.0 0.9", "v 0.3 1.1 0.9");
    let said = job.expect(4, "bake small.toml -o cache --resume");
    assert!(said.contains("solid"), "{said}");
    fs::create_dir(job.path("mine")).unwrap();
    fs::write(job.path("mine/notes.txt"), "keep").unwrap();
    job.expect(4, "bake small.toml -o mine");
    assert_eq!(fs::read_dir(job.path("mine")).unwrap().count(), 1);
    assert_eq!(job.hash("cache"), before);
    // Not physics: a longer shot, and the limit of substeps.
    job.edit("box.obj", "v 0.3 1.1 0.9", "v 0.3 1.0 0.9");
    job.edit("small.toml", "frames = 8", "frames = 3");
    job.expect(
        0,
        "bake small.toml -o cache --resume --set solver.pbf.max_substeps=64",
    );
    assert_ne!(job.hash("cache"), before);
    job.expect(0, "bake small.toml -o three");
    let ledger = |cache: &str| fs::read(job.path(cache).join("frames/small.0003.ply")).unwrap();
    assert_eq!(ledger("cache"), ledger("three"));
}

#[test]
fn faults_end_with_their_code_and_write_nothing() {
    let job = Job::new();
    let entries = || fs::read_dir(job.folder.path()).unwrap().count();
    let before = entries();
    let said = job.expect(2, "bake small.toml --set solver.pbf.particle_spacing=-1");
    assert!(said.contains("solver.pbf.particle_spacing"), "{said}");
    job.expect(2, "bake absent.toml");
    job.expect(2, "bake small.toml --adapter no-such-adapter");
    job.expect(2, "bake small.toml --frames 1-8x2");
    job.expect(2, "bake small.toml --frames 3-8");
    job.expect(2, "bake small.toml --frames 1,3");
    assert!(
        job.expect(2, "bake small.toml --frames 1-9")
            .contains("shot.frames")
    );
    let wide = "--set domain.max=[800,400,400] --set solver.pbf.particle_spacing=0.5";
    assert!(
        job.expect(2, &format!("bake small.toml {wide}"))
            .contains("max_storage_buffer_binding_size")
    );
    assert!(
        job.expect(2, &format!("inspect small.toml {wide}"))
            .contains("max_storage_buffer_binding_size")
    );
    // FLIP: four bytes for each of 98 million bricks.
    let wide = "--solver flip --set domain.max=[1000,800,500]";
    for command in ["bake", "inspect"] {
        let said = job.expect(2, &format!("{command} small.toml {wide}"));
        assert!(said.contains("max_storage_buffer_binding_size"), "{said}");
    }
    job.expect(2, "bake small.toml --nonsense");
    for (set, key) in [
        ("cell_size=0.4", "solver.flip.cell_size"),
        ("pressure.tolerance=0", "solver.flip.pressure.tolerance"),
        ("pressure.preconditioner=ippp", "nearest is \"ipp\""),
    ] {
        let said = job.expect(
            2,
            &format!("bake small.toml --solver flip --set solver.flip.{set}"),
        );
        assert!(said.contains(key), "{said}");
    }
    let said = job.expect(2, "bake small.toml --solver sph");
    assert!(said.contains("pbf or flip"), "{said}");
    job.edit("small.toml", "[solver.flip]\ncell_size = 0.2\n", "");
    let said = job.expect(2, "bake small.toml --solver flip");
    assert!(
        said.contains("[solver.flip]") && said.contains("cell_size"),
        "{said}"
    );
    job.edit(
        "small.toml",
        "[effects]",
        "[solver.flip]\ncell_size = 0.2\n[effects]",
    );
    // Too fast for the substeps that the scene allows: the frame fails, and the start is kept.
    let said = job.expect(
        5,
        "bake small.toml -o fast --set solver.pbf.max_substeps=1 --set water.gravity=[0,-2000,0]",
    );
    assert!(
        said.contains("frame 1") && said.contains("max_substeps"),
        "{said}"
    );
    job.expect(0, "verify fast");
    fs::remove_dir_all(job.path("fast")).unwrap();
    job.edit("small.toml", "frames = 8", "frame = 8");
    let said = job.expect(2, "bake small.toml");
    assert!(
        said.contains("small.toml:4") && said.contains("frames"),
        "{said}"
    );
    assert_eq!(entries(), before);
}

/// Without any driver: the exit code, and the packages to install.
#[cfg(target_os = "linux")]
#[test]
fn no_adapter_names_the_package() {
    let job = Job::new();
    let output = job
        .command("bake small.toml")
        .env("VK_DRIVER_FILES", "/nonexistent")
        .env("VK_ICD_FILENAMES", "/nonexistent")
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{said}");
    assert!(said.contains("mesa-vulkan-drivers"), "{said}");
}

/// The table of exit codes in docs/commands.md: a missing path is a cache's fault, or a scene's if
/// it is named like one.
#[test]
fn missing_paths_exit_with_the_documented_codes() {
    let job = Job::new();
    let commands = [
        (4, "check missing"),
        (4, "inspect missing"),
        (4, "inspect missing --plot plots"),
        (4, "verify missing"),
        (4, "diff missing missing"),
        (4, "render missing --look look.toml"),
        (4, "render missing --look look.toml -o pictures"),
        (2, "check missing.toml"),
        (2, "inspect missing.toml"),
        (2, "bake missing.toml"),
        (2, "render missing --look missing.toml"),
    ];
    for (code, command) in commands {
        let said = job.expect(code, command);
        assert!(said.contains("missing"), "{command}: {said}");
    }
}

/// A check that had nothing to compare does not pass.
#[test]
fn a_check_without_water_is_refused() {
    let job = Job::new();
    let dry = "--set water.block=[]";
    for solver in ["pbf", "flip"] {
        let said = job.expect(2, &format!("check small.toml --solver {solver} {dry}"));
        assert!(said.contains("nothing was compared"), "{said}");
        job.expect(0, &format!("check small.toml --solver {solver}"));
    }
}

/// The output states which substep is checked; the refusal of a substep beyond the frame's last
/// states their number.
#[test]
fn a_check_takes_any_substep_of_a_frame() {
    let job = Job::new();
    for (solver, cfl) in [("pbf", 0.01), ("flip", 0.01)] {
        let set = format!("--set solver.{solver}.cfl={cfl} --progress none");
        let check = format!("check small.toml --solver {solver} {set}");
        let said = job.expect(2, &format!("{check} --substep 9999"));
        let (_, count) = said.split_once("the frame after frame 0 has ").unwrap();
        let count: u32 = count.trim().parse().unwrap();
        assert!(count > 1, "{said}");
        let said = job.expect(0, &format!("{check} --substep last"));
        assert!(
            said.contains(&format!("substep {count} after frame 0\n")),
            "{said}"
        );
        let json = job.json(0, &format!("{check} --substep {count}"));
        assert_eq!(
            (&json["frames"], &json["substeps"]),
            (&serde_json::json!([0]), &serde_json::json!([count]))
        );
        job.expect(2, &format!("{check} --substep {}", count + 1));
    }
    let said = job.expect(0, "check small.toml");
    assert!(said.contains("substep 1 after frame 0\n"), "{said}");
    let said = job.expect(2, "check small.toml --substep 0");
    assert!(said.contains("from 1 on, or last"), "{said}");
}

#[test]
fn a_check_names_the_errors_that_it_adds() {
    let job = Job::new();
    let said = job.expect(0, "check small.toml --imprecision vulkan-worst:3");
    assert!(said.contains("with the errors of vulkan-worst:3"), "{said}");
    let said = job.expect(2, "check small.toml --imprecision vulkan-best");
    assert!(
        said.contains("there is vulkan-worst, or vulkan-worst:SEED"),
        "{said}"
    );
    job.expect(2, "check small.toml --imprecision vulkan-worst:-1");
    job.expect(
        2,
        "check c --render --look look.toml --imprecision vulkan-worst",
    );
}

#[test]
fn a_new_look_leaves_the_cache_as_it_is() {
    let job = Job::new();
    job.expect(0, "bake small.toml -o cache --frames 1-4");
    let before = job.hash("cache");
    job.expect(0, "render cache --look look.toml -o day");
    job.expect(0, "render cache --look wide.toml -o wide --frames 2-4x2");
    assert_eq!(job.hash("cache"), before);
    let png = |folder: &str, frame: u32| {
        fs::read(job.path(folder).join(format!("small.{frame:04}.png"))).unwrap()
    };
    assert_ne!(png("day", 2), png("wide", 2));
    assert!(!job.path("wide/small.0003.png").exists());
    assert!(job.path("day/small.0003.exr").exists());

    // Existing pictures with the same hashes are kept; a torn picture is made again; one of another
    // look is replaced with --overwrite.
    let first = png("day", 1);
    assert!(
        job.expect(0, "render cache --look look.toml -o day")
            .contains("0 frames rendered, 4 already existed")
    );
    fs::write(job.path("day/small.0001.png"), &first[..first.len() / 2]).unwrap();
    let said = job.expect(0, "render cache --look look.toml -o day");
    assert!(
        said.contains("1 frame rendered, 3 already existed"),
        "{said}"
    );
    assert_eq!(png("day", 1), first);
    job.expect(4, "render cache --look wide.toml -o day");
    assert_eq!(png("day", 1), first);
    let said = job.expect(0, "render cache --look wide.toml -o day --overwrite");
    assert!(said.contains("4 frames rendered"), "{said}");
    assert_ne!(png("day", 1), first);

    // A cache moved elsewhere renders the same; a missing frame, a damaged one and a foreign
    // target are errors.
    fs::rename(job.path("cache"), job.path("moved")).unwrap();
    job.expect(0, "render moved --look look.toml -o again --frames 1");
    assert_eq!(png("again", 1), first);
    job.expect(4, "render moved --look look.toml -o day --frames 4-5");
    job.expect(2, "render moved --look look.toml -o moved/pictures");
    job.expect(4, "render nowhere --look look.toml -o day");
    let frame = job.path("moved/frames/small.0002.ply");
    let mut bytes = fs::read(&frame).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&frame, bytes).unwrap();
    let said = job.expect(4, "render moved --look look.toml -o new --frames 2");
    assert!(said.contains("small.0002.ply"), "{said}");
    job.expect(4, "verify moved");
}

#[test]
fn keys_of_a_look_are_overridden_each_try_in_its_own_folder() {
    let job = Job::new();
    job.expect(0, "bake small.toml -o cache --frames 1");
    let render = "render cache --look look.toml";
    let png = |folder: &str| fs::read(job.path(folder).join("small.0001.png")).unwrap();
    job.expect(0, render);
    job.expect(0, &format!("{render} --set view.exposure_stops=2"));
    job.expect(
        0,
        &format!("{render} --set view.exposure_stops=2 --set ground.colour=[0.1,0.2,0.3]"),
    );
    let plain = png("renders/small-look");
    let bright = png("renders/small-look-view.exposure_stops=2");
    let other = png("renders/small-look-view.exposure_stops=2-ground.colour=_0.1_0.2_0.3");
    assert!(plain != bright && bright != other);
    // What the file says is the same picture as what lies over it.
    let text = fs::read_to_string(job.path("look.toml")).unwrap();
    fs::write(
        job.path("bright.toml"),
        format!("{text}\n[view]\nexposure_stops = 2\n"),
    )
    .unwrap();
    job.expect(0, "render cache --look bright.toml");
    assert_eq!(png("renders/small-bright"), bright);
    // A folder of one try is not filled with another.
    let folder = "-o renders/small-look-view.exposure_stops=2";
    let said = job.expect(4, &format!("{render} --set view.exposure_stops=1 {folder}"));
    assert!(said.contains("--overwrite"), "{said}");
    for (set, words) in [
        ("view.exposure=2", "view.exposure"),
        ("image.samples=0", "image.samples"),
        ("image.samples", "key=value"),
    ] {
        let said = job.expect(2, &format!("{render} --set {set}"));
        assert!(said.contains(words), "{set}: {said}");
    }
}

#[test]
fn shipped_scenes_load_and_plan() {
    let job = Job::new();
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    for name in ["quickstart", "wave-city", "dam-break", "wave-tank"] {
        let file = scenes.join(format!("{name}.toml"));
        let output = job.command("inspect").arg(&file).output().unwrap();
        assert!(
            output.status.success(),
            "{name}: {}",
            String::from_utf8_lossy(&output.stderr)
        );
        assert!(String::from_utf8_lossy(&output.stdout).contains("pbf/compute_lambda"));
        let mut flip = job.command("inspect --solver flip");
        let output = flip.arg(&file).output().unwrap();
        assert!(output.status.success(), "{name}");
        let plan = String::from_utf8_lossy(&output.stdout);
        assert!(plan.contains("pressure/"), "{name}: {plan}");
        let grid = plan.contains("125 × 63 × 75 cells");
        assert_eq!(grid, name == "wave-city", "{plan}");
    }
}
