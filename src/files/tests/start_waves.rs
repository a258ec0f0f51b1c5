use std::collections::BTreeSet;

use swell_scene::{
    Scene, SceneError,
    open_waves::{Regular, Sea},
    start_waves::{Solitary, StartWave},
};

use super::generation_zone::{fields, keys_of};
use crate::parse_scene;

const SOLITARY: &str = "kind = \"solitary\"\nheight = 0.2\nat = 4.0\n";
const STOKES: &str = "kind = \"stokes\"\nheight = 0.1\nperiod = 2.0\n";

/// Loads a tank, 16 m long, 3 m high and 1.6 m wide, with these waves on water 1 m deep.
fn load(waves: &[&str], overrides: &[&str]) -> Result<Scene, SceneError> {
    let waves = waves
        .iter()
        .map(|wave| format!("[[water.wave]]\ndepth = 1.0\n{wave}"));
    let text = format!(
        "[shot]\nname = \"a\"\nframes = 9\nframes_per_second = 30\n[domain]\nmin = [-2, 5, 0]\n\
         max = [14, 8, 1.6]\n[solver]\nmethod = \"flip\"\n[solver.flip]\ncell_size = 0.1\n{}",
        waves.collect::<String>()
    );
    let overrides: Vec<_> = overrides.iter().map(|it| (*it).to_owned()).collect();
    parse_scene(&text, "s.toml".as_ref(), "".as_ref(), &overrides)
}

fn refusal(waves: &[&str], overrides: &[&str]) -> String {
    load(waves, overrides).expect_err("refused").to_string()
}

#[test]
fn waves_of_the_start_outside_of_theory_are_refused_by_key() {
    let sea = "kind = \"sea\"\nsignificant_height = 0.1\npeak_period = 2.0\n";
    assert_eq!(
        load(&[SOLITARY, STOKES, sea], &[])
            .map(|scene| scene.water.waves.len())
            .ok(),
        Some(3)
    );
    let cases: [(&[&str], &[&str], &str); 9] = [
        (
            &[SOLITARY, STOKES],
            &["water.wave.1.depth=1.1"],
            "water.wave[1].depth: 1.1 m, and water.wave[0] has 1 m",
        ),
        (
            &[SOLITARY],
            &["water.wave.0.height=0.51"],
            "water.wave[0].height: 0.51 m on 1 m of water",
        ),
        (
            &[SOLITARY],
            &["water.wave.0.depth=3.5"],
            "water.wave[0].depth: 3.5 m of water in a domain that is 3 m high",
        ),
        (
            &[SOLITARY],
            &["water.gravity=[0.0, 0.0, -9.81]"],
            "water.gravity: water.wave[0] needs gravity along -y",
        ),
        (
            &[SOLITARY],
            &["water.block=[{min=[0,5,0],max=[1,6,1]}]"],
            "water.block and water.mesh cannot stand beside it",
        ),
        (
            &[SOLITARY],
            &["domain.periodic=[\"x\"]"],
            "water.wave[0].direction_degrees: waves that go towards 0 degrees do not fit",
        ),
        (
            &[STOKES],
            &["domain.periodic=[\"x\"]"],
            "water.wave[0].period: waves of 2 s that go towards 0 degrees: 3.0",
        ),
        (
            &[STOKES],
            &["water.wave.0.height=0.9"],
            "water.wave[0].height: waves of 0.9 m on 1 m of water break",
        ),
        (
            &[STOKES],
            &["water.wave.0.period=0.5", "water.wave.0.height=0.05"],
            "water.wave[0].period: waves of 0.5 s are 0.390 m long",
        ),
    ];
    for (waves, overrides, words) in cases {
        let said = refusal(waves, overrides);
        assert!(said.contains(words), "{overrides:?}: {said}");
    }
    let unknown = refusal(&[STOKES], &["water.wave.0.ramp=1.0"]);
    assert!(unknown.contains("ramp"), "{unknown}");
}

/// Three waves of 16/3 m fit the tank's length; a period 1 % off does not.
#[test]
fn regular_waves_of_the_start_fit_a_period() {
    let fits = |period: f64| {
        let period = format!("water.wave.0.period={period}");
        load(&[STOKES], &["domain.periodic=[\"x\"]", &period]).is_ok()
    };
    let number = std::f64::consts::TAU * 3.0 / 16.0;
    let period = std::f64::consts::TAU / (9.81 * number * number.tanh()).sqrt();
    assert!(fits(period) && !fits(1.01 * period) && !fits(0.99 * period));
}

#[test]
fn keys_of_waves_of_the_start_are_the_fields_of_their_kind() {
    let keys = keys_of::<StartWave>;
    let without_ramp = |mut fields: BTreeSet<String>| {
        assert!(fields.remove("ramp"));
        fields
    };
    assert_eq!(keys("solitary"), fields::<Solitary>());
    assert_eq!(keys("stokes"), without_ramp(fields::<Regular>()));
    assert_eq!(keys("sea"), without_ramp(fields::<Sea>()));
}

/// The water of a start is what lies below the waves, lints know its depth and its waves.
#[test]
fn waves_of_the_start_are_known_to_volumes_and_lints() {
    let scene = load(&[STOKES], &[]).expect("valid");
    // Three wave lengths but for a fiftieth hold the volume of still water to a wave's tenth.
    let still = 16.0 * 1.6;
    assert!(
        (scene.asked_volume() / still - 1.0).abs() < 0.01,
        "{}",
        scene.asked_volume()
    );
    assert!(scene.lints().is_empty(), "{:?}", scene.lints());
    let near = load(&[SOLITARY], &["water.wave.0.at=1.5"]).expect("valid");
    let cut = "water.wave[0].at: the domain ends 1.50 m from the crest, where the wave still has";
    assert!(near.lints()[0].starts_with(cut), "{:?}", near.lints());
    let far = load(&[SOLITARY], &["water.wave.0.at=8.0"]).expect("valid");
    assert!(far.lints().is_empty(), "{:?}", far.lints());
    let zone = |ramp: &str, height: &str| {
        let waves = format!("{{kind=\"stokes\",height={height},period=2.0,depth=1.0{ramp}}}");
        let zone = format!("effects.generation_zone={{walls=[\"-x\"],length=8.0,waves={waves}}}");
        load(&[STOKES], &[&zone]).expect("valid").lints().join("\n")
    };
    assert!(!zone(",ramp=0.0", "0.1").contains("water.wave"));
    assert!(zone("", "0.1").contains("waves.ramp: these waves grow from rest within 4 s"));
    assert!(zone(",ramp=0.0", "0.2").contains("they are other waves than those of water.wave"));
    let both = load(
        &[SOLITARY; 2],
        &[
            "domain.max.1=6.3",
            "water.wave.0.at=8.0",
            "water.wave.1.at=8.0",
        ],
    );
    let both = both.expect("valid").lints().join("\n");
    assert!(
        both.contains("the crests of all waves, where they meet, are 0.400 m"),
        "{both}"
    );
    let scene = load(&[SOLITARY], &["domain.max.1=6.15", "water.wave.0.at=8.0"]).expect("valid");
    let lints = scene.lints().join("\n");
    assert!(
        lints.contains("water.wave[0]: crests 0.200 m above water 1 m deep reach the ceiling"),
        "{lints}"
    );
}
