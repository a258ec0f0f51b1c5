//! What a bake runs on: an adapter, or the CPU with the f64 reference.

use std::{
    env::consts::{ARCH, OS},
    fmt,
};

use glam::DVec3;

use swell_domain::{
    budget::Breach,
    particles::Particles,
    solver::{PassTime, Solver, StepReport, Watch},
};
use swell_gpu::adapter::{Context, GpuError, Needs};
use swell_reference::ReferenceError;
use swell_scene::{Method, Scene, flip::Precision};
use swell_solve::{
    SolveError,
    flip::Flip,
    pbf::Pbf,
    plan::{Plan, device_limits},
};

use super::{Blame, prepare::Start};

pub use swell_gpu::{
    ceilings::Ceilings,
    shader::{Shaders, ShadersError},
};

/// An adapter, and the shaders that run on it.
#[derive(Clone, Debug, Default)]
pub struct Gpu {
    /// Index of the adapter, or a part of its name; the best one where `None`.
    pub adapter: Option<String>,
    /// The shipped ones by default.
    pub shaders: Shaders,
}

impl Gpu {
    /// Opens the adapter for passes with these needs.
    ///
    /// # Errors
    /// Those of [`Context::open_for`].
    pub fn open(&self, needs: Needs) -> Result<Context, GpuError> {
        let mut context = Context::open_for(self.adapter.as_deref(), needs)?;
        context.shaders = self.shaders.clone();
        Ok(context)
    }
}

impl From<Option<String>> for Gpu {
    fn from(adapter: Option<String>) -> Self {
        Self {
            adapter,
            shaders: Shaders::default(),
        }
    }
}

/// What to run on.
#[derive(Clone, Debug)]
pub enum Device {
    /// An adapter.
    Gpu(Gpu),
    /// A device that the caller opened.
    Open(Box<Context>),
    /// The f64 reference; no driver is touched.
    Cpu,
}

/// A device that stands ready.
pub enum Opened {
    /// An adapter's.
    Gpu(Box<Context>),
    /// This machine's processors.
    Cpu,
}

/// What passes took, and what the device gives.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PassTimes {
    /// By name; empty unless timed.
    pub passes: Vec<PassTime>,
    /// Only of an adapter whose passes were timed.
    pub ceilings: Option<Ceilings>,
}

impl PassTimes {
    /// Of passes that were timed on an adapter: measures what it gives.
    ///
    /// # Errors
    /// Those of [`Ceilings::measure`].
    pub fn on(context: &Context, passes: Vec<PassTime>) -> Result<Self, GpuError> {
        Ok(Self {
            passes,
            ceilings: Some(Ceilings::measure(context)?),
        })
    }
}

/// Which part of a device's ceilings a pass reaches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reached {
    /// Of the bandwidth; more than 1 where what is bound stays in a cache.
    pub memory: Option<f64>,
    /// Of the arithmetic rate.
    pub arithmetic: Option<f64>,
    /// What the device waits for: `memory` or `arithmetic` where the pass reaches half of it or more, and the larger part of both; `start`
    /// where a run takes at most twice what a pass without work takes; else `latency`, of loads that wait for one another, of branches,
    /// of lanes without work. `None` where bytes or operations are not known.
    pub waits_for: Option<&'static str>,
}

/// The part of a ceiling from which on it is what holds a pass.
const HELD: f64 = 0.5;
/// The times that a pass without work takes, up to which its start is what holds a pass.
const STARTING: f64 = 2.0;

