//! Particle solvers on the GPU.

mod air;
pub mod boundary;
pub mod buffers;
pub mod effects;
pub mod flip;
pub mod params;
pub mod pbf;
pub mod plan;
pub mod pressure;
mod state;
pub mod trace;
pub mod whitewater;

use swell_domain::budget::Breach;
use swell_gpu::{adapter::GpuError, buffer::Mirror, reflect::Layout};

use params::{
    Counters, FlipParams, Inlets, IterationControl, Params, Phase, SolidGrid, SolidGrids,
    SurveyHead,
};
use pressure::{PressureBrick, PressureControl, PressureControl64, PressurePhase, PressureStats};

/// Every struct that the host and the shaders share, by the name that it has in WGSL.
pub fn mirrors() -> Vec<Layout> {
    vec![
        Params::layout(),
        Phase::layout(),
        FlipParams::layout(),
        SolidGrid::layout(),
        SolidGrids::layout(),
        Inlets::layout(),
        Counters::layout(),
        IterationControl::layout(),
        SurveyHead::layout(),
        params::DeviceBrick::layout(),
        PressurePhase::layout(),
        PressureControl::layout(),
        PressureControl64::layout(),
        PressureStats::layout(),
        PressureBrick::layout(),
    ]
}

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
    /// A substep that a frame does not have.
    #[error("substep {asked} was asked for, and the frame after frame {frame} has {count}")]
    NoSubstep {
        /// From 1.
        asked: u32,
        /// The frame before.
        frame: u32,
        /// Substeps that the frame has.
        count: u32,
    },
    /// The numbers failed; the state before this frame stands.
    #[error(transparent)]
    Numbers(#[from] Breach),
}
