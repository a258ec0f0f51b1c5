//! Runs the experiments of a study, measures them, and writes the page.
//!
//! The `engine` opens devices, runs points and stores their results. Each kind of study is a file
//! or folder beside it, which defines what is run, measured and drawn: `sweep` changes one setting
//! at a time, [`stability`] runs demanding scenes and checks them against bounds, [`validation`]
//! compares with theory and experiments, `comparison` bakes and renders a scene with two solvers,
//! `surface` draws a scene with one setting of the look changed at a time, and `tune` searches for
//! the cheapest settings of a shot.
//!
//! A further kind needs one file here that implements `engine::Kind`, a parser in
//! [`files::study`](swell_files::study), and a line in [`study`].

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
use swell_files::study::Study;
use swell_gpu::adapter;
use swell_stage::{
    bake,
    device::{Gpu, Opened},
    inspect::study::Outline,
    render::{self, gallery},
};
use swell_study::raster::{self, RasterError};

use engine::{Bench, StudyKind, Work};

pub use engine::Devices;
pub use error::StudyError;
pub use run::Run;

/// A study to run, and where its results go.
#[derive(Clone, Debug)]
pub struct StudyRequest {
    /// Name of the study, the title of its page.
    pub name: String,
    /// The validated study.
    pub study: Study,
    /// Folder for caches, pictures, table and page.
    pub directory: PathBuf,
    /// Share of the points to run, without table and page; `None` for the whole study, including
    /// what shares have run already.
    pub chunk: Option<Chunk>,
    /// Adapter and shaders for runs on a GPU.
    pub gpu: Gpu,
    /// The command as typed, for the page.
    pub command: String,
}

