//! Sweeps beyond the keys of a scene: a coarser run, devices, solvers, precisions.

use super::{ITERATIONS, Job, stands};

/// The difference of the last value's run on cells twice as large estimates the discretisation
/// error, and the page states the knee beside it.
#[test]
fn the_knee_is_told_beside_the_discretisation_error() {
    let job = Job::new();
    let text = r#"
kind = "sweep"
scene = "tiny.toml"
set = ["solver.method=flip"]
key = "solver.flip.pressure.tolerance"
values = [0.5, 1e-2, 1e-6]
coarser = ["solver.flip.cell_size=0.2", "solver.flip.particles_per_cell=64"]
steps = 6
errors = ["velocity_error", "divergence"]
[[method]]
name = "multigrid"
"#;
    let (outcome, points) = job.run(text, false).unwrap();
    assert_eq!(points.len(), 4);
    assert_eq!(job.column("key")[3], "coarser");
    let error = job.numbers("velocity_error");
    // A grid of 6 cells is off by some per cent.
    assert!((1e-3..1.0).contains(&error[3]), "{error:?}");
    assert!(error[2] < 1e-4 * error[3], "{error:?}");
    let told = "The discretisation error, in the rows with the key coarser";
    assert!(job.read("index.html").contains(told));
    assert!(!outcome.findings[0].contains("not known"), "{outcome:?}");
    // A divergence has no discretisation error.
    assert_eq!(job.column("divergence")[3], "");
    let (_, points) = job
        .run(&text.replace("coarser =", "# coarser ="), false)
        .unwrap();
    assert_eq!((points.len(), stands(&points)), (3, 3));
    assert!(!job.read("index.html").contains(told));

    for (from, to, expected) in [
        (
            "cell_size=0.2",
            "cell_size=0.15",
            "s.toml:7: coarser: a projection is compared with",
        ),
        (
            "particles_per_cell=64",
            "particles_per_cell=8",
            "on cells twice as large",
        ),
    ] {
        let said = job.load(&text.replace(from, to)).unwrap_err();
        assert!(said.contains(expected), "{said}");
    }
    let report = ITERATIONS.replace(
        "steps = 4",
        "steps = 4\ncoarser = [\"shot.frames_per_second=30\"]",
    );
    let said = job.load(&report).unwrap_err();
    assert!(
        said.contains("s.toml:8: coarser: these errors measure what the iterations leave"),
        "{said}"
    );

    // Against a finest run, `coarser` adds one more run.
    let finest = r#"
kind = "sweep"
scene = "tiny.toml"
key = "solver.pbf.iterations"
values = [2, 8]
coarser = ["shot.frames_per_second=30"]
seconds = 0.3333333333
errors = ["energy_error"]
[[method]]
name = "red/black"
"#;
    let job = Job::new();
    job.run(finest, false).unwrap();
    let energy = job.column("energy_error");
    assert!(
        energy[1].is_empty() && energy[2].parse::<f64>().unwrap() > 0.0,
        "{energy:?}"
    );
}

/// A single f32 word stalls, two words go further, and f64 reaches the resolution
/// of f32 velocities.
#[test]
fn a_projection_is_held_against_f64_in_each_precision() {
    let job = Job::new();
    let text = r#"
kind = "sweep"
scene = "tiny.toml"
set = ["solver.method=flip", "solver.flip.pressure.tolerance=1e-12"]
key = "solver.flip.pressure.precision"
values = ["f32", "f32_refined", "f64"]
steps = 3
errors = ["pressure_error", "velocity_error"]
[[method]]
name = "multigrid"
"#;
    job.run(text, false).unwrap();
    let [pressure, velocity] = ["pressure_error", "velocity_error"].map(|error| job.numbers(error));
    // After 1 to 12 steps two words are 2.4 to 3.6 times as good as one (lavapipe).
    assert!(pressure[0] > 2.0 * pressure[1], "{pressure:?}");
    // ‖x − x64‖ ≤ κ 1e-12; κ of six cells is below 100.
    assert!(
        pressure[1] > 1e3 * pressure[2] && pressure[2] < 1e-10,
        "{pressure:?}"
    );
    // A few times half a unit in the last place of f32.
    assert!(
        velocity[2] < 1e-7 && velocity[0] > velocity[2],
        "{velocity:?}"
    );
    assert_eq!(job.column("missed"), ["1", "1", "0"]);
}

/// Device and solver are settings like others.
#[test]
fn devices_and_solvers_are_swept() {
    let job = Job::new();
    let text = r#"
kind = "sweep"
scene = "tiny.toml"
key = "device"
values = ["gpu", "cpu"]
seconds = 0.3333333333
errors = ["energy_error"]
[[method]]
name = "pbf"
[[method]]
name = "flip"
set = ["solver.method=flip"]
"#;
    job.run(text, false).unwrap();
    assert_eq!(job.column("device"), ["gpu", "cpu", "gpu", "cpu"]);
    let energy = job.column("energy_error");
    let value = |k: usize| energy[k].parse::<f64>().unwrap();
    // f32 against f64, over 20 steps.
    assert!(
        value(0) < 1e-2 && value(2) < 1e-2 && value(0) > 0.0,
        "{energy:?}"
    );
    assert!(energy[1].is_empty() && energy[3].is_empty(), "{energy:?}");
    let page = job.read("index.html");
    assert!(
        page.contains("On CPU f64 reference") && page.contains("tiny by device"),
        "{page}"
    );
    for (from, to, expected) in [
        (
            "\"cpu\"",
            "\"tpu\"",
            "s.toml:5: values[1]: \"tpu\" is not a device",
        ),
        ("\"cpu\"", "\"gpu\"", "the value is listed twice"),
        (
            "name = \"pbf\"",
            "name = \"pbf\"\ndevice = \"cpu\"",
            "method[0].device: the key is the device itself",
        ),
    ] {
        let said = job.load(&text.replace(from, to)).unwrap_err();
        assert!(said.contains(expected), "{said}");
    }

    let job = Job::new();
    let text = r#"
kind = "sweep"
scene = "tiny.toml"
key = "solver.method"
values = ["pbf", "flip"]
steps = 3
repeats = 2
errors = ["density_error_mean"]
[[method]]
name = "both"
"#;
    job.run(text, false).unwrap();
    assert_eq!(job.column("setting"), ["pbf", "flip"]);
    let particles = job.numbers("particles");
    assert!(particles[1] > 7.0 * particles[0], "{particles:?}");
    let page = job.read("index.html");
    assert!(
        page.contains("tiny by solver.method") && page.contains("to the greatest of 2"),
        "{page}"
    );
}

#[test]
fn a_scene_that_is_not_there_is_named_where_the_study_names_it() {
    let said = Job::new()
        .load(&ITERATIONS.replace("tiny.toml", "none.toml"))
        .unwrap_err();
    assert!(said.contains("s.toml:4: scene: cannot read"), "{said}");
    assert!(said.contains("none.toml"), "{said}");
}

/// A point that the study no longer names stays in the ledger but not in the report.
#[test]
fn dropped_values_are_not_reported() {
    let job = Job::new();
    job.run(ITERATIONS, false).unwrap();
    let (_, points) = job
        .run(&ITERATIONS.replace("[1, 4]", "[4, 8]"), false)
        .unwrap();
    assert_eq!(stands(&points), 2);
    assert_eq!(job.column("setting"), ["4", "8", "4", "8"]);
    assert!(!job.read("index.html").contains("<td>1</td><td>216</td>"));
    assert_eq!(job.read("results.jsonl").lines().count(), 6);
}
