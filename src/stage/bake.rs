//! `bake`: turns a scene into a particle cache.

mod expected;
mod water;

use std::{fs, path::PathBuf, sync::atomic::AtomicBool, time::Instant};

use serde_json::{Value, json};

use swell_cache::{
    Asset, CacheError, CacheReader, CacheWriter, Clock, GridRecord, Manifest, Parent, failed,
};
use swell_domain::{
    budget::Breach, frame_range::FrameRange, keep::Keep, particles::Particles, posix,
    signed_distance::SignedDistanceError, solver::StepReport, sources::Solids,
};
use swell_gpu::adapter::GpuError;
use swell_scene::{Held, Scene, SceneError, grids::Grids};

use super::{
    Blame,
    branch::{Branch, BranchError, BranchPoint},
    device::{Device, Identity, Opened, PassTimes, SolverError, needs},
    drive::{Drive, End, Step},
    prepare::{Start, Volume},
    probes,
    replay::{self, Failure, ReplayError},
    time::Share,
};

pub use self::expected::{DiskSpace, Expected, expected, shot_bytes};

/// What to bake, where, and on which device.
#[derive(Clone, Debug)]
pub struct Request {
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
pub enum Event {
    /// The device is open and the scene is filled with water.
    Ready {
        /// Adapter and driver, or the f64 reference.
        device: Identity,
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
        /// Wall-clock time it took, seconds.
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
pub struct Outcome {
    /// Last frame in the cache.
    pub last_frame: u32,
    /// Number of frames computed by this run.
    pub frames: u32,
    /// Bytes of frames written by this run.
    pub bytes: u64,
    /// Seconds that the solver waited for the disk.
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

/// Why a bake failed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BakeError {
    /// The scene or one of its meshes is invalid.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// A solid without an inside, or too large a distance grid.
    #[error(transparent)]
    Solid(#[from] SignedDistanceError),
    /// More particles than the budget allows, known before the bake.
    #[error("budget.particles is {limit}: {}", more_than(*.frame, *.count))]
    Particles {
        /// Limit of the budget.
        limit: f64,
        /// First frame that exceeds it; 0 for the start.
        frame: u32,
        /// Number of particles after that frame.
        count: usize,
    },
    /// The device cannot be opened or does not suffice.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The solver failed.
    #[error(transparent)]
    Solve(#[from] SolverError),
    /// Reading or writing the cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The bake in the cache has other physics.
    #[error(
        "{directory} was baked from another scene: {difference}; choose another -o",
        directory = .directory.display()
    )]
    OtherPhysics {
        /// Directory of the cache.
        directory: PathBuf,
        /// Key that differs, and both values.
        difference: String,
    },
    /// The bake cannot begin from the requested frame.
    #[error(transparent)]
    Branch(#[from] BranchError),
    /// Frames that a bake cannot compute.
    #[error("--frames {0}")]
    Frames(String),
    /// A branch that begins at or after its last frame.
    #[error("{asked}: nothing is left to bake after frame {frame}; raise shot.frames")]
    NothingLeft {
        /// The option that asks for it.
        asked: String,
        /// The frame to begin from.
        frame: u32,
    },
    /// A budget was exceeded; the state that the frame began with is kept.
    #[error(
        "{failure}; the last good frame is kept, and `swell check {}` computes this one again",
        posix::path(failed)
    )]
    Budget {
        /// The exceeded budget, and where in the frame.
        failure: Box<Failure>,
        /// Folder with the inputs of the frame.
        failed: PathBuf,
    },
    /// The inputs of the failed frame could not be kept, or the frame could not be recomputed.
    #[error("{breach}; keeping its inputs failed")]
    NotKept {
        /// The exceeded budget.
        breach: Box<Breach>,
        /// Why the inputs could not be kept.
        source: Box<ReplayError>,
    },
    /// A mesh file changed or disappeared between loading and caching.
    #[error("{file}: {what}", file = .file.display())]
    Asset {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        what: String,
    },
}

impl From<&BakeError> for Blame {
    fn from(error: &BakeError) -> Self {
        match error {
            BakeError::Scene(error) => error.into(),
            BakeError::Solid(error) => error.into(),
            BakeError::Gpu(error) => error.into(),
            BakeError::Solve(error) => error.into(),
            BakeError::Cache(error) | BakeError::Branch(BranchError::Cache(error)) => error.into(),
            BakeError::Branch(BranchError::Scene { .. }) => Self::Files,
            BakeError::Branch(_) => Self::Input,
            BakeError::OtherPhysics { .. } => Self::Files,
            BakeError::Budget { .. } | BakeError::NotKept { .. } => Self::Numbers,
            BakeError::Particles { .. }
            | BakeError::Frames(_)
            | BakeError::NothingLeft { .. }
            | BakeError::Asset { .. } => Self::Input,
        }
    }
}

/// Runs a bake. `tell` receives progress events, and setting `stop` ends the bake after the current
/// frame.
///
/// # Errors
/// [`BakeError`]; the frames that were completed before are in the cache.
pub fn bake(
    request: &Request,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome, BakeError> {
    let scene = &request.scene;
    let last = last_frame(request)?;
    let Beginning {
        start,
        clock,
        parent,
        notes,
    } = beginning(request, last)?;
    check_count(scene, &start, parent.as_ref(), last)?;
    let opened = request.device.open(needs(scene))?;
    let opened = opened.counting(request.time_passes);
    let mut drive = Drive::unloaded(&opened, scene, &start, request.time_passes)?.with_probes();
    let device = opened.identity();
    let warnings = start.warnings(scene);
    let (mut writer, mut clock, state) =
        open_cache(request, &device, &start, &warnings, clock, &parent)?;
    let first = clock.frame + 1;
    tell(Event::Ready {
        device,
        particles: start.particles.len(),
        removed: start.removed,
        boundary_samples: start.boundary.sample_count(),
        solver: scene.solver.method.name(),
        bytes: drive.bytes(),
        disk: DiskSpace::of(request, &start.particles, first, last)?,
        first,
        last,
        parent,
        notes,
        volume: start.volume(scene),
        warnings,
    });
    drive.load_watched(&start.particles, clock.frame, &state)?;
    drive.go_on_with(clock.next_id);
    let mut looked = probes::Looked::new(scene);
    let mut held = Held::default();
    let mut blocked = 0;
    let mut most = start.particles.len();
    let ended = drive.run(last, stop, |step| {
        looked.add(scene, step.frame, &step.looks);
        let begin = Instant::now();
        let time = scene.shot.time(step.frame);
        let looks = Some(step.looks);
        let seen = probes::look(scene, time, &step.particles, &step.pressures, looks);
        let seconds = step.seconds + begin.elapsed().as_secs_f64();
        let Step {
            frame,
            particles,
            next_id,
            report,
            ..
        } = step;
        clock.next_id = next_id;
        clock.walls = particles.walls;
        clock.substep = particles.substep;
        held.add(scene, &particles);
        most = most.max(particles.len());
        blocked += report.exchange.map_or(0, |exchange| exchange.blocked);
        clock.frame = frame;
        clock.time = time;
        clock.substeps = report.substeps;
        clock.steps += u64::from(report.substeps);
        let extra = json!({ "seconds": seconds });
        writer.submit(clock, particles, seen, to_json(&report), extra)?;
        if frame == first {
            // Left by an earlier bake that failed at this frame.
            failed::remove(&request.directory)?;
        }
        tell(Event::Frame {
            frame,
            report,
            seconds,
        });
        Ok::<_, BakeError>(())
    });
    let (end, broken) = match ended {
        Ok(end) => (end, None),
        Err(BakeError::Solve(error)) => (End::Done, Some(error)),
        Err(error) => return Err(error),
    };
    // What was computed before a failure is kept.
    let summary = writer.finish()?;
    tell(Event::Written {
        bytes: summary.bytes,
    });
    let (passes, shares) = match request.time_passes {
        true => (drive.timings(), drive.shares()),
        false => Default::default(),
    };
    drop(drive);
    if let Some(error) = broken {
        return Err(self::end(request, &opened, &start, error));
    }
    Ok(Outcome {
        last_frame: summary.last_frame,
        frames: summary.frames,
        bytes: summary.bytes,
        waited: summary.waiting.as_secs_f64(),
        interrupted: end == End::Stopped,
        warnings: [
            looked.warnings(scene),
            held.warnings(),
            water::never_entered(blocked),
            water::overfull(scene, most),
        ]
        .concat(),
        passes: match request.time_passes {
            true => opened.pass_times(passes)?,
            false => PassTimes::default(),
        },
        shares,
    })
}

/// Refuses a bake that is known to exceed the particle budget: at its start, or with what emitters
/// add when no drain can remove any.
fn check_count(
    scene: &Scene,
    start: &Start,
    parent: Option<&Parent>,
    last: u32,
) -> Result<(), BakeError> {
    let Some(limit) = scene.budget.particles else {
        return Ok(());
    };
    let first = parent.map_or(0, |parent| parent.frame);
    let particles = start.particles.len();
    let boundary = &start.boundary;
    let solids = Solids {
        still: boundary.distance.as_ref(),
        moving: &boundary.moving,
        pose: &|index, seconds| scene.moving_solids[index].pose(seconds),
    };
    let later = start
        .sources
        .least_counts(particles, first + 1..last + 1, &solids);
    let mut counts = std::iter::once((0, particles)).chain(later);
    match counts.find(|(_, count)| *count as f64 > limit) {
        Some((frame, count)) => Err(BakeError::Particles {
            limit,
            frame,
            count,
        }),
        None => Ok(()),
    }
}

/// The count and when it is reached, in words.
fn more_than(frame: u32, count: usize) -> String {
    match frame {
        0 => format!("the start has {count} particles"),
        _ => format!(
            "with what emitters bring there are {count} particles or more after frame {frame}"
        ),
    }
}

/// The error of a frame that could not be computed. If a budget was exceeded, keeps the frame's
/// inputs first.
fn end(request: &Request, opened: &Opened, start: &Start, error: SolverError) -> BakeError {
    let Some(breach) = error.breach() else {
        return error.into();
    };
    let directory = &request.directory;
    match replay::keep(directory, opened, &request.scene, start, breach) {
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

fn to_json(report: &StepReport) -> Value {
    serde_json::to_value(report).unwrap_or(Value::Null)
}

/// The last requested frame. A bake computes every frame up to it, and a scene is validated only up
/// to its own last frame.
fn last_frame(request: &Request) -> Result<u32, BakeError> {
    let shot = request.scene.shot.frames;
    let Some(frames) = &request.frames else {
        return Ok(shot);
    };
    let fault = |what: String| Err(BakeError::Frames(format!("{frames}: {what}")));
    if frames.len() as u64 != u64::from(frames.last() - frames.first()) + 1 {
        return fault("skips frames, and each frame of a bake needs the one before".into());
    }
    if frames.last() > shot {
        return fault(format!("the shot has {shot} frames; raise shot.frames"));
    }
    Ok(frames.last())
}

/// What a new bake begins with, and what its plan is made for.
struct Beginning {
    start: Start,
    clock: Clock,
    parent: Option<Parent>,
    notes: Vec<String>,
}

/// The scene's own start, the frame that the request names, or the beginning of the cache to
/// resume.
fn beginning(request: &Request, last: u32) -> Result<Beginning, BakeError> {
    let (scene, directory) = (&request.scene, &request.directory);
    let stands = request.resume && swell_cache::exists(directory);
    let open = |from| Branch::open(from, scene);
    let branch = match request.from.as_ref().map(open).transpose()? {
        Some(branch) if !stands => return branched(request, last, branch),
        other => other,
    };
    let start = if stands {
        Start::of_cache::<BakeError>(scene, &CacheReader::open(directory)?)?
    } else {
        Start::of(scene)?
    };
    Ok(Beginning {
        start,
        clock: Clock::default(),
        parent: branch.map(|branch| branch.parent),
        notes: Vec::new(),
    })
}

fn branched(request: &Request, last: u32, mut branch: Branch) -> Result<Beginning, BakeError> {
    let scene = &request.scene;
    let frame = branch.clock.frame;
    if last <= frame {
        return Err(BakeError::NothingLeft {
            asked: match (&request.frames, &request.from) {
                (Some(frames), _) => format!("--frames {frames}"),
                (None, Some(from)) => format!("--from {from}"),
                (None, None) => format!("a shot of {last} frames"),
            },
            frame,
        });
    }
    let start = Start::with(scene, branch.particles.clone())?;
    branch.note_covered(scene, &start.boundary);
    Ok(Beginning {
        start,
        clock: branch.clock,
        parent: Some(branch.parent),
        notes: branch.notes,
    })
}

/// Refuses a range whose first frame lies beyond the next one to bake.
fn check_first(request: &Request, next: u32) -> Result<(), BakeError> {
    match &request.frames {
        Some(frames) if frames.first() > next => Err(BakeError::Frames(format!(
            "{frames}: frame {next} has not been baked, and each frame needs the one \
             before: --frames {next}-{}",
            frames.last()
        ))),
        _ => Ok(()),
    }
}

/// Creates a cache or resumes one: returns the writer, its clock and the state at that point.
fn open_cache(
    request: &Request,
    device: &Identity,
    start: &Start,
    warnings: &[String],
    clock: Clock,
    parent: &Option<Parent>,
) -> Result<(CacheWriter, Clock, Particles), BakeError> {
    let scene = &request.scene;
    let text = scene.to_toml(&swell_scene::asset_path);
    let manifest = Manifest {
        format_version: Manifest::FORMAT_VERSION,
        program: swell_domain::PROGRAM.into(),
        program_version: swell_domain::VERSION.into(),
        shaders: device.shaders.clone(),
        shot: scene.shot.name.clone(),
        scene_hash: swell_scene::physics_hash(scene),
        solver: scene.solver.method.name().into(),
        device: device.name.clone(),
        driver: device.driver.clone(),
        backend: device.backend.clone(),
        frames_per_second: scene.shot.frames_per_second,
        particle_spacing: scene.particle_spacing(),
        rest_density: scene.water.rest_density,
        origin: scene.origin.to_array(),
        attributes: start.particles.attributes.keys().cloned().collect(),
        grids: scene.grids.map(|grids| grid_record(scene, &grids)),
        keep: scene.keep.filter(|keep| *keep != Keep::All),
        compression: scene.compression,
        probes: probes::records(scene),
        parent: parent.clone(),
        warnings: warnings.to_vec(),
        start_particles: 0,
        files: Vec::new(),
    };
    let directory = &request.directory;
    if swell_cache::exists(directory) && request.resume {
        let cached = CacheReader::open(directory)?;
        if let Some(difference) = swell_scene::physics_difference(cached.scene_toml(), &text)? {
            return Err(BakeError::OtherPhysics {
                directory: directory.clone(),
                difference,
            });
        }
        check_first(request, cached.last_frame() + 1)?;
        let (writer, entry, state) = CacheWriter::resume(directory, &manifest)?;
        return Ok((writer, entry.clock, state));
    }
    check_first(request, clock.frame + 1)?;
    let assets = assets(scene)?;
    // No step has run yet, so pressures are unknown.
    let seen = probes::look(scene, clock.time, &start.particles, &[], None);
    let particles = &start.particles;
    let writer = CacheWriter::create(directory, manifest, &text, &assets, clock, particles, &seen)?;
    Ok((writer, clock, particles.clone()))
}

/// The scene's grids as the manifest records them.
fn grid_record(scene: &Scene, grids: &Grids) -> GridRecord {
    GridRecord {
        surface: grids.surface,
        velocity: grids.velocity,
        voxel_size: grids.voxel_size,
        origin: scene.domain.min.to_array(),
        precision: grids.precision,
    }
}

/// Reads the scene's mesh files for the cache and checks that they have not changed.
fn assets(scene: &Scene) -> Result<Vec<Asset>, BakeError> {
    let read = |(file, hash): (PathBuf, String)| {
        let fault = |what: String| BakeError::Asset {
            file: file.clone(),
            what,
        };
        let bytes = fs::read(&file).map_err(|error| fault(error.to_string()))?;
        if blake3::hash(&bytes).to_hex().as_str() != hash {
            return Err(fault("changed since the scene was loaded".into()));
        }
        let path = swell_scene::asset_path(&file, &hash);
        Ok(Asset {
            name: path.trim_start_matches("assets/").to_owned(),
            bytes,
        })
    };
    scene.mesh_files().into_iter().map(read).collect()
}
