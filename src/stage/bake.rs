//! `bake`: turns a scene into a particle cache.

mod disk;
mod error;
mod frames;
mod inflow;
mod manifest;
mod plan;
mod water;

use std::{path::PathBuf, sync::atomic::AtomicBool};

use swell_cache::{CacheWriter, Clock, Parent, failed};
use swell_domain::{frame_range::FrameRange, particles::Particles, solver::StepReport};
use swell_scene::Scene;
use swell_solve::plan::Share;

use super::{
    branch::BranchPoint,
    device::{Device, Identity, Opened, PassTimes, SolverError, needs},
    drive::{Drive, End},
    prepare::Volume,
    probes, replay,
};
use frames::Frames;

pub use self::{disk::DiskSpace, error::BakeError, inflow::Inflow, plan::BakePlan};

/// What to bake, where, and on which device.
#[derive(Clone, Debug)]
pub struct BakeRequest {
    /// The validated scene.
    pub scene: Scene,
    /// Directory of the cache.
    pub directory: PathBuf,
    /// Frames to bake; the whole shot if `None`.
    pub frames: Option<FrameRange>,
    /// Whether to resume a bake that already exists in the directory.
    pub resume: bool,
    /// Frame of another cache to begin from; the scene's own start if `None`.
    pub from: Option<BranchPoint>,
    /// Device to solve on.
    pub device: Device,
    /// Whether to time passes on the device, which runs them one by one; on the CPU they always run
    /// so.
    pub time_passes: bool,
}

/// Progress of a running bake.
#[derive(Clone, Debug)]
pub enum BakeEvent {
    /// The device is open and the scene is filled with water.
    Ready {
        /// Adapter and driver, or the f64 reference.
        device: Identity,
        /// Warning about the adapter, as [`Opened::software_warning`].
        software_warning: Option<String>,
        /// Number of particles at the start.
        particles: usize,
        /// Particles left out because a solid covers them or they lie behind a wall.
        removed: usize,
        /// Volume of water at the start.
        volume: Volume,
        /// Number of samples on solids.
        boundary_samples: usize,
        /// Name of the solver.
        solver: &'static str,
        /// GPU memory in total and for neighbour lists, bytes; `None` on the CPU.
        bytes: Option<(u64, u64)>,
        /// Disk space that the frames will need, and that is free.
        disk: DiskSpace,
        /// First frame that will be computed.
        first: u32,
        /// Last frame that will be computed.
        last: u32,
        /// The frame of another cache that a new bake begins from, if it does.
        parent: Option<Parent>,
        /// Notes about beginning from that frame, a sentence each.
        notes: Vec<String>,
        /// Warnings about the scene, a sentence each.
        warnings: Vec<String>,
    },
    /// A frame was computed.
    Frame {
        /// Number of the frame.
        frame: u32,
        /// Report of its substeps.
        report: StepReport,
        /// Wall-clock time since the frame before was done, or since the run began, seconds.
        seconds: f64,
    },
    /// The frames computed by this run are on the disk. Also sent before the error if a later frame
    /// failed.
    Written {
        /// Bytes written by this run.
        bytes: u64,
    },
}

/// Result of a bake that met no error.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct BakeOutcome {
    /// Last frame in the cache.
    pub last_frame: u32,
    /// Number of frames computed by this run.
    pub frames: u32,
    /// Bytes of frames written by this run.
    pub bytes: u64,
    /// Seconds for which frames that were read waited for the disk; the solver may have computed
    /// the next one meanwhile.
    pub waited: f64,
    /// Whether a signal ended it before the last frame.
    pub interrupted: bool,
    /// Warnings about the frames computed by this run, a sentence each.
    pub warnings: Vec<String>,
    /// Seconds and runs of each pass, if measured.
    pub passes: PassTimes,
    /// The same grouped by purpose, with bytes.
    pub shares: Vec<Share>,
}

/// Runs a bake. `tell` receives progress events, and setting `stop` ends the bake after the current
/// frame.
///
/// # Errors
/// [`BakeError`]; the frames that were completed before are in the cache.
pub fn bake(
    request: &BakeRequest,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(BakeEvent),
) -> Result<BakeOutcome, BakeError> {
    run(request, &BakePlan::new(request)?, stop, tell)
}

