#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::{f64::consts::FRAC_PI_2, path::Path};

use glam::{DQuat, DVec3};
use serde_json::{Value, json};

use crate::look::camera_file::tests::glb;
use crate::parse_scene;
use crate::scene_to_toml;
use swell_scene::Scene;

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n\
    f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";

const SCENE: &str = r#"
[shot]
name = "door"
frames = 20
frames_per_second = 10
[domain]
min = [0, 0, 0]
max = [8, 4, 4]
[[water.block]]
min = [0, 0, 0]
max = [8, 1, 4]
[[solid]]
mesh = "cube.obj"
translate = [3.0, 0.5, 1.0]
track = { file = "door.glb", node = "door" }
[solver]
method = "flip"
[solver.flip]
cell_size = 0.25
"#;

/// A door at (3, 0, 1) below a cart. The cart moves 2 m along x within two seconds; in the second
/// of them the door makes a quarter turn about y.
fn file(path: &str, interpolation: &str, last: [f32; 4]) -> Vec<u8> {
    // Times, then translations; times, then rotations.
    let mut numbers = vec![0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 1.0, 2.0];
    let values: Vec<f32> = match path {
        "rotation" => [[0.0, 0.0, 0.0, 1.0], last].concat(),
        _ => vec![1.0, 1.0, 1.0, 2.0, 2.0, 2.0],
    };
    numbers.extend(&values);
    let kind = if path == "rotation" { "VEC4" } else { "VEC3" };
    let view = |at: usize, count: usize| {
        json!({
            "buffer": 0, "byteOffset": 4 * at, "byteLength": 4 * count
        })
    };
    let of = |view: usize, count: usize, kind: &str| -> Value {
        let mut accessor =
            json!({ "bufferView": view, "componentType": 5126, "count": count, "type": kind });
        if kind == "SCALAR" {
            let first = [0.0, 1.0][view / 2];
            accessor["min"] = json!([first]);
            accessor["max"] = json!([2.0]);
        }
        accessor
    };
    let document = json!({
        "asset": { "version": "2.0" },
        "scenes": [{ "nodes": [0] }],
        "nodes": [
            { "name": "cart", "children": [1] },
            { "name": "door", "translation": [3.0, 0.0, 1.0] },
        ],
        "buffers": [{ "byteLength": 4 * numbers.len() }],
        "bufferViews": [view(0, 2), view(2, 6), view(8, 2), view(10, values.len())],
        "accessors": [of(0, 2, "SCALAR"), of(1, 2, "VEC3"), of(2, 2, "SCALAR"), of(3, 2, kind)],
        "animations": [{
            "samplers": [
                { "input": 0, "output": 1, "interpolation": "LINEAR" },
                { "input": 2, "output": 3, "interpolation": interpolation },
            ],
            "channels": [
                { "sampler": 0, "target": { "node": 0, "path": "translation" } },
                { "sampler": 1, "target": { "node": 1, "path": path } },
            ],
        }],
    });
    glb(&document, &numbers)
}

/// An animated door below an animated cart, z up, as written by Blender 4.5.15; the door's mesh has
/// the name of its object.
const BLENDER: &str = include_str!("door.usda");

fn load(bytes: &[u8], set: &[&str]) -> Result<Scene, String> {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("cube.obj"), CUBE).unwrap();
    std::fs::write(dir.path().join("door.glb"), bytes).unwrap();
    std::fs::write(dir.path().join("door.usda"), bytes).unwrap();
    let set: Vec<_> = set.iter().map(|&s| s.to_owned()).collect();
    let scene = parse_scene(SCENE, Path::new("s.toml"), dir.path(), &set);
    let scene = scene.map_err(|error| error.to_string())?;
    // Written out, the scene has the poses in place and is equal.
    let written = scene_to_toml(&scene, &|_, _| "cube.obj".to_owned());
    assert!(
        written.contains("poses = ") && !written.contains("file = \"door"),
        "{written}"
    );
    let again = parse_scene(&written, Path::new("w.toml"), dir.path(), &[]).unwrap();
    assert_eq!(scene, again);
    Ok(scene)
}

