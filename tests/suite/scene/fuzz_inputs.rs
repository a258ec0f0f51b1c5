//! Bad input: each fault of a scene has its message, and no bytes make a parser panic.

mod numbers;
mod whitewater;

use std::path::Path;

use proptest::prelude::*;
use swell::{
    domain::{mesh::TriangleMesh, mesh_file::MeshFormat, vdb},
    files::{load_scene, look::camera_file, parse_scene, study::Study, tolerance},
    scene::{Method, Scene, SceneError},
};

use super::faults::{
    FLIP_FAULTS, FORCE_FAULTS, KEY_FAULTS, SCENE, SOURCE_FAULTS, VALUE_FAULTS, ZONE_FAULTS,
};
use crate::support::mutate::mutate;

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n\
    f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";

/// A sphere by OpenVDB, in half precision.
const LEVEL_SET: &[u8] = include_bytes!("../domain/files/half.vdb");

/// A camera as Blender writes it.
const CAMERA: &[u8] = include_bytes!("../../../src/files/look/usd_camera/blender_lens.usda");

/// A folder with one good mesh and some bad ones.
fn assets() -> tempfile::TempDir {
    let dir = tempfile::tempdir().expect("a temporary directory");
    let files: [(&str, &[u8]); 6] = [
        ("cube.obj", CUBE.as_bytes()),
        ("broken.obj", b"v 0 0 0\nv 1 0 x\n"),
        ("sheet.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"),
        ("empty.stl", b""),
        ("push.csv", b"0,0\n1,one\n"),
        ("back.csv", b"0,0\n1,2\n0.5,3\n"),
    ];
    for (name, bytes) in files {
        std::fs::write(dir.path().join(name), bytes).expect("written");
    }
    dir
}

fn parse(dir: &Path, text: &str) -> Result<Scene, SceneError> {
    parse_scene(text, Path::new("scenes/bad.toml"), dir, &[])
}

