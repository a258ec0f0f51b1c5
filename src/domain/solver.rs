//! What every solver is to the stages.

use serde::{Deserialize, Serialize};

use super::particles::Particles;

/// What one output frame's steps did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepReport {
    /// Substeps of this frame.
    pub substeps: u32,
    /// Solver iterations, summed over substeps.
    pub iterations: u64,
    /// Mean of max(0, ρ/ρ0 − 1) at the frame's end.
    pub density_error_mean: f64,
    /// Its 99th percentile.
    pub density_error_p99: f64,
    /// Its maximum.
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
}

/// A solver that advances a particle state frame by frame.
///
/// All that it needs for the next frame is in the state that it hands back.
pub trait Solver {
    /// What stops it.
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
    fn advance(&mut self) -> Result<(Particles, StepReport), Self::Error>;

    /// Seconds and runs by pass since the solver was built, where it measures them.
    fn timings(&self) -> Vec<(&'static str, f64, u64)>;
}
