//! Recomputes a frame that exceeded a budget from the state before it, to find the pass that first
//! went wrong.

use std::{fmt, path::Path};
use swell_files::recorded_scene;
use swell_files::scene_to_toml;

use glam::{DVec3, Vec3};
use serde_json::json;

use swell_cache::{
    CacheError, CacheReader,
    failed::{self, Failed},
    frame::Stamp,
};
use swell_domain::{
    bricks::CELLS,
    budget::{Breach, Watched},
    particles::Particles,
    poisson::FLUID,
    signed_distance::SignedDistanceError,
    solver::StepReport,
};
use swell_gpu::{
    adapter::{GpuError, check_request},
    buffer::Buf,
    recording::TracePoint,
};
use swell_scene::{ByMethod, Method, Scene, SceneError, Solver, flip::Precision};
use swell_solve::{
    SolveError,
    flip::{Flip, buffers::*},
    pbf::Pbf,
    plan::device_limits,
    pressure::{self, DONE},
    trace::{Begun, Span, TraceFrame, Traced},
};

use super::{
    Blame,
    device::{Device, Gpu, Opened, SolverError, needs},
    drive::Drive,
    prepare::Start,
    watch::{Watch, volume_of},
};

/// Where in a frame something first went wrong.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FaultOrigin {
    /// Number of the substep in the frame, from 1.
    pub substep: u32,
    /// Name of the pass.
    pub pass: &'static str,
    /// Buffer that the pass wrote.
    pub buffer: String,
}

/// A frame that exceeds a budget each time it is computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Failure {
    /// The exceeded budget.
    pub breach: Breach,
    /// Where it first happened; `None` on the CPU, where passes are not traced, and if the state
    /// that the frame began with is at fault.
    pub place: Option<FaultOrigin>,
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}; ", self.breach)?;
        match &self.place {
            // No pass adds water.
            None if self.breach.watched == Watched::Count => write!(f, "emitters brought them"),
            Some(FaultOrigin {
                substep,
                pass,
                buffer,
            }) => write!(
                f,
                "first in {pass} of substep {substep}, in what it wrote to {buffer}"
            ),
            None => write!(f, "in no pass that can be named"),
        }
    }
}

/// Recomputes the frame after `last`, which ended with `state`, and finds out what goes wrong in
/// it. `None` if nothing does.
///
/// # Errors
/// A device error; a state that does not belong to the scene.
pub fn replay(
    opened: &Opened,
    scene: &Scene,
    start: &Start,
    last: u32,
    state: &Particles,
) -> Result<Option<Failure>, SolverError> {
    let before = Watch::new(scene, &start.particles, last, state);
    let mut drive = Drive::unloaded(opened, scene, start, false)?;
    drive.load_watched(&start.particles, last, state)?;
    let breach = match drive.advance() {
        Ok(_) => return Ok(None),
        Err(error) => match error.breach() {
            Some(breach) => breach.clone(),
            None => return Err(error),
        },
    };
    if breach.watched == Watched::Count {
        return Ok(Some(Failure {
            breach,
            place: None,
        }));
    }
    let made = drive.report().cloned();
    // Two solvers at once may exceed the device's memory.
    drop(drive);
    let Opened::Gpu(context) = opened else {
        return Ok(Some(Failure {
            breach,
            place: None,
        }));
    };
    let mut finder = Finder {
        scene,
        state,
        breach: &breach,
        made,
        energy: before.energy(),
        start_volume: before.start_volume(),
        precision: None,
        is_correcting: false,
        place: None,
    };
    let plan = start.plan_of(scene, state, device_limits(context));
    let boundary = &start.boundary;
    match &scene.by_method() {
        ByMethod::Pbf(scene) => {
            let grid = scene.of_projection();
            finder.precision = grid.map(|grid| grid.settings().pressure.precision);
            finder.trace(last, Pbf::new(context, scene, plan, boundary, false)?)?;
        }
        ByMethod::Flip(scene) => {
            finder.precision = Some(scene.settings().pressure.precision);
            finder.trace(last, Flip::new(context, scene, plan, boundary, false)?)?;
        }
    }
    let place = finder.place;
    Ok(Some(Failure { breach, place }))
}

