//! Faults of look files carry line, key and a way out; no text makes the parser panic.

#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::path::Path;

use proptest::prelude::*;

use super::{Look, LookError};

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

fn fault(text: &str) -> (usize, String, String) {
    match Look::parse(text, Path::new("a.toml")) {
        Err(LookError::Fault {
            line, key, message, ..
        }) => (line, key, message),
        other => panic!("expected a fault, got {other:?}"),
    }
}

#[test]
fn a_plain_look_parses_and_layout_does_not_change_its_hash() {
    let look = Look::parse(PLAIN, Path::new("a.toml")).unwrap();
    let spaced = PLAIN.replace(" = ", "=") + "\n# a comment\n[sun]\nintensity = 1.0\n";
    let same = Look::parse(&spaced, Path::new("b.toml")).unwrap();
    assert_eq!(look.hash(), same.hash());
    let other = Look::parse(&PLAIN.replace("35.0", "35.1"), Path::new("a.toml")).unwrap();
    assert_ne!(look.hash(), other.hash());
    assert_eq!(look.hash().len(), 64);
}

#[test]
fn an_unknown_key_names_line_key_and_neighbour() {
    let (line, key, message) = fault(&PLAIN.replace("width", "widht"));
    assert_eq!(line, 6);
    assert_eq!(key, "image.widht");
    assert!(message.contains("did you mean `width`"), "{message}");
    assert!(
        message.contains("`samples`"),
        "lists what is allowed: {message}"
    );
}

#[test]
fn an_unknown_table_is_named() {
    let (line, key, message) = fault(&format!("{PLAIN}[watr]\nindex = 1.3\n"));
    assert_eq!((line, key.as_str()), (10, "watr"));
    assert!(message.contains("did you mean `water`"), "{message}");
}

#[test]
fn a_wrong_type_names_line_and_key() {
    let (line, key, message) = fault(&PLAIN.replace("35.0", "\"wide\""));
    assert_eq!((line, key.as_str()), (2, "camera.focal_length_mm"));
    assert!(message.contains("invalid type"), "{message}");
}

#[test]
fn a_missing_key_names_its_table() {
    let (line, key, _) = fault(&PLAIN.replace("focal_length_mm = 35.0\n", ""));
    assert_eq!((line, key.as_str()), (1, "camera.focal_length_mm"));
}

#[test]
fn an_unknown_variant_names_its_neighbour() {
    let (line, key, message) = fault(&format!("{PLAIN}[surface]\nfilter = \"curvature_flo\"\n"));
    assert_eq!((line, key.as_str()), (11, "surface.filter"));
    assert!(
        message.contains("did you mean `curvature_flow`"),
        "{message}"
    );
}

#[test]
fn values_out_of_range_are_refused_with_what_is_allowed() {
    for (from, to, line, key) in [
        ("35.0", "-1.0", 2, "camera.focal_length_mm"),
        ("35.0", "nan", 2, "camera.focal_length_mm"),
        ("width = 64", "width = 0", 6, "image.width"),
        ("height = 36", "height = 64", 1, "camera.film_back_mm"),
        ("[10.0, 1.0, 0.0]", "[0.0, 3.0, 0.0]", 4, "camera.target"),
    ] {
        let (found_line, found_key, _) = fault(&PLAIN.replace(from, to));
        assert_eq!((found_line, found_key.as_str()), (line, key), "{to}");
    }
    let (_, _, message) = fault(&PLAIN.replace("width = 64", "width = 0"));
    assert!(message.contains("allowed is 1 to 32768"), "{message}");
}

#[test]
fn keyframes_must_ascend() {
    let text = PLAIN.replace(
        "position = [0.0, 3.0, 0.0]\ntarget = [10.0, 1.0, 0.0]\n",
        "",
    ) + "[[camera.keyframe]]\nframe = 5\nposition = [0, 3, 0]\ntarget = [9, 1, 0]\n\
           [[camera.keyframe]]\nframe = 5\nposition = [0, 3, 0]\ntarget = [9, 1, 0]\n";
    let (line, key, _) = fault(&text);
    assert_eq!((line, key.as_str()), (13, "camera.keyframe.1.frame"));
}

#[test]
fn the_panorama_counts_in_the_hash_and_its_name_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let text = PLAIN.replace("\"hosek_wilkie\"", "\"panorama\"\nfile = \"x.exr\"");
    let look = |text: &str, name: &str, bytes: &[u8]| {
        std::fs::write(folder.path().join(name), bytes).unwrap();
        Look::parse(text, &folder.path().join("look.toml"))
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

#[test]
fn shipped_looks_parse() {
    for name in ["day", "dusk"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("scenes/looks/{name}.toml"));
        Look::load(&path).unwrap();
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, ..ProptestConfig::default() })]

    #[test]
    fn no_text_panics(text in "\\PC*") {
        let _ = Look::parse(&text, Path::new("a.toml"));
    }

    #[test]
    fn no_damage_to_a_good_look_panics(at in 0usize..200, cut in 0usize..40, put in "[\\[\\]a-z0-9=.\"\n{},é-]{0,12}") {
        let start = at.min(PLAIN.len());
        let end = (start + cut).min(PLAIN.len());
        let text = format!("{}{put}{}", &PLAIN[..start], &PLAIN[end..]);
        let _ = Look::parse(&text, Path::new("a.toml"));
    }
}
