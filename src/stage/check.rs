//! `check`: opens the starting state of a step and the device, and lets the crate `check` compare
//! the step with the reference.

use std::{
    mem,
    path::PathBuf,
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use swell_cache::{CacheError, CacheReader, Manifest};
use swell_check::{arithmetic, check_flip, check_pbf};
use swell_domain::{
    frame_range::FrameRange, particles::Particles, signed_distance::SignedDistanceError,
    substep::SubstepChoice,
};
use swell_gpu::adapter::{Context, GpuError, Needs};
use swell_scene::{ByMethod, Scene, SceneError};
use swell_solve::{SolveError, plan::device_limits};

use super::{
    Blame,
    device::{Gpu, needs, shaders_note},
    prepare::Start,
    whitewater::{Stream, WhitewaterError},
};

pub use swell_check::{CheckRow, CheckTable, Checked};

/// Where the inputs of the step come from.
#[derive(Clone, Debug)]
pub enum CheckInput {
    /// A scene's start: frame 0.
    Scene(Box<Scene>),
    /// Frames of a cache; its last frame if none are given.
    Cache(PathBuf, Option<FrameRange>),
}

/// What to check.
#[derive(Clone, Debug)]
pub struct CheckRequest {
    /// Source of the inputs.
    pub source: CheckInput,
    /// Which substep to check of the frame that follows each input.
    pub substep: SubstepChoice,
    /// Adapter and shaders.
    pub gpu: Gpu,
}

/// The first row out of tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FirstOver {
    /// Frame that the step started from.
    pub frame: u32,
    /// Number of the substep in the frame after it.
    pub substep: Option<u32>,
    /// Pass of the row.
    pub pass: &'static str,
    /// Field of the row.
    pub field: &'static str,
}

/// Progress of a running check.
#[derive(Clone, Debug)]
pub enum CheckEvent<'a> {
    /// The device is open.
    Ready {
        /// Adapter and driver.
        device: String,
        /// Warning about the adapter, as [`Context::software_warning`].
        software_warning: Option<String>,
        /// Name of the solver.
        solver: &'static str,
        /// Number of particles at the start.
        particles: usize,
        /// Number of frames that will be checked.
        frames: usize,
        /// Warnings about the scene, a sentence each.
        warnings: Vec<String>,
    },
    /// The step after a frame was checked.
    Frame {
        /// Number of the frame that the step started from.
        frame: u32,
        /// The comparison, and the number of the substep.
        checked: &'a Checked,
        /// Wall-clock time it took, seconds.
        seconds: f64,
    },
}

/// Result of a check.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct CheckOutcome {
    /// All frames combined: for each row the value that deviates most.
    pub table: CheckTable,
    /// The first row out of tolerance.
    pub first_over: Option<FirstOver>,
    /// Frames that were checked.
    pub frames: Vec<u32>,
    /// For each of them, the substep of the following frame that was checked.
    pub substeps: Vec<Option<u32>>,
    /// Hash of the shaders if they are not the built-in ones.
    pub shaders: Option<String>,
    /// Whether a signal ended it.
    pub interrupted: bool,
}

/// Why a check could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CheckError {
    /// Reading the cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in the cache is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A solid without an inside, or too large a distance grid.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// The device cannot be opened or does not suffice.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The solver failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
    /// A whitewater stream, or the water that it was made from, cannot be used.
    #[error(transparent)]
    Whitewater(#[from] WhitewaterError),
    /// A stream that no GPU pass makes.
    #[error(
        "{} is a stream of {of}, which is made on the CPU: no pass is checked",
        directory.display()
    )]
    NoPasses {
        /// Directory of the stream.
        directory: PathBuf,
        /// What it holds.
        of: &'static str,
    },
    /// Nothing was compared, which must not count as a success.
    #[error("nothing was compared: there is no water in it")]
    NoWater,
}

impl From<&CheckError> for Blame {
    fn from(error: &CheckError) -> Self {
        match error {
            CheckError::Cache(error) => error.into(),
            CheckError::Scene(error) => error.into(),
            CheckError::Solid(error) => error.into(),
            CheckError::Gpu(error) => error.into(),
            CheckError::Solve(error) => error.into(),
            CheckError::Whitewater(error) => error.into(),
            CheckError::NoPasses { .. } => Self::Input,
            CheckError::NoWater => Self::Input,
        }
    }
}

