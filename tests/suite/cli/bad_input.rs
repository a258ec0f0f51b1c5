//! Bad input to each command: one line of error, the exit code of its kind, and nothing is written.

use std::fs;

use crate::support::{
    job::{Job, LOOK},
    made_cache::{Made, write_cache},
};

/// An OpenVDB file with only fog and velocity grids.
const FOG: &[u8] = include_bytes!("../domain/files/no-level-set.vdb");

/// Points as another program may write them: no camera, no moving prim, no mesh.
const POINTS: &str = "#usda 1.0\n(\n    defaultPrim = \"p\"\n)\n\ndef Points \"p\"\n\
    {\n    point3f[] points = [(0, 0, 0)]\n}\n";

const SCENE: &str = r#"
[shot]
name = "small"
frames = 2
frames_per_second = 24

[domain]
min = [0.0, 0.0, 0.0]
max = [2.0, 1.0, 1.0]

[[water.block]]
min = [0.0, 0.0, 0.0]
max = [2.0, 0.5, 1.0]

[[solid]]
mesh = "box.obj"

[solver]
method = "pbf"

[solver.pbf]
particle_spacing = 0.1
"#;

const BOX: &str = "v 0.3 0.1 0.5\nv 0.7 0.1 0.5\nv 0.3 0.5 0.5\nv 0.3 0.1 0.9\n\
    f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

/// A valid scene, look and cache, and a faulty one for each fault.
fn given() -> Job {
    let job = Job::of(&[
        ("scene.toml", SCENE),
        ("box.obj", BOX),
        ("look.toml", LOOK),
        ("points.usda", POINTS),
        ("words.usda", "a camera\n"),
        ("crate.usdc", "PXR-USDC\0\0\0\0"),
        ("shot.usda", POINTS),
    ]);
    fs::write(job.path("fog.vdb"), FOG).unwrap();
    let mesh = "mesh = \"box.obj\"";
    for (name, file) in [("fog", "fog.vdb"), ("mesh", "points.usda")] {
        let text = SCENE.replace(mesh, &format!("mesh = \"{file}\""));
        job.write(&format!("solid-{name}.toml"), &text);
    }
    for (name, file) in [("points", "points.usda"), ("gone", "gone.usda")] {
        let text = SCENE.replace(mesh, &format!("{mesh}\ntrack = {{ file = \"{file}\" }}"));
        job.write(&format!("track-{name}.toml"), &text);
    }
    let own = ["focal_length_mm", "film_back_mm", "position", "target"];
    let is_kept = |line: &&str| !own.iter().any(|key| line.starts_with(key));
    let bare: Vec<&str> = LOOK.lines().filter(is_kept).collect();
    for name in ["gone.usda", "points.usda", "words.usda", "crate.usdc"] {
        let camera = format!("[camera]\nfile = \"{name}\"");
        let text = bare.join("\n").replace("[camera]", &camera);
        job.write(&format!("look-{name}.toml"), &text);
    }
    for name in ["cache", "damaged", "shots/flip", "shots/pbf"] {
        write_cache(&job.path(name), &Made::default());
    }
    let frame = job.path("damaged/frames/small.0000.ply");
    let mut bytes = fs::read(&frame).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&frame, bytes).unwrap();
    job
}

/// Command, exit code, required part of the line.
const FAULTS: [(&str, i32, &str); 21] = [
    ("verify gone", 4, "gone does not exist"),
    (
        "verify look.toml",
        4,
        "look.toml is a file; a cache is a folder",
    ),
    (
        "export shots --npy p.%04d.npy",
        4,
        "shots is not a cache; name one of shots/flip, shots/pbf",
    ),
    ("verify damaged", 4, "small.0000.ply is damaged"),
    ("diff cache damaged", 4, "small.0000.ply is damaged"),
    (
        "export cache --npy p.%04d.npy --chunk 4/3",
        2,
        "no share 4 of 3: the shares are 1/3 to 3/3",
    ),
    (
        "export cache --npy p.%04d.npy --chunk 0/3",
        2,
        "no share 0 of 3",
    ),
    (
        "export cache --npy p.%04d.npy --chunk three",
        2,
        "write 1/4 for the first of four",
    ),
    (
        "render cache --look look.toml --chunk 4/3",
        2,
        "no share 4 of 3",
    ),
    (
        "export cache --npy p.%04d.npy --frames 3-9",
        4,
        "frames 0 to 4, not 5",
    ),
    (
        "export cache --npy p.%04d.npy --device gpu",
        2,
        "unexpected",
    ),
    (
        "bake scene.toml --device abacus",
        2,
        "[possible values: gpu, cpu]",
    ),
    (
        "render cache --look look-gone.usda.toml",
        2,
        "camera.file: cannot read gone.usda",
    ),
    (
        "render cache --look look-points.usda.toml",
        2,
        "camera.file: points.usda: none of its prims is a Camera",
    ),
    (
        "export cache --usd s.usda --look look-words.usda.toml",
        2,
        "camera.file: words.usda: it is neither USD",
    ),
    (
        "export cache --usd s.usda --look look-crate.usdc.toml",
        2,
        "binary USD; write it as text: usdcat",
    ),
    ("bake track-gone.toml", 2, "track.file: gone.usda"),
    (
        "bake track-points.toml",
        2,
        "points.usda: none of its prims has a transform",
    ),
    (
        "bake solid-mesh.toml",
        2,
        "allowed are .obj, .ply, .stl and .vdb",
    ),
    (
        "bake solid-fog.toml",
        2,
        "no level set among its grids (density, v)",
    ),
    (
        "export cache --usd shot.usda",
        4,
        "shot.usda is not from an export",
    ),
];

#[test]
fn bad_input_is_reported_in_one_line() {
    let job = given();
    let names = || {
        let entries = fs::read_dir(job.folder.path()).unwrap();
        let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name()).collect();
        names.sort();
        names
    };
    let before = names();
    for (words, code, part) in FAULTS {
        let output = job.run(words);
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(code), "swell {words}: {said}");
        assert!(said.contains(part), "swell {words}: {said}");
        // After an unknown word of the command line, the usage follows the error line.
        let lines = said.lines().take_while(|line| !line.is_empty()).count();
        assert!(
            lines == 1 && (said.lines().count() == 1 || part == "unexpected"),
            "swell {words}: {said}"
        );
    }
    assert_eq!(names(), before, "nothing is written");
    // Negative control: the valid inputs.
    job.expect(0, "verify cache");
    job.expect(0, "inspect scene.toml");
    job.expect(
        0,
        "export cache --npy p.%04d.npy --usd s.usda --look look.toml --chunk 3/3",
    );
}

/// With --keep-going an export writes the intact frames beside a damaged one. Either way the
/// fault is one line.
#[test]
fn a_damaged_frame_is_one_line_of_an_export() {
    let job = given();
    job.expect_clear(
        4,
        "export damaged --npy p.%04d.npy --frames 0-2",
        "small.0000.ply is damaged",
    );
    job.expect_clear(
        4,
        "export damaged --npy p.%04d.npy --frames 0-2 --keep-going",
        "small.0000.ply is damaged",
    );
    assert!(!job.path("p.0000.npy").exists() && job.path("p.0002.npy").exists());
}