impl Reached {
    /// By all runs of a pass.
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

/// A device as the manifest has it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Adapter, or that it is the reference.
    pub name: String,
    /// Driver and its version; of the reference what its libraries were built for.
    pub driver: String,
    /// `Vulkan`, `Metal`, `Dx12`; `CPU` of the reference.
    pub backend: String,
    /// Hash of the shaders where they are not the shipped ones, as [`Shaders::edited`].
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

/// What is said of shaders behind a device or a program: nothing of the shipped ones.
pub fn shaders_note(edited: Option<&str>) -> String {
    edited.map_or(String::new(), |hash| {
        format!(" with shaders {hash}, not the shipped ones")
    })
}

/// What stops a solver, whichever it is.
#[derive(Debug, thiserror::Error)]
pub enum SolverError {
    /// On the GPU.
    #[error(transparent)]
    Gpu(#[from] SolveError),
    /// In f64 on the CPU.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// A budget, at a frame's end.
    #[error(transparent)]
    Budget(#[from] Breach),
}

impl SolverError {
    /// The budget that was broken, where that is what it is.
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
            SolverError::Budget(_) => Self::Numbers,
        }
    }
}

impl Device {
    /// Opens it; an adapter for passes with these needs.
    ///
    /// # Errors
    /// Those of an adapter.
    pub fn open(&self, needs: Needs) -> Result<Opened, GpuError> {
        Ok(match self {
            Self::Gpu(gpu) => Opened::Gpu(Box::new(gpu.open(needs)?)),
            Self::Open(context) => Opened::Gpu(context.clone()),
            Self::Cpu => Opened::Cpu,
        })
    }
}

/// What a scene's passes ask of an adapter.
pub fn needs(scene: &Scene) -> Needs {
    let flip = scene.solver.flip.as_ref();
    let flip = flip.filter(|_| scene.solver.method == Method::Flip);
    Needs {
        f64: flip.is_some_and(|flip| flip.pressure.precision == Precision::F64),
    }
}

/// A solver of a scene, and what it was planned to take.
pub struct Built {
    /// Not loaded yet.
    pub solver: Box<dyn Solver<Error = SolverError>>,
    /// Of the GPU; `None` on the CPU.
    pub plan: Option<Plan>,
}

impl Opened {
    /// The same; where `counts`, timers count operations as well.
    pub fn counting(mut self, counts: bool) -> Self {
        if let Self::Gpu(context) = &mut self {
            context.counts_operations = counts;
        }
        self
    }

    /// For the manifest.
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

    /// What passes took on it.
    ///
    /// # Errors
    /// Those of [`PassTimes::on`].
    pub fn pass_times(&self, passes: Vec<PassTime>) -> Result<PassTimes, GpuError> {
        match self {
            Self::Gpu(context) => PassTimes::on(context, passes),
            Self::Cpu => Ok(PassTimes {
                passes,
                ceilings: None,
            }),
        }
    }

    /// The scene's solver on it, with what the scene's plan names and no more.
    ///
    /// # Errors
    /// A buffer over the adapter's limits, with the figures; the device at fault.
    pub fn build(
        &self,
        scene: &Scene,
        start: &Start,
        is_timed: bool,
    ) -> Result<Built, SolverError> {
        let boundary = &start.boundary;
        let method = scene.solver.method;
        let Self::Gpu(context) = self else {
            let solver: Box<dyn Solver<Error = SolverError>> = match method {
                Method::Pbf => Box::new(Unified(swell_reference::pbf::Pbf::new(scene, boundary))),
                Method::Flip => {
                    Box::new(Unified(swell_reference::flip::Flip::new(scene, boundary)))
                }
            };
            return Ok(Built { solver, plan: None });
        };
        let plan = start.plan(scene, device_limits(context));
        let planned = Some(start.shown_plan(scene, device_limits(context)));
        let solver: Box<dyn Solver<Error = SolverError>> = match method {
            Method::Pbf => Box::new(Unified(Pbf::new(context, scene, plan, boundary, is_timed)?)),
            Method::Flip => Box::new(Unified(Flip::new(
                context, scene, plan, boundary, is_timed,
            )?)),
        };
        Ok(Built {
            solver,
            plan: planned,
        })
    }
}

/// A solver whose errors are [`SolverError`]s.
struct Unified<S>(S);

impl<S: Solver> Solver for Unified<S>
where
    SolverError: From<S::Error>,
{
    type Error = SolverError;

    fn load(&mut self, frame: u32, particles: &Particles) -> Result<(), SolverError> {
        Ok(self.0.load(frame, particles)?)
    }

    fn advance_watched(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<(Particles, StepReport), SolverError> {
        Ok(self.0.advance_watched(watch)?)
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
        // Ten runs of 0.1 s move and compute these parts of what the device could.
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
        // 2 ms and less are a start, 2.1 ms are not.
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
