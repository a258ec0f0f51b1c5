//! Faults of look files carry line, key and a remedy; no text makes the parser panic.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::path::Path;

use proptest::prelude::*;

use super::camera_file;
use crate::{load_look, parse_look};
use swell_scene::{
    Place, SceneError,
    look::{LookError, canonical},
};

const PLAIN: &str = "[camera]
focal_length_mm = 35.0
position = [0.0, 3.0, 0.0]
target = [10.0, 1.0, 0.0]
[image]
width = 64
height = 36
[sky]
model = \"hosek_wilkie\"
";

const POSE: &str = "position = [0.0, 3.0, 0.0]\ntarget = [10.0, 1.0, 0.0]\n";

fn fault(text: &str) -> (usize, String, String) {
    match parse_look(text, Path::new("a.toml")) {
        Err(LookError(SceneError::Fault(fault))) => match fault.place {
            Place::Line(line) => (line, fault.key, fault.message),
            Place::Whole => (0, fault.key, fault.message),
            Place::Override(text) => panic!("{text}"),
        },
        other => panic!("expected a fault, got {other:?}"),
    }
}

#[test]
fn a_plain_look_parses_and_layout_does_not_change_its_hash() {
    let look = parse_look(PLAIN, Path::new("a.toml")).unwrap();
    let spaced = PLAIN.replace(" = ", "=") + "\n# a comment\n[sun]\nintensity = 1.0\n";
    let same = parse_look(&spaced, Path::new("b.toml")).unwrap();
    assert_eq!(look.hash(), same.hash());
    let other = parse_look(&PLAIN.replace("35.0", "35.1"), Path::new("a.toml")).unwrap();
    assert_ne!(look.hash(), other.hash());
    assert_eq!(look.hash().len(), 64);
}

/// The hash of version 0.1.0, before voxels and splats could be chosen; any other
/// choice changes it.
#[test]
fn a_look_that_leaves_choices_out_keeps_its_hash() {
    const BEFORE: &str = "023f42bda0627032e91d99f5fb5b472c5f3a4c996b6ea8ba9b58729051c346b6";
    let hash = |surface: &str| {
        let text = format!("{PLAIN}[surface]\n{surface}");
        parse_look(&text, Path::new("a.toml")).unwrap().hash()
    };
    assert_eq!(hash(""), BEFORE);
    assert_eq!(
        hash("splat = \"ellipsoid\"\nvoxels_per_spacing = 2.0\n"),
        BEFORE
    );
    let others = [
        hash("splat = \"sphere\"\n"),
        hash("voxels_per_spacing = 2.5\n"),
    ];
    assert!(others[0] != BEFORE && others[1] != BEFORE && others[0] != others[1]);
}

#[test]
fn an_unknown_key_names_line_key_and_neighbour() {
    let (line, key, message) = fault(&PLAIN.replace("width", "widht"));
    assert_eq!(line, 6);
    assert_eq!(key, "image.widht");
    assert!(
        message.contains("unknown key in [image]; the nearest is \"width\""),
        "{message}"
    );
    assert!(
        message.contains("samples"),
        "lists what is allowed: {message}"
    );
}

#[test]
fn an_unknown_table_is_named() {
    let (line, key, message) = fault(&format!("{PLAIN}[watr]\nindex = 1.3\n"));
    assert_eq!((line, key.as_str()), (10, "watr"));
    assert!(
        message.contains("unknown key; the nearest is \"water\""),
        "{message}"
    );
}

#[test]
fn a_wrong_type_names_line_and_key() {
    let (line, key, message) = fault(&PLAIN.replace("35.0", "\"wide\""));
    assert_eq!((line, key.as_str()), (2, "camera.focal_length_mm"));
    assert!(
        message.contains(
            "invalid type: string \"wide\", expected a number; allowed: a number from 1 to 5000, mm"
        ),
        "{message}"
    );
}

#[test]
fn a_missing_key_names_its_table() {
    let (line, key, _) = fault(&PLAIN.replace("focal_length_mm = 35.0\n", ""));
    assert_eq!((line, key.as_str()), (1, "camera.focal_length_mm"));
}

