//! A scene run over and over with one setting changed at a time: errors, times, curves, page.
//!
//! Each point is one line of `results.jsonl`, written when it is done; a point whose line stands there is not run again.

mod errors;
mod frames;
mod ledger;
mod projection;
mod report;

use std::sync::atomic::{AtomicBool, Ordering};

use crate::{
    domain::particles::Particles,
    gpu::adapter::{Context, GpuError, Needs},
    reference::ReferenceError,
    scene::{
        Method, Scene, physics_hash,
        study::sweep::{ErrorMeasure, Line, LineDevice, Measure, Point, Sweep},
    },
    solve::SolveError,
    study::measure::Gauge,
};

use super::{
    super::{
        device::{Opened, SolverError, needs},
        prepare::Start,
    },
    Event, Outcome, PointEvent, PointStatus, Request, StudyError, direction,
    ledger::Ledger,
    still_level,
};
use ledger::{Record, Run, Verdict};
use projection::Projections;

/// Changes whenever what a line holds does.
const FORM: &str = "swell sweep 2";

/// What the points of a sweep share.
struct Bench<'a> {
    sweep: &'a Sweep,
    /// One for all, so that runs of different resolution are measured alike.
    gauge: Option<Gauge>,
    projections: Option<Projections>,
}

/// Runs it; points whose lines stand in the directory are not run again.
pub(super) fn run(
    request: &Request,
    sweep: &Sweep,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome, StudyError> {
    let devices = open(request, sweep)?;
    let mut bench = Bench {
        gauge: gauge(sweep)?,
        projections: sweep.state.clone().map(Projections::new),
        sweep,
    };
    let mut ledger = Ledger::open(&request.directory)?;
    let points = |line: &Line| line.points.len() + usize::from(line.coarser.is_some());
    let count = sweep.lines.iter().map(points).sum();
    let mut number = 0;
    let mut results: Vec<Vec<Record>> = Vec::new();
    for line in &sweep.lines {
        let mut records = Vec::new();
        for point in line.points.iter().chain(&line.coarser) {
            let opened = devices.of(point);
            let Some((record, status)) = bench.record(&mut ledger, line, opened, point, stop)?
            else {
                return Ok(Outcome::default());
            };
            number += 1;
            tell(Event::Point(PointEvent {
                number,
                count,
                name: match is_coarser(line, point) {
                    true => format!("{}, coarser: {}", line.name, point.label),
                    false => format!("{}, {} = {}", line.name, line.key, point.label),
                },
                status,
            }));
            records.push(record);
        }
        results.push(records);
    }
    report::write_all(request, sweep, &devices, &results)
}

/// What a sweep's points run on.
struct Devices {
    cpu: Opened,
    /// `None` where no point is on it.
    gpu: Option<Opened>,
}

impl Devices {
    fn of(&self, point: &Point) -> &Opened {
        match (point.device, &self.gpu) {
            (LineDevice::Gpu, Some(gpu)) => gpu,
            _ => &self.cpu,
        }
    }
}

/// The adapter is opened once, and only where a point is on it. Where it has no f64 the points that ask for it fail, and
/// the others do not.
fn open(request: &Request, sweep: &Sweep) -> Result<Devices, StudyError> {
    let points = || sweep.lines.iter().flat_map(|line| &line.points);
    let mut on_gpu = points()
        .filter(|point| point.device == LineDevice::Gpu)
        .peekable();
    let gpu = match on_gpu.peek() {
        None => None,
        Some(_) => {
            let wanted = Needs {
                f64: on_gpu.any(|point| needs(&point.scene).f64),
            };
            let adapter = request.adapter.as_deref();
            let context = match Context::open_for(adapter, wanted) {
                Err(GpuError::NoF64 { .. }) => Context::open(adapter)?,
                other => other?,
            };
            Some(Opened::Gpu(Box::new(context)))
        }
    };
    Ok(Devices {
        cpu: Opened::Cpu,
        gpu,
    })
}

/// Whether a point is what the finest one's error is told beside.
fn is_coarser(line: &Line, point: &Point) -> bool {
    line.coarser
        .as_ref()
        .is_some_and(|coarser| std::ptr::eq(coarser, point))
}

impl Bench<'_> {
    /// A point's line: the one that stands, or a new one; `None` where `stop` ended it before it was done.
    fn record(
        &mut self,
        ledger: &mut Ledger<Record>,
        line: &Line,
        opened: &Opened,
        point: &Point,
        stop: &AtomicBool,
    ) -> Result<Option<(Record, PointStatus)>, StudyError> {
        let finest = line.points.last().filter(|_| is_coarser(line, point));
        let hash = self.hash(opened, point, finest);
        if let Some(record) = ledger.find(&hash) {
            return Ok(Some((record.clone(), PointStatus::Stands)));
        }
        let (verdict, status) = match self.run(opened, point, finest, stop) {
            Ok(None) => return Ok(None),
            Ok(Some(run)) => {
                let known =
                    |error: &ErrorMeasure| Some((error.name(), errors::of(*error, &run, None)?));
                let told = self.sweep.errors.iter().filter_map(known).collect();
                let status = PointStatus::Done(1e3 * run.per_frame()[1], told);
                (Verdict::Done(Box::new(run)), status)
            }
            Err(error) if is_of_the_point(&error) => {
                let message = error.to_string();
                (
                    Verdict::Failed(message.clone()),
                    PointStatus::Failed(message),
                )
            }
            Err(error) => return Err(error),
        };
        let key = match finest {
            None => line.key.clone(),
            Some(_) => "coarser".to_owned(),
        };
        let record = Record {
            hash,
            method: line.name.clone(),
            key,
            setting: point.label.clone(),
            verdict,
        };
        ledger.append(&record)?;
        Ok(Some((record, status)))
    }

    fn run(
        &mut self,
        opened: &Opened,
        point: &Point,
        finest: Option<&Point>,
        stop: &AtomicBool,
    ) -> Result<Option<Run>, StudyError> {
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        let repeats = self.sweep.repeats;
        let Some(projections) = &mut self.projections else {
            let measure = self.sweep.errors[0].measure();
            return frames::run(opened, point, repeats, measure, self.gauge.as_ref(), stop);
        };
        match opened {
            Opened::Gpu(context) => Ok(Some(match finest {
                None => projections.run(context, point, repeats)?,
                Some(finest) => projections.coarser(context, finest, point)?,
            })),
            Opened::Cpu => unreachable!("refused where the study is loaded"),
        }
    }

    /// Of all that a line depends on: physics, when to give up, frames, repeats, how it is measured, device, program.
    fn hash(&self, opened: &Opened, point: &Point, finest: Option<&Point>) -> String {
        let state = self.sweep.state.as_ref();
        let solver = &point.scene.solver;
        let most = match solver.method {
            Method::Pbf => solver.pbf().max_substeps,
            Method::Flip => solver.flip().max_substeps,
        };
        let limits = format!("{most} {:?}", point.scene.budget);
        let text = [
            FORM.to_owned(),
            physics_hash(&point.scene),
            limits,
            point.frames.to_string(),
            self.sweep.repeats.to_string(),
            format!("{:?}", self.sweep.errors[0].measure()),
            state.map_or(String::new(), |state| physics_hash(&state.scene)),
            finest.map_or(String::new(), |finest| physics_hash(&finest.scene)),
            format!("{:?}", self.gauge),
            opened.identity().to_string(),
            env!("CARGO_PKG_VERSION").to_owned(),
        ];
        blake3::hash(text.join("\n").as_bytes())
            .to_hex()
            .to_string()
    }
}

