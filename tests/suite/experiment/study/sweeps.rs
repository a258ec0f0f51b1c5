//! Sweeps that are run, resumed and measured.

use std::fs;

use swell::experiment::PointStatus;

use super::{ITERATIONS, Job, SCENE, stands};

/// The page begins with the study's name, one sentence and the curve with its knee; the comparison
/// of methods is folded.
fn reads_from_the_answer_on(page: &str) {
    let place = |text: &str| page.find(text).unwrap_or_else(|| panic!("{text}: {page}"));
    let order = [
        "<h1>tiny-study</h1>",
        "<p class=\"answer\">The knee is solver.pbf.iterations = ",
        "<svg",
        ">knee: ",
        "<summary>3 more curves</summary>",
        "Why &lt;this&gt; is run.",
        "<h2>Knees</h2>",
        "<summary>Method against method in equal time</summary>",
        "<h2>Table</h2>",
        "<summary>What was run</summary>",
    ];
    for pair in order.windows(2) {
        assert!(place(pair[0]) < place(pair[1]), "{pair:?}");
    }
    // Causes of overflow in a narrow window: text that does not wrap, boxes that scroll or have
    // a minimum width.
    for wide in ["nowrap", "overflow-x", "min-width", "white-space:pre}"] {
        assert!(!page.contains(wide), "{wide}");
    }
}

#[test]
fn a_sweep_runs_once_and_tells() {
    let job = Job::new();
    let (outcome, points) = job.run(ITERATIONS, false).unwrap();
    assert_eq!((points.len(), stands(&points)), (4, 0));
    // The knee and the better method depend on timings; that both are reported does not.
    let tells = |what: &str| outcome.findings.iter().any(|f| f.contains(what));
    assert!(tells("knee") && tells("at equal time"), "{outcome:?}");
    assert_eq!(
        job.column("method"),
        ["jacobi", "jacobi", "red_black", "red_black"]
    );
    assert_eq!(job.column("setting"), ["1", "4", "1", "4"]);
    assert_eq!(job.column("particles"), ["216"; 4]);
    assert_eq!(job.column("repeats"), ["2"; 4]);
    // Four frames of one step each, with 1 or 4 iterations per step.
    assert_eq!(job.column("iterations"), ["4", "16", "4", "16"]);
    // Lists and pairs: 9 passes over neighbours per frame against 3. Neighbour
    // counts differ little.
    let work = job.numbers("work");
    assert!((work[1] / work[0] - 3.0).abs() < 0.6, "{work:?}");
    // A block of 6 layers that begins to collapse: more iterations leave less error.
    let error = job.numbers("density_error_mean");
    assert!(error[1] < error[0] && error[3] < error[2], "{error:?}");
    // 4 steps are fewer than 51.
    assert_eq!(job.column("convergence_point_density"), [""; 4]);

    let page = job.read("index.html");
    assert_eq!(page.matches("<svg").count(), 4);
    reads_from_the_answer_on(&page);
    for text in [
        "Why &lt;this&gt; is run.",
        "swell study s.toml",
        "not within the run",
        "23.73",
        "736",
    ] {
        assert_eq!(
            page.contains(text),
            text != "736" && text != "23.73",
            "{text}"
        );
    }
    for outside in ["src=\"", "href=", "<script"] {
        assert!(!page.contains(outside), "{outside}");
    }
    let picture = fs::read(job.out("curves/density_error_mean-time.png")).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(&picture))
        .read_info()
        .unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut pixels).unwrap();
    // Title, two labels and numbers: above the plot, where only text is drawn, there
    // are dark pixels.
    let row = 4 * reader.info().width as usize;
    let dark = pixels[..50 * row]
        .chunks_exact(4)
        .filter(|p| p[0] < 100)
        .count();
    assert!(dark > 200, "{dark}");

    // Again: nothing is run, and the output is the same.
    let lines = job.read("results.jsonl");
    let written = (job.read("results.csv"), page);
    let (_, points) = job.run(ITERATIONS, false).unwrap();
    assert_eq!(stands(&points), 4);
    assert_eq!(job.read("results.jsonl"), lines);
    assert_eq!((job.read("results.csv"), job.read("index.html")), written);

    // Only the point of a missing line is run again.
    let (kept, _) = lines.trim_end().rsplit_once('\n').unwrap();
    fs::write(job.out("results.jsonl"), format!("{kept}\n")).unwrap();
    let (_, points) = job.run(ITERATIONS, false).unwrap();
    assert_eq!(stands(&points), 3);

    // Negative control: after a change of one method's setting, only the other's results are
    // reused; after a change of the scene, none.
    let other = ITERATIONS.replace("iteration=jacobi", "iteration=chebyshev");
    let (_, points) = job.run(&other, false).unwrap();
    assert_eq!(stands(&points), 2);
    fs::write(
        job.folder.path().join("tiny.toml"),
        SCENE.replace("0.6, 0.6, 0.6", "0.6, 0.5, 0.6"),
    )
    .unwrap();
    let (_, points) = job.run(ITERATIONS, false).unwrap();
    assert_eq!(stands(&points), 0);
}

