//! Cameras from files written here, compared with known matrices.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::f64::consts::{FRAC_PI_2, PI};

use serde_json::{Value, json};

use glam::DVec3;

use super::*;
use swell_scene::look::{FitSpec, Framing};

/// Returns a binary glTF file (version 2, section 4.4) with these numbers in its binary chunk.
pub(crate) fn glb(document: &Value, numbers: &[f32]) -> Vec<u8> {
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let data: Vec<u8> = numbers.iter().flat_map(|x| x.to_le_bytes()).collect();
    let mut file = b"glTF".to_vec();
    let total = 12 + 8 + text.len() + 8 + data.len();
    for word in [2, total as u32, text.len() as u32] {
        file.extend(word.to_le_bytes());
    }
    file.extend(b"JSON");
    file.extend(&text);
    file.extend((data.len() as u32).to_le_bytes());
    file.extend(b"BIN\0");
    file.extend(&data);
    file
}

/// A sampler: node, path, interpolation, times and values.
type Row<'a> = (usize, &'a str, &'a str, &'a [f32], &'a [f32]);

/// Returns a file with these nodes, a camera with this vertical field of view, and an animation.
fn animated(nodes: &Value, yfov: f64, rows: &[Row<'_>]) -> Vec<u8> {
    let (mut numbers, mut views, mut accessors) = (Vec::new(), Vec::new(), Vec::new());
    let (mut samplers, mut channels) = (Vec::new(), Vec::new());
    let mut put = |values: &[f32], width: usize| {
        views.push(json!({
            "buffer": 0, "byteOffset": 4 * numbers.len(), "byteLength": 4 * values.len()
        }));
        let kind = ["SCALAR", "", "VEC3", "VEC4"][width - 1];
        let mut accessor = json!({
            "bufferView": views.len() - 1, "componentType": 5126, "count": values.len() / width,
            "type": kind
        });
        if width == 1 {
            accessor["min"] = json!([values[0]]);
            accessor["max"] = json!([values[values.len() - 1]]);
        }
        accessors.push(accessor);
        numbers.extend_from_slice(values);
        accessors.len() - 1
    };
    for (node, path, interpolation, times, values) in rows {
        let width = if *path == "rotation" { 4 } else { 3 };
        let (input, output) = (put(times, 1), put(values, width));
        samplers.push(json!({ "input": input, "output": output, "interpolation": interpolation }));
        channels.push(json!({
            "sampler": samplers.len() - 1, "target": { "node": node, "path": path }
        }));
    }
    let mut document = json!({
        "asset": { "version": "2.0" },
        "nodes": nodes,
        "cameras": [{
            "type": "perspective", "name": "lens",
            "perspective": { "yfov": yfov, "znear": 0.1, "aspectRatio": 16.0 / 9.0 }
        }],
    });
    if !rows.is_empty() {
        document["buffers"] = json!([{ "byteLength": 4 * numbers.len() }]);
        document["bufferViews"] = json!(views);
        document["accessors"] = json!(accessors);
        document["animations"] = json!([{ "samplers": samplers, "channels": channels }]);
    }
    glb(&document, &numbers)
}

fn nothing(name: &str) -> std::result::Result<Vec<u8>, String> {
    Err(format!("{name} does not exist"))
}

fn read(bytes: &[u8]) -> Result<CameraFile> {
    super::read(bytes, None, &nothing)
}

/// Rounding error of `f32` numbers up to ten metres and their products, metres.
const ROUNDING: f64 = 1e-5;

fn near(a: DVec3, b: DVec3) -> bool {
    (a - b).length() < ROUNDING
}

#[test]
fn a_camera_hangs_in_its_hierarchy() {
    // A crane rotated by a quarter turn about y and scaled, with the camera on its
    // arm, rolled by 30°.
    let half = (FRAC_PI_2 / 2.0).sin() as f32;
    let (sin, cos) = (PI / 12.0).sin_cos();
    let nodes = json!([
        { "name": "crane", "translation": [1.0, 2.0, 3.0], "rotation": [0.0, half, 0.0, half],
          "scale": [2.0, 2.0, 2.0], "children": [1] },
        { "name": "arm", "translation": [0.0, 1.0, -4.0], "children": [2] },
        { "name": "shot", "camera": 0, "rotation": [0.0, 0.0, sin, cos] },
    ]);
    let camera = read(&animated(&nodes, 0.5, &[])).unwrap();
    let stand = camera.at(7.0);
    // A quarter turn about y maps −z to −x.
    assert!(
        near(stand.position, DVec3::new(1.0 - 8.0, 2.0 + 2.0, 3.0)),
        "{stand:?}"
    );
    assert!(near(stand.forward, DVec3::NEG_X), "{stand:?}");
    // A roll of 30° counter-clockwise about the camera's +z, which is +x in the world, tilts its
    // top towards its −x, which is +z in the world.
    let up = DVec3::new(0.0, 0.75f64.sqrt(), 0.5);
    assert!(near(stand.up, up), "{stand:?}");
    // Control: the opposite direction.
    assert!(!near(stand.up, DVec3::new(0.0, up.y, -up.z)));
    // Half of a film 20.25 mm high over the tangent of half of 0.5 radians.
    let framing = Framing::new(FitSpec::Height, [16, 9]);
    let focal = camera.focal_length_mm(&framing, 20.25, 0.0);
    assert!((focal - 10.125 / 0.25f64.tan()).abs() < 1e-4, "{focal}");
    assert!((camera.aspect_ratio().unwrap() - 16.0 / 9.0).abs() < 1e-6);
}

/// A node placed by a matrix, and one animated with each interpolation.
#[test]
fn animations_are_joined_as_the_standard_says() {
    let nodes = json!([
        { "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 10, 0, 0, 1], "children": [1] },
        { "camera": 0, "translation": [9.0, 9.0, 9.0] },
    ]);
    let at =
        |rows: &[Row<'_>], seconds: f64| read(&animated(&nodes, 1.0, rows)).unwrap().at(seconds);
    let times = [1.0, 3.0];
    let values = [0.0, 0.0, 0.0, 4.0, 2.0, 0.0];
    let linear: [Row<'_>; 1] = [(1, "translation", "LINEAR", &times, &values)];
    let step: [Row<'_>; 1] = [(1, "translation", "STEP", &times, &values)];
    for (seconds, expected) in [
        (0.0, 0.0),
        (1.0, 0.0),
        (1.5, 1.0),
        (2.0, 2.0),
        (3.0, 4.0),
        (9.0, 4.0),
    ] {
        let x = at(&linear, seconds).position.x - 10.0;
        assert!((x - expected).abs() < ROUNDING, "{seconds}: {x}");
        let stepped = if seconds < 3.0 { 0.0 } else { 4.0 };
        let x = at(&step, seconds).position.x - 10.0;
        assert!((x - stepped).abs() < ROUNDING, "{seconds}: {x}");
    }
    // x = t³ − 2 t² + 3 over 1 to 3 s is its own Hermite curve: values 2 and 12, slopes −1 and 15.
    let cubic = [
        0.0, 0.0, 0.0, 2.0, 0.0, 0.0, -1.0, 0.0, 0.0, //
        15.0, 0.0, 0.0, 12.0, 0.0, 0.0, 0.0, 0.0, 0.0,
    ];
    let rows: [Row<'_>; 1] = [(1, "translation", "CUBICSPLINE", &times, &cubic)];
    for t in [1.0, 1.3, 2.0, 2.9, 3.0f64] {
        let x = at(&rows, t).position.x - 10.0;
        let expected = t.powi(3) - 2.0 * t * t + 3.0;
        assert!((x - expected).abs() < ROUNDING, "{t}: {x} {expected}");
    }
    // Control: linear interpolation differs.
    assert!((at(&rows, 2.0).position.x - 10.0 - 7.0).abs() > 1.0);
    // A rotation of 90° about y: 45° half-way along the great circle. Blending the components would
    // not keep a constant speed.
    let half = (FRAC_PI_2 / 2.0).sin() as f32;
    let turns = [0.0, 0.0, 0.0, 1.0, 0.0, half, 0.0, half];
    let rows: [Row<'_>; 1] = [(1, "rotation", "LINEAR", &times, &turns)];
    let part = 0.25f64;
    let forward = at(&rows, 1.0 + 2.0 * part).forward;
    let (sin, cos) = (part * FRAC_PI_2).sin_cos();
    assert!(near(forward, DVec3::new(-sin, 0.0, -cos)), "{forward}");
}

/// Static values do not count in the range of a camera's motion: nodes without an animation, and
/// keys of a single value.
#[test]
fn a_camera_moves_where_its_keys_differ() {
    let nodes = json!([{ "camera": 0, "translation": [9.0, 9.0, 9.0] }]);
    let moves = |rows: &[Row<'_>]| read(&animated(&nodes, 1.0, rows)).unwrap().moves();
    let one: Row<'_> = (0, "scale", "LINEAR", &[0.0, 9.0], &[1.0; 6]);
    let values = [0.0, 0.0, 0.0, 4.0, 2.0, 0.0];
    let two: Row<'_> = (0, "translation", "LINEAR", &[2.0, 3.0], &values);
    assert_eq!(moves(&[]), None);
    assert_eq!(moves(&[one]), None);
    assert_eq!(moves(&[one, two]), Some([2.0, 3.0]));
}

/// Each file with the words that identify its error.
#[test]
fn what_is_no_camera_is_told() {
    let plain = json!([{ "name": "shot", "camera": 0 }]);
    let good = animated(
        &plain,
        0.5,
        &[(0, "translation", "LINEAR", &[0.0, 1.0], &[0.0; 6])],
    );
    assert!(read(&good).is_ok());
    let told = |bytes: &[u8], name: Option<&str>| {
        let error = super::read(bytes, name, &nothing).err();
        error.map_or_else(String::new, |error| error.to_string())
    };
    // A file truncated anywhere is rejected; no prefix reads as something else.
    for end in (0..good.len()).step_by(7) {
        assert!(!told(&good[..end], None).is_empty(), "{end}");
    }
    assert!(told(&good, Some("other")).contains("there are shot"));
    assert!(told(&good, Some("shot")).is_empty() && told(&good, Some("lens")).is_empty());
    let text = |document: Value| document.to_string().into_bytes();
    let none = text(json!({ "asset": { "version": "2.0" }, "nodes": [{}] }));
    assert!(told(&none, None).contains("none of its nodes"));
    let flat = json!({
        "asset": { "version": "2.0" }, "nodes": [{ "name": "plan", "camera": 0 }],
        "cameras": [{ "type": "orthographic",
                      "orthographic": { "xmag": 1.0, "ymag": 1.0, "znear": 0.1, "zfar": 9.0 } }]
    });
    assert!(told(&text(flat), None).contains("plan is orthographic"));
    let two = json!([{ "name": "left", "camera": 0 }, { "name": "right", "camera": 0 }]);
    let two = animated(&two, 0.5, &[]);
    assert!(told(&two, None).contains("left, right"));
    assert!(told(&two, Some("lens")).contains("2 cameras"));
    assert!(told(&two, Some("left")).is_empty());
    let ring = json!([{ "children": [1] }, { "children": [0], "camera": 0 }]);
    assert!(told(&animated(&ring, 0.5, &[]), None).contains("under itself"));
    let flat = json!([{ "camera": 0, "scale": [0.0, 0.0, 0.0] }]);
    assert!(told(&animated(&flat, 0.5, &[]), None).contains("no inverse"));
    let few: [Row<'_>; 1] = [(0, "translation", "LINEAR", &[0.0, 1.0], &[0.0; 3])];
    assert!(told(&animated(&plain, 0.5, &few), None).contains("1 values for 2 times"));
    let back: [Row<'_>; 1] = [(0, "translation", "LINEAR", &[1.0, 0.0], &[0.0; 6])];
    assert!(told(&animated(&plain, 0.5, &back), None).contains("not in ascending order"));
    let twice: [Row<'_>; 1] = [(0, "translation", "LINEAR", &[0.0, 1.0], &[0.0; 6])];
    let twice = [twice[0], twice[0]];
    let told_twice = told(&animated(&plain, 0.5, &twice), None);
    assert!(!told_twice.is_empty(), "{told_twice}");
    // A buffer in a missing file, and one embedded in the text.
    let outside = |uri: &str| {
        text(json!({
            "asset": { "version": "2.0" }, "nodes": [{ "camera": 0 }],
            "cameras": [{ "type": "perspective", "perspective": { "yfov": 0.5, "znear": 0.1 } }],
            "buffers": [{ "byteLength": 16, "uri": uri }],
            "bufferViews": [
                { "buffer": 0, "byteLength": 4 },
                { "buffer": 0, "byteOffset": 4, "byteLength": 12 }
            ],
            "accessors": [
                { "bufferView": 0, "componentType": 5126, "count": 1, "type": "SCALAR",
                  "min": [0.0], "max": [0.0] },
                { "bufferView": 1, "componentType": 5126, "count": 1, "type": "VEC3" }
            ],
            "animations": [{
                "samplers": [{ "input": 0, "output": 1 }],
                "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }]
            }]
        }))
    };
    assert!(told(&outside("a%20b.bin"), None).contains("a b.bin does not exist"));
    // 0.0, then 1.0, 2.0, 3.0.
    let inside = outside("data:application/octet-stream;base64,AAAAAAAAgD8AAABAAABAQA==");
    let stand = read(&inside).unwrap().at(0.0);
    assert!(near(stand.position, DVec3::new(1.0, 2.0, 3.0)), "{stand:?}");
    assert!(told(&outside("data:;base64,AAAA"), None).contains("3 bytes of 16"));
}