/// Checks the step after each frame; setting `stop` ends the check after the current one.
///
/// # Errors
/// [`CheckError`]. A row out of tolerance is not an error; it is reported in the outcome.
pub fn check(
    request: &CheckRequest,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(CheckEvent<'_>),
) -> Result<CheckOutcome, CheckError> {
    let (subject, frames) = open(&request.source)?;
    let context = request.gpu.open(subject.needs())?;
    let shaders = context.shaders.edited().map(str::to_owned);
    let info = &context.info;
    tell(CheckEvent::Ready {
        device: format!(
            "{} ({} {}){}",
            info.name,
            info.driver,
            info.driver_info,
            shaders_note(shaders.as_deref())
        ),
        software_warning: context.software_warning(),
        solver: subject.name(),
        particles: subject.particles(),
        frames: frames.len(),
        warnings: subject.warnings(),
    });
    let mut outcome = CheckOutcome {
        shaders,
        ..CheckOutcome::default()
    };
    for frame in frames {
        outcome.interrupted = stop.load(Ordering::Relaxed);
        if outcome.interrupted {
            break;
        }
        let begin = Instant::now();
        let mut checked = subject.check(&context, frame, request.substep)?;
        let is_first = outcome.table.rows.is_empty();
        if is_first && !checked.table.rows.is_empty() {
            let solved = mem::replace(&mut checked.table, arithmetic::check(&context)?);
            checked.table.absorb(solved);
        }
        tell(CheckEvent::Frame {
            frame,
            checked: &checked,
            seconds: begin.elapsed().as_secs_f64(),
        });
        let Checked { table, substep } = checked;
        if let (None, Some(row)) = (outcome.first_over, table.first_over()) {
            outcome.first_over = Some(FirstOver {
                frame,
                substep,
                pass: row.field.pass,
                field: row.field.name,
            });
        }
        outcome.frames.push(frame);
        outcome.substeps.push(substep);
        outcome.table.absorb(table);
    }
    if outcome.table.rows.is_empty() && !outcome.interrupted {
        return Err(CheckError::NoWater);
    }
    Ok(outcome)
}

/// What is checked.
enum Subject {
    Step(Box<CheckedStep>),
    /// Frames of a whitewater stream.
    Whitewater(Box<Stream>),
}

/// A solver's step, from a scene's start or from frames of a cache.
struct CheckedStep {
    scene: Scene,
    start: Start,
    cache: Option<CacheReader>,
}

impl CheckedStep {
    fn check(
        &self,
        context: &Context,
        frame: u32,
        which: SubstepChoice,
    ) -> Result<Checked, CheckError> {
        let particles = match &self.cache {
            Some(cache) => cache.state(frame)?,
            None => self.start.particles.clone(),
        };
        let (scene, start) = (&self.scene, &self.start);
        Ok(check_substep(
            context, scene, start, frame, &particles, which,
        )?)
    }
}

impl Subject {
    fn needs(&self) -> Needs {
        match self {
            Self::Step(step) => needs(&step.scene),
            Self::Whitewater(_) => Needs::default(),
        }
    }

    fn name(&self) -> &'static str {
        match self {
            Self::Step(step) => step.scene.solver.method().name(),
            Self::Whitewater(_) => Manifest::WHITEWATER,
        }
    }

    fn particles(&self) -> usize {
        match self {
            Self::Step(step) => step.start.particles.len(),
            Self::Whitewater(stream) => stream.water(),
        }
    }

    fn warnings(&self) -> Vec<String> {
        match self {
            Self::Step(step) => step.scene.warnings(),
            Self::Whitewater(_) => Vec::new(),
        }
    }

    fn check(
        &self,
        context: &Context,
        frame: u32,
        which: SubstepChoice,
    ) -> Result<Checked, CheckError> {
        match self {
            Self::Step(step) => step.check(context, frame, which),
            Self::Whitewater(stream) => Ok(Checked {
                table: stream.check(context, frame)?,
                // A frame of whitewater is a single step.
                substep: Some(1),
            }),
        }
    }
}

fn open(source: &CheckInput) -> Result<(Subject, Vec<u32>), CheckError> {
    match source {
        CheckInput::Scene(scene) => {
            let start = Start::of(scene)?;
            let step = CheckedStep {
                scene: (**scene).clone(),
                start,
                cache: None,
            };
            Ok((Subject::Step(Box::new(step)), vec![0]))
        }
        CheckInput::Cache(directory, frames) => {
            let cache = CacheReader::open(directory)?;
            let frames: Vec<u32> = match frames {
                Some(frames) => frames.iter().collect(),
                None => vec![cache.last_frame()],
            };
            for &frame in &frames {
                cache.kept(frame)?;
            }
            if cache.manifest().is_whitewater() {
                let stream = Stream::open(directory, cache, &frames)?;
                return Ok((Subject::Whitewater(Box::new(stream)), frames));
            }
            if let Some(of) = cache.manifest().stream_of() {
                return Err(CheckError::NoPasses {
                    directory: directory.clone(),
                    of,
                });
            }
            let scene = super::baked_scene(&cache, directory)?;
            let start = Start::of_cache::<CheckError>(&scene, &cache)?;
            let step = CheckedStep {
                scene,
                start,
                cache: Some(cache),
            };
            Ok((Subject::Step(Box::new(step)), frames))
        }
    }
}

/// Checks the first substep with [`check_substep`].
///
/// # Errors
/// Those of [`check_substep`].
pub fn check_frame(
    context: &Context,
    scene: &Scene,
    start: &Start,
    frame: u32,
    particles: &Particles,
) -> Result<CheckTable, SolveError> {
    let first = SubstepChoice::default();
    Ok(check_substep(context, scene, start, frame, particles, first)?.table)
}

/// Checks a substep of the frame after `particles`, the state at the end of `frame`; the substeps
/// before it run without checks. With PBF also checks the measurement at the end of a frame, as if
/// the frame ended there.
///
/// # Errors
/// A device error, invalid numbers in the solver, or a substep that the frame does not have.
pub fn check_substep(
    context: &Context,
    scene: &Scene,
    start: &Start,
    frame: u32,
    particles: &Particles,
    which: SubstepChoice,
) -> Result<Checked, SolveError> {
    if particles.is_empty() {
        return Ok(Checked::default());
    }
    let plan = start.plan_of(scene, particles, device_limits(context));
    let boundary = &start.boundary;
    match &scene.by_method() {
        ByMethod::Pbf(scene) => {
            let boundaries = [boundary; 2];
            check_pbf(context, scene, plan, boundaries, (frame, particles), which)
        }
        ByMethod::Flip(scene) => {
            check_flip(context, scene, plan, boundary, (frame, particles), which)
        }
    }
}
