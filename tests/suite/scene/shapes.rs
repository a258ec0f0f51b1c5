//! What a scene may say of solids whose shape changes, and what is refused.

use std::{fs, path::Path};

use swell::files::{parse_scene, physics_difference, physics_hash, scene_to_toml};

use crate::support::job::{Job, assert_has};

const SCENE: &str = r#"
[shot]
name = "grow"
frames = 4
frames_per_second = 24
[domain]
min = [0, 0, 0]
max = [2, 1, 1]
[[water.block]]
min = [0, 0, 0]
max = [2, 0.5, 1]
[[solid]]
sequence = { files = "box.%04d.obj", start = 7 }
translate = [0.5, 0.2, 0.2]
scale = 0.4
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
[solver.pbf]
particle_spacing = 0.05
"#;

/// A box of quads, 1 m long along y and z. Its sides are bent by `bend`, so that they could be split
/// along either diagonal.
fn cuboid(length: f64, bend: f64) -> String {
    format!(
        "v 0 0 0\nv {length} 0 0\nv {length} 1 {bend}\nv 0 1 0\nv 0 0 1\nv {length} 0 1\n\
         v {length} 1 1\nv 0 1 1\n\
         f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n"
    )
}

/// Boxes 7 to 11, each longer than the one before and bent to the other side.
fn job() -> Job {
    let job = Job::of(&[("grow.toml", SCENE)]);
    for k in 7..=11 {
        let bend = if k % 2 == 0 { 0.1 } else { -0.1 };
        job.write(
            &format!("box.{k:04}.obj"),
            &cuboid(0.1 * f64::from(k), bend),
        );
    }
    job
}

#[test]
fn files_are_found_by_their_numbers_and_stay_one_surface() {
    let job = job();
    // Not of the sequence: other numbers of digits, other names.
    job.write("box.12.obj", "v 0 0 0\n");
    job.write("box.0012.ply", "ply\n");
    let parse = |text: &str, set: &[&str]| {
        let set: Vec<_> = set.iter().map(|&it| it.to_owned()).collect();
        parse_scene(text, Path::new("grow.toml"), job.folder.path(), &set)
    };
    let scene = parse(SCENE, &[]).unwrap();
    let solid = &scene.moving_solids[0];
    assert_eq!((solid.name().as_str(), solid.key()), ("box", "sequence"));
    let sequence = solid.sequence.as_ref().unwrap();
    assert_eq!((sequence.files.len(), sequence.first), (5, 7));
    // File 7 is at frame 1. Bent quads are split along the diagonal of the first file in all.
    let shape = &sequence.shape;
    assert!((shape.times()[0] - 1.0 / 24.0).abs() < 1e-12);
    assert_eq!(shape.breaks().count(), 0);
    let long = |time: f64| {
        let bounds = shape.mesh(time).bounds().unwrap();
        (bounds.min.x, bounds.max.x)
    };
    for (frame, length) in [(0.0, 0.7), (1.0, 0.7), (2.5, 0.85), (5.0, 1.1), (9.0, 1.1)] {
        let (from, to) = long(frame / 24.0);
        assert!((from - 0.5).abs() < 1e-9 && (to - 0.5 - 0.4 * length).abs() < 1e-9);
    }
    // The written-out scene lists the files, and is the same one.
    let written = scene_to_toml(&scene, &|file, _| {
        file.file_name().unwrap().to_string_lossy().into_owned()
    });
    let again = parse(&written, &[]).unwrap();
    assert_eq!(
        again.moving_solids[0].sequence.as_ref().unwrap().shape,
        *shape
    );
    assert_eq!(physics_hash(&again), physics_hash(&scene));
    // Paths do not count in the physics, contents and times do.
    let elsewhere = scene_to_toml(&scene, &|file, hash| format!("{hash}/{}", file.display()));
    assert_eq!(physics_difference(&written, &elsewhere).unwrap(), None);
    let rate = "solid[0].sequence.frames_per_second=25";
    let faster = scene_to_toml(&parse(SCENE, &[rate]).unwrap(), &|file, _| {
        file.display().to_string()
    });
    let differs = physics_difference(&written, &faster).unwrap().unwrap();
    assert!(
        differs.starts_with("solid[0].sequence.frames_per_second"),
        "{differs}"
    );
    job.write("box.0009.obj", &cuboid(0.95, 0.0));
    assert_ne!(
        physics_hash(&parse(SCENE, &[]).unwrap()),
        physics_hash(&scene)
    );
}