/// A quarter turn about y.
fn quarter() -> [f32; 4] {
    let (sin, cos) = (std::f32::consts::FRAC_PI_4).sin_cos();
    [0.0, sin, 0.0, cos]
}

#[test]
fn a_solid_goes_as_its_node_does() {
    let scene = load(&file("rotation", "LINEAR", quarter()), &[]).unwrap();
    let solid = &scene.moving_solids[0];
    let corner = DVec3::new(4.0, 0.5, 1.0);
    for (t, expected) in [
        (0.0, corner),
        (0.5, corner + 0.5 * DVec3::X),
        (1.0, corner + DVec3::X),
        // The cart is 2 m ahead, and a point a metre along x from the hinge is now
        // a metre along -z.
        (2.0, DVec3::new(5.0, 0.5, 0.0)),
        (9.0, DVec3::new(5.0, 0.5, 0.0)),
    ] {
        let at = solid.pose(&[], t).place(corner);
        // The file stores `f32`.
        assert!((at - expected).length() < 1e-6, "{t}: {at}");
    }
    // 1 m/s, and in the second second a quarter turn per second at the corner
    // farthest from the hinge.
    assert!((solid.peak_speed(&[], 0.0, 0.9) - 1.0).abs() < 1e-6);
    let farthest = DVec3::new(1.0, 1.5, 1.0).length();
    let most = 1.0 + FRAC_PI_2 * farthest;
    assert!((solid.peak_speed(&[], 1.2, 1.4) / most - 1.0).abs() < 1e-6);
    // Control: the opposite rotation.
    let [_, sin, _, cos] = quarter();
    let other = load(&file("rotation", "LINEAR", [0.0, -sin, 0.0, cos]), &[]).unwrap();
    let at = other.moving_solids[0].pose(&[], 2.0).place(corner);
    assert!((at - DVec3::new(5.0, 0.5, 2.0)).length() < 1e-6, "{at}");
}