#[test]
fn each_fault_names_file_line_key_and_what_is_allowed() {
    let dir = assets();
    let flip = [Method::Flip.as_override()];
    let parse = |text: &str, overrides: &[String]| {
        parse_scene(text, Path::new("scenes/bad.toml"), dir.path(), overrides)
    };
    parse(SCENE, &[]).expect("the good scene is good");
    parse(SCENE, &flip).expect("the good scene is good for FLIP");
    let mut wrong = Vec::new();
    let of_pbf = KEY_FAULTS.iter().chain(VALUE_FAULTS).chain(ZONE_FAULTS);
    let of_pbf = of_pbf.chain(SOURCE_FAULTS).chain(FORCE_FAULTS);
    let of_pbf = of_pbf.map(|fault| (fault, &[][..]));
    let of_flip = FLIP_FAULTS.iter().map(|fault| (fault, &flip[..]));
    for ((old, new, line, expected), overrides) in of_pbf.chain(of_flip) {
        assert!(SCENE.contains(old), "{old}");
        let result = parse(&SCENE.replacen(old, new, 1), overrides);
        if expected.is_empty() {
            // Negative control: the change is allowed.
            if let Err(error) = result {
                wrong.push(format!("{new}: {error}"));
            }
            continue;
        }
        let message = match result {
            Ok(_) => {
                wrong.push(format!("{new}: accepted"));
                continue;
            }
            Err(error) => error.to_string(),
        };
        let place = format!("scenes/bad.toml:{line}: ");
        let is_complete = expected.iter().all(|part| message.contains(part));
        if !message.starts_with(&place) || !is_complete {
            wrong.push(format!("{message}\n  wanted line {line} and {expected:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_missing_table_and_a_missing_file_are_named() {
    let dir = assets();
    let without = SCENE.replace(
        "[domain]\nmin = [0.0, 0.0, 0.0]\nmax = [25.0, 12.6, 15.0]\n",
        "",
    );
    let message = parse(dir.path(), &without)
        .expect_err("no domain")
        .to_string();
    assert!(
        message.contains("domain: missing; allowed: a table with at least min and max"),
        "{message}"
    );
    let error = load_scene(&dir.path().join("none.toml"), &[]).expect_err("no file");
    assert!(matches!(error, SceneError::Read { .. }), "{error}");
}

const STUDY: &str = r#"kind = "solver_comparison"
scene = "scene.toml"
look = "look.toml"
solvers = ["pbf", "flip"]
frames = "1-240x2"
pictures = "60,120"
"#;

const LOOK: &str = r#"[camera]
focal_length_mm = 35.0
film_back_mm = [36.0, 20.25]
position = [-2.0, 3.0, 2.5]
target = [0.0, 1.0, 0.75]
[image]
width = 64
height = 36
[sky]
model = "hosek_wilkie"
[sun]
azimuth_degrees = 120.0
elevation_degrees = 35.0
[output]
formats = ["png"]
"#;

#[test]
fn each_fault_of_a_study_names_file_line_key_and_what_is_allowed() {
    let dir = assets();
    let write = |name: &str, text: &str| {
        std::fs::write(dir.path().join(name), text).expect("written");
    };
    write("scene.toml", SCENE);
    let (pbf_alone, _) = SCENE.split_once("[solver.flip]").expect("a table");
    write("pbf.toml", pbf_alone);
    write("bad.toml", &SCENE.replace("frames = 240", "frames = 0"));
    write("look.toml", LOOK);
    write("exr.toml", &LOOK.replace("png", "exr"));
    let parse = |text: &str| Study::parse(text, Path::new("s.toml"), dir.path());
    parse(STUDY).expect("the good study is good");
    for (old, new, expected) in [
        (
            "solver_comparison",
            "comparison",
            "s.toml:1: kind: \"comparison\" is not a value of kind; the nearest is \
             \"solver_comparison\"; allowed: \"solver_comparison\"",
        ),
        (
            "pictures",
            "picture",
            "s.toml:6: picture: unknown key; the nearest is \"pictures\"",
        ),
        (
            "look = \"look.toml\"\n",
            "",
            "look: missing; allowed: a look file",
        ),
        (
            "\"flip\"]",
            "\"pbf\"]",
            "s.toml:4: solvers: [\"pbf\", \"pbf\"] are not two solvers",
        ),
        ("\"flip\"]", "\"sph\"]", "solvers: \"sph\" is not a solver"),
        (
            "1-240x2",
            "1-241",
            "s.toml:5: frames: the shot has frames 1 to 240",
        ),
        ("1-240x2", "0-9", "frames: the shot has frames 1 to 240"),
        (
            "60,120",
            "120-60",
            "s.toml:6: pictures: `120-60` is not a frame range",
        ),
        (
            "scene.toml",
            "pbf.toml",
            "solver.method: the scene has no table [solver.flip]",
        ),
        (
            "look.toml",
            "exr.toml",
            "s.toml:3: look: its output.formats has no \"png\"",
        ),
        ("scene.toml", "bad.toml", "bad.toml:3: shot.frames: 0"),
        ("scene.toml", "none.toml", "cannot read"),
        ("look.toml", "none.toml", "none.toml"),
    ] {
        assert!(STUDY.contains(old), "{old}");
        let message = match parse(&STUDY.replacen(old, new, 1)) {
            Ok(_) => panic!("{new}: accepted"),
            Err(error) => error.to_string(),
        };
        assert!(message.contains(expected), "{message}\n  wanted {expected}");
    }
}

/// Every fractional number that a stability study may have: its key, the text around it, and the
/// number in that text.
const STUDY_NUMBERS: &[(&str, &str, &str)] = &[
    ("case[0].against[0].scale", "scale = 1.0", "1.0"),
    ("case[0].against[0].shift", "shift = [0.5,", "0.5"),
    ("case[0].mark[0].at_most", "at_most = 0.25", "0.25"),
    ("case[0].mark[0].after", "after = 0.01", "0.01"),
    ("case[0].mark[0].since", "since = 0.02", "0.02"),
    ("case[0].mark[1].at_least", "at_least = 0.75", "0.75"),
    ("case[0].mark[1].region", "region = [[0.0,", "0.0"),
    ("limit[0].passes", "passes = 0.5", "0.5"),
    ("limit[0].fails", "fails = 8.0", "8.0"),
    ("limit[0].ratio", "ratio = 1.5", "1.5"),
    ("limit[0].seconds", "seconds = 0.125", "0.125"),
];

const STABILITY: &str = r#"kind = "stability"
[[case]]
number = 1
name = "a"
scene = "scene.toml"
solvers = ["pbf"]
devices = ["cpu"]
frames = 3
[[case.against]]
scale = 1.0
shift = [0.5, 0, 0]
[[case.mark]]
of = "sinking"
at_most = 0.25
after = 0.01
since = 0.02
[[case.mark]]
of = "in_region"
at_least = 0.75
region = [[0.0, 0, 0], [1, 1, 1]]
[[limit]]
name = "b"
scene = "scene.toml"
solvers = ["pbf"]
set = ["solver.pbf.cfl={}"]
passes = 0.5
fails = 8.0
ratio = 1.5
seconds = 0.125
[[limit.mark]]
of = "speed"
at_most = 100.0
"#;

#[test]
fn every_number_of_a_study_has_a_range_and_says_it() {
    let dir = assets();
    std::fs::write(dir.path().join("scene.toml"), SCENE).expect("written");
    let parse = |text: &str| Study::parse(text, Path::new("s.toml"), dir.path());
    parse(STABILITY).unwrap_or_else(|error| panic!("the good study is good: {error}"));
    for (key, place, old) in STUDY_NUMBERS {
        assert_eq!(STABILITY.matches(place).count(), 1, "{place}");
        for number in ["1e308", "-1e308", "inf", "nan"] {
            let text = STABILITY.replace(place, &place.replace(old, number));
            let said = parse(&text).map(|_| ()).expect_err(&text).to_string();
            let (_, words) = said
                .split_once(&format!(": {key}: "))
                .unwrap_or_else(|| panic!("{key} = {number}: {said}"));
            assert!(words.contains("; allowed: "), "{said}");
            assert!(words.contains(" from ") && words.contains(" to "), "{said}");
            assert!(said.len() < 200, "{said}");
        }
    }
}

/// A closed cube in each format, as seeds for mutation.
fn seeds() -> Vec<(MeshFormat, Vec<u8>)> {
    let mesh = TriangleMesh::from_bytes(CUBE.as_bytes(), MeshFormat::Obj, Path::new("cube.obj"))
        .expect("a cube");
    let mut stl_text = String::from("solid cube\n");
    let mut stl = vec![0u8; 80];
    stl.extend((mesh.triangles.len() as u32).to_le_bytes());
    for t in 0..mesh.triangles.len() {
        stl_text += "facet normal 0 0 1\nouter loop\n";
        stl.extend([0u8; 12]);
        for v in mesh.corners(t) {
            stl_text += &format!("vertex {} {} {}\n", v.x, v.y, v.z);
            for x in v.to_array() {
                stl.extend((x as f32).to_le_bytes());
            }
        }
        stl_text += "endloop\nendfacet\n";
        stl.extend([0u8; 2]);
    }
    stl_text += "endsolid cube\n";
    let mut vertices = String::new();
    let mut faces = String::new();
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment seed\nelement vertex 8\nproperty float x\n\
             property float y\nproperty float z\nelement face {}\n\
             property list uchar uint vertex_indices\nend_header\n",
            mesh.triangles.len()
        )
    };
    let mut ply = header("binary_little_endian").into_bytes();
    for v in &mesh.vertices {
        vertices += &format!("{} {} {}\n", v.x, v.y, v.z);
        for x in v.to_array() {
            ply.extend((x as f32).to_le_bytes());
        }
    }
    for t in &mesh.triangles {
        faces += &format!("3 {} {} {}\n", t[0], t[1], t[2]);
        ply.push(3);
        ply.extend(t.iter().flat_map(|i| i.to_le_bytes()));
    }
    let ply_text = header("ascii") + &vertices + &faces;
    vec![
        (MeshFormat::Obj, CUBE.as_bytes().to_vec()),
        (MeshFormat::Stl, stl),
        (MeshFormat::Stl, stl_text.into_bytes()),
        (MeshFormat::Ply, ply),
        (MeshFormat::Ply, ply_text.into_bytes()),
    ]
}

#[test]
fn mesh_fuzz_seeds_load_as_cubes() {
    for (format, bytes) in seeds() {
        let mesh = TriangleMesh::from_bytes(&bytes, format, Path::new("seed")).expect("a cube");
        assert_eq!(
            (mesh.vertices.len(), mesh.triangles.len()),
            (8, 12),
            "{format:?}"
        );
        assert!(mesh.check_inside().is_ok_and(|holes| holes.0.is_empty()));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_bytes_make_a_mesh_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        for format in [MeshFormat::Obj, MeshFormat::Ply, MeshFormat::Stl] {
            let _ = TriangleMesh::from_bytes(&bytes, format, Path::new("fuzz"));
        }
    }

    #[test]
    fn no_mutation_makes_a_mesh_reader_panic(
        seed in 0usize..5,
        edits in prop::collection::vec(any::<(u16, u8, u8)>(), 1..6),
    ) {
        let (format, bytes) = seeds().swap_remove(seed);
        let read = TriangleMesh::from_bytes(&mutate(bytes, &edits), format, Path::new("fuzz"));
        if let Ok(mesh) = read {
            prop_assert!(mesh.vertices.iter().all(|v| v.is_finite()));
            let count = mesh.vertices.len() as u32;
            prop_assert!(mesh.triangles.iter().flatten().all(|&v| v < count));
            let _ = mesh.check_inside();
        }
    }

    #[test]
    fn no_mutation_makes_the_reader_of_level_sets_panic(
        edits in prop::collection::vec(any::<(u16, u8, u8)>(), 1..6),
    ) {
        let bytes = mutate(LEVEL_SET.to_vec(), &edits);
        let read = TriangleMesh::from_bytes(&bytes, MeshFormat::Vdb, Path::new("fuzz"));
        if let Ok(mesh) = read {
            prop_assert!(mesh.vertices.iter().all(|v| v.is_finite()));
        }
        let _ = vdb::grids(&bytes);
    }

    #[test]
    fn no_tokens_make_the_obj_reader_panic(
        lines in prop::collection::vec(
            "(v|f|vn|vt|o|g|l|p|usemtl|mtllib|s|\\\\)\
             ( -?[0-9]{1,20}(/-?[0-9]{0,19}){0,3}){0,6}",
            0..30,
        ),
    ) {
        let text = lines.join("\n");
        let _ = TriangleMesh::from_bytes(text.as_bytes(), MeshFormat::Obj, Path::new("fuzz"));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn no_text_makes_the_scene_parser_panic(text in any::<String>()) {
        let _ = parse(Path::new("/nowhere"), &text);
    }

    #[test]
    fn no_mutation_makes_the_scene_parser_panic(
        edits in prop::collection::vec(any::<(u16, u8, u8)>(), 1..6),
    ) {
        let bytes = mutate(SCENE.as_bytes().to_vec(), &edits);
        // Parsing allocates nothing for the water, however much a mutation asks for.
        let _ = parse(Path::new("/nowhere"), &String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn no_mutation_makes_the_study_parser_panic(
        edits in prop::collection::vec(any::<(u16, u8, u8)>(), 1..6),
    ) {
        let bytes = mutate(STUDY.as_bytes().to_vec(), &edits);
        let text = String::from_utf8_lossy(&bytes);
        let _ = Study::parse(&text, Path::new("s.toml"), Path::new("/nowhere"));
    }

    /// If a mutated camera still parses, its position is finite and its direction is a unit vector.
    #[test]
    fn no_mutation_makes_the_reader_of_usd_panic(
        edits in prop::collection::vec(any::<(u16, u8, u8)>(), 1..6),
    ) {
        let bytes = mutate(CAMERA.to_vec(), &edits);
        let beside = |_: &str| Err("nothing is beside it".to_owned());
        if let Ok(camera) = camera_file::read(&bytes, None, &beside) {
            let stand = camera.at(0.1);
            prop_assert!(stand.position.is_finite() && (stand.forward.length() - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn no_mutation_makes_the_tolerance_parser_panic(
        edits in prop::collection::vec(any::<(u16, u8, u8)>(), 1..6),
    ) {
        let text = "[position]\nmax = 1e-3\n[attributes.c]\nrms = 1\n[aggregates]\n\
            volume = { relative = 0.1 }\n\
            [pictures]\nperceptual = 90\n";
        let bytes = mutate(text.as_bytes().to_vec(), &edits);
        let _ = tolerance::parse(&String::from_utf8_lossy(&bytes), Path::new("t.toml"));
    }

    #[test]
    fn no_override_makes_the_scene_parser_panic(
        key in "[a-z._\\[\\]0-9]{0,20}",
        value in any::<String>(),
        known in "(shot|solver\\.pbf|solver\\.flip|water\\.block|effects|domain)\\.[a-z0-9_]{0,8}",
    ) {
        let overrides = [format!("{key}={value}"), format!("{known}={value}")];
        let _ = parse_scene(SCENE, Path::new("s.toml"), Path::new("/nowhere"), &overrides[..1]);
        let _ = parse_scene(SCENE, Path::new("s.toml"), Path::new("/nowhere"), &overrides[1..]);
    }
}