/// A change of a job's files.
type Edit<'a> = &'a dyn Fn(&Job);

#[test]
fn bad_files_are_named_before_anything_is_written() {
    let sheet = "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
    let edits: [(Edit<'_>, &[&str]); 14] = [
        (
            &|job| fs::remove_file(job.path("box.0009.obj")).unwrap(),
            &[
                "solid[0].sequence.files",
                "box.0009.obj is missing between box.0008.obj",
            ],
        ),
        (
            &|job| {
                for k in 8..=11 {
                    fs::remove_file(job.path(&format!("box.{k:04}.obj"))).unwrap();
                }
            },
            &["solid[0].sequence.files", "there is only box.0007.obj"],
        ),
        (
            &|job| job.edit("grow.toml", "box.%04d.obj", "box.obj"),
            &[
                "solid[0].sequence.files",
                "\"box.obj\"",
                "one place for a number",
            ],
        ),
        (
            &|job| job.edit("grow.toml", "box.%04d.obj", "ball.%04d.obj"),
            &[
                "solid[0].sequence.files",
                "there is no file like ball.0001.obj",
            ],
        ),
        (
            &|job| job.edit("grow.toml", "box.%04d.obj", "sub/box.%04d.obj"),
            &["solid[0].sequence.files", "cannot list the folder", "sub"],
        ),
        (
            &|job| job.edit("grow.toml", "box.%04d.obj", "../box.%04d.obj"),
            &["solid[0].sequence.files", "leads out of the folder"],
        ),
        (
            &|job| job.write("box.0010.obj", sheet),
            &["solid[0].sequence.files", "box.0010.obj", "has no inside"],
        ),
        (
            &|job| job.write("box.0010.obj", "v 0 0 0\nf 1 2 3\n"),
            &["solid[0].sequence.files", "box.0010.obj", "line 2"],
        ),
        (
            &|job| job.edit("grow.toml", "start = 7", "first = 7"),
            &["solid[0].sequence.first", "in their names"],
        ),
        (
            &|job| {
                job.edit(
                    "grow.toml",
                    "sequence =",
                    "mesh = \"box.0007.obj\"\nsequence =",
                )
            },
            &["solid[0].sequence", "not together with mesh"],
        ),
        (
            &|job| job.edit("grow.toml", "\"box.%04d.obj\"", "[\"box.0007.obj\"]"),
            &["solid[0].sequence.files", "1 files"],
        ),
        (
            &|job| {
                let list = "[\"box.0007.obj\", \"box.0008.obj\"], blake3 = [\"00\", \"11\"]";
                job.edit("grow.toml", "\"box.%04d.obj\"", list);
            },
            &["solid[0].sequence.blake3", "box.0007.obj has BLAKE3"],
        ),
        (
            &|job| job.edit("grow.toml", "translate = [0.5", "translate = [9.5"),
            &["solid[0].sequence", "never enters the domain"],
        ),
        (
            &|job| {
                let periodic = "max = [2, 1, 1]\nperiodic = [\"z\"]";
                job.edit("grow.toml", "max = [2, 1, 1]", periodic);
                job.edit("grow.toml", "cell_size = 0.1", "cell_size = 0.125");
            },
            &["solid[0].sequence", "domain.periodic"],
        ),
    ];
    for (edit, words) in edits {
        let job = job();
        edit(&job);
        let said = job.expect(2, "bake grow.toml -o out");
        assert_has(&said, words);
        assert!(said.contains("grow.toml:"), "{said}");
        assert!(!job.path("out").exists(), "{words:?}");
    }
    // Control: as it is, it bakes.
    let job = job();
    job.expect(0, "bake grow.toml -o out --frames 1-2");
    assert!(job.path("out").exists());
}

#[test]
fn an_emitter_within_reach_of_a_changing_shape_is_refused() {
    let job = job();
    let emitter = |from: f64| {
        format!(
            "[[emitter]]\nmin = [{from}, 0.3, 0.3]\nmax = [{}, 0.5, 0.5]\nvelocity = [1, 0, 0]\n\
             [solver]\n",
            from + 0.2
        )
    };
    job.edit("grow.toml", "[solver]\n", &emitter(0.8));
    let said = job.expect(2, "bake grow.toml -o out");
    assert_has(&said, &["emitter[0]", "box", "shape changes"]);
    // Control: farther away it is not.
    job.edit(
        "grow.toml",
        "min = [0.8, 0.3, 0.3]\nmax = [1, ",
        "min = [1.3, 0.3, 0.3]\nmax = [1.5, ",
    );
    job.expect(0, "bake grow.toml -o out --frames 1-1");
}

#[test]
fn odd_files_are_warned_of_by_name() {
    let warned = |edit: &dyn Fn(&Job)| {
        let job = job();
        edit(&job);
        job.expect(0, "bake grow.toml --dry-run -o out")
    };
    let plain = warned(&|_| {});
    assert!(!plain.contains("warning"), "{plain}");
    // What it costs: the grid is 0.6 m by 0.8 m by 0.8 m with nodes 0.05 m apart.
    assert_has(
        &plain,
        &["box: 5 mesh files; distances at", "sampled again"],
    );
    let triangles = cuboid(0.9, 0.0).replace("f 1 4 3 2", "f 1 4 3\nf 1 3 2");
    let said = warned(&|job| {
        job.write(
            "box.0009.obj",
            &triangles
                .replace("f 2 3 7 6", "f 2 3 7\nf 2 7 6")
                .replace("f 5 6 7 8", "f 5 6 7\nf 5 7 8")
                .replace("f 1 5 8 4", "f 5 8 4\nf 1 5 4")
                .replace("f 1 2 6 5", "f 2 6 5\nf 1 2 5"),
        )
    });
    assert_has(
        &said,
        &[
            "warning",
            "the triangles of box.0009.obj, box.0010.obj are not those",
        ],
    );
    let said = warned(&|job| job.edit("grow.toml", "start = 7", "start = 12"));
    assert_has(&said, &["the shape never changes", "start = 7"]);
    let said = warned(&|job| job.edit("grow.toml", "frames = 4", "frames = 9"));
    assert_has(&said, &["box.0011.obj is at", "the shape rests"]);
    let open = cuboid(1.0, 0.0).replace("f 5 6 7 8\n", "");
    let said = warned(&|job| job.write("box.0010.obj", &open));
    assert_has(&said, &["box.0010.obj: it is open"]);
}

/// A cache has all files, and a resumed bake needs no others.
#[test]
fn a_cache_has_its_files_and_is_resumed_and_verified_without_others() {
    let job = job();
    job.expect(0, "bake grow.toml -o all");
    job.expect(0, "bake grow.toml -o part --frames 1-2");
    job.expect(0, "bake grow.toml -o part --resume");
    let frames = |cache: &str| fs::read(job.path(&format!("{cache}/frames.jsonl"))).is_ok();
    assert!(frames("part"));
    let same = job.expect(0, "diff all part");
    assert!(same.contains("the same, bit for bit"), "{same}");
    assert_eq!(fs::read_dir(job.path("all/assets")).unwrap().count(), 5);
    for k in 7..=11 {
        fs::remove_file(job.path(&format!("box.{k:04}.obj"))).unwrap();
    }
    job.expect(0, "verify all");
    job.expect(0, "check all --frames 2");
    job.expect(0, "bake all/scene.toml -o again");
    let same = job.expect(0, "diff all again");
    assert!(same.contains("the same, bit for bit"), "{same}");
    // USD has the points as samples, and one list of triangles.
    job.expect(0, "export all --usd shot.usda");
    let text = fs::read_to_string(job.path("shot.usda")).unwrap();
    assert_has(
        &text,
        &[
            "def Mesh \"box\"",
            "point3f[] points.timeSamples",
            "int[] faceVertexCounts = [",
        ],
    );
    // Control: one with another content is not the same bake.
    let mut bytes = fs::read(job.path("all/scene.toml")).unwrap();
    let at = bytes.windows(9).position(|it| it == b"blake3 = ").unwrap() + 11;
    bytes[at] = if bytes[at] == b'0' { b'1' } else { b'0' };
    fs::write(job.path("all/scene.toml"), bytes).unwrap();
    job.expect(4, "verify all");
}