#[test]
fn a_missing_table_is_named_itself_with_what_it_takes() {
    let sky = PLAIN.find("[sky]").unwrap();
    let (_, key, message) = fault(&PLAIN[..sky]);
    assert_eq!(key, "sky");
    assert!(
        message.contains("missing; allowed: a table with at least model"),
        "{message}"
    );
    let (_, key, message) = fault(&PLAIN[PLAIN.find("[image]").unwrap()..]);
    assert_eq!(key, "camera");
    assert!(
        message.contains("missing; allowed: a table with at least focal_length_mm"),
        "{message}"
    );
    // The table at the beginning of the text is not blamed either.
    let (_, key, _) = fault("[image]\nwidth = 64\n[sky]\nmodel = \"hosek_wilkie\"\n");
    assert_eq!(key, "camera");
    for (from, to, expected, words) in [
        (
            "model = \"hosek_wilkie\"\n",
            "",
            "sky.model",
            "\"panorama\"",
        ),
        ("\"hosek_wilkie\"", "\"panorama\"", "sky.file", "EXR file"),
        (
            "[image]",
            "[surface]\nripple = { slope = 0.1 }\n[image]",
            "surface.ripple.wavelength_m",
            "from 0.001 to 1000, metres",
        ),
        (
            "[image]",
            "[basin]\nthickness_m = 1.0\n[image]",
            "basin.height_m",
            "from 0.001 to 1000, metres",
        ),
        (
            POSE,
            "[[camera.keyframe]]\nframe = 1\ntarget = [0, 0, 0]\n",
            "camera.keyframe[0].position",
            "three numbers",
        ),
    ] {
        assert!(PLAIN.contains(from), "{from}");
        let (_, key, message) = fault(&PLAIN.replace(from, to));
        assert_eq!(key, expected, "{to}");
        assert!(
            message.contains("missing") && message.contains(words),
            "{message}"
        );
    }
}

#[test]
fn a_second_key_and_a_number_of_300_digits_are_named_in_few_words() {
    let (line, key, message) = fault(&PLAIN.replace("width = 64", "width = 64\nwidth = 65"));
    assert_eq!((line, key.as_str()), (7, "image.width"));
    assert!(
        message.contains("this key is defined twice in [image]"),
        "{message}"
    );
    let (_, key, message) = fault(&PLAIN.replace("35.0", "1e308"));
    assert_eq!(key, "camera.focal_length_mm");
    assert!(
        message.starts_with("1e308 is out of range; allowed: a number from 1 to 5000, mm"),
        "{message}"
    );
    let (_, _, message) = fault(&PLAIN.replace("width = 64", "width = 6.4"));
    assert!(message.contains("expected a whole number"), "{message}");
}

#[test]
fn a_panorama_that_is_not_there_is_a_fault_of_its_key() {
    let text = PLAIN.replace("\"hosek_wilkie\"", "\"panorama\"\nfile = \"none.exr\"");
    let (line, key, message) = fault(&text);
    assert_eq!((line, key.as_str()), (10, "sky.file"));
    assert!(
        message.contains("cannot read none.exr: No such file"),
        "{message}"
    );
    // A file that is not a picture is found by its reader and reported at the same location.
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("none.exr"), b"nonsense").unwrap();
    let look = parse_look(&text, &folder.path().join("look.toml")).unwrap();
    let told = look.panorama_fault("no EXR").unwrap().to_string();
    let place = format!(
        "{}:10: sky.file: ",
        folder.path().join("look.toml").display()
    );
    assert!(told.starts_with(&place), "{told}");
    assert!(told.contains("none.exr: no EXR"), "{told}");
    let plain = parse_look(PLAIN, Path::new("a.toml")).unwrap();
    assert!(plain.panorama_fault("no EXR").is_none());
}

