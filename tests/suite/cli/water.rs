//! How much water a scene holds, as `inspect` and a bake say it.

use crate::support::job::{Job, assert_has};

const SCENE: &str = r#"
[shot]
name = "water"
frames = 24
frames_per_second = 24

[domain]
min = [0.0, 0.0, 0.0]
max = [0.8, 0.8, 0.8]

[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.8, 0.4, 0.8]

[solver]
method = "flip"

[solver.flip]
cell_size = 0.2

[solver.pbf]
particle_spacing = 0.1
"#;

fn job() -> Job {
    Job::of(&[("water.toml", SCENE)])
}

const BAKE: &str = "bake water.toml --device cpu --frames 1";

#[test]
fn the_volume_that_is_made_stands_beside_the_one_asked_for() {
    let job = job();
    let told =
        "256 particles (0 left out where solids are), 0.2560 m³ of water of 0.2560 m³ asked for";
    let said = job.expect(0, "inspect water.toml");
    assert_has(&said, &[told]);
    assert!(!said.contains("warning"), "{said}");
    assert_has(&job.expect(0, &format!("{BAKE} -o whole")), &[told]);

    // 0.37 m: of 3.7 layers four.
    job.edit(
        "water.toml",
        "max = [0.8, 0.4, 0.8]",
        "max = [0.8, 0.37, 0.8]",
    );
    let lint = "water.block[0]: 0.2368 m³ are asked for and 0.2560 m³ made, 8.1 % more: it is filled with whole layers, 8 × 4 × 8 \
                particles 0.1 m apart";
    let told =
        "256 particles (0 left out where solids are), 0.2560 m³ of water of 0.2368 m³ asked for";
    for words in ["inspect water.toml", &format!("{BAKE} -o off")] {
        assert_has(&job.expect(0, words), &[&format!("warning: {lint}"), told]);
    }
    assert_has(&job.expect(2, "inspect water.toml --deny lint"), &[lint]);
    let plan = job.json(0, "inspect water.toml");
    assert!(
        (plan["volume"].as_f64().unwrap() - 0.256).abs() < 1e-12,
        "{plan}"
    );
    assert!((plan["volume_asked"].as_f64().unwrap() - 0.2368).abs() < 1e-12);
    let said = job.expect(0, &format!("{BAKE} -o dry --dry-run"));
    assert_has(
        &said,
        &["256 particles at the start, 0.2560 m³ of water of 0.2368 m³ asked for"],
    );
    // What begins from a frame asks for nothing.
    let said = job.expect(
        0,
        "bake water.toml --device cpu --frames 2 --from off:1 -o branch",
    );
    assert_has(&said, &["0.2560 m³ of water\n"]);
}