/// Examines what each dispatch wrote: for values that are not finite, and for the watched quantity
/// over its limit.
struct Finder<'a> {
    scene: &'a Scene,
    state: &'a Particles,
    breach: &'a Breach,
    /// Report of the frame, if it was completed.
    made: Option<StepReport>,
    energy: f64,
    start_volume: Option<f64>,
    /// Precision of the pressure solve; `None` without a projection.
    precision: Option<Precision>,
    /// Whether the substep has reached the density correction, whose residual has no budget.
    is_correcting: bool,
    place: Option<FaultOrigin>,
}

/// Unit roundoff of f32.
const U: f64 = 1.0 / (1 << 24) as f64;

impl Finder<'_> {
    fn trace(
        &mut self,
        last: u32,
        mut solver: impl TraceFrame<Error = SolveError>,
    ) -> Result<(), SolveError> {
        solver.load(last, self.state)?;
        // PBF counts over a frame, so the substep may be unknown.
        let from = self.breach.substep.unwrap_or(1);
        let span = Span::From(from);
        let traced = solver.trace_frame(span, &mut |begun, traced| self.observe(begun, traced));
        match traced {
            // The cause was found, or the solver itself reported it.
            Ok(_) | Err(SolveError::Numbers(_)) => Ok(()),
            Err(error) => Err(error),
        }
    }

    fn observe(&mut self, begun: &Begun, traced: Traced<'_>) -> Result<(), SolveError> {
        if traced.point == TracePoint::Before {
            return Ok(());
        }
        match traced.pass {
            "flip/survey" => self.is_correcting = false,
            "pressure/density_source" => self.is_correcting = true,
            _ => {}
        }
        let found = match traced.first_not_finite()? {
            Some(buffer) => Some(buffer),
            None => self.first_over(&traced)?,
        };
        let Some(buffer) = found else {
            return Ok(());
        };
        self.place = Some(FaultOrigin {
            substep: begun.number,
            pass: traced.pass,
            buffer,
        });
        // The error ends the trace.
        Err(self.breach.clone().into())
    }

    /// The buffer, among those the dispatch wrote, whose content exceeds the watched limit.
    fn first_over(&self, traced: &Traced<'_>) -> Result<Option<String>, SolveError> {
        let limit = self.breach.limit;
        let n = self.state.len();
        match self.breach.watched {
            Watched::NotFinite => Ok(None),
            Watched::Speed | Watched::SpeedJump => self.too_fast(traced, limit),
            Watched::Substeps => self.too_fast(traced, self.most_speed()),
            Watched::Particles => {
                for buffer in [ID, sorted_id(n)] {
                    if traced.writes(buffer.name()) {
                        let mut id = traced.read(buffer.clone(), n)?;
                        id.sort_unstable();
                        if id != self.state.id {
                            return Ok(Some(buffer.name().to_owned()));
                        }
                    }
                }
                Ok(None)
            }
            Watched::DensityErrorMean | Watched::DensityErrorP99 | Watched::DensityErrorMax
                if is_measured(traced.pass) =>
            {
                let count = match self.scene.solver.method() {
                    Method::Pbf => n,
                    // The buffer continues beyond the water of this substep with stale values.
                    Method::Flip => (traced.one(PARAMS)?.wet_cells + CELLS) as usize,
                };
                let mut density = traced.read(DENSITY, count)?;
                if self.scene.solver.method() == Method::Flip {
                    let mut kind = traced.read(CELL_KIND, count)?.into_iter();
                    density.retain(|_| kind.next() == Some(FLUID));
                }
                let density = density.into_iter().map(f64::from);
                let report = self.scene.report(&Particles::default(), density);
                let measured = match self.breach.watched {
                    Watched::DensityErrorMean => report.density_error_mean,
                    Watched::DensityErrorMax => report.density_error_max,
                    _ => report.density_error_p99,
                };
                Ok((measured > limit).then(|| DENSITY.name().to_owned()))
            }
            Watched::Residual if traced.pass == "pressure/reduce" && !self.is_correcting => {
                let Some(precision) = self.precision else {
                    return Ok(None);
                };
                let control = traced.pressure_control(precision)?;
                let is_over = control.state == DONE && control.residual() > limit;
                Ok(is_over.then(|| pressure::buffers::CONTROL.name().to_owned()))
            }
            Watched::Divergence if traced.pass == "pressure/measure_divergence" => {
                let divergence = f64::from(traced.pressure_stats()?.divergence_after);
                let params = traced.one(PARAMS)?;
                // The device uses the rounded time step.
                let change = divergence * f64::from(params.time_step) * (1.0 + U);
                Ok((change > limit).then(|| pressure::buffers::STATS.name().to_owned()))
            }
            Watched::Volume if traced.writes(POSITION.name()) => {
                let moved = Particles {
                    position: self.positions(traced)?,
                    ..Particles::default()
                };
                let drift = |start: f64| (volume_of(self.scene, &moved) / start - 1.0).abs();
                let is_over = self.start_volume.is_some_and(|start| drift(start) > limit);
                Ok(is_over.then(|| POSITION.name().to_owned()))
            }
            Watched::Energy => {
                let Some(velocity) = written_velocity(traced) else {
                    return Ok(None);
                };
                let energy = self.energy_of(traced, velocity.clone())?;
                let work = self
                    .made
                    .as_ref()
                    .map_or(0.0, |report| report.boundary_work);
                let allowed = self.scene.allowed_energy(n, self.energy, work, limit);
                Ok((energy > allowed).then(|| velocity.name().to_owned()))
            }
            Watched::Capped if traced.writes(COUNTERS.name()) => {
                let capped = f64::from(traced.counters()?.capped);
                let substeps = self.made.as_ref().map_or(1, |report| report.substeps);
                let most = limit * n as f64 * f64::from(substeps);
                Ok((capped > most).then(|| COUNTERS.name().to_owned()))
            }
            _ => Ok(None),
        }
    }

    /// Speed above which the scene's `max_substeps` do not suffice, m/s.
    fn most_speed(&self) -> f64 {
        let solver = &self.scene.solver;
        let way = match solver {
            Solver::Pbf(pbf) => pbf.cfl * pbf.particle_spacing,
            Solver::Flip(flip) => flip.cfl * flip.cell_size,
        };
        way * self.breach.limit * self.scene.shot.frames_per_second
    }

    fn too_fast(&self, traced: &Traced<'_>, limit: f64) -> Result<Option<String>, SolveError> {
        for buffer in [VELOCITY, SORTED_VELOCITY] {
            if traced.writes(buffer.name()) {
                let velocity = traced.read(buffer.clone(), self.state.len())?;
                let speed = |v: &[f32; 3]| vector(v).length();
                if velocity.iter().any(|v| speed(v) > limit) {
                    return Ok(Some(buffer.name().to_owned()));
                }
            }
        }
        Ok(None)
    }

    /// Current world positions, metres.
    fn positions(&self, traced: &Traced<'_>) -> Result<Vec<[f32; 3]>, SolveError> {
        let local = traced.read(POSITION, self.state.len())?;
        let world = |x: &[f32; 3]| (self.scene.domain.min + vector(x)).as_vec3().to_array();
        Ok(local.iter().map(world).collect())
    }

    /// Kinetic and potential energy of the current positions and of `velocity`, J; their order does
    /// not matter.
    fn energy_of(&self, traced: &Traced<'_>, velocity: Buf<[f32; 3]>) -> Result<f64, SolveError> {
        let velocity = traced.read(velocity, self.state.len())?;
        let state = Particles {
            position: self.positions(traced)?,
            velocity,
            ..Particles::default()
        };
        let report = self.scene.report(&state, [].into_iter());
        Ok(self.scene.total_energy(state.len(), &report))
    }
}