/// Numbers outside of every range of a look; each is rejected with its key and the range.
#[test]
fn every_number_of_a_look_has_a_range() {
    for (table, key, value) in [
        ("camera", "focal_length_mm", "{}"),
        ("camera", "film_back_mm", "[{}, 20.25]"),
        ("camera", "position", "[0.0, {}, 0.0]"),
        ("camera", "target", "[10.0, {}, 0.0]"),
        ("camera", "up", "[0.0, {}, 0.0]"),
        ("image", "shutter", "{}"),
        (
            "image",
            "shutter_ramps",
            "[{}, 0.1]\nshutter_curve = \"trapezoid\"",
        ),
        ("camera.lens", "f_stop", "{}\nfocus_distance_m = 1.0"),
        ("camera.lens", "focus_distance_m", "{}\nf_stop = 1.0"),
        ("surface", "radius_m", "{}"),
        ("surface", "smoothing_width_m", "{}"),
        ("surface", "voxels_per_spacing", "{}"),
        ("surface", "roughness", "{}"),
        ("surface.ripple", "wavelength_m", "{}\nslope = 0.1"),
        ("surface.ripple", "slope", "{}\nwavelength_m = 1.0"),
        ("water", "index", "{}"),
        ("water", "absorption_per_metre", "[{}, 0.0, 0.0]"),
        ("water", "scattering_per_metre", "[0.0, {}, 0.0]"),
        (
            "water.spray",
            "density_per_metre",
            "{}\nspeed_m_per_s = 1.0",
        ),
        (
            "water.spray",
            "speed_m_per_s",
            "{}\ndensity_per_metre = 1.0",
        ),
        ("sun", "azimuth_degrees", "{}"),
        ("sun", "elevation_degrees", "{}"),
        ("sun", "intensity", "{}"),
        ("sky", "turbidity", "{}"),
        ("sky", "albedo", "[{}, 0.0, 0.0]"),
        ("ground", "colour", "[{}, 0.0, 0.0]"),
        ("ground", "variation", "{}"),
        ("ground", "haze_m", "{}"),
        ("basin", "height_m", "{}"),
        ("basin", "thickness_m", "{}\nheight_m = 1.0"),
        ("solids", "colour", "[{}, 0.0, 0.0]"),
        ("solids.windows", "storey_m", "{}\nbay_m = 1.0"),
        ("solids.windows", "bay_m", "{}\nstorey_m = 1.0"),
        ("solids.windows", "lit", "{}\nstorey_m = 1.0\nbay_m = 1.0"),
        ("view", "exposure_stops", "{}"),
        ("view", "saturation", "{}"),
        ("view", "contrast", "{}"),
    ] {
        for number in ["1e308", "-1e308", "inf", "nan"] {
            let line = format!("{key} = {}\n", value.replace("{}", number));
            let head = format!("[{table}]\n");
            let mut text = PLAIN.to_owned();
            if let Some(old) = PLAIN.lines().find(|l| l.starts_with(&format!("{key} ="))) {
                text = text.replace(&format!("{old}\n"), "");
            }
            text = match text.contains(&head) {
                true => text.replace(&head, &format!("{head}{line}")),
                false => format!("{text}{head}{line}"),
            };
            let (_, found, message) = fault(&text);
            assert_eq!(found, format!("{table}.{key}"), "{text}");
            assert!(
                message.contains("is out of range; allowed: "),
                "{table}.{key}: {message}"
            );
            assert!(message.len() < 150, "{message}");
        }
    }
}

#[test]
fn an_unknown_variant_names_its_neighbour() {
    let (line, key, message) = fault(&format!("{PLAIN}[surface]\nfilter = \"curvature_flo\"\n"));
    assert_eq!((line, key.as_str()), (11, "surface.filter"));
    assert!(
        message.contains(
            "\"curvature_flo\" is not a value of filter; the nearest is \"curvature_flow\""
        ),
        "{message}"
    );
}

#[test]
fn values_out_of_range_are_refused_with_what_is_allowed() {
    for (from, to, line, key) in [
        ("35.0", "-1.0", 2, "camera.focal_length_mm"),
        ("35.0", "nan", 2, "camera.focal_length_mm"),
        ("width = 64", "width = 0", 6, "image.width"),
        ("[10.0, 1.0, 0.0]", "[0.0, 3.0, 0.0]", 4, "camera.target"),
    ] {
        let (found_line, found_key, _) = fault(&PLAIN.replace(from, to));
        assert_eq!((found_line, found_key.as_str()), (line, key), "{to}");
    }
    let (_, _, message) = fault(&PLAIN.replace("width = 64", "width = 0"));
    assert!(
        message.contains("allowed: a whole number from 1 to 32768, pixels"),
        "{message}"
    );
}

