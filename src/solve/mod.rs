//! Particle solvers on the GPU.

pub mod boundary;
pub mod flip;
mod iteration;
pub mod params;
pub mod pbf;
pub mod pressure;
mod state;

use crate::gpu::adapter::GpuError;

/// What stops a solve.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The state handed in does not fit what the solver was built for.
    #[error("the solver holds {planned} particles, and the state has {given}")]
    Count {
        /// Particles of the plan.
        planned: usize,
        /// Particles of the state.
        given: usize,
    },
    /// The numbers failed; the state before this frame stands.
    #[error("frame {frame}: {what}")]
    Numbers {
        /// Output frame that could not be computed.
        frame: u32,
        /// What was seen, with the figure.
        what: String,
    },
}
