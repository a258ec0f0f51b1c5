//! Sweeps from the study file to the page.
mod settings;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::atomic::AtomicBool,
};

use swell::{
    experiment::{Event, Outcome, PointStatus, Request, StudyError, study},
    scene::{
        Stop,
        study::{Study, sweep::Sweep},
    },
    stage::device::Gpu,
};
use tempfile::TempDir;

const SCENE: &str = r#"
[shot]
name = "tiny"
frames = 8
frames_per_second = 60
[domain]
min = [0.0, 0.0, 0.0]
max = [1.2, 1.0, 0.6]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.6, 0.6, 0.6]
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
[solver.flip]
cell_size = 0.1
density_correction = false
pressure = { max_iterations = 1000 }
[budget]
residual = 1.0
divergence = false
"#;

const ITERATIONS: &str = r#"
kind = "sweep"
about = ["Why <this> is run."]
scene = "tiny.toml"
key = "solver.pbf.iterations"
values = [1, 4]
steps = 4
repeats = 2
errors = ["density_error_mean", "density_error_max"]
convergence_point = true
[[method]]
name = "jacobi"
set = ["solver.pbf.iteration=jacobi"]
[[method]]
name = "red_black"
"#;

struct Job {
    folder: TempDir,
}

impl Job {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        fs::write(folder.path().join("tiny.toml"), SCENE).unwrap();
        Self { folder }
    }

    fn out(&self, name: &str) -> PathBuf {
        self.folder.path().join("out").join(name)
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.out(name)).unwrap()
    }

    fn load(&self, text: &str) -> Result<Sweep, String> {
        match Study::parse(text, Path::new("s.toml"), self.folder.path()) {
            Ok(Study::Sweep(sweep)) => Ok(*sweep),
            Ok(other) => panic!("{other:?}"),
            Err(error) => Err(error.to_string()),
        }
    }

    /// What became of each point.
    fn run(&self, text: &str, stop: bool) -> Result<(Outcome, Vec<PointStatus>), StudyError> {
        let request = Request {
            name: "tiny-study".into(),
            study: Study::Sweep(Box::new(self.load(text).unwrap())),
            directory: self.folder.path().join("out"),
            gpu: Gpu::default(),
            command: "swell study s.toml".into(),
        };
        let mut points = Vec::new();
        let outcome = study(&request, &AtomicBool::new(stop), &mut |event| {
            if let Event::Point(point) = event {
                points.push(point.status);
            }
        })?;
        Ok((outcome, points))
    }

    /// The values of a column of the table, by its title.
    fn column(&self, title: &str) -> Vec<String> {
        let csv = self.read("results.csv");
        let mut rows = csv.lines().map(|row| row.split(',').collect::<Vec<_>>());
        let place = rows.next().unwrap().iter().position(|t| *t == title);
        let place = place.unwrap_or_else(|| panic!("{title}: {csv}"));
        rows.map(|row| row[place].to_owned()).collect()
    }

    fn numbers(&self, title: &str) -> Vec<f64> {
        self.column(title)
            .iter()
            .map(|v| v.parse().unwrap())
            .collect()
    }
}

fn stands(points: &[PointStatus]) -> usize {
    let is_standing = |p: &&PointStatus| matches!(p, PointStatus::Stands);
    points.iter().filter(is_standing).count()
}

