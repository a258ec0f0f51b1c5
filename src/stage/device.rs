//! The device that a bake runs on: an adapter, or the CPU with the f64 reference.

use std::{
    env::consts::{ARCH, OS},
    fmt,
};

use glam::DVec3;

use swell_domain::{
    band::BandError,
    budget::Breach,
    particles::Particles,
    solver::{PassTime, Solver, Unread, Watch},
};
use swell_gpu::adapter::{Context, Needs};
use swell_reference::ReferenceError;
use swell_scene::{ByMethod, Scene, flip::Precision};
use swell_solve::{
    flip::Flip,
    pbf::Pbf,
    plan::{Plan, device_limits},
};

use super::{Blame, prepare::Start};

pub use swell_gpu::{
    adapter::GpuError,
    ceilings::Ceilings,
    imprecision::{Imprecision, UnknownProfile},
    shader::{Shaders, ShadersError},
    traffic::Traffic,
};
pub use swell_solve::SolveError;

/// An adapter, and the shaders that run on it.
#[derive(Clone, Debug, Default)]
pub struct Gpu {
    /// Index of the adapter or a part of its name; the best adapter if `None`.
    pub adapter: Option<String>,
    /// Shaders to run; the built-in ones by default.
    pub shaders: Shaders,
    /// Whether a software adapter is refused.
    pub is_hardware_required: bool,
    /// Simulated imprecision.
    pub imprecision: Option<Imprecision>,
}

impl Gpu {
    /// Opens the adapter for passes with these needs.
    ///
    /// # Errors
    /// Those of [`Context::open_for`]; [`GpuError::Software`] where hardware is required.
    pub fn open(&self, needs: Needs) -> Result<Context, GpuError> {
        let adapter = self.adapter.as_deref();
        let mut context = match self.imprecision {
            Some(profile) => Context::open_imprecise(adapter, profile)?,
            None => Context::open_for(adapter, needs)?,
        };
        if self.is_hardware_required {
            context.require_hardware()?;
        }
        context.shaders = self.shaders.clone();
        Ok(context)
    }
}

impl From<Option<String>> for Gpu {
    fn from(adapter: Option<String>) -> Self {
        Self {
            adapter,
            ..Self::default()
        }
    }
}

/// The device to run on.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum Device {
    /// An adapter to open.
    Gpu(Gpu),
    /// A device that the caller has opened.
    Open(Box<Context>),
    /// The f64 reference; no driver is used.
    Cpu,
}

/// An open device.
pub enum Opened {
    /// An adapter's context.
    Gpu(Box<Context>),
    /// This machine's processors.
    Cpu,
}

/// Times of passes, and the ceilings of the device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassTimes {
    /// Times by pass name; empty unless timed.
    pub passes: Vec<PassTime>,
    /// Ceilings of the adapter; `None` unless passes were timed on one.
    pub ceilings: Option<Ceilings>,
    /// What the host asked of the device for all frames of a bake; `None` unless timed on one.
    pub traffic: Option<Traffic>,
}

impl PassTimes {
    /// Times of passes on an adapter; measures the adapter's ceilings.
    ///
    /// # Errors
    /// Those of [`Ceilings::measure`].
    pub fn on(context: &Context, passes: Vec<PassTime>) -> Result<Self, GpuError> {
        Ok(Self {
            passes,
            ceilings: Some(Ceilings::measure(context)?),
            traffic: None,
        })
    }
}

/// Fractions of a device's ceilings that a pass reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// Fraction of the bandwidth; above 1 if the bound data stays in a cache.
    pub memory: Option<f64>,
    /// Fraction of the arithmetic rate.
    pub arithmetic: Option<f64>,
    /// What limits the pass; `None` if its bytes or operations are unknown.
    ///
    /// `memory` or `arithmetic` if the pass reaches at least half of that ceiling (the larger of
    /// the two); `start` if a run takes at most twice as long as an empty pass; otherwise
    /// `latency`: dependent loads, branches, or idle lanes.
    pub waits_for: Option<&'static str>,
}

/// Fraction of a ceiling from which on it limits a pass.
const HELD: f64 = 0.5;
/// Multiple of an empty pass's time up to which the start limits a pass.
const STARTING: f64 = 2.0;