#[test]
fn a_signal_ends_it_and_a_failure_is_listed() {
    let job = Job::new();
    // 0.16 m/s after a frame: at a CFL number of 1e-4 that needs hundreds of substeps.
    let text = ITERATIONS
        .replace("solver.pbf.iterations", "solver.pbf.cfl")
        .replace("[1, 4]", "[1e-4, 1.0, 0.5]");
    let (outcome, points) = job.run(&text, true).unwrap();
    assert!(outcome.page.is_none() && points.is_empty());
    assert!(!job.out("results.csv").exists());

    let (outcome, points) = job.run(&text, false).unwrap();
    assert!(outcome.page.is_some());
    let failed = |p: &PointStatus| {
        matches!(
            p,
            PointStatus::Failed(said) if said.contains("max_substeps is 32")
        )
    };
    assert_eq!(
        points.iter().map(failed).collect::<Vec<_>>(),
        [true, false, false, true, false, false]
    );
    assert_eq!(job.column("setting").len(), 6);
    assert!(job.column("failed")[0].contains("asked for"));
    assert_eq!(job.column("failed")[1], "");
    let page = job.read("index.html");
    assert!(page.contains("<h2>Failed</h2>"));
    // In the list, in the table, and below each of the four curves.
    assert!(
        page.matches("solver.pbf.cfl = 1e-4: frame 1").count() >= 5,
        "{page}"
    );
    // Failures are reused like results.
    let (_, points) = job.run(&text, false).unwrap();
    assert_eq!(stands(&points), 6);
}

/// The dam before it moves: 6 × 6 × 6 cells.
#[test]
fn projections_approach_the_exact_solution() {
    let job = Job::new();
    let text = r#"
kind = "sweep"
scene = "tiny.toml"
set = ["solver.method=flip"]
key = "solver.flip.pressure.tolerance"
values = [1e-1, 1e-3, 1e-6]
steps = 3
errors = ["velocity_error", "pressure_error", "divergence"]
[[method]]
name = "ghost fluid"
[[method]]
name = "voxel"
set = ["solver.flip.surface=voxel", "solver.flip.pressure.preconditioner=jacobi"]
"#;
    job.run(text, false).unwrap();
    for error in ["velocity_error", "pressure_error", "divergence"] {
        let found = job.numbers(error);
        for line in [0, 3] {
            // More than two decades of tolerance reduce the error by at least one; 1e-6 is near the
            // resolution of f32 velocities.
            assert!(found[line + 1] < 0.1 * found[line], "{error}: {found:?}");
            assert!(
                found[line + 2] < 0.1 * found[line + 1],
                "{error}: {found:?}"
            );
            assert!(
                found[line + 2] < 1e-5 && found[line] > 1e-4,
                "{error}: {found:?}"
            );
        }
    }
    assert_eq!(job.column("missed"), ["0"; 6]);
    let page = job.read("index.html");
    assert!(
        page.contains("(216 rows)") || page.contains("rows)"),
        "{page}"
    );
}

#[test]
fn runs_are_held_against_their_finest() {
    let job = Job::new();
    let text = r#"
kind = "sweep"
scene = "tiny.toml"
key = "shot.frames_per_second"
values = [50, 100, 200]
seconds = 0.2
errors = ["profile_error", "energy_error"]
[[method]]
name = "flip"
set = ["solver.method=flip", "shot.frames_per_second=50"]
[[method]]
name = "pbf"
"#;
    let sweep = job.load(text).unwrap();
    let blend = |k: usize| {
        sweep.lines[0].points[k]
            .scene
            .solver
            .flip()
            .unwrap()
            .pic_blend
    };
    // The same blend per second at each rate: two frames at 100 Hz keep what one at 50 Hz keeps.
    assert!((blend(0) - 0.05).abs() < 1e-12);
    assert!(((1.0 - blend(1)).powi(2) - 0.95).abs() < 1e-12);
    assert!(((1.0 - blend(2)).powi(4) - 0.95).abs() < 1e-12);
    job.run(text, false).unwrap();
    let energy = job.column("energy_error");
    assert!(energy[2].is_empty() && energy[5].is_empty(), "{energy:?}");
    let value = |k: usize| energy[k].parse::<f64>().unwrap();
    for line in [0, 3] {
        assert!(
            value(line + 1) < value(line) && value(line) < 0.5,
            "{energy:?}"
        );
    }
    assert!(job.read("index.html").contains("α_ref"));
}

