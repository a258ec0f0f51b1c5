//! Interface between solvers and stages.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{absorber::AbsorberStates, particles::Particles, probe::Patch, sources::Exchange};

/// Report on the steps of one output frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Number of substeps of the frame.
    pub substeps: u32,
    /// Solver iterations, summed over substeps.
    pub iterations: u64,
    /// Mean of max(0, ρ/ρ0 − 1) at the frame's end; for FLIP, over the water cells of the
    /// last substep.
    pub density_error_mean: f64,
    /// 99th percentile of max(0, ρ/ρ0 − 1).
    pub density_error_p99: f64,
    /// Maximum of max(0, ρ/ρ0 − 1).
    pub density_error_max: f64,
    /// Kinetic energy, J.
    pub kinetic_energy: f64,
    /// Potential energy relative to the domain's least corner, J.
    pub potential_energy: f64,
    /// Largest speed, m/s.
    pub max_speed: f64,
    /// Number of times that a particle was slowed to the displacement cap.
    pub capped: u64,
    /// Number of times that a particle had more neighbours than its list holds, so that they were
    /// searched for directly.
    pub searched: u64,
    /// Work done on the water by moving walls and solids, by emitters, and by forces, J.
    #[serde(default)]
    pub boundary_work: f64,
    /// Volume of the water at the frame's end, m³, as measured by a volume probe; only if a budget
    /// limits it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume: Option<f64>,
    /// Report on the pressure projections; only for solvers that have them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub projection: Option<Projection>,
    /// Particles that then entered and left, which the figures above do not include; only for
    /// scenes with emitters or drains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exchange: Option<Exchange>,
    /// Position of `density_error_max`, the centre of the cell or the particle, in the scene's
    /// coordinates, metres. Not stored in ledgers.
    #[serde(skip)]
    pub densest_at: Option<[f64; 3]>,
}

/// Report on the pressure projections of one output frame. Their iterations are in [`StepReport`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Projection {
    /// Largest ‖b − Ap‖/‖b‖ of a solve, from a freshly computed residual.
    pub residual: f64,
    /// Largest |∇·u| in a water cell before a projection, 1/s.
    pub divergence_before: f64,
    /// Largest |∇·u| in a water cell after a projection, 1/s.
    pub divergence_after: f64,
    /// Number of solves, including those of the density correction, that ended above
    /// their tolerance.
    pub missed: u32,
    /// Largest number of simultaneous bodies of water without contact to air.
    pub pockets: u32,
    /// Largest |mean of ∇·u| over such a body, 1/s: no pressure can remove it, as where a solid
    /// crushes the water.
    #[serde(default)]
    pub incompatible: f64,
    /// Water cells without an open face, which the system leaves out, summed over substeps.
    pub dropped: u64,
    /// Iterations of the density correction's solves, summed over substeps.
    pub correction_iterations: u64,
}

/// Data requested at the end of a substep. A solver reads back only what is requested here.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Requested {
    /// Whether to return positions and velocities of all particles.
    pub particles: bool,
    /// Whether to return the pressures at the scene's pressure points.
    pub pressures: bool,
    /// Surface patches, in world coordinates, whose pressures to return; only for solvers with a
    /// pressure on cells.
    pub patches: Vec<Patch>,
}

/// Time span of a substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Start, seconds from the start of the shot.
    pub start: f64,
    /// End, seconds from the start of the shot. Bit-identical to the next substep's start, except
    /// for the last substep of a frame.
    pub end: f64,
    /// Whether this is the last substep of the frame.
    pub is_last: bool,
}

/// State of the water at the end of a substep, as far as it was requested.
#[derive(Clone, Debug, Default)]
pub struct Observed {
    /// World positions and velocities in the order of the frame; empty if not requested.
    pub particles: Particles,
    /// Pressures at the pressure points, Pa; `None` where there was no water. Empty if
    /// not requested.
    pub pressures: Vec<Option<f64>>,
    /// Pressures on the patches, Pa; 0 where they are dry.
    pub patches: Vec<f64>,
}

/// Observes the substeps of a frame while it is computed, without influence on the result.
pub trait Watch {
    /// Returns what to observe at the end of a substep; called once per substep, in order.
    fn wants(&mut self, substep: Span) -> Requested;

    /// Receives what was requested for that substep; not called if nothing was.
    fn look(&mut self, substep: Span, seen: Observed);
}

