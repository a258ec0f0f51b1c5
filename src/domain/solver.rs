//! What every solver is to the stages.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::{particles::Particles, probe::Patch, sources::Exchange};

/// Report of one output frame's steps.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Substeps of this frame.
    pub substeps: u32,
    /// Solver iterations, summed over substeps.
    pub iterations: u64,
    /// Mean of max(0, ρ/ρ0 − 1) at the frame's end; with FLIP over the cells of water that its last substep found.
    pub density_error_mean: f64,
    /// 99th percentile of max(0, ρ/ρ0 − 1).
    pub density_error_p99: f64,
    /// Maximum of max(0, ρ/ρ0 − 1).
    pub density_error_max: f64,
    /// Joule.
    pub kinetic_energy: f64,
    /// Joule, against the domain's least corner.
    pub potential_energy: f64,
    /// m/s.
    pub max_speed: f64,
    /// Times that a particle was slowed to the displacement cap.
    pub capped: u64,
    /// Times that a particle had more neighbours than its list holds and was searched for.
    pub searched: u64,
    /// Done on the water by walls and solids that move, joule.
    #[serde(default)]
    pub boundary_work: f64,
    /// Volume of the water at the frame's end, m³, as a probe has it; only where a budget watches it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub volume: Option<f64>,
    /// Report of the pressure projections; only of solvers that have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub projection: Option<Projection>,
    /// What then entered and left, which the figures above do not see; only of scenes with emitters or drains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exchange: Option<Exchange>,
    /// Where `density_error_max` is: the middle of that cell, or that particle, in the scene's coordinates, metres. No ledger keeps it.
    #[serde(skip)]
    pub densest_at: Option<[f64; 3]>,
}

/// Report of one output frame's pressure projections; iterations stand in the frame's report.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Projection {
    /// Largest ‖b − Ap‖/‖b‖ of a solve, from a freshly computed residual.
    pub residual: f64,
    /// Largest |∇·u| in a cell of water before a projection, 1/s.
    pub divergence_before: f64,
    /// The same after it.
    pub divergence_after: f64,
    /// Solves, the density correction's among them, that ended above their tolerance.
    pub missed: u32,
    /// Most bodies of water at once that no air touched.
    pub pockets: u32,
    /// Largest |mean of ∇·u| over such a body, 1/s: what no pressure undoes, as where a solid crushes it.
    #[serde(default)]
    pub incompatible: f64,
    /// Cells of water without an open face, left out of the system, summed over substeps.
    pub dropped: u64,
    /// Iterations of the density correction's solves, summed over substeps.
    pub correction_iterations: u64,
}

/// What is looked at when a substep ends. A solver reads back what is named here, and nothing else.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Wanted {
    /// Positions and velocities of all particles.
    pub particles: bool,
    /// Pressures at the scene's points of pressure.
    pub pressures: bool,
    /// Pressures on these patches of surfaces, world coordinates; only of solvers with a pressure on cells.
    pub patches: Vec<Patch>,
}

/// A substep of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Seconds from the shot's start.
    pub start: f64,
    /// Seconds from the shot's start; the next substep's start to the last bit, but for a frame's last.
    pub end: f64,
    /// Whether the frame ends with it.
    pub is_last: bool,
}

/// The water when a substep ended.
#[derive(Clone, Debug, Default)]
pub struct Seen {
    /// World positions and velocities in the order of the frame's; empty where not wanted.
    pub particles: Particles,
    /// Pa; `None` where there was no water; empty where not wanted.
    pub pressures: Vec<Option<f64>>,
    /// On the patches, Pa; 0 where they are dry.
    pub patches: Vec<f64>,
}

/// Looks on while a frame is computed. It changes nothing.
pub trait Watch {
    /// What it wants to see of a substep; asked once, in order.
    fn wants(&mut self, substep: Span) -> Wanted;

    /// Shows it what it wanted of that substep; not called where that is nothing.
    fn look(&mut self, substep: Span, seen: Seen);
}

impl Wanted {
    /// Whether there is anything.
    pub fn is_any(&self) -> bool {
        *self != Self::default()
    }
}

/// Who looks at frames alone.
pub struct Nobody;

impl Watch for Nobody {
    fn wants(&mut self, _: Span) -> Wanted {
        Wanted::default()
    }

    fn look(&mut self, _: Span, _: Seen) {}
}

/// What a pass took.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PassTime {
    /// Its name.
    pub pass: &'static str,
    /// Of all runs, seconds.
    pub seconds: f64,
    /// How often it ran.
    pub runs: u64,
    /// Bytes that all runs moved if each of what they bind is read and written once, as far as it is read and written at all; 0 where that
    /// is not known.
    pub bytes: u64,
    /// Operations on floats and on integers of all runs, where they were counted.
    pub operations: Option<[u64; 2]>,
}

impl PassTime {
    /// Of a pass: seconds, runs, bytes and operations of all runs.
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

/// A solver that advances a particle state frame by frame.
///
/// All that it needs for the next frame is in the state that it hands back.
pub trait Solver {
    /// Error that ends a step.
    type Error;

    /// Takes over `particles` as the state at the end of `frame`; 0 is the start.
    ///
    /// # Errors
    /// The device fails, or the state does not fit what the solver was built for.
    fn load(&mut self, frame: u32, particles: &Particles) -> Result<(), Self::Error>;

    /// Computes the next frame.
    ///
    /// # Errors
    /// The device fails, or the numbers do.
    fn advance(&mut self) -> Result<(Particles, StepReport), Self::Error> {
        self.advance_watched(&mut Nobody)
    }

    /// The same, the same to the last bit, while `watch` looks on at the ends of substeps.
    ///
    /// # Errors
    /// As [`Solver::advance`].
    fn advance_watched(
        &mut self,
        watch: &mut dyn Watch,
    ) -> Result<(Particles, StepReport), Self::Error>;

    /// Pressure at world points, metres, as the last substep had it, Pa against the air's; `None`
    /// where there was no water. Told only of scenes with a probe of pressure: others keep nothing for it.
    ///
    /// # Errors
    /// The device.
    fn pressures(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, Self::Error>;

    /// What passes took since the solver was built, where it measures them.
    fn timings(&self) -> Vec<PassTime>;
}