/// Velocities that a pass leaves, if it writes velocities or positions.
fn written_velocity(traced: &Traced<'_>) -> Option<Buf<[f32; 3]>> {
    let is_written = |buffer: &Buf<[f32; 3]>| traced.writes(buffer.name());
    let written = [VELOCITY, SORTED_VELOCITY].into_iter().find(is_written);
    written.or_else(|| is_written(&POSITION).then_some(VELOCITY))
}

/// Whether a pass leaves the densities that a frame's report describes. Those within a PBF
/// iteration are intermediate.
fn is_measured(pass: &str) -> bool {
    matches!(pass, "pbf/measure_density" | "flip/find_water")
}

fn vector(v: &[f32; 3]) -> DVec3 {
    Vec3::from_array(*v).as_dvec3()
}

/// Writes `failed/` into the cache of a failed bake, and says where in the frame it went wrong.
///
/// # Errors
/// An error of the cache.
pub(super) fn keep(
    directory: &Path,
    opened: &Opened,
    scene: &Scene,
    start: &Start,
    breach: &Breach,
) -> Result<Failure, ReplayError> {
    let cached = CacheReader::open(directory)?;
    let last = cached.last_frame();
    let state = cached.read(last)?;
    // If the device fails now, the frame's own breach is still reported.
    let failure = match replay(opened, scene, start, last, &state) {
        Ok(Some(failure)) => failure,
        Ok(None) | Err(_) => Failure {
            breach: breach.clone(),
            place: None,
        },
    };
    let stamp = Stamp {
        program: swell_domain::PROGRAM,
        program_version: swell_domain::VERSION,
        shot: &scene.shot.name,
        origin: scene.origin,
        frame: last,
        time: f64::from(last) / scene.shot.frames_per_second,
    };
    let Breach {
        frame,
        substep,
        watched,
        measured,
        limit,
        ..
    } = &failure.breach;
    let place = failure.place.as_ref();
    let report = json!({
        "last_frame": last, "frame": frame, "substep": substep, "budget": watched.name(),
        "measured": measured,
        "limit": limit, "message": failure.to_string(),
        "device": match opened { Opened::Gpu(_) => "gpu", Opened::Cpu => "cpu" },
        "pass": place.map(|p| json!({ "name": p.pass, "substep": p.substep, "buffer": p.buffer })),
    });
    let failed = Failed {
        scene_toml: scene_to_toml(scene, &swell_scene::asset_path),
        start: state,
        last_frame: last,
        report,
    };
    failed::write(directory, &failed, &stamp)?;
    Ok(failure)
}

