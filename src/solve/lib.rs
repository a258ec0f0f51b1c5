//! GPU solvers: position-based fluids (PBF), FLIP, the pressure projection, effects and whitewater.

mod air;
pub mod boundary;
pub mod buffers;
mod by_method;
pub mod effects;
pub mod flip;
mod grid;
pub mod params;
pub mod pbf;
pub mod plan;
pub mod pressure;
mod state;
pub mod trace;
pub mod whitewater;

use swell_domain::budget::Breach;
use swell_gpu::{adapter::GpuError, buffer::Mirror, reflect::Layout};
use swell_scene::moving_solid::OtherBodies;

use params::{
    Counters, DeviceForce, DeviceTurn, FlipParams, Inlets, IterationControl, Params, Phase,
    PosedSolid, PosedSolids, SolidGrid, SurveyHead,
};
use pressure::{
    PocketPart, PressureBrick, PressureControl, PressureControl64, PressurePhase, PressureStats,
};

/// Returns the host-side layouts of all structs shared with the shaders, under their WGSL names.
pub fn mirrors() -> Vec<Layout> {
    vec![
        Params::layout(),
        Phase::layout(),
        FlipParams::layout(),
        SolidGrid::layout(),
        DeviceForce::layout(),
        DeviceTurn::layout(),
        PosedSolid::layout(),
        PosedSolids::layout(),
        Inlets::layout(),
        Counters::layout(),
        IterationControl::layout(),
        SurveyHead::layout(),
        params::DeviceBrick::layout(),
        pressure::bodies::DeviceBody::layout(),
        pressure::bodies::DeviceBody::layout(),
        pressure::bodies::BodyPair::layout(),
        PressurePhase::layout(),
        PressureControl::layout(),
        PressureControl64::layout(),
        PressureStats::layout(),
        PressureBrick::layout(),
        PocketPart::layout(),
    ]
}

/// Error that ends a solve.
#[derive(Debug, thiserror::Error)]
pub enum SolveError {
    /// A GPU operation failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The particle count of the state differs from the count that the solver was built for.
    #[error("the solver holds {planned} particles, and the state has {given}")]
    Count {
        /// Particles that the solver was built for.
        planned: usize,
        /// Particles of the state.
        given: usize,
    },
    /// The number of bodies of the state is not the scene's.
    #[error(transparent)]
    Bodies(#[from] OtherBodies),
    /// The frame has fewer substeps than the requested one.
    #[error("substep {asked} was requested, but the frame after frame {frame} has {count}")]
    NoSubstep {
        /// Requested substep, counted from 1.
        asked: u32,
        /// Number of the frame before the traced one.
        frame: u32,
        /// Substeps that the frame has.
        count: u32,
    },
    /// A numerical budget was exceeded; the state from before this frame is kept.
    #[error(transparent)]
    Numbers(#[from] Breach),
}
