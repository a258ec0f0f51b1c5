//! Lints as a user meets them: `inspect` and a bake print them, the cache records them, and either
//! command fails where they are denied.
use swell::cache::CacheReader;

use crate::support::job::{Job, assert_has};

#[test]
fn lints_are_warnings_unless_they_are_denied() {
    let job = Job::new();
    let lint = "wave_maker[0].motion: waves 0.02 m high are ";
    let set = "--set wave_maker=[{wall=\"-x\",motion={kind=\"solitary\",height=0.02,depth=1.0}}]";
    let words = |command: &str, rest: &str| format!("{command} small.toml {set} {rest}");
    assert_has(&job.expect(0, &words("inspect", "")), &["warning: ", lint]);
    let bake = "--device cpu --frames 1 -o";
    for command in [
        words("inspect", "--deny lint"),
        words("bake", &format!("{bake} denied --deny lint")),
    ] {
        let said = job.expect(2, &command);
        assert_has(&said, &["small.toml: denied by --deny lint:", lint]);
    }
    assert!(!job.path("denied").exists());
    assert_has(
        &job.expect(0, &words("bake", &format!("{bake} told"))),
        &["warning: ", lint],
    );
    assert_has(&job.expect(0, "inspect told"), &["warning: ", lint]);
    // Nothing to deny. (Waves of half a second would break.)
    let calm = "--set wave_maker[0].motion.period=2.0";
    job.expect(0, &format!("inspect small.toml --deny lint {calm}"));
}

/// A probe samples at most once per substep, so too high a rate shows only during the bake.
#[test]
fn a_probe_that_looks_less_often_than_it_should_is_told_of() {
    let job = Job::new();
    let bake = |rate: &str, to: &str| {
        let probe = format!("probe=[{{kind=\"volume\",rate_hz={rate}}}]");
        let words = format!("bake small.toml --device cpu --frames 1-2 --set {probe} -o {to}");
        let said = job.expect(0, &words);
        let reader = CacheReader::open(&job.path(to)).unwrap();
        let steps = reader.entries()[1..].iter();
        (
            said,
            steps
                .map(|entry| entry.report["substeps"].as_u64().unwrap())
                .sum::<u64>(),
        )
    };
    // 33 samples in two frames of a sixtieth of a second.
    let (said, substeps) = bake("1000", "often");
    assert!(substeps < 33);
    let expected = format!(
        "warning: probe volume-1 was sampled {substeps} of the 33 times that its rate_hz asks for"
    );
    assert_has(&said, &[&expected]);
    // Negative control: the solver steps at least as often as the probe samples.
    let (said, _) = bake("60", "each");
    assert!(!said.contains("rate_hz"), "{said}");
}

/// Of bodies that are small beside cells the smallest is named; larger ones are not.
#[test]
fn bodies_that_are_small_beside_cells_are_named() {
    let job = Job::new();
    let cube = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/hard_cases/cube.obj");
    job.write("cube.obj", &std::fs::read_to_string(cube).unwrap());
    let body = |x: f64, scale: f64| {
        format!("{{mesh=\"cube.obj\",translate=[{x},1.5,0.5],scale={scale},density=500}}")
    };
    let said = |bodies: &str| job.expect(0, &format!("inspect small.toml --set body=[{bodies}]"));
    let both = said(&format!("{},{}", body(0.2, 0.02), body(0.6, 0.03)));
    assert_has(
        &both,
        &[
            "warning: body.mesh of cube (the smallest of 2): ",
            "cells a body may",
        ],
    );
    // Negative control.
    let large = said(&body(0.2, 0.5));
    assert!(!large.contains("body.mesh of"), "{large}");
}