/// Where runs are measured against the finest; its cubes are those of the coarsest lattice.
fn gauge(sweep: &Sweep) -> Result<Option<Gauge>, StudyError> {
    let points = || sweep.lines.iter().flat_map(|line| &line.points);
    let Some(finest) = points().last() else {
        return Ok(None);
    };
    if sweep.errors[0].measure() != Measure::Finest {
        return Ok(None);
    }
    let scene = &finest.scene;
    let spacings = points().map(|point| point.scene.particle_spacing());
    let gauge = Gauge::new(scene.domain, direction(scene), spacings.fold(0.0, f64::max));
    let start = Start::of(scene)?.particles.position;
    let still = still_level(scene, &gauge, &start, scene.particle_spacing());
    Ok(Some(gauge.with_still_level(still)))
}

/// Energy per mass, m²/s²: ½ v² + g h over the domain's least corner, mean over the particles.
fn specific_energy(scene: &Scene, particles: &Particles) -> f64 {
    let gravity = scene.water.gravity;
    let of = |(x, v): (&[f32; 3], &[f32; 3])| {
        let [x, v] = [x, v].map(|p| glam::Vec3::from_array(*p).as_dvec3());
        0.5 * v.length_squared() - gravity.dot(x - scene.domain.min)
    };
    let all = particles.position.iter().zip(&particles.velocity);
    all.map(of).sum::<f64>() / particles.len().max(1) as f64
}

/// Whether an error says something of the point, and the study goes on without it.
fn is_of_the_point(error: &StudyError) -> bool {
    matches!(
        error,
        StudyError::Point(_)
            | StudyError::Solve(
                SolverError::Gpu(SolveError::Numbers(_) | SolveError::Gpu(GpuError::NoF64 { .. }),)
                    | SolverError::Reference(
                        ReferenceError::Numbers(_) | ReferenceError::NotConverged { .. },
                    )
            )
    )
}