/// The same settings in f32 and f64 differ only by rounding; a different time step does not.
#[test]
fn a_method_runs_on_the_cpu_and_another_is_held_against_it() {
    let job = Job::new();
    let text = r#"
kind = "sweep"
scene = "tiny.toml"
key = "shot.frames_per_second"
values = [50, 100]
seconds = 0.2
errors = ["profile_error", "energy_error"]
[[method]]
name = "f64"
device = "cpu"
[[method]]
name = "f32"
against = "f64"
"#;
    job.run(text, false).unwrap();
    assert_eq!(job.column("device"), ["cpu", "cpu", "gpu", "gpu"]);
    let energy = job.column("energy_error");
    // The finest run is its own reference; runs against another method's have one each.
    assert_eq!(energy[1], "");
    let [coarse, _, first, second] = [0, 1, 2, 3].map(|k| energy[k].parse().unwrap_or(f64::NAN));
    // 10 or 20 steps of f32, each rounded to 6e-8 and amplified by iterations on a crowded lattice:
    // below 1e-5, and not 0. Negative control: half the steps differ by per cents, as would f32
    // against the wrong run.
    assert!(first > 0.0 && first < 1e-5, "{energy:?}");
    assert!(second > 0.0 && second < 1e-5, "{energy:?}");
    assert!(coarse > 1e-3, "{energy:?}");
    let page = job.read("index.html");
    assert!(page.contains("On CPU f64 reference ("), "{page}");
    assert!(page.contains("f32 is compared, value by value, with f64"));

    // A point is identified by its settings and device, not by its method's name: with the names
    // swapped, the same four results are reused.
    let (_, points) = job.run(text, false).unwrap();
    assert_eq!(stands(&points), 4);
    let moved = text
        .replace("device = \"cpu\"", "device = \"gpu\"")
        .replace("name = \"f32\"", "name = \"f32\"\ndevice = \"cpu\"");
    let (_, points) = job.run(&moved, false).unwrap();
    assert_eq!(stands(&points), 4, "the same four, by another name");
    let more = moved.replace("[50, 100]", "[50, 100, 200]");
    let (_, points) = job.run(&more, false).unwrap();
    assert_eq!(stands(&points), 4);
}

/// A tank at rest under its own weight is still with a projection, and simmers without.
#[test]
fn water_at_rest_is_told_from_water_that_simmers() {
    let job = Job::new();
    let text = ITERATIONS
        .replace("steps = 4", "steps = 40")
        .replace("repeats = 2\n", "")
        .replace("convergence_point = true\n", "")
        .replace(
            "\"density_error_mean\", \"density_error_max\"",
            "\"top_speed\", \"weight_error\"",
        )
        .replace(
            "key = ",
            "set = [\"shot.frames=40\", \"domain.max=[0.6, 1.0, 0.6]\", \
             \"probe=[{ kind = \\\"pressure\\\", at = [0.3, 0.25, 0.3] }]\"]\nkey = ",
        )
        .replace(
            "name = \"red_black\"",
            "name = \"alone\"\nset = [\"solver.pbf.grid_projection=false\"]",
        );
    job.run(&text, false).unwrap();
    let (speed, weight) = (job.numbers("top_speed"), job.numbers("weight_error"));
    let (projected, alone) = (&speed[..2], &speed[2..]);
    assert!(projected.iter().all(|&speed| speed < 0.02), "{speed:?}");
    assert!(alone.iter().all(|&speed| speed > 0.05), "{speed:?}");
    assert!(weight[..2].iter().all(|&off| off < 0.03), "{weight:?}");
    assert!(weight[2..].iter().any(|&off| off > 0.03), "{weight:?}");
}

#[test]
fn iterations_come_nearer_to_what_is_converged() {
    let job = Job::new();
    let text = ITERATIONS
        .replace("[1, 4]", "[1, 4, 32]")
        .replace("repeats = 2\n", "")
        .replace(
            "\"density_error_mean\", \"density_error_max\"",
            "\"distance_to_converged\"",
        )
        .replace(
            "steps = 4",
            "set = [\"solver.pbf.grid_projection=false\"]\nsteps = 4",
        );
    job.run(&text, false).unwrap();
    let distance = job.numbers("distance_to_converged");
    for line in distance.chunks(3) {
        // A block in free space: 32 iterations are off by a hundredth of a spacing,
        // one by much more.
        assert!(line[1] < line[0] && line[2] < line[1], "{distance:?}");
        assert!(line[2] < 0.01 && line[2] > 0.0, "{distance:?}");
    }
}