/// Why a frame could not be recomputed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReplayError {
    /// Reading the folder or its cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The scene in the folder is invalid.
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
    Solve(#[from] SolverError),
}

impl From<&ReplayError> for Blame {
    fn from(error: &ReplayError) -> Self {
        match error {
            ReplayError::Cache(error) => error.into(),
            ReplayError::Scene(error) => error.into(),
            ReplayError::Solid(error) => error.into(),
            ReplayError::Gpu(error) => error.into(),
            ReplayError::Solve(error) => error.into(),
        }
    }
}

/// Whether `directory` is the `failed/` folder of a failed bake.
pub fn is_failed(directory: &Path) -> bool {
    failed::is_failed(directory)
}

/// Result of recomputing the frame of a failed bake.
#[derive(Debug)]
pub struct Replayed {
    /// Number of the frame.
    pub frame: u32,
    /// Warning about the adapter, as [`Opened::software_warning`].
    pub software_warning: Option<String>,
    /// What went wrong again; `None` if nothing did.
    pub failure: Option<Failure>,
}

/// Recomputes the frame of `directory`, a cache's `failed/` folder, on the kind of device that it
/// failed on.
///
/// # Errors
/// [`ReplayError`]. A breach is not an error; it is part of the result.
pub fn replay_failed(directory: &Path, gpu: &Gpu) -> Result<Replayed, ReplayError> {
    let Failed {
        scene_toml,
        start: state,
        last_frame,
        report,
    } = failed::read(directory)?;
    // The mesh files are in the cache that contains this folder.
    let cached = CacheReader::open(&directory.join(".."))?;
    let file = directory.join("scene.toml");
    let scene = recorded_scene(&scene_toml, &file, cached.dir())?;
    let start = Start::of_cache::<ReplayError>(&scene, &cached)?;
    if let Some(adapter) = &gpu.adapter {
        check_request(adapter)?;
    }
    let device = match report["device"].as_str() {
        Some("cpu") => Device::Cpu,
        _ => Device::Gpu(gpu.clone()),
    };
    let opened = device.open(needs(&scene))?;
    let failure = replay(&opened, &scene, &start, last_frame, &state)?;
    Ok(Replayed {
        frame: last_frame + 1,
        software_warning: opened.software_warning(),
        failure,
    })
}
