//! Baselines with measured limits: which changes are detected on an adapter without hashes, and
//! which with them.

use std::fs;

use serde_json::Value;
use swell::domain::particles::Particles;

use crate::support::{
    job::{Job, assert_has},
    made_cache::{Made, write_cache},
};

/// Writes a made cache whose velocities are scaled by `by`, on another device.
fn faster(job: &Job, name: &str, device: &str, by: f32) {
    let scaled = |_: u32, particles: &mut Particles| {
        for velocity in particles.velocity.iter_mut().flatten() {
            *velocity *= by;
        }
    };
    let made = Made {
        device,
        spoil: &scaled,
        ..Made::default()
    };
    write_cache(&job.path(name), &made);
}

#[test]
fn a_one_percent_change_is_seen_without_hashes_where_the_spread_was_measured() {
    let job = Job::of(&[]);
    write_cache(&job.path("b"), &Made::default());
    // Two adapters that round differently, and a changed constant: 1 % of speed, 2 % of energy.
    faster(&job, "second", "a second device", 1.0001);
    faster(&job, "third", "a third device", 0.9998);
    faster(&job, "changed", "a third device", 1.01);
    // A plain baseline allows 3 % of kinetic energy.
    job.expect(0, "diff b --write-baseline any.json");
    job.expect(0, "diff changed any.json");
    let said = job.expect(0, "diff b --write-baseline base.json --spread second");
    assert_has(
        &said,
        &["limits from the spread of bakes with: a second device"],
    );
    // A spread of 0.02 % of the energy allows 0.1 %: 0.04 % pass, 2 % do not.
    assert_has(
        &job.expect(0, "diff third base.json"),
        &["by aggregates: the baseline has no"],
    );
    let said = job.expect(1, "diff changed base.json");
    assert_has(&said, &["out: frame 0, kinetic_energy: difference"]);

    // The known adapter, treated as unknown.
    faster(&job, "here", "a device", 1.00001);
    assert_has(&job.expect(1, "diff here base.json"), &["hash differs"]);
    assert_has(
        &job.expect(0, "diff here base.json --ignore-hashes"),
        &["by aggregates: hashes are ignored, as asked"],
    );
    faster(&job, "changed-here", "a device", 1.01);
    job.expect(1, "diff changed-here base.json --ignore-hashes");
    assert_has(
        &job.expect(2, "diff b here --ignore-hashes"),
        &[
            "hashes can be ignored for a cache and a baseline",
            "(--ignore-hashes)",
        ],
    );

    // Rewriting the same frames keeps the spreads; other frames discard them, and the
    // limits with them.
    let before = fs::read(job.path("base.json")).unwrap();
    job.expect(0, "diff b --write-baseline base.json");
    assert_eq!(fs::read(job.path("base.json")).unwrap(), before);
    assert_has(
        &job.expect(0, "diff b --write-baseline base.json --frames 0-2"),
        &["spreads of another scene or other frames dropped"],
    );
    job.expect(0, "diff changed base.json --frames 0-2");
    let lose = |_: u32, particles: &mut Particles| {
        particles.position.pop();
        particles.velocity.pop();
        particles.id.pop();
    };
    let made = Made {
        spoil: &lose,
        device: "lossy",
        ..Made::default()
    };
    write_cache(&job.path("lost"), &made);
    for (words, expected) in [
        ("--spread b", "has no spread"),
        ("--spread lost", "another number of particles"),
    ] {
        let said = job.expect(2, &format!("diff b --write-baseline new.json {words}"));
        assert_has(&said, &[expected]);
        assert!(!job.path("new.json").exists());
    }
}

#[test]
fn aggregates_of_a_baseline_are_judged_where_its_hashes_match() {
    let job = Job::of(&[]);
    write_cache(&job.path("b"), &Made::default());
    job.expect(0, "diff b --write-baseline base.json");
    job.expect(0, "diff b base.json");
    let text = fs::read_to_string(job.path("base.json")).unwrap();
    let mut base: Value = serde_json::from_str(&text).unwrap();
    // Far within the stated limits, but more than rounding.
    for (name, by) in [("kinetic_energy", 1.001), ("potential_energy", 0.9999)] {
        let place = &mut base["frames"][3]["aggregates"][name];
        let value = place.as_f64().unwrap();
        *place = (value * by).into();
        job.write("off.json", &base.to_string());
        let said = job.expect(1, "diff b off.json");
        assert_has(&said, &[&format!("out: frame 3, {name}: difference")]);
        assert!(!said.contains("hash differs"), "{said}");
        base["frames"][3]["aggregates"][name] = value.into();
    }
    job.write("off.json", &base.to_string());
    job.expect(0, "diff b off.json");
}

/// Compares the shipped scene with FLIP with its tracked baseline as on an adapter without hashes:
/// the unchanged program passes on any adapter, and a change of `pic_blend` by 1 % does not.
#[test]
fn a_tracked_baseline_sees_one_percent_of_pic_blend_on_any_adapter() {
    let root = env!("CARGO_MANIFEST_DIR");
    let job = Job::of(&[]);
    let bake = |cache: &str, set: &str| {
        let words =
            format!("bake {root}/scenes/wave-city.toml --solver flip --frames 1-3 -o {cache}{set}");
        job.expect(0, &words);
    };
    bake("as-is", "");
    bake("changed", " --set solver.flip.pic_blend=0.0505");
    let compare = |code: i32, cache: &str| {
        let baseline = format!("{root}/tests/baselines/wave-city-flip.json");
        job.expect(
            code,
            &format!("diff {cache} {baseline} --frames 0-3 --ignore-hashes"),
        )
    };
    assert_has(&compare(0, "as-is"), &["hashes are ignored"]);
    assert_has(&compare(1, "changed"), &["kinetic_energy: difference"]);
}