#[test]
fn keyframes_must_ascend() {
    let poses =
        "[[camera.keyframe]]\nframe = 5\nposition = [0, 3, 0]\ntarget = [9, 1, 0]\n".repeat(2);
    let (line, key, _) = fault(&(PLAIN.replace(POSE, "") + &poses));
    assert_eq!((line, key.as_str()), (13, "camera.keyframe[1].frame"));
    let (line, key, message) = fault(&(PLAIN.to_owned() + &poses));
    assert_eq!((line, key.as_str()), (3, "camera.position"));
    assert!(
        message.contains("given together with keyframe"),
        "{message}"
    );
}

#[test]
fn the_panorama_counts_in_the_hash_and_its_name_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let text = PLAIN.replace("\"hosek_wilkie\"", "\"panorama\"\nfile = \"x.exr\"");
    let look = |text: &str, name: &str, bytes: &[u8]| {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        parse_look(text, &folder.path().join("look.toml"))
            .unwrap()
            .hash()
    };
    let first = look(&text, "x.exr", b"one");
    assert_ne!(first, look(&text, "x.exr", b"two"));
    assert_eq!(
        first,
        look(&text.replace("x.exr", "y.exr"), "y.exr", b"one")
    );
}

/// Keys added later, with values other than their defaults: (table, line).
const NEWER: [(&str, &str); 6] = [
    ("image", "overscan = 8"),
    ("image", "crop = [1, 2, 60, 30]"),
    ("output", "colour_space = \"acescg\""),
    ("output", "solids = \"holdout\""),
    ("output", "formats = [\"exr\"]\nlights = [\"sun\"]"),
    ("output", "formats = [\"exr\"]\ncryptomatte = true"),
];

/// Returns a look with additional lines in a table.
fn with(table: &str, lines: &str) -> String {
    let head = format!("[{table}]\n");
    match PLAIN.contains(&head) {
        true => PLAIN.replace(&head, &format!("{head}{lines}\n")),
        false => format!("{PLAIN}{head}{lines}\n"),
    }
}

#[test]
fn a_look_without_newer_keys_keeps_its_hash() {
    let hash = |text: &str| parse_look(text, Path::new("a.toml")).unwrap().hash();
    // The hash from before these keys existed.
    const BEFORE: &str = "023f42bda0627032e91d99f5fb5b472c5f3a4c996b6ea8ba9b58729051c346b6";
    assert_eq!(hash(PLAIN), BEFORE);
    for (table, line) in NEWER {
        assert_ne!(hash(&with(table, line)), BEFORE, "{line}");
    }
}

#[test]
fn a_crop_lies_within_the_image_on_whole_pixels_and_without_overscan() {
    for (lines, words) in [
        ("crop = [0, 0, 65, 36]", "is not inside a 64 × 36 image"),
        ("crop = [0, 0, 64, 37]", "is not inside a 64 × 36 image"),
        ("crop = [10, 0, 10, 36]", "is not inside a 64 × 36 image"),
        ("crop = [0, 20, 64, 19]", "is not inside a 64 × 36 image"),
        ("crop = [0.5, 0, 64, 36]", "is not in whole pixels"),
        ("crop = [-1, 0, 64, 36]", "out of range"),
        (
            "crop = [0, 0, 8, 8]\noverscan = 1",
            "given together with overscan",
        ),
    ] {
        let (_, key, message) = fault(&with("image", lines));
        assert_eq!(key, "image.crop", "{lines}");
        assert!(message.contains(words), "{lines}: {message}");
    }
    let window = |lines: &str| {
        let look = parse_look(&with("image", lines), Path::new("a.toml")).unwrap();
        let window = look.window();
        (window.corner, window.size)
    };
    assert_eq!(window(""), ([0, 0], [64, 36]));
    assert_eq!(window("crop = [0, 0, 64, 36]"), ([0, 0], [64, 36]));
    assert_eq!(window("crop = [3, 5, 10, 6]"), ([3, 5], [7, 1]));
    assert_eq!(window("overscan = 8"), ([-8, -8], [80, 52]));
}

