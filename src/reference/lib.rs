//! The solvers once more, in f64 on the CPU: what the GPU's results are measured against.
//!
//! Plain where the GPU is clever: no lists of fixed capacity, no colours in memory, no f32. Each
//! function that carries the name of a GPU pass is its twin: the same inputs, the same outputs.

pub mod flip;
mod hash;
pub mod neighbors;
pub mod pbf;
pub mod poisson;
pub mod rays;
pub mod whitewater;

use std::{collections::BTreeMap, time::Instant};

use swell_domain::{budget::Breach, solver::PassTime};

/// What stops the reference.
#[derive(Debug, thiserror::Error)]
pub enum ReferenceError {
    /// The numbers failed; the state before this frame stands.
    #[error(transparent)]
    Numbers(#[from] Breach),
    /// A sparse factor could not be made.
    #[error("the sparse Cholesky factor: {0}")]
    Factor(String),
    /// Newton's steps did not come to their end.
    #[error(
        "{steps} linear solves leave a compression of {error:.3e}, and {tolerance:.1e} was asked"
    )]
    NotConverged {
        /// Linear solves.
        steps: usize,
        /// max(0, C) that is left.
        error: f64,
        /// What was asked.
        tolerance: f64,
    },
}

/// Wall clock by pass.
#[derive(Clone, Debug, Default)]
pub struct Timings(BTreeMap<&'static str, (f64, u64)>);

impl Timings {
    /// Does a pass's work.
    pub fn time<T>(&mut self, pass: &'static str, work: impl FnOnce() -> T) -> T {
        let begin = Instant::now();
        let result = work();
        let (seconds, runs) = self.0.entry(pass).or_default();
        *seconds += begin.elapsed().as_secs_f64();
        *runs += 1;
        result
    }

    /// By pass.
    pub fn rows(&self) -> Vec<PassTime> {
        let rows = self.0.iter();
        rows.map(|(&pass, &(seconds, runs))| PassTime::new(pass, seconds, runs, 0, None))
            .collect()
    }
}