impl Reached {
    /// Fractions over all runs of a pass.
    pub fn of(time: &PassTime, ceilings: &Ceilings) -> Self {
        let part = |amount: u64, ceiling: f64| amount as f64 / time.seconds / ceiling;
        let memory = (time.bytes > 0).then(|| part(time.bytes, ceilings.bandwidth));
        let arithmetic = time
            .operations
            .map(|[floats, integers]| part(floats + integers, ceilings.arithmetic));
        let each = time.seconds / time.runs as f64;
        let waits_for = memory.zip(arithmetic).map(|(memory, arithmetic)| {
            match (memory.max(arithmetic) >= HELD, memory > arithmetic) {
                (true, true) => "memory",
                (true, false) => "arithmetic",
                _ if each <= STARTING * ceilings.start => "start",
                _ => "latency",
            }
        });
        Self {
            memory,
            arithmetic,
            waits_for,
        }
    }
}

/// A device as recorded in the manifest.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Name of the adapter, or of the reference.
    pub name: String,
    /// Driver and its version; for the reference, the target that it was built for.
    pub driver: String,
    /// `Vulkan`, `Metal` or `Dx12`; `CPU` for the reference.
    pub backend: String,
    /// Hash of the shaders if they are not the built-in ones, as in [`Shaders::edited`].
    pub shaders: Option<String>,
}

impl fmt::Display for Identity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let shaders = shaders_note(self.shaders.as_deref());
        write!(
            f,
            "{} ({}, {}){shaders}",
            self.name, self.driver, self.backend
        )
    }
}

/// Note about edited shaders that follows a device or a program; empty for the built-in ones.
pub fn shaders_note(edited: Option<&str>) -> String {
    edited.map_or(String::new(), |hash| {
        format!(" with shaders {hash}, not the shipped ones")
    })
}