#[test]
fn a_sweep_runs_once_and_tells() {
    let job = Job::new();
    let (outcome, points) = job.run(ITERATIONS, false).unwrap();
    assert_eq!((points.len(), stands(&points)), (4, 0));
    // Which setting is the knee and who is better, times decide; that both are told, they do not.
    let tells = |what: &str| outcome.findings.iter().any(|f| f.contains(what));
    assert!(tells("knee") && tells("at equal time"), "{outcome:?}");
    assert_eq!(
        job.column("method"),
        ["jacobi", "jacobi", "red_black", "red_black"]
    );
    assert_eq!(job.column("setting"), ["1", "4", "1", "4"]);
    assert_eq!(job.column("particles"), ["216"; 4]);
    assert_eq!(job.column("repeats"), ["2"; 4]);
    // One step a frame of four, each of so many iterations.
    assert_eq!(job.column("iterations"), ["4", "16", "4", "16"]);
    // Lists and pairs: 9 passes over neighbours a frame to 3. The neighbours themselves differ little.
    let work = job.numbers("work");
    assert!((work[1] / work[0] - 3.0).abs() < 0.6, "{work:?}");
    // A block of 6 layers that begins to fall over: more iterations leave less error.
    let error = job.numbers("density_error_mean");
    assert!(error[1] < error[0] && error[3] < error[2], "{error:?}");
    // 4 steps are no 51.
    assert_eq!(job.column("convergence_point_density"), [""; 4]);

    let page = job.read("index.html");
    assert_eq!(page.matches("<svg").count(), 4);
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
    // Title, two labels, and numbers: above the plot, where nothing but text is drawn, there are dark pixels.
    let row = 4 * reader.info().width as usize;
    let dark = pixels[..50 * row]
        .chunks_exact(4)
        .filter(|p| p[0] < 100)
        .count();
    assert!(dark > 200, "{dark}");

    // Again: nothing is run, and what is written is the same.
    let lines = job.read("results.jsonl");
    let written = (job.read("results.csv"), page);
    let (_, points) = job.run(ITERATIONS, false).unwrap();
    assert_eq!(stands(&points), 4);
    assert_eq!(job.read("results.jsonl"), lines);
    assert_eq!((job.read("results.csv"), job.read("index.html")), written);

    // A line that is gone is run again, and it alone.
    let (kept, _) = lines.trim_end().rsplit_once('\n').unwrap();
    fs::write(job.out("results.jsonl"), format!("{kept}\n")).unwrap();
    let (_, points) = job.run(ITERATIONS, false).unwrap();
    assert_eq!(stands(&points), 3);

    // Negative control: with another scene nothing stands; with one method's setting changed the other's points do.
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
    // 0.16 m/s after a frame: at a CFL number of 1e-4 that asks for hundreds of substeps.
    let text = ITERATIONS
        .replace("solver.pbf.iterations", "solver.pbf.cfl")
        .replace("[1, 4]", "[1e-4, 1.0, 0.5]");
    let (outcome, points) = job.run(&text, true).unwrap();
    assert!(outcome.page.is_none() && points.is_empty());
    assert!(!job.out("results.csv").exists());

    let (outcome, points) = job.run(&text, false).unwrap();
    assert!(outcome.page.is_some());
    let failed = |p: &PointStatus| matches!(p, PointStatus::Failed(said) if said.contains("max_substeps is 32"));
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
    // A failure stands as well as a result.
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
            // Two decades of tolerance and more buy at least one of error; 1e-6 is near what f32 velocities can hold.
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
    let blend = |k: usize| sweep.lines[0].points[k].scene.solver.flip().pic_blend;
    // As much a second at each rate: two frames of 100 keep what one of 50 keeps.
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

/// The same settings in f32 and f64: rounding is what differs, and the step's length is another matter.
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
    // 10 or 20 steps of f32, each rounded to 6e-8 and amplified by iterations on a crowded lattice: below 1e-5, and not
    // 0. Half the steps are off by percents: negative control, for so would be f32 against the wrong run.
    assert!(first > 0.0 && first < 1e-5, "{energy:?}");
    assert!(second > 0.0 && second < 1e-5, "{energy:?}");
    assert!(coarse > 1e-3, "{energy:?}");
    let page = job.read("index.html");
    assert!(page.contains("On CPU f64 reference ("), "{page}");
    assert!(page.contains("f32 is held, value by value, against f64"));

    // The device is in what a point depends on: on the GPU nothing of the CPU's stands.
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

#[test]
fn iterations_come_nearer_to_what_is_converged() {
    let job = Job::new();
    let text = ITERATIONS
        .replace("[1, 4]", "[1, 4, 32]")
        .replace("repeats = 2\n", "")
        .replace(
            "\"density_error_mean\", \"density_error_max\"",
            "\"distance_to_converged\"",
        );
    job.run(&text, false).unwrap();
    let distance = job.numbers("distance_to_converged");
    for line in distance.chunks(3) {
        // A block in free room: 32 iterations leave a hundredth of a spacing, one much more.
        assert!(line[1] < line[0] && line[2] < line[1], "{distance:?}");
        assert!(line[2] < 0.01 && line[2] > 0.0, "{distance:?}");
    }
}

#[test]
fn devices_and_references_that_do_not_fit_are_refused() {
    let job = Job::new();
    let second = "name = \"red_black\"\n";
    for (from, to, expected) in [
        (
            second,
            "name = \"b\"\ndevice = \"tpu\"\n",
            "s.toml:16: method[1].device: \"tpu\" is no device; allowed: \"gpu\", or \"cpu\"",
        ),
        (
            second,
            "name = \"b\"\nagainst = \"jacobi\"\n",
            "s.toml:16: method[1].against: \"jacobi\" is needed by none of these errors",
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
    let finest = ITERATIONS.replace("steps = 4", "steps = 10").replace(
        "\"density_error_mean\", \"density_error_max\"",
        "\"crest_error\"",
    );
    for (name, values, expected) in [
        ("sor", "[1, 4]", "is the name of no other method"),
        ("b", "[1, 4]", "is the name of no other method"),
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
        .map(|p| p.scene.solver.pbf().stop);
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
            "errors[0]: \"density_error_mode\" is no error that is measured",
        ),
        (
            "_max\"",
            "_mean\"",
            "errors[1]: \"density_error_mean\" stands there twice",
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
    // A fault of the scene itself is said at its own place.
    fs::write(
        job.folder.path().join("tiny.toml"),
        SCENE.replace("frames = 8", "frames = 0"),
    )
    .unwrap();
    let said = job.load(ITERATIONS).unwrap_err();
    assert!(said.contains("tiny.toml:4: shot.frames"), "{said}");
}

#[test]
fn the_command_tells_each_point() {
    let job = Job::new();
    fs::write(job.folder.path().join("s.toml"), ITERATIONS).unwrap();
    let run = |progress: &str| {
        Command::new(env!("CARGO_BIN_EXE_swell"))
            .current_dir(job.folder.path())
            .args(["study", "s.toml", "-o", "out", "--progress", progress])
            .output()
            .unwrap()
    };
    let output = run("plain");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(
        said.contains("point 1 of 4  jacobi, solver.pbf.iterations = 1  done"),
        "{said}"
    );
    // What the finding is, times decide; that there is one, they do not.
    assert!(
        said.contains("density_error_mean, jacobi: ") && said.contains("page: out"),
        "{said}"
    );
    // A failure is told once.
    let failing = ITERATIONS.replace(
        "name = \"red_black\"",
        "name = \"red_black\"\nset = [\"solver.pbf.cfl=1e-4\", \"solver.pbf.max_substeps=1\"]",
    );
    fs::write(job.folder.path().join("s.toml"), failing).unwrap();
    let said = run("plain").stderr;
    let said = String::from_utf8_lossy(&said);
    assert_eq!(said.matches("point 3 of 4").count(), 1, "{said}");
    assert!(
        said.contains("red_black, solver.pbf.iterations = 1  failed: frame 1"),
        "{said}"
    );
    fs::write(job.folder.path().join("s.toml"), ITERATIONS).unwrap();
    let output = run("json");
    let lines = String::from_utf8(output.stdout).unwrap();
    let events: Vec<serde_json::Value> = lines
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(events[3]["status"], "stands there");
    assert_eq!(events[3]["count"], 4);

    // While another writes there, and where anything else lies, a study does not begin.
    let results = fs::File::open(job.folder.path().join("out/results.jsonl")).unwrap();
    results.lock().unwrap();
    let output = run("plain");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{said}");
    assert!(said.contains("another study writes here"), "{said}");
    results.unlock().unwrap();
    assert!(run("plain").status.success());
    fs::remove_file(job.folder.path().join("out/results.jsonl")).unwrap();
    let page = job.folder.path().join("out/index.html");
    fs::write(&page, "mine").unwrap();
    let output = run("plain");
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(4), "{said}");
    assert!(said.contains("what is no study's"), "{said}");
    assert_eq!(fs::read_to_string(page).unwrap(), "mine");
}
