//! Studies from their file to the page.

mod command;
mod faults;
mod settings;
mod shares;
mod stability;
mod surfaces;
mod sweeps;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
};

use swell::{
    experiment::{self, PointStatus, StudyError, StudyEvent, StudyOutcome, StudyRequest},
    files::study::{Study, sweep::Sweep},
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

    /// Runs the study and returns the outcome and the status of each point.
    fn run(&self, text: &str, stop: bool) -> Result<(StudyOutcome, Vec<PointStatus>), StudyError> {
        let study = Study::parse(text, Path::new("s.toml"), self.folder.path()).unwrap();
        let request = StudyRequest {
            name: "tiny-study".into(),
            study,
            directory: self.folder.path().join("out"),
            chunk: None,
            gpu: Gpu::default(),
            command: "swell study s.toml".into(),
        };
        let mut points = Vec::new();
        let outcome = experiment::study(&request, &AtomicBool::new(stop), &mut |event| {
            if let StudyEvent::Point(point) = event {
                assert!(point.number <= point.count, "{point:?}");
                points.push(point.status);
            }
        })?;
        Ok((outcome, points))
    }

    /// Returns the values of a table column, by its title.
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
