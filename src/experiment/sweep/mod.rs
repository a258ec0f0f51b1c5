//! Sweeps: runs a scene repeatedly with one setting changed at a time and relates errors to time.

pub(super) mod digits;
mod frames;
mod measured;
mod projection;
mod report;
mod words;

use swell_files::study::sweep::{ErrorMeasure, Line, Measure, Point, Sweep};
use swell_gpu::adapter::Needs;
use swell_stage::{gauge, prepare::Start};
use swell_study::measure::Gauge;

use super::{
    PointStatus, StudyError,
    engine::{Bench, StudyKind, WorkUnit, needs_of},
    ledger::Key,
    report::Report,
};
use measured::{SweepRun, error};
use projection::Projections;

impl StudyKind for Sweep {
    fn needs(&self) -> Option<Needs> {
        needs_of(self.points().map(|point| (&point.scene, point.device)))
    }

    fn count(&self) -> usize {
        self.points().count() + self.lines.iter().flat_map(|line| &line.coarser).count()
    }

    fn work_units(&self) -> Option<Vec<WorkUnit>> {
        let of_line = |line: &Line| 0..line.points.iter().chain(&line.coarser).count();
        Some(
            self.lines
                .iter()
                .flat_map(of_line)
                .map(WorkUnit::of)
                .collect(),
        )
    }

    fn run(&self, bench: &mut Bench<'_>) -> Result<Option<Report>, StudyError> {
        let mut lab = Lab {
            sweep: self,
            gauge: gauge_of(self)?,
            projections: self.state.as_ref().map(Projections::new),
        };
        let mut ledger = bench.ledger()?;
        let mut runs = Vec::new();
        for line in &self.lines {
            let mut of_line = Vec::new();
            for point in line.points.iter().chain(&line.coarser) {
                if !bench.is_next_ours() {
                    continue;
                }
                let coarser = line.coarser.as_ref();
                let is_coarser = coarser.is_some_and(|coarser| std::ptr::eq(coarser, point));
                let finest = line.points.last().filter(|_| is_coarser);
                let name = match is_coarser {
                    true => format!("{}, coarser: {}", line.name, point.label),
                    false => format!("{}, {} = {}", line.name, line.key, point.label),
                };
                let key = lab.key(bench, point, finest);
                let measure = || lab.measure(bench, point, finest);
                if let Some((run, stood)) = bench.point(&mut ledger, &name, key, measure)? {
                    bench.report_point(name, status(&self.errors, &run, stood));
                    of_line.push(run);
                }
            }
            runs.push(of_line);
        }
        if bench.is_part() {
            return Ok(None);
        }
        bench.joined(&ledger);
        Ok(Some(report::draw(self, bench, &runs)))
    }
}

fn status(errors: &[ErrorMeasure], run: &SweepRun, stood: bool) -> PointStatus {
    let known = |of: &ErrorMeasure| Some((of.name(), error(*of, &run.measured, None)?));
    match &run.ended {
        _ if stood => PointStatus::Stands,
        Some(message) => PointStatus::Failed(message.clone()),
        None => PointStatus::Done(
            1e3 * run.per_frame()[1],
            errors.iter().filter_map(known).collect(),
        ),
    }
}

/// State shared by the points of a sweep.
struct Lab<'a> {
    sweep: &'a Sweep,
    /// A single gauge, so that runs of different resolution are measured in the same manner.
    gauge: Option<Gauge>,
    projections: Option<Projections<'a>>,
}

impl Lab<'_> {
    /// Measures a point. `finest` is the reference of a coarser point.
    fn measure(
        &mut self,
        bench: &Bench<'_>,
        point: &Point,
        finest: Option<&Point>,
    ) -> Result<SweepRun, StudyError> {
        match (&mut self.projections, finest) {
            (None, _) => frames::measure(bench, point, self.sweep, self.gauge.as_ref()),
            (Some(projections), None) => projections.measure(bench, point, self.sweep.repeats),
            (Some(projections), Some(finest)) => projections.coarser(bench, finest, point),
        }
    }

    fn key(&self, bench: &Bench<'_>, point: &Point, finest: Option<&Point>) -> Key {
        let points = [point].into_iter().chain(&self.sweep.state).chain(finest);
        let runs: Vec<_> = points.map(|point| (&point.scene, point.device)).collect();
        let repeats = self.sweep.repeats;
        let is_weighed = self.sweep.errors.contains(&ErrorMeasure::Weight);
        let measured = format!(
            "{repeats} {:?} {:?} {:?}",
            self.sweep.errors[0].measure(),
            self.gauge,
            is_weighed.then(|| point.scene.pressure_points()),
        );
        bench.devices.key(&runs, point.frames, &measured)
    }
}

/// Gauge for runs that are compared with the finest one; its cubes are those of the coarsest
/// lattice.
fn gauge_of(sweep: &Sweep) -> Result<Option<Gauge>, StudyError> {
    let Some(finest) = sweep.points().last() else {
        return Ok(None);
    };
    if sweep.errors[0].measure() != Measure::Finest {
        return Ok(None);
    }
    let spacings = sweep.points().map(|point| point.scene.particle_spacing());
    let scene = &finest.scene;
    let start = Start::of(scene)?.particles.position;
    let coarsest = spacings.fold(0.0, f64::max);
    Ok(Some(gauge::gauge(
        scene,
        coarsest,
        &start,
        scene.particle_spacing(),
    )))
}
