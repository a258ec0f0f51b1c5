//! Buffers that PBF alone has.

use crate::params::{IterationControl, Params, Phase};
use swell_gpu::buffer::{Buf, Windows};

pub use crate::buffers::*;

/// What a substep's passes know.
pub const PARAMS: Buf<Params> = Buf::uniform("params");
/// Which particles a dispatch handles, and where their neighbours stand.
pub const PHASES: Windows<Phase> = Windows::new("phase", "phases");
/// Positions in sorted order with λ in w, m²; then boundary samples with their weight in w, by cell; then a particle that is far
/// from everything. Where one binding does not hold them all, those from [`Plan::page`](crate::plan::Plan::page) on stand in
/// [`PREDICTED_HIGH`].
pub const PREDICTED: Buf<[f32; 4]> = Buf::new("predicted");
/// See [`PREDICTED`].
pub const PREDICTED_HIGH: Buf<[f32; 4]> = Buf::new("predicted_high");
/// Predicted positions in storage order; after the sort what an iteration corrects positions to, in sorted order, and with the
/// Chebyshev semi-iteration, once these are taken over, what they were before.
pub const CORRECTED: Buf<[f32; 3]> = Buf::new("corrected");
/// Position at the substep's start, in sorted order.
pub const START_POSITION: Buf<[f32; 3]> = Buf::new("start_position");
/// [`IS_DROP`] in sorted order.
pub const SORTED_IS_DROP: Buf<u32> = Buf::new("sorted_is_drop");
/// Neighbours of the particles of a chunk, in blocks of particles, fours of neighbours together; a shader variable.
pub const NEIGHBOR_LIST: Buf<[u32; 4]> = Buf::new("neighbor_list");
/// Neighbours of each particle, in sorted order; more than a list holds where it has to be searched for.
pub const NEIGHBOR_COUNT: Buf<u32> = Buf::new("neighbor_count");
/// The iteration until a density error.
pub const CONTROL: Buf<IterationControl> = Buf::new("control");
/// Density errors of 256 particles each, summed.
pub const ERROR_SUMS: Buf<f32> = Buf::new("error_sums");
/// Σ λ over a substep's iterations, in sorted order, m².
pub const LAMBDA_SUM: Buf<f32> = Buf::new("lambda_sum");
/// What moving walls did to each particle: in two halves, of its prediction and of its corrections.
pub const WALL_WORK: Buf<f32> = Buf::new("wall_work");
/// Where the boundary samples of each cell begin among them, and how many there are in all.
pub const BOUNDARY_CELL_START: Buf<u32> = Buf::new("boundary_cell_start");

/// Of each boundary sample, m/s.
pub const SAMPLE_VELOCITY: Buf<[f32; 3]> = Buf::new("sample_velocity");

/// The lists of a chunk's particles, which [`NEIGHBOR_LIST`] is bound to.
pub fn list_of(chunk: usize) -> Buf<[u32; 4]> {
    Buf::named(format!("{}.{chunk}", NEIGHBOR_LIST.name()))
}