/// Like [`bake`], with the request's plan.
///
/// # Panics
/// If the plan is of another request.
///
/// # Errors
/// As for [`bake`].
pub fn run(
    request: &BakeRequest,
    plan: &BakePlan<'_>,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(BakeEvent),
) -> Result<BakeOutcome, BakeError> {
    let (scene, start) = (plan.scene, &plan.start);
    assert!(
        std::ptr::eq(scene, &request.scene),
        "a bake has its own plan"
    );
    let opened = request.device.open(needs(scene))?;
    let opened = opened.counting(request.time_passes);
    let mut drive = Drive::unloaded(&opened, scene, start, request.time_passes)?.with_probes();
    let device = opened.identity();
    let (writer, clock, state) = open_cache(request, plan, &device)?;
    let first = clock.frame + 1;
    let disk = DiskSpace::of(&request.directory, plan, first)?;
    tell(ready(plan, &opened, drive.bytes(), disk, first));
    drive.load_watched(&start.particles, clock.frame, &state)?;
    drive.go_on_with(clock.next_id);
    let mut frames = Frames::new(request, plan, writer, clock);
    let before = opened.traffic();
    let ended = drive.run_ahead(plan.last, stop, |step| frames.add(step, tell));
    let (end, broken) = match ended {
        Ok(end) => (end, None),
        Err(BakeError::Solve(error)) => (End::Done, Some(error)),
        Err(error) => return Err(error),
    };
    let traffic = opened
        .traffic()
        .zip(before)
        .map(|(all, before)| all - before);
    // What was computed before a failure is kept.
    let (summary, warnings) = frames.finish()?;
    tell(BakeEvent::Written {
        bytes: summary.bytes,
    });
    let times = request
        .time_passes
        .then(|| (drive.timings(), drive.shares()));
    drop(drive);
    if let Some(error) = broken {
        return Err(self::end(request, &opened, plan, error));
    }
    let (passes, shares) = match times {
        Some((passes, shares)) => {
            let times = opened.pass_times(passes)?;
            (PassTimes { traffic, ..times }, shares)
        }
        None => Default::default(),
    };
    Ok(BakeOutcome {
        last_frame: summary.last_frame,
        frames: summary.frames,
        bytes: summary.bytes,
        waited: summary.waiting.as_secs_f64(),
        interrupted: end == End::Stopped,
        warnings,
        passes,
        shares,
    })
}

/// Creates the planned cache or resumes it: returns the writer, its clock and the state at that
/// point.
fn open_cache(
    request: &BakeRequest,
    plan: &BakePlan<'_>,
    device: &Identity,
) -> Result<(CacheWriter, Clock, Particles), BakeError> {
    let directory = &request.directory;
    let manifest = manifest::manifest(plan, device);
    if plan.is_resumed {
        let (writer, entry, state) = CacheWriter::resume(directory, &manifest)?;
        return Ok((writer, entry.clock, state));
    }
    let (scene, particles, clock) = (plan.scene, &plan.start.particles, plan.clock);
    let text = swell_files::scene_to_toml(scene, &swell_scene::asset_path);
    let assets = manifest::assets(scene)?;
    // No step has run yet, so pressures are unknown.
    let seen = probes::look(scene, clock.time, particles, &[], None);
    let writer = CacheWriter::create(directory, manifest, &text, &assets, clock, particles, &seen)?;
    Ok((writer, clock, particles.clone()))
}

fn ready(
    plan: &BakePlan<'_>,
    opened: &Opened,
    bytes: Option<(u64, u64)>,
    disk: DiskSpace,
    first: u32,
) -> BakeEvent {
    BakeEvent::Ready {
        device: opened.identity(),
        software_warning: opened.software_warning(),
        particles: plan.start.particles.len(),
        removed: plan.start.removed,
        volume: plan.volume(),
        boundary_samples: plan.start.boundary.sample_count(),
        solver: plan.scene.solver.method().name(),
        bytes,
        disk,
        first,
        last: plan.last,
        parent: plan.parent.clone(),
        notes: plan.notes.clone(),
        warnings: plan.warnings.clone(),
    }
}

/// The error of a frame that could not be computed. If a budget was exceeded, keeps the frame's
/// inputs first.
fn end(
    request: &BakeRequest,
    opened: &Opened,
    plan: &BakePlan<'_>,
    error: SolverError,
) -> BakeError {
    let Some(breach) = error.breach() else {
        return error.into();
    };
    let directory = &request.directory;
    match replay::keep(directory, opened, plan.scene, &plan.start, breach) {
        Ok(failure) => BakeError::Budget {
            failure: Box::new(failure),
            failed: directory.join(failed::FAILED),
        },
        Err(source) => BakeError::NotKept {
            breach: Box::new(breach.clone()),
            source: Box::new(source),
        },
    }
}