#[test]
fn layers_of_an_exr_need_one() {
    for (line, key) in [
        ("lights = [\"sun\"]", "output.lights"),
        ("cryptomatte = true", "output.cryptomatte"),
    ] {
        let (_, found, message) = fault(&with("output", line));
        assert_eq!(found, key);
        assert!(message.contains("add it to `formats`"), "{message}");
    }
    let (_, key, message) = fault(&with("output", "formats = [\"exr\"]\nlights = [\"sum\"]"));
    assert!(
        key.starts_with("output.lights") && message.contains("the nearest is \"sun\""),
        "{key}: {message}"
    );
}

#[test]
fn what_a_look_does_not_name_is_not_in_its_hash() {
    let look = |text: &str| parse_look(text, Path::new("a.toml")).unwrap();
    let text = canonical(look(PLAIN).spec());
    for word in ["lens", "file", "name", "shutter_", "focus"] {
        assert!(!text.contains(word), "{word}: {text}");
    }
    let keyed = PLAIN.replace(POSE, "")
        + "[[camera.keyframe]]\nframe = 5\nposition = [0, 3, 0]\ntarget = [9, 1, 0]\n";
    assert!(!canonical(look(&keyed).spec()).contains("focus"));
    // Controls: setting either changes the hash.
    let lens = "[camera]\nlens = { f_stop = 2.0, focus_distance_m = 6.0 }\n";
    let triangle = "[image]\nshutter_curve = \"triangle\"\n";
    let hash = |text: &str| look(text).hash();
    let plain = hash(PLAIN);
    assert_ne!(plain, hash(&PLAIN.replace("[camera]\n", lens)));
    assert_ne!(plain, hash(&PLAIN.replace("[image]\n", triangle)));
    let named = "[image]\nshutter_curve = \"box\"\n";
    assert_eq!(plain, hash(&PLAIN.replace("[image]\n", named)));
}

const LENS: &str = "[camera]\nlens = { f_stop = 2.0, focus_distance_m = 6.0 }\n";

#[test]
fn ramps_and_focus_go_with_what_they_are_of() {
    let ramps = "[image]\nshutter_curve = \"trapezoid\"\nshutter_ramps = [0.6, 0.5]\n";
    let (_, key, message) = fault(&PLAIN.replace("[image]\n", ramps));
    assert_eq!(key, "image.shutter_ramps");
    assert!(message.contains("at most 1 together"), "{message}");
    let (_, key, _) = fault(&PLAIN.replace("[image]\n", "[image]\nshutter_ramps = [0.1, 0.1]\n"));
    assert_eq!(key, "image.shutter_ramps");
    let keyed = PLAIN.replace(POSE, "")
        + "[[camera.keyframe]]\nframe = 5\nposition = [0, 3, 0]\ntarget = [9, 1, 0]\n\
           focus_distance_m = 3.0\n";
    let (_, key, message) = fault(&keyed);
    assert_eq!(key, "camera.keyframe[0].focus_distance_m");
    assert!(message.contains("[camera.lens]"), "{message}");
    parse_look(&keyed.replace("[camera]\n", LENS), Path::new("a.toml")).unwrap();
}

/// A lens of f/2 and 35 mm focused at 6 m blurs infinity to 35/36 · 64 · 0.0175 / 6 = 0.18 pixels;
/// at 3840 pixels it is 10.9, an area of 93.2.
#[test]
fn a_lens_with_too_few_samples_is_said() {
    let text = PLAIN.replace("[camera]\n", LENS);
    let lints = |text: &str| parse_look(text, Path::new("a.toml")).unwrap().lints();
    assert!(lints(PLAIN).is_empty() && lints(&text).is_empty());
    let large = text
        .replace("width = 64", "width = 3840")
        .replace("height = 36", "height = 2160");
    let said = lints(&large);
    assert_eq!(said.len(), 1);
    assert!(
        said[0].contains("10.9 pixels") && said[0].contains("from 94 samples on"),
        "{said:?}"
    );
    let many = large.replace("[image]\n", "[image]\nsamples = 94\n");
    assert!(lints(&many).is_empty());
    let many = large.replace("[image]\n", "[image]\nsamples = 93\n");
    assert_eq!(lints(&many).len(), 1);
}

