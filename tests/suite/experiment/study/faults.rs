//! Faulty sweeps are refused with the position of the fault in the study.

use std::fs;

use swell::scene::Stop;

use super::{ITERATIONS, Job, SCENE};

#[test]
fn devices_and_references_that_do_not_fit_are_refused() {
    let job = Job::new();
    let second = "name = \"red_black\"\n";
    for (from, to, expected) in [
        (
            second,
            "name = \"b\"\ndevice = \"tpu\"\n",
            "s.toml:16: method[1].device: \"tpu\" is not a device; allowed: \"gpu\", or \"cpu\"",
        ),
        (
            second,
            "name = \"b\"\nagainst = \"jacobi\"\n",
            "s.toml:16: method[1].against: \"jacobi\" is needed by none of these errors",
        ),
        (
            "\"density_error_mean\", \"density_error_max\"",
            "\"weight_error\"",
            "weight_error cannot be measured of \"jacobi\" with 1: its scene has no probe of \
             pressure",
        ),
        (
            "\"density_error_mean\", \"density_error_max\"",
            "\"distance_to_converged\", \"density_error_max\"",
            "errors[1]: \"density_error_max\" is not measured in the same run",
        ),
    ] {
        assert!(ITERATIONS.contains(from), "{from}");
        let said = job.load(&ITERATIONS.replace(from, to)).unwrap_err();
        assert!(said.contains(expected), "{said}");
    }
    // The message names a key of another kind, not a missing one.
    let other = ITERATIONS.replace("kind = \"sweep\"", "kind = \"solver_comparison\"");
    let said = job.load(&other).unwrap_err();
    let words = "does not go with kind = \"solver_comparison\"; allowed with it: kind, scene";
    assert!(said.contains("s.toml:") && said.contains(words), "{said}");
    let said = job
        .load(&ITERATIONS.replace("steps = 4\n", ""))
        .unwrap_err();
    let words =
        "steps: missing; allowed: a whole number from 1 to 1000000, not together with seconds; or";
    assert!(
        said.contains(words) && !said.contains("scene.steps"),
        "{said}"
    );
    let finest = ITERATIONS.replace("steps = 4", "steps = 10").replace(
        "\"density_error_mean\", \"density_error_max\"",
        "\"crest_error\"",
    );
    for (name, values, expected) in [
        ("sor", "[1, 4]", "is not the name of another method"),
        ("b", "[1, 4]", "is not the name of another method"),
        ("jacobi", "[1, 8]", "has another key, other values"),
    ] {
        let lines = format!("name = \"b\"\nvalues = {values}\nagainst = \"{name}\"\n");
        let said = job.load(&finest.replace(second, &lines)).unwrap_err();
        assert!(said.contains("s.toml:17: method[1].against: "), "{said}");
        assert!(said.contains(expected), "{said}");
    }
    let fits = "name = \"b\"\nagainst = \"jacobi\"\n";
    let sweep = job.load(&finest.replace(second, fits)).unwrap();
    assert_eq!(sweep.lines[1].against, Some(0));

    let projection = ITERATIONS
        .replace("solver.pbf.iterations", "solver.flip.pressure.tolerance")
        .replace("[1, 4]", "[0.1, 0.01]")
        .replace("solver.pbf.iteration=jacobi", "solver.method=flip")
        .replace(
            "scene = \"tiny.toml\"",
            "scene = \"tiny.toml\"\nset = [\"solver.method=flip\"]",
        )
        .replace(
            "\"density_error_mean\", \"density_error_max\"",
            "\"divergence\"",
        );
    assert!(job.load(&projection).is_ok());
    let on_cpu = projection.replace(second, "name = \"b\"\ndevice = \"cpu\"\n");
    let said = job.load(&on_cpu).unwrap_err();
    let expected = "s.toml:17: method[1].device: the reference's projection is what these errors";
    assert!(said.contains(expected), "{said}");

    let converged = ITERATIONS.replace(
        "\"density_error_mean\", \"density_error_max\"",
        "\"distance_to_converged\"",
    );
    // 0.6 m a side: 24 spacings of 0.025 m are 13 824 particles; 20 of 0.03 m are 8 000.
    let fine = |spacing: &str| {
        let set =
            format!("scene = \"tiny.toml\"\nset = [\"solver.pbf.particle_spacing={spacing}\"]");
        job.load(&converged.replace("scene = \"tiny.toml\"", &set))
    };
    assert!(fine("0.03").is_ok());
    let said = fine("0.025").unwrap_err();
    assert!(
        said.contains("s.toml:10: errors: distance_to_converged takes"),
        "{said}"
    );
    assert!(
        said.contains("has 13824 particles, and up to 9000"),
        "{said}"
    );
    let said = job
        .load(&projection.replace("divergence", "distance_to_converged"))
        .unwrap_err();
    assert!(
        said.contains("is measured with solver.method pbf, and \"jacobi\" with 0.1 has another"),
        "{said}"
    );
}

