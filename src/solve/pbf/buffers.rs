//! Buffers that only PBF has.

use crate::params::{IterationControl, Params, Phase};
use swell_gpu::buffer::{Buf, Windows};

pub use crate::buffers::*;

/// Parameters of a substep.
pub const PARAMS: Buf<Params> = Buf::uniform("params");
/// The particles that a dispatch handles.
pub const PHASES: Windows<Phase> = Windows::new("phase", "phases");
/// Positions in sorted order with λ in w, m²; then boundary samples with their weight in w, sorted
/// by cell; then a dummy particle far from everything. If one binding cannot hold them all, the
/// entries from [`Plan::page`](crate::plan::Plan::page) on are in [`PREDICTED_HIGH`].
pub const PREDICTED: Buf<[f32; 4]> = Buf::new("predicted");
/// See [`PREDICTED`].
pub const PREDICTED_HIGH: Buf<[f32; 4]> = Buf::new("predicted_high");
/// Predicted positions in storage order; after the sort the corrected positions of an iteration, in
/// sorted order. With the Chebyshev semi-iteration, pbf/exchange then leaves the positions from
/// before the correction here.
pub const CORRECTED: Buf<[f32; 3]> = Buf::new("corrected");
/// Position at the substep's start, in sorted order.
pub const START_POSITION: Buf<[f32; 3]> = Buf::new("start_position");
/// Neighbours of the particles of a chunk, in blocks of particles, four neighbours per value; a
/// shader variable.
pub const NEIGHBOR_LIST: Buf<[u32; 4]> = Buf::new("neighbor_list");
/// Number of neighbours of each particle, in sorted order. If it exceeds the list's capacity,
/// passes search the cells for this particle.
pub const NEIGHBOR_COUNT: Buf<u32> = Buf::new("neighbor_count");
/// State of the iteration to a density error.
pub const CONTROL: Buf<IterationControl> = Buf::new("control");
/// Sums of the density errors of 256 particles each.
pub const ERROR_SUMS: Buf<f32> = Buf::new("error_sums");
/// Σ λ over the iterations of a substep, in sorted order, m². With moving walls or solids it is
/// behind [`WALL_WORK`]: see [`lambda_sum`].
pub const LAMBDA_SUM: Buf<f32> = Buf::new("lambda_sum");
/// Work by moving walls on each particle, in two parts: by its corrections and by its prediction.
/// [`LAMBDA_SUM`] follows where it is needed.
pub const WALL_WORK: Buf<f32> = Buf::new("wall_work");

/// Returns [`LAMBDA_SUM`] of `n` particles, where it is with or without walls or solids that move.
pub fn lambda_sum(has_movers: bool, n: usize) -> Buf<f32> {
    match has_movers {
        true => WALL_WORK.after(2 * n),
        false => LAMBDA_SUM,
    }
}

/// Index of the first boundary sample of each cell, and finally the number of samples.
pub const BOUNDARY_CELL_START: Buf<u32> = Buf::new("boundary_cell_start");

/// Returns the buffer with the lists of one chunk's particles, which [`NEIGHBOR_LIST`] is bound to.
pub fn list_of(chunk: usize) -> Buf<[u32; 4]> {
    Buf::named(format!("{}.{chunk}", NEIGHBOR_LIST.name()))
}
