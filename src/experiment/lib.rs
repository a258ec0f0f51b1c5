//! Experiments: runs what a study asks for, measures it, and writes the page.
//!
//! The `engine` opens devices, runs points and keeps their results; a kind of study is a file or folder beside it: what is
//! run, what is measured, what is drawn. `sweep` changes one setting at a time, [`stability`] runs scenes that are hard on a
//! solver against their marks, [`validation`] against theory and experiments, `comparison` bakes and renders a scene with two solvers,
//! `surface` draws one with one setting of the look changed at a time, `tune` looks for the cheapest settings of a shot.
//!
//! A further kind is one file here that implements `engine::Kind`, its parser in [`scene::study`](swell_scene::study), and
//! a line in [`study`].

mod claim;
mod comparison;
mod engine;
mod error;
mod ledger;
mod report;
mod run;
pub mod stability;
mod surface;
mod sweep;
mod tune;
pub mod validation;

use std::{path::PathBuf, sync::atomic::AtomicBool};

use swell_domain::chunk::Chunk;
use swell_gpu::adapter;
use swell_scene::study::Study;
use swell_stage::{bake, device::Gpu, inspect::study::Outline, render};

use engine::{Bench, Kind, Work};

pub use engine::Devices;
pub use error::StudyError;
pub use run::Run;

/// What to study, and where to.
#[derive(Clone, Debug)]
pub struct Request {
    /// Of the study, as its page is titled.
    pub name: String,
    /// Validated study.
    pub study: Study,
    /// Caches, pictures, table and page go in here.
    pub directory: PathBuf,
    /// Share of the points that is run, without table and page; the whole study where there is none, with what shares have
    /// run already.
    pub chunk: Option<Chunk>,
    /// Adapter and shaders of what runs on a GPU.
    pub gpu: Gpu,
    /// As typed, for the page.
    pub command: String,
}

/// What a study has to tell while it runs.
#[derive(Clone, Debug)]
pub enum Event {
    /// A bake begins or goes on.
    Solver(&'static str),
    /// What a user has to know of a scene of the study.
    Warning(String),
    /// A bake tells.
    Bake(Box<bake::Event>),
    /// A render tells.
    Render(render::Event),
    /// A point of a sweep.
    Point(PointEvent),
    /// A share ran points of the whole study, which were taken over now or before.
    Joined {
        /// Such as `1/4`.
        share: String,
        /// Its ledger in the study's folder.
        file: String,
        /// How many.
        points: usize,
    },
}

/// Where a sweep stands.
#[derive(Clone, Debug)]
pub struct PointEvent {
    /// From 1.
    pub number: usize,
    /// Points of the study.
    pub count: usize,
    /// Method and setting.
    pub name: String,
    /// What became of it.
    pub status: PointStatus,
}

/// What became of a point of a sweep.
#[derive(Clone, Debug)]
pub enum PointStatus {
    /// It stands there from a run before.
    Stands,
    /// It was run: milliseconds a frame or a projection, and each error that is known already, with its name.
    Done(f64, Vec<(&'static str, f64)>),
    /// Its numbers failed.
    Failed(String),
}

/// How a study ended.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// Its page; `None` where a signal ended it before, and of a share.
    pub page: Option<PathBuf>,
    /// What a share came to; `None` where a signal ended it before, and of a whole study.
    pub share: Option<Share>,
    /// What was found, in words.
    pub findings: Vec<String>,
    /// Marks that are missed and not known to be; only of a study that has marks.
    pub missed: Vec<String>,
}

/// What a share of a study came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Share {
    /// Points that were run.
    pub ran: usize,
    /// Points of the share that stood in a ledger.
    pub stood: usize,
    /// Points of the study that no ledger of the folder has when the share is done.
    pub left: usize,
    /// Whether these may come to less: a search for a limit ends when it has found it.
    pub is_left_at_most: bool,
}

fn kind_of(study: &Study) -> &dyn Kind {
    match study {
        Study::SolverComparison(comparison) => &**comparison,
        Study::Sweep(sweep) => &**sweep,
        Study::Stability(stability) => &**stability,
        Study::Surface(surface) => &**surface,
        Study::Tune(tune) => &**tune,
        Study::Validation(validation) => &**validation,
    }
}

/// Whether each point that shares are dealt, in the study's order, is of this one.
///
/// # Errors
/// [`StudyError::NoShares`].
pub fn dealt(study: &Study, chunk: Chunk) -> Result<Vec<bool>, StudyError> {
    let places = kind_of(study).places();
    let places = places.ok_or(StudyError::NoShares(Outline::of(study).kind))?;
    let ranks: Vec<usize> = places.iter().map(|place| place.rank).collect();
    Ok(chunk.deal(&ranks))
}

/// Runs a study, or a share of it; `tell` hears of progress, and `stop` ends it after the current frame of a bake, a render or a point, which
/// is then run anew. Results that stand in the directory already are kept.
///
/// # Errors
/// [`StudyError`].
pub fn study(
    request: &Request,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome, StudyError> {
    // Also where no point needs it: a name that is none is not passed over.
    if let Some(adapter) = &request.gpu.adapter {
        adapter::check_request(adapter)?;
    }
    for warning in request.study.warnings() {
        tell(Event::Warning(warning));
    }
    let kind = kind_of(&request.study);
    let (work, count) = match request.chunk {
        None => (Work::Whole, kind.count()),
        Some(chunk) => {
            let is_ours = dealt(&request.study, chunk)?;
            let places = kind.places().into_iter().flatten().zip(&is_ours);
            let count = places.filter(|(_, is)| **is).map(|(place, _)| place.points);
            let count = count.sum();
            (Work::Share(chunk, is_ours), count)
        }
    };
    let devices = Devices::open(&request.gpu, kind.needs())?;
    claim::take(&request.directory, &request.name, &request.command)?;
    let mut bench = Bench::new(request, &devices, stop, tell, (work, count));
    let report = match kind.run(&mut bench) {
        Err(StudyError::Stopped) => return Ok(Outcome::default()),
        report => report?,
    };
    if let Some(report) = report {
        return report.write(request, bench.told_of_shares());
    }
    let (ran, stood) = (bench.ran.get(), bench.stood.get());
    // Once more over all points, which runs none of them: others have worked meanwhile.
    let mut look = Bench::new(request, &devices, stop, tell, (Work::Look, kind.count()));
    kind.run(&mut look)?;
    let share = Some(Share {
        ran,
        stood,
        left: look.left.get(),
        is_left_at_most: look.is_left_at_most.get(),
    });
    Ok(Outcome {
        share,
        ..Outcome::default()
    })
}