#[test]
fn each_fault_names_file_line_key_and_what_is_allowed() {
    let job = Job::new();
    let sweep = job.load(ITERATIONS).unwrap();
    let counts = sweep.lines[0]
        .points
        .iter()
        .map(|p| p.scene.solver.pbf().unwrap().stop);
    assert_eq!(
        counts.collect::<Vec<_>>(),
        [Stop::Iterations(1), Stop::Iterations(4)]
    );
    for (old, new, expected) in [
        (
            "repeats",
            "repeat",
            "s.toml:8: repeat: unknown key; the nearest is \"repeats\"",
        ),
        (
            "iterations\"",
            "iteration\"",
            "s.toml:6: values[0]: solver.pbf.iteration: ",
        ),
        (
            "[1, 4]",
            "[1, 0]",
            "s.toml:6: values[1]: solver.pbf.iterations: ",
        ),
        (
            "[1, 4]",
            "[1, 1]",
            "s.toml:6: values[1]: the scene is the same as with a value before it",
        ),
        (
            "[1, 4]",
            "[4]",
            "s.toml:6: values: a sweep has two values or more",
        ),
        (
            "pbf.iterations",
            "flip.cfl",
            "s.toml:6: values[1]: the scene is the same",
        ),
        (
            "pbf.iterations",
            "sph.iterations",
            "s.toml:6: values[0]: solver.sph: unknown key",
        ),
        (
            "iteration=jacobi",
            "iteration=sor",
            "s.toml:13: method[0].set[0]: solver.pbf.iteration: \"sor\" is no",
        ),
        (
            "steps = 4",
            "steps = 0",
            "s.toml:7: steps: 0 is out of range; allowed: a whole number",
        ),
        (
            "steps = 4",
            "seconds = 0.11",
            "s.toml:7: seconds: at 60 frames a second these are 6.6 frames",
        ),
        ("steps = 4\n", "", "steps: missing"),
        (
            "key = \"solver.pbf.iterations\"\n",
            "",
            "key: missing; allowed: a key of the scene",
        ),
        (
            "_mean\"",
            "_mode\"",
            "errors[0]: \"density_error_mode\" is not an error that is measured",
        ),
        (
            "_max\"",
            "_mean\"",
            "errors[1]: \"density_error_mean\" is listed twice",
        ),
        (
            "density_error_max",
            "velocity_error",
            "errors[1]: \"velocity_error\" is not measured in the same run",
        ),
        (
            "\"density_error_mean\", \"density_error_max\"",
            "\"pressure_error\"",
            "errors: these are measured with solver.method flip",
        ),
        (
            "\"density_error_mean\", \"density_error_max\"",
            "\"crest_error\"",
            "errors: crest_error is taken at 10 times",
        ),
        (
            "\"red_black\"",
            "\"jacobi\"",
            "method[1].name: \"jacobi\" is the name of another method",
        ),
    ] {
        assert!(ITERATIONS.contains(old), "{old}");
        let said = job.load(&ITERATIONS.replacen(old, new, 1)).unwrap_err();
        assert!(
            said.contains(expected) && said.contains("s.toml"),
            "{new}: {said}"
        );
    }
    // A fault of the scene is reported at its position in the scene.
    fs::write(
        job.folder.path().join("tiny.toml"),
        SCENE.replace("frames = 8", "frames = 0"),
    )
    .unwrap();
    let said = job.load(ITERATIONS).unwrap_err();
    assert!(said.contains("tiny.toml:4: shot.frames"), "{said}");
}
