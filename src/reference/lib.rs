//! Reference implementation of the solvers: f64 on the CPU, which GPU results are compared with.
//!
//! It favours simplicity over speed: no neighbour lists of fixed capacity, no colour ordering in
//! memory, no f32. A function with the name of a GPU pass is its reference pass: it has the same
//! inputs and the same outputs.

pub mod flip;
mod hash;
pub mod neighbors;
pub mod pbf;
pub mod poisson;
pub mod rays;
pub mod whitewater;

use std::{collections::BTreeMap, time::Instant};

use swell_domain::{budget::Breach, solver::PassTime};

/// Error that ends a reference solve.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// A numerical budget was exceeded; the state from before this frame is kept.
    #[error(transparent)]
    Numbers(#[from] Breach),
    /// The number of bodies of the state is not the scene's.
    #[error(transparent)]
    Bodies(#[from] swell_scene::moving_solid::OtherBodies),
    /// The sparse Cholesky factorisation failed.
    #[error("the sparse Cholesky factor: {0}")]
    Factor(String),
    /// The Newton iteration did not converge.
    #[error(
        "{steps} linear solves leave a compression of {error:.3e}, and {tolerance:.1e} was asked"
    )]
    NotConverged {
        /// Linear solves done.
        steps: usize,
        /// Remaining compression max(0, C).
        error: f64,
        /// Requested bound on the compression.
        tolerance: f64,
    },
}

/// Wall-clock time by pass.
#[derive(Clone, Debug, Default)]
pub struct Timings(BTreeMap<&'static str, (f64, u64)>);

impl Timings {
    /// Runs `work` and adds its time to that of `pass`.
    pub fn time<T>(&mut self, pass: &'static str, work: impl FnOnce() -> T) -> T {
        let begin = Instant::now();
        let result = work();
        let (seconds, runs) = self.0.entry(pass).or_default();
        *seconds += begin.elapsed().as_secs_f64();
        *runs += 1;
        result
    }

    /// Returns the time and the number of runs of each pass, sorted by name.
    pub fn rows(&self) -> Vec<PassTime> {
        let rows = self.0.iter();
        rows.map(|(&pass, &(seconds, runs))| PassTime::new(pass, seconds, runs, 0, None))
            .collect()
    }
}