impl Requested {
    /// Returns whether anything is requested.
    pub fn is_any(&self) -> bool {
        *self != Self::default()
    }
}

/// A watch that observes nothing.
pub struct NoWatch;

impl Watch for NoWatch {
    fn wants(&mut self, _: Span) -> Requested {
        Requested::default()
    }

    fn look(&mut self, _: Span, _: Observed) {}
}

/// Time and traffic of a pass.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassTime {
    /// Name of the pass.
    pub pass: &'static str,
    /// Time of all runs, seconds.
    pub seconds: f64,
    /// Number of runs.
    pub runs: u64,
    /// Bytes moved by all runs if each binding is read and written once, as far as the pass reads
    /// and writes it at all; 0 if unknown.
    pub bytes: u64,
    /// Floating-point and integer operations of all runs, if counted.
    pub operations: Option<[u64; 2]>,
}

impl PassTime {
    /// Builds the record of a pass from the totals of all runs.
    pub fn new(
        pass: &'static str,
        seconds: f64,
        runs: u64,
        bytes: u64,
        operations: Option<[u64; 2]>,
    ) -> Self {
        Self {
            pass,
            seconds,
            runs,
            bytes,
            operations,
        }
    }

    /// Adds further runs of the same pass.
    pub fn add(&mut self, more: &Self) {
        self.seconds += more.seconds;
        self.runs += more.runs;
        self.bytes += more.bytes;
        let both = self.operations.zip(more.operations);
        self.operations = both.map(|(sum, more)| [sum[0] + more[0], sum[1] + more[1]]);
    }
}

/// A frame that a solver has computed, still to be read. It may be read on another thread, while
/// the solver computes the next frame.
pub struct Unread<E> {
    /// State of the absorbing walls at the frame's end.
    pub walls: AbsorberStates,
    read: Box<Read<E>>,
}

type Read<E> = dyn FnOnce() -> Result<(Particles, StepReport), E> + Send;

impl<E> Unread<E> {
    /// A frame that `read` reads, with the walls at its end.
    pub fn new(
        walls: AbsorberStates,
        read: impl FnOnce() -> Result<(Particles, StepReport), E> + Send + 'static,
    ) -> Self {
        let read = Box::new(read);
        Self { walls, read }
    }

    /// Returns the state and its report.
    ///
    /// # Errors
    /// If the computation has failed.
    pub fn read(self) -> Result<(Particles, StepReport), E> {
        (self.read)()
    }

    /// Converts the error.
    pub fn map_err<F: From<E>>(self) -> Unread<F>
    where
        E: 'static,
    {
        let read = self.read;
        Unread::new(self.walls, move || Ok(read()?))
    }
}

/// A solver that advances a state of particles frame by frame.
///
/// The state that it returns contains all that it needs for the next frame.
pub trait Solver {
    /// Error that ends a step.
    type Error;

    /// Takes `particles` as the state at the end of `frame`; frame 0 is the start.
    ///
    /// # Errors
    /// If the device fails, or if the state does not fit what the solver was built for.
    fn load(&mut self, frame: u32, particles: &Particles) -> Result<(), Self::Error>;

    /// Computes the next frame while `watch` observes the ends of substeps, which has no influence
    /// on the result. After an error, also one of reading the frame, a state has to be loaded.
    ///
    /// # Errors
    /// If the device fails, or if the computation does.
    fn compute(&mut self, watch: &mut dyn Watch) -> Result<Unread<Self::Error>, Self::Error>;

    /// Computes the next frame and reads it.
    ///
    /// # Errors
    /// As [`Solver::compute`].
    fn advance(&mut self) -> Result<(Particles, StepReport), Self::Error> {
        self.advance_watched(&mut NoWatch)
    }

    /// Same as [`Solver::advance`] while `watch` observes the ends of substeps.
    ///
    /// # Errors
    /// As [`Solver::compute`].
    fn advance_watched(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<(Particles, StepReport), Self::Error> {
        self.compute(watch)?.read()
    }

    /// Returns the pressure of the last substep at world points, metres, in Pa relative to the air;
    /// `None` where there was no water. Valid only for scenes with a pressure probe: others do not
    /// keep the data.
    ///
    /// # Errors
    /// If the device fails.
    fn pressures(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, Self::Error>;

    /// Returns the times of all passes since the solver was built, if it measures them.
    fn timings(&self) -> Vec<PassTime>;
}