fn shot(nodes: serde_json::Value) -> Vec<u8> {
    let document = serde_json::json!({
        "asset": { "version": "2.0" }, "nodes": nodes,
        "cameras": [{ "type": "perspective",
                      "perspective": { "yfov": 0.5, "znear": 0.1, "aspectRatio": 16.0 / 9.0 } }],
    });
    camera_file::tests::glb(&document, &[])
}

/// A camera file is found beside its look and no farther, its bytes count in the hash, and it
/// replaces other poses.
#[test]
fn a_camera_from_a_file() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("looks/shot.glb");
    std::fs::create_dir(folder.path().join("looks")).unwrap();
    let one = shot(serde_json::json!([{ "name": "a", "camera": 0, "translation": [0, 3, 0] }]));
    std::fs::write(&file, &one).unwrap();
    std::fs::write(folder.path().join("out.glb"), &one).unwrap();
    let text = PLAIN
        .replace(POSE, "file = \"shot.glb\"\n")
        .replace("focal_length_mm = 35.0\n", "");
    let at = folder.path().join("looks/look.toml");
    let look = |text: &str| parse_look(text, &at);
    let told = |text: &str| match look(text) {
        Err(LookError(SceneError::Fault(fault))) => (fault.key, fault.message),
        other => panic!("expected a fault, got {other:?}"),
    };
    let first = look(&text).unwrap();
    assert_eq!(first.camera_file().unwrap().at(0.0).position.y, 3.0);
    std::fs::write(folder.path().join("looks/other.glb"), &one).unwrap();
    let renamed = look(&text.replace("shot", "other")).unwrap();
    assert_eq!(first.hash(), renamed.hash());
    let moved = shot(serde_json::json!([{ "name": "a", "camera": 0, "translation": [0, 4, 0] }]));
    std::fs::write(&file, &moved).unwrap();
    assert_ne!(first.hash(), look(&text).unwrap().hash());
    for (from, to, key, words) in [
        ("shot.glb", "none.glb", "camera.file", "cannot read"),
        ("shot.glb", "../out.glb", "camera.file", "leads out"),
        (
            "file = \"shot.glb\"",
            "file = \"shot.glb\"\nname = \"b\"",
            "camera.name",
            "there are a",
        ),
        (
            "file = \"shot.glb\"\n",
            "name = \"a\"\n",
            "camera.name",
            "given without file",
        ),
        (
            "[camera]\n",
            "[camera]\nfocal_length_mm = 35.0\n",
            "camera.focal_length_mm",
            "together with file",
        ),
        (
            "[camera]\n",
            &format!("[camera]\n{POSE}"),
            "camera.position",
            "together with file",
        ),
        (
            "height = 36",
            "height = 64\n",
            "camera.file",
            "an aspect ratio of 1.7778, a 64 × 64 image has 1.0000",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        let (found, message) = told(&text.replace(from, to));
        assert_eq!(found, key, "{to}: {message}");
        assert!(message.contains(words), "{to}: {message}");
    }
    // The look's fit decides.
    let square = text.replace("height = 36", "height = 64");
    look(&square.replace("[camera]\n", "[camera]\nfit = \"fill\"\n")).unwrap();
    std::fs::write(&file, &one[..one.len() / 2]).unwrap();
    let (key, message) = told(&text);
    assert_eq!(key, "camera.file");
    assert!(message.contains("neither USD"), "{message}");
}

#[test]
fn shipped_looks_parse() {
    for name in ["day", "dusk"] {
        let path =
            Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../../scenes/looks/{name}.toml"));
        load_look(&path).unwrap();
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, ..ProptestConfig::default() })]

    #[test]
    fn no_text_panics(text in "\\PC*") {
        let _ = parse_look(&text, Path::new("a.toml"));
    }

    #[test]
    fn no_damage_to_a_good_look_panics(
        at in 0usize..200, cut in 0usize..40, put in "[\\[\\]a-z0-9=.\"\n{},é-]{0,12}"
    ) {
        let start = at.min(PLAIN.len());
        let end = (start + cut).min(PLAIN.len());
        let text = format!("{}{put}{}", &PLAIN[..start], &PLAIN[end..]);
        let _ = parse_look(&text, Path::new("a.toml"));
    }
}