#[test]
fn what_is_no_motion_of_a_solid_is_refused() {
    let turns = file("rotation", "LINEAR", quarter());
    let node = "solid[0].track={ file = \"door.glb\", node = \"gate\" }";
    let any = "solid[0].track={ file = \"door.glb\" }";
    let none = "solid[0].track={ file = \"none.glb\", node = \"door\" }";
    let both = "solid[0].motion={ kind = \"sine\", stroke = 1, period = 1 }";
    let late = "solid[0].track={ poses = [[1, 0, 0, 0, 0, 0, 0, 1]] }";
    let long = "solid[0].track={ poses = [[0, 0, 0, 0, 0, 0, 0, 1], [1, 0, 0, 0, 0, 0, 0, 2]] }";
    for (bytes, set, words) in [
        (
            &turns,
            &[node][..],
            "no node is called \"gate\"; there are cart, door",
        ),
        (&turns, &[any], "it has 2 nodes: cart, door; name one"),
        (&turns, &[none], "none.glb"),
        (
            &turns,
            &[both, "solid[0].direction=[1, 0, 0]"],
            "given together with",
        ),
        (&turns, &[late], "the first pose is at 1 s"),
        (&turns, &[long], "not a unit quaternion"),
        (&turns, &["domain.periodic=[\"z\"]"], "domain.periodic"),
        (
            &file("rotation", "STEP", quarter()),
            &[],
            "interpolated in steps",
        ),
        (
            &file("scale", "LINEAR", quarter()),
            &[],
            "size or shape differs",
        ),
        (&b"no glTF".to_vec(), &[], "door.glb"),
    ] {
        let error = load(bytes, set).unwrap_err();
        assert!(
            error.contains(words) && error.contains("solid[0]"),
            "{set:?}: {error}"
        );
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

const OF_USD: &str = "solid[0].track={ file = \"door.usda\", node = \"door\" }";

/// Compared with the corner (4, -1, 0.5) of the door in Blender, z up.
#[test]
fn a_solid_goes_as_a_prim_of_blender_does() {
    let scene = load(BLENDER.as_bytes(), &[OF_USD]).unwrap();
    let solid = &scene.moving_solids[0];
    for (frame, [x, y, z]) in [
        (0.0, [4.0, -1.0, 0.5]),
        (1.0, [4.0, -1.0, 0.5]),
        (7.0, [4.324_646_473, -1.0, 0.468_869_537]),
        (13.0, [5.028_356_552, -1.0, 0.399_474_412]),
        (19.0, [5.427_847_862, -0.292_893_231, 0.372_517_794]),
        (25.0, [5.041_246_891, 0.0, 0.471_459_329]),
        (40.0, [5.041_246_891, 0.0, 0.471_459_329]),
    ] {
        let at = solid
            .pose(&[], frame / 24.0)
            .place(DVec3::new(4.0, 0.5, 1.0));
        // Blender and the file use `f32`.
        let off = (at - DVec3::new(x, z, -y)).length();
        assert!(off < 2e-6, "{frame}: {at} is {off} m off");
    }
    // Control: with y up it moves elsewhere.
    let other = BLENDER.replace("upAxis = \"Z\"", "upAxis = \"Y\"");
    let other = load(other.as_bytes(), &[OF_USD]).unwrap();
    let at = |scene: &Scene| {
        scene.moving_solids[0]
            .pose(&[], 1.0)
            .place(DVec3::new(4.0, 0.5, 1.0))
    };
    assert!((at(&other) - at(&scene)).length() > 0.1);
}

/// A door whose matrix has two samples a quarter turn and half a second apart, in centimetres.
const MATRICES: &str = "#usda 1.0\n(\n    metersPerUnit = 0.01\n    timeCodesPerSecond = 10\n    \
    upAxis = \"Y\"\n)\ndef Xform \"door\"\n{\n    \
    matrix4d xformOp:transform.timeSamples = {\n        \
    0: ( (1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (300, 0, 100, 1) ),\n        \
    5: ( (0, 0, -1, 0), (0, 1, 0, 0), (1, 0, 0, 0), (400, 0, 100, 1) ),\n    }\n    \
    uniform token[] xformOpOrder = [\"xformOp:transform\"]\n}\n";

/// A layer's rate as in usd-core 26.11 (`Usd.Stage.GetTimeCodesPerSecond`), with the lint that
/// names its source.
#[test]
fn a_layer_without_time_codes_a_second_has_its_frames_a_second() {
    let any = "solid[0].track={ file = \"door.usda\" }";
    for (said, rate, words) in [
        ("timeCodesPerSecond = 10", 10.0, ""),
        ("framesPerSecond = 10", 10.0, ""),
        (
            "framesPerSecond = 12\n    timeCodesPerSecond = 10",
            10.0,
            "",
        ),
        (
            "framesPerSecond = 12",
            12.0,
            "the file has 12 time codes a second, by its framesPerSecond, and the shot has 10",
        ),
        (
            "framesPerSecond = 10\n    timeCodesPerSecond = 25",
            25.0,
            "the file has 25 time codes a second, by its timeCodesPerSecond, and the shot has 10",
        ),
        (
            "startTimeCode = 0",
            24.0,
            "the file has 24 time codes a second, as every layer that does not say its \
             timeCodesPerSecond, and the shot has 10",
        ),
    ] {
        let text = MATRICES.replace("timeCodesPerSecond = 10", said);
        let scene = load(text.as_bytes(), &[any]).unwrap();
        // The quarter turn ends at time code 5.
        let turned = |t: f64| {
            let turn = scene.moving_solids[0].pose(&[], t).turn;
            turn.angle_between(DQuat::IDENTITY)
        };
        let end = 5.0 / rate;
        assert!((turned(end) - FRAC_PI_2).abs() < 1e-7, "{said}");
        assert!((turned(0.5 * end) - 0.5 * FRAC_PI_2).abs() < 1e-7, "{said}");
        match (scene.lints().as_slice(), words) {
            ([], "") => {}
            ([lint], words) if !words.is_empty() => assert!(lint.contains(words), "{said}: {lint}"),
            (lints, _) => panic!("{said}: {lints:?}"),
        }
    }
    let none = MATRICES.replace("timeCodesPerSecond = 10", "framesPerSecond = 0");
    let error = load(none.as_bytes(), &[any]).unwrap_err();
    assert!(
        error.contains("framesPerSecond is not a positive number"),
        "{error}"
    );
}

#[test]
fn between_matrices_a_solid_turns_and_keeps_its_shape() {
    let any = "solid[0].track={ file = \"door.usda\" }";
    let scene = load(MATRICES.as_bytes(), &[any]).unwrap();
    let corner = DVec3::new(4.0, 0.5, 1.0);
    let half = 0.5f64.sqrt();
    for (t, expected) in [
        (0.0, corner),
        (0.25, DVec3::new(3.5 + half, 0.5, 1.0 - half)),
        (0.5, DVec3::new(4.0, 0.5, 0.0)),
        (2.0, DVec3::new(4.0, 0.5, 0.0)),
    ] {
        let at = scene.moving_solids[0].pose(&[], t).place(corner);
        assert!((at - expected).length() < 1e-9, "{t}: {at}");
    }
}

/// The same door numbered from 1001, and one whose times are frames of the shot.
#[test]
fn a_solid_s_file_begins_at_its_own_frame() {
    let later = MATRICES.replace("        0: (", "        1001: (");
    let later = later.replace("    5: (", "    1006: (");
    let of = |more: &str| format!("solid[0].track={{ file = \"door.usda\"{more} }}");
    let corner = DVec3::new(4.0, 0.5, 1.0);
    let half = 0.5f64.sqrt();
    let at = |scene: &Scene, t: f64| scene.moving_solids[0].pose(&[], t).place(corner);
    // Time codes are those of the file at any rate of the shot: frame 1 is at 1001.
    for (rate, first) in [("10", 0.1), ("20", 0.05)] {
        let rate = format!("shot.frames_per_second={rate}");
        let scene = load(later.as_bytes(), &[&of(", start = 1001"), &rate]).unwrap();
        for (t, expected) in [
            (0.0, corner),
            (first, corner),
            (first + 0.25, DVec3::new(3.5 + half, 0.5, 1.0 - half)),
            (first + 0.5, DVec3::new(4.0, 0.5, 0.0)),
        ] {
            let off = (at(&scene, t) - expected).length();
            assert!(off < 1e-9, "{rate}, {t}: {off}");
        }
        // A rate that differs from the file's is reported.
        let lints = scene.lints();
        let is_said = |lint: &String| {
            lint.starts_with(
                "solid.track.file: the file has 10 time codes a second, by its \
                 timeCodesPerSecond, and the shot has 20",
            )
        };
        assert_eq!(lints.iter().filter(|it| is_said(it)).count(), lints.len());
        assert_eq!(lints.len(), usize::from(rate.ends_with("=20")), "{lints:?}");
    }
    // A shot that begins between two matrices: after half a second the door has turned by an eighth
    // of a turn, and is 45° from its start.
    let scene = load(
        MATRICES.as_bytes(),
        &[&of(", start = 3.5"), "shot.frames_per_second=10"],
    );
    let scene = scene.unwrap();
    let begun = 0.5 * FRAC_PI_2;
    for (t, turned) in [(0.0, 0.0), (0.125, 0.5 * begun), (0.25, begun)] {
        let pose = scene.moving_solids[0].pose(&[], t);
        let angle = pose.turn.angle_between(DQuat::IDENTITY);
        assert!((angle - turned).abs() < 1e-7, "{t}: {angle}");
        let hinge = DVec3::new(3.5 + 2.0 * t, 0.0, 1.0);
        assert!(
            (pose.centre - hinge).length() < 1e-9,
            "{t}: {}",
            pose.centre
        );
    }
    // Frame 10 is at 1 s in the glTF file: the shot begins a tenth of a second earlier, with the
    // hinge at x = 3.9.
    let door = "solid[0].track={ file = \"door.glb\", node = \"door\", start = 10 }";
    let scene = load(&file("rotation", "LINEAR", quarter()), &[door]).unwrap();
    for (t, expected) in [
        (0.1, DVec3::new(4.1, 0.5, 1.0)),
        (1.1, DVec3::new(5.0, 0.5, 0.9)),
    ] {
        // The file stores `f32`.
        let off = (at(&scene, t) - expected).length();
        assert!(off < 1e-6, "{t}: {off}");
    }
    // Controls: without `start` the solid is static before its first key, or, started too late,
    // after its last; both are reported.
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("cube.obj"), CUBE).unwrap();
    std::fs::write(dir.path().join("door.usda"), later).unwrap();
    for (more, frames) in [("", "0 to 20"), (", start = 1007", "1006 to 1026")] {
        let scene = parse_scene(SCENE, Path::new("s.toml"), dir.path(), &[of(more)]).unwrap();
        assert!(
            [0.5, 2.0]
                .iter()
                .all(|&t| (at(&scene, t) - corner).length() < 1e-9),
            "{more}"
        );
        let lints = scene.lints();
        let [lint] = &lints[..] else {
            panic!("{lints:?}")
        };
        for part in [
            "solid.track.start: ",
            "over frames 1001 to 1006",
            &format!("frames {frames} of it"),
            "start = 1001",
        ] {
            assert!(lint.contains(part), "{part}: {lint}");
        }
    }
}

#[test]
fn what_is_no_motion_in_usd_is_refused() {
    let gate = "solid[0].track={ file = \"door.usda\", node = \"gate\" }";
    let any = "solid[0].track={ file = \"door.usda\" }";
    let twice = BLENDER.replace(
        "def Xform \"cart\"",
        "def Xform \"door\"\n    {\n    }\n    def Xform \"cart\"",
    );
    let taken = BLENDER.replace(
        "def Xform \"cart\"",
        "def Xform \"cart\" (\n    payload = @cart.usdc@\n)",
    );
    let larger = MATRICES.replace("(0, 0, -1, 0), (0, 1, 0, 0)", "(0, 0, -1, 0), (0, 2, 0, 0)");
    for (text, set, words) in [
        (
            BLENDER,
            gate,
            "no prim is called \"gate\"; with a transform there are /root/cart/door, /root/cart",
        ),
        (
            BLENDER,
            any,
            "it has 2 prims with a transform: /root/cart/door, /root/cart; name one",
        ),
        (
            &twice,
            OF_USD,
            "2 prims are called \"door\": /root/door, /root/cart/door",
        ),
        (
            &taken,
            OF_USD,
            "prim /root/cart takes parts from elsewhere, which are not read (payload)",
        ),
        (&taken, gate, "prim /root/cart takes parts from elsewhere"),
        (
            &larger,
            OF_USD,
            "prim /door: at 0.5 s its size or shape differs",
        ),
        ("PXR-USDC\0", OF_USD, "binary USD; write it as text"),
        ("#usda 1.0\n", any, "none of its prims has a transform"),
    ] {
        let error = load(text.as_bytes(), &[set]).unwrap_err();
        assert!(
            error.contains(words) && error.contains("solid[0]"),
            "{words}: {error}"
        );
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}