/// Progress of a running study.
#[derive(Clone, Debug)]
pub enum StudyEvent {
    /// The bake of the named solver begins or resumes.
    Solver(&'static str),
    /// Warning about the study or one of its scenes.
    Warning(String),
    /// Warning about the adapter, as [`Opened::software_warning`].
    SoftwareWarning(String),
    /// Progress of a bake.
    Bake(Box<bake::BakeEvent>),
    /// Progress of a render.
    Render(render::RenderEvent),
    /// Outcome of a point.
    Point(PointEvent),
    /// A share ran points that the whole study has copied, now or earlier.
    Joined {
        /// The share, such as `1/4`.
        share: String,
        /// Name of its ledger in the study's folder.
        file: String,
        /// Number of its points.
        points: usize,
    },
}

/// Outcome and position of a point within the study.
#[derive(Clone, Debug)]
pub struct PointEvent {
    /// Number of the point, from 1.
    pub number: usize,
    /// Number of points in the study or the share.
    pub count: usize,
    /// Name of the point, with method and setting.
    pub name: String,
    /// Outcome of the point.
    pub status: PointStatus,
}

/// Outcome of a point.
#[derive(Clone, Debug)]
pub enum PointStatus {
    /// Found in a ledger from an earlier run.
    Stands,
    /// Finished: milliseconds per frame or projection, and the errors that are known already, by
    /// name.
    Done(f64, Vec<(&'static str, f64)>),
    /// Failed, with the reason.
    Failed(String),
}

/// Outcome of a study.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct StudyOutcome {
    /// Path of the page; `None` for a share, and where a signal ended the study.
    pub page: Option<PathBuf>,
    /// Outcome of a share; `None` for a whole study, and where a signal ended it.
    pub share: Option<Share>,
    /// Findings, as sentences.
    pub findings: Vec<String>,
    /// Missed marks that are not listed as known failures; empty for studies without marks.
    pub missed: Vec<String>,
}

/// Outcome of a share of a study.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub struct Share {
    /// Number of points that were run.
    pub ran: usize,
    /// Number of points of the share that were found in a ledger.
    pub stood: usize,
    /// Number of points of the study that no ledger of the folder has at the end of the share.
    pub left: usize,
    /// Whether `left` is an upper bound, because a search for a limit ends as soon as it has found
    /// it.
    pub is_left_at_most: bool,
}

fn kind_of(study: &Study) -> &dyn StudyKind {
    match study {
        Study::SolverComparison(comparison) => &**comparison,
        Study::Sweep(sweep) => &**sweep,
        Study::Stability(stability) => &**stability,
        Study::Surface(surface) => &**surface,
        Study::Tune(tune) => &**tune,
        Study::Validation(validation) => &**validation,
    }
}

/// Returns for each unit of work of a study, in its order, whether it belongs to a share.
///
/// # Errors
/// [`StudyError::NoShares`] if the study cannot be divided.
pub fn dealt(study: &Study, chunk: Chunk) -> Result<Vec<bool>, StudyError> {
    let units = kind_of(study).work_units();
    let units = units.ok_or(StudyError::NoShares(Outline::of(study).kind))?;
    let ranks: Vec<usize> = units.iter().map(|unit| unit.rank).collect();
    Ok(chunk.deal(&ranks))
}

/// Checks that this build can score and draw what a study asks for.
fn require_features(request: &StudyRequest) -> Result<(), StudyError> {
    let has_charts = match &request.study {
        Study::SolverComparison(_) | Study::Stability(_) | Study::Validation(_) => false,
        Study::Sweep(_) | Study::Surface(_) | Study::Tune(_) => request.chunk.is_none(),
    };
    if has_charts {
        raster::require().map_err(RasterError::from)?;
    }
    match &request.study {
        Study::Surface(study) if surface::is_scored(study) => Ok(gallery::require_scores()?),
        _ => Ok(()),
    }
}

/// Runs a study or a share of it, and keeps results that the folder already has. Reports progress
/// through `tell`. Setting `stop` ends the study after the current frame; an unfinished point is
/// run again next time.
///
/// # Errors
/// [`StudyError`] describes all causes; `stop` is not an error but gives an empty outcome.
pub fn study(
    request: &StudyRequest,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(StudyEvent),
) -> Result<StudyOutcome, StudyError> {
    // Checked even where no point needs an adapter, so that a misspelled name is not ignored.
    if let Some(adapter) = &request.gpu.adapter {
        adapter::check_request(adapter)?;
    }
    require_features(request)?;
    for warning in request.study.warnings() {
        tell(StudyEvent::Warning(warning));
    }
    let kind = kind_of(&request.study);
    let (work, count) = match request.chunk {
        None => (Work::Whole, kind.count()),
        Some(chunk) => {
            let is_ours = dealt(&request.study, chunk)?;
            let places = kind.work_units().into_iter().flatten().zip(&is_ours);
            let count = places.filter(|(_, is)| **is).map(|(place, _)| place.points);
            let count = count.sum();
            (Work::Share(chunk, is_ours), count)
        }
    };
    let devices = Devices::open(&request.gpu, kind.needs())?;
    let software_warning = devices.gpu.as_ref().and_then(Opened::software_warning);
    if let Some(warning) = software_warning {
        tell(StudyEvent::SoftwareWarning(warning));
    }
    claim::take(&request.directory, &request.name, &request.command)?;
    let mut bench = Bench::new(request, &devices, stop, tell, (work, count));
    let report = match kind.run(&mut bench) {
        Err(StudyError::Stopped) => return Ok(StudyOutcome::default()),
        report => report?,
    };
    if let Some(report) = report {
        return report.write(request, bench.told_of_shares());
    }
    let (ran, stood) = (bench.ran.get(), bench.stood.get());
    // Counts the missing points without running any, because other processes have worked meanwhile.
    let mut look = Bench::new(request, &devices, stop, tell, (Work::Look, kind.count()));
    kind.run(&mut look)?;
    let share = Some(Share {
        ran,
        stood,
        left: look.left.get(),
        is_left_at_most: look.is_left_at_most.get(),
    });
    Ok(StudyOutcome {
        share,
        ..StudyOutcome::default()
    })
}
