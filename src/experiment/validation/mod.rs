//! Validation studies: runs benchmarks with known answers, and compares the results with theory and
//! experiments.

mod beach;
mod body;
mod numbers;
mod record;
mod report;
mod ship_waves;
mod start;
mod verdict;

use std::{collections::BTreeMap, sync::atomic::AtomicBool};

use serde::{Deserialize, Serialize};

use swell_files::study::validation::{Benchmark, Trial, Validation};
use swell_gpu::adapter::Needs;
use swell_stage::{drive::Drive, prepare::Start};

use super::{
    Devices, PointStatus, StudyError,
    engine::{Bench, StudyKind, WorkUnit, needs_of, until_done},
    report::Report,
};
use record::Record;

pub use verdict::{Judged, judge};

/// Results of a run.
pub type BenchmarkRun = super::Run<BenchmarkMeasurements>;

/// Measurements that a benchmark takes from a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(expecting = "struct Measured")]
pub struct BenchmarkMeasurements {
    /// Values by the names in
    /// [`Measure::numbers`](swell_files::study::validation::Measure::numbers), without those that
    /// cannot be determined.
    pub numbers: BTreeMap<String, f64>,
    /// Curves by the names in [`Measure::curves`](swell_files::study::validation::Measure::curves).
    pub curves: BTreeMap<String, Vec<(f64, f64)>>,
}

impl StudyKind for Validation {
    fn needs(&self) -> Option<Needs> {
        let runs = self.benchmarks.iter().flat_map(|benchmark| &benchmark.runs);
        needs_of(runs.map(|run| (&run.scene, run.device)))
    }

    fn count(&self) -> usize {
        self.benchmarks
            .iter()
            .map(|benchmark| benchmark.runs.len())
            .sum()
    }

    fn work_units(&self) -> Option<Vec<WorkUnit>> {
        let of_benchmark = |benchmark: &Benchmark| 0..benchmark.runs.len();
        Some(
            self.benchmarks
                .iter()
                .flat_map(of_benchmark)
                .map(WorkUnit::of)
                .collect(),
        )
    }

    fn run(&self, bench: &mut Bench<'_>) -> Result<Option<Report>, StudyError> {
        let mut ledger = bench.ledger()?;
        let mut results = Vec::new();
        for benchmark in &self.benchmarks {
            let mut runs = Vec::new();
            for trial in &benchmark.runs {
                if !bench.is_next_ours() {
                    continue;
                }
                let name = format!("{}, {}", benchmark.name, trial.name());
                let measured = format!(
                    "{:?} {:?} {:?}",
                    benchmark.measure, benchmark.scale, benchmark.points
                );
                let scenes = [(&trial.scene, trial.device)];
                let key = bench
                    .devices
                    .key(&scenes, trial.scene.shot.frames, &measured);
                let measure = || run_benchmark(bench.devices, benchmark, trial, bench.stop);
                if let Some((run, stood)) = bench.point(&mut ledger, &name, key, measure)? {
                    bench.report_point(name, status(&run, stood));
                    runs.push(run);
                }
            }
            results.push((benchmark, runs));
        }
        if bench.is_part() {
            return Ok(None);
        }
        bench.joined(&ledger);
        let judged = |(benchmark, runs): (_, Vec<BenchmarkRun>)| {
            let judged = judge(benchmark, &runs);
            (benchmark, runs, judged)
        };
        let results: Vec<_> = results.into_iter().map(judged).collect();
        Ok(Some(report::draw(self, bench, &results)))
    }
}

fn status(run: &BenchmarkRun, stood: bool) -> PointStatus {
    match &run.ended {
        Some(message) => PointStatus::Failed(message.clone()),
        None if stood => PointStatus::Stands,
        None => PointStatus::Done(1e3 * run.per_frame()[1], Vec::new()),
    }
}

/// Runs a trial of a benchmark over its whole shot, or until its numbers fail.
///
/// # Errors
/// Failures that the numbers did not cause: of the device or a file, or [`StudyError::Stopped`] if
/// `stop` was set before the end.
pub fn run_benchmark(
    devices: &Devices,
    benchmark: &Benchmark,
    trial: &Trial,
    stop: &AtomicBool,
) -> Result<BenchmarkRun, StudyError> {
    let mut run = BenchmarkRun::default();
    if let Err(error) = go(devices, benchmark, trial, stop, &mut run) {
        run.ended = Some(error.of_the_point()?);
    }
    Ok(run)
}

fn go(
    devices: &Devices,
    benchmark: &Benchmark,
    trial: &Trial,
    stop: &AtomicBool,
    run: &mut BenchmarkRun,
) -> Result<(), StudyError> {
    let scene = &trial.scene;
    let mut start = Start::of(scene)?;
    let mut water = std::mem::take(&mut start.particles).filled();
    start::prepare(benchmark, scene, &mut water);
    if let Some(band) = scene.band() {
        band.enter(&mut water);
    }
    start.particles = water;
    run.particles = start.particles.len();
    let mut drive = Drive::new(devices.of(trial.device), scene, &start, false)?.with_probes();
    let mut record = Record::new(benchmark, scene, &start.particles.water());
    let mut seconds = 0.0;
    let ended = until_done(&mut drive, scene.shot.frames, stop, |step| {
        seconds += step.seconds;
        run.frames += 1;
        record.look(&step);
        Ok(())
    });
    run.seconds.push(seconds);
    run.measured = numbers::of(&record);
    ended
}
