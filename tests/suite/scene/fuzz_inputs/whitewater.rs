//! Whitewater settings: each number has a range, each fault is located, and no text makes
//! the parser panic.

use std::path::Path;

use proptest::prelude::*;
use swell::{
    domain::whitewater::ShotScale,
    files::whitewater::{WhitewaterSettings, written_out},
    scene::SceneError,
};

use super::numbers::each_number_has_a_range;
use crate::support::mutate::mutate;

const SETTINGS: &str = "seed = 5\nmax_particles = 1000\nradius = [0.001, 0.002]\n\
    [emission]\ntrapped_air_rate = 12.5\nwave_crest_rate = 3\ntrapped_air = [1, 2]\n\
    wave_crest = [3, 4]\nenergy = [0.5, 6]\n\
    [spray]\ndrop_radius = 0.001\nwind = [1, -2.5, 0]\n\
    [foam]\nlifetime = [1, 2]\ncrowd = 3\n[bubbles]\nrise_speed = 0.1\nresponse = 0.5\n";

/// Key, value with `{}` in place of the number, and whether both ends of the range are valid
/// together with the other settings.
const NUMBERS: &[(&str, &str, bool)] = &[
    ("radius", "[{}, {}]", true),
    ("radius", "[{}, 0.002]", false),
    ("emission.trapped_air_rate", "{}", true),
    ("emission.wave_crest_rate", "{}", true),
    ("emission.trapped_air", "[{}, 2.0]", false),
    ("emission.trapped_air", "[1.0, {}]", false),
    ("emission.wave_crest", "[{}, 2.0]", false),
    ("emission.energy", "[{}, 2.0]", false),
    ("spray.drop_radius", "{}", true),
    ("spray.wind", "[0, {}, 0]", true),
    ("foam.lifetime", "[{}, {}]", true),
    ("foam.crowd", "{}", true),
    ("bubbles.rise_speed", "{}", true),
    ("bubbles.response", "{}", true),
];

/// Key and both ends of the range of each integer.
const WHOLE: [(&str, u64, u64); 2] = [
    ("seed", 0, 4_294_967_295),
    ("max_particles", 1, 200_000_000),
];

fn parse(text: &str) -> Result<WhitewaterSettings, SceneError> {
    WhitewaterSettings::parse(text, Path::new("bad.toml"))
}

fn shot() -> ShotScale {
    ShotScale::of_volume(200.0)
}

#[test]
fn every_number_of_whitewater_has_a_range_and_says_it() {
    parse(SETTINGS).expect("good settings");
    each_number_has_a_range(|set| parse(set).map(|_| ()), NUMBERS);
    for (key, least, most) in WHOLE {
        for end in [least, most] {
            parse(&format!("{key} = {end}")).expect(key);
        }
        let below = least as i64 - 1;
        for number in [
            below.to_string(),
            (most + 1).to_string(),
            "1.5".into(),
            "nan".into(),
        ] {
            let said = parse(&format!("{key} = {number}"))
                .expect_err(key)
                .to_string();
            let range = format!("allowed: a whole number from {least} to {most}");
            assert!(said.starts_with(&format!("bad.toml:1: {key}: ")), "{said}");
            assert!(said.contains(&range) && said.len() < 300, "{said}");
        }
    }
    // The lists above cover every numeric key.
    let all = SETTINGS.matches(" = ").count();
    let mut keys: Vec<_> = NUMBERS.iter().map(|number| number.0).collect();
    keys.dedup();
    assert_eq!(keys.len() + WHOLE.len(), all);
}

#[test]
fn each_fault_of_whitewater_names_file_line_key_and_what_is_allowed() {
    for (old, new, line, expected) in [
        (
            "crowd = 3",
            "crowds = 3",
            15,
            &["foam.crowds: unknown key in [foam]; the nearest is \"crowd\""][..],
        ),
        (
            "[spray]",
            "[sprey]",
            10,
            &["sprey: unknown key; the nearest is \"spray\""],
        ),
        (
            "wind = [1, -2.5, 0]",
            "wind = [1, -2.5]",
            12,
            &[
                "spray.wind: ",
                "; allowed: three numbers from -1000 to 1000",
            ],
        ),
        (
            "wind = [1, -2.5, 0]",
            "wind = 3",
            12,
            &["spray.wind: ", "; allowed: three numbers"],
        ),
        (
            "lifetime = [1, 2]",
            "lifetime = [2, 1]",
            14,
            &["foam.lifetime: [2, 1] is not ascending; allowed: "],
        ),
        (
            "radius = [0.001, 0.002]",
            "radius = [0.002, 0.001]",
            3,
            &["radius: [0.002, 0.001] is not ascending"],
        ),
        (
            "energy = [0.5, 6]",
            "energy = [6, 6]",
            9,
            &["emission.energy: [6, 6] is not ascending"],
        ),
        (
            "seed = 5",
            "seed = \"five\"",
            1,
            &["seed: ", "; allowed: a whole number from 0 to 4294967295"],
        ),
        (
            "response = 0.5",
            "response = 0.5\nresponse = 1",
            19,
            &["response"],
        ),
        ("seed = 5", "seed = ", 1, &[""]),
        // Negative control: minimum and maximum may be equal.
        ("lifetime = [1, 2]", "lifetime = [2, 2]", 14, &[]),
    ] {
        assert!(SETTINGS.contains(old), "{old}");
        let found = parse(&SETTINGS.replacen(old, new, 1)).map(|_| ());
        let Err(error) = found else {
            assert!(expected.is_empty(), "{new}: accepted");
            continue;
        };
        let said = error.to_string();
        assert!(
            said.starts_with(&format!("bad.toml:{line}: ")),
            "{new}: {said}"
        );
        for words in expected {
            assert!(said.contains(words), "{said}\n  wanted {words}");
        }
        assert!(!expected.is_empty(), "{new}: {said}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1000))]

    #[test]
    fn no_text_makes_the_whitewater_parser_panic(text in any::<String>()) {
        let _ = parse(&text);
    }

    /// Settings that parse survive being written and parsed again; errors name the file.
    #[test]
    fn no_mutation_makes_the_whitewater_parser_panic(
        edits in prop::collection::vec(any::<(u16, u8, u8)>(), 1..6),
    ) {
        let bytes = mutate(SETTINGS.as_bytes().to_vec(), &edits);
        match parse(&String::from_utf8_lossy(&bytes)) {
            Ok(settings) => {
                let settled = settings.settled(&shot());
                let again = parse(&written_out(&settled)).expect("what was written");
                prop_assert_eq!(again.settled(&shot()), settled);
            }
            Err(error) => prop_assert!(error.to_string().starts_with("bad.toml:")),
        }
    }
}