/// An error of either solver.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolverError {
    /// The solver on the GPU failed.
    #[error(transparent)]
    Gpu(#[from] SolveError),
    /// The f64 reference on the CPU failed.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// A budget exceeded at the end of a frame.
    #[error(transparent)]
    Budget(#[from] Breach),
    /// A band of particles that could not be laid at the end of a frame.
    #[error("frame {frame}: {error}")]
    Band {
        /// Number of the frame.
        frame: u32,
        /// The reason.
        error: BandError,
    },
}

impl SolverError {
    /// The exceeded budget, if that is the error.
    pub fn breach(&self) -> Option<&Breach> {
        match self {
            Self::Gpu(SolveError::Numbers(breach))
            | Self::Reference(ReferenceError::Numbers(breach))
            | Self::Budget(breach) => Some(breach),
            _ => None,
        }
    }
}

impl From<&SolverError> for Blame {
    fn from(error: &SolverError) -> Self {
        match error {
            SolverError::Gpu(error) => error.into(),
            SolverError::Reference(error) => error.into(),
            SolverError::Budget(_) | SolverError::Band { .. } => Self::Numbers,
        }
    }
}

impl Device {
    /// Opens the device; an adapter for passes with these needs.
    ///
    /// # Errors
    /// Those of [`Gpu::open`]; the CPU always opens.
    pub fn open(&self, needs: Needs) -> Result<Opened, GpuError> {
        Ok(match self {
            Self::Gpu(gpu) => Opened::Gpu(Box::new(gpu.open(needs)?)),
            Self::Open(context) => Opened::Gpu(context.clone()),
            Self::Cpu => Opened::Cpu,
        })
    }
}

/// Adapter features that a scene's passes need.
pub fn needs(scene: &Scene) -> Needs {
    let flip = scene.solver.flip();
    Needs {
        f64: flip.is_some_and(|flip| flip.pressure.precision == Precision::F64),
    }
}

/// A solver of either method on either device.
pub type AnySolver = dyn Solver<Error = SolverError> + Send;

/// A scene's solver, and its plan.
pub struct Built {
    /// The solver, without a state yet.
    pub solver: Box<AnySolver>,
    /// Plan of the passes and buffers on the GPU; `None` on the CPU.
    pub plan: Option<Plan>,
}

impl Opened {
    /// Sets whether timers count operations as well.
    pub fn counting(mut self, counts: bool) -> Self {
        if let Self::Gpu(context) = &mut self {
            context.counts_operations = counts;
        }
        self
    }

    /// The device's identity for the manifest.
    pub fn identity(&self) -> Identity {
        match self {
            Self::Gpu(context) => Identity {
                name: context.info.name.clone(),
                driver: format!("{} {}", context.info.driver, context.info.driver_info),
                backend: context.info.backend.to_string(),
                shaders: context.shaders.edited().map(str::to_owned),
            },
            Self::Cpu => Identity {
                name: "CPU f64 reference".into(),
                driver: format!("{ARCH} {OS}"),
                backend: "CPU".into(),
                shaders: None,
            },
        }
    }

    /// Warning about the adapter, as [`Context::software_warning`].
    pub fn software_warning(&self) -> Option<String> {
        match self {
            Self::Gpu(context) => context.software_warning(),
            Self::Cpu => None,
        }
    }

    /// Times of passes on this device.
    ///
    /// # Errors
    /// Those of [`PassTimes::on`].
    pub fn pass_times(&self, passes: Vec<PassTime>) -> Result<PassTimes, GpuError> {
        match self {
            Self::Gpu(context) => PassTimes::on(context, passes),
            Self::Cpu => Ok(PassTimes {
                passes,
                ..PassTimes::default()
            }),
        }
    }

    /// What the host has asked of the device since it was opened; `None` without an adapter.
    pub fn traffic(&self) -> Option<Traffic> {
        match self {
            Self::Gpu(context) => Some(context.traffic()),
            Self::Cpu => None,
        }
    }

    /// Builds the scene's solver on this device, with exactly the passes and buffers of its plan.
    ///
    /// # Errors
    /// A buffer that exceeds the adapter's limits, with the figures; a device error.
    pub fn build(
        &self,
        scene: &Scene,
        start: &Start,
        is_timed: bool,
    ) -> Result<Built, SolverError> {
        let boundary = &start.boundary;
        let by_method = &scene.by_method();
        let Self::Gpu(context) = self else {
            let solver: Box<AnySolver> = match by_method {
                ByMethod::Pbf(scene) => {
                    Box::new(Unified(swell_reference::pbf::Pbf::new(scene, boundary)))
                }
                ByMethod::Flip(scene) => {
                    Box::new(Unified(swell_reference::flip::Flip::new(scene, boundary)))
                }
            };
            return Ok(Built { solver, plan: None });
        };
        let plan = start.plan(scene, device_limits(context));
        let planned = Some(start.shown_plan(scene, device_limits(context)));
        let solver: Box<AnySolver> = match by_method {
            ByMethod::Pbf(scene) => {
                Box::new(Unified(Pbf::new(context, scene, plan, boundary, is_timed)?))
            }
            ByMethod::Flip(scene) => Box::new(Unified(Flip::new(
                context, scene, plan, boundary, is_timed,
            )?)),
        };
        Ok(Built {
            solver,
            plan: planned,
        })
    }
}

/// Adapts a solver so that its errors are [`SolverError`]s.
struct Unified<S>(S);

impl<S: Solver> Solver for Unified<S>
where
    S::Error: 'static,
    SolverError: From<S::Error>,
{
    type Error = SolverError;

    fn load(&mut self, frame: u32, particles: &Particles) -> Result<(), SolverError> {
        Ok(self.0.load(frame, particles)?)
    }

    fn compute(&mut self, watch: &mut dyn Watch) -> Result<Unread<SolverError>, SolverError> {
        Ok(self.0.compute(watch)?.map_err())
    }

    fn pressures(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, SolverError> {
        Ok(self.0.pressures(points)?)
    }

    fn timings(&self) -> Vec<PassTime> {
        self.0.timings()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_holds_a_pass_is_the_ceiling_that_it_comes_near() {
        let ceilings = Ceilings {
            bandwidth: 1e9,
            arithmetic: 1e10,
            start: 0.001,
        };
        // Ten runs of 0.1 s reach these fractions of the ceilings.
        let of = |memory: f64, arithmetic: f64, seconds: f64| {
            let bytes = (memory * 1e9 * seconds) as u64;
            let half = (0.5 * arithmetic * 1e10 * seconds) as u64;
            let time = PassTime::new("some/pass", seconds, 10, bytes, Some([half, half]));
            Reached::of(&time, &ceilings)
        };
        let reached = of(0.75, 0.25, 1.0);
        assert_eq!(
            (reached.memory, reached.arithmetic),
            (Some(0.75), Some(0.25))
        );
        assert_eq!(reached.waits_for, Some("memory"));
        assert_eq!(of(0.5, 0.625, 1.0).waits_for, Some("arithmetic"));
        assert_eq!(of(0.25, 0.25, 1.0).waits_for, Some("latency"));
        // Up to 2 ms a run counts as a start, 2.1 ms does not.
        assert_eq!(of(0.25, 0.25, 0.02).waits_for, Some("start"));
        assert_eq!(of(0.25, 0.25, 0.021).waits_for, Some("latency"));
        assert_eq!(of(0.75, 0.25, 0.02).waits_for, Some("memory"));
        // Raster passes.
        let time = PassTime::new("some/pass", 1.0, 10, 0, None);
        let reached = Reached::of(&time, &ceilings);
        let none = (reached.memory, reached.arithmetic, reached.waits_for);
        assert_eq!(none, (None, None, None));
    }
}
