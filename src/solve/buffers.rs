//! Buffers that both solvers have. Positions in metres from the domain's minimum corner, velocities
//! in m/s.

use swell_gpu::buffer::Buf;

pub use swell_gpu::sort::{CELL_OF, CELL_START, ELEMENT_COUNT, ID, ORDER, PLACED, SLOT_IN_CELL};

use super::params::{Counters, PosedSolids, SolidGrid};

/// Position of each particle, in storage order.
pub const POSITION: Buf<[f32; 3]> = Buf::new("position");
/// Velocity of each particle, in storage order.
pub const VELOCITY: Buf<[f32; 3]> = Buf::new("velocity");
/// Ids in sorted order, which follow those of `n` particles in storage order.
pub fn sorted_id(n: usize) -> Buf<u32> {
    ID.after(n)
}
/// Quantized position of each particle in one word, in sorted order, in steps of 1/256 of h or of a
/// cell (shared/place.wgsl).
pub const PLACE: Buf<u32> = Buf::new("place");
/// Velocity of each particle, in sorted order.
pub const SORTED_VELOCITY: Buf<[f32; 3]> = Buf::new("sorted_velocity");
/// 1 for each particle that is an isolated droplet, far from all water with a pressure on the grid,
/// else 0; in storage order, and behind that in sorted order. Exists only in PBF with a grid.
pub const IS_DROP: Buf<f32> = Buf::new("is_drop");
/// Relative density ρ/ρ0: per particle in sorted order (PBF), or per cell, 0 without water (FLIP).
pub const DENSITY: Buf<f32> = Buf::new("density");
/// Events that passes count over a frame.
pub const COUNTERS: Buf<Counters> = Buf::new("counters");
/// Partial sums per workgroup of the work by moving walls: for PBF over a frame, divided by mass /
/// Δt; for FLIP over a substep, divided by Δx² Δt, W/m².
pub const BOUNDARY_WORK: Buf<f32> = Buf::new("boundary_work");
/// Signed distances at the nodes of all solids' grids, one grid after another, x fastest, metres.
/// Of a solid whose shape changes they are those at the substep's start, and behind them are those
/// at its end, and the velocities of the surface, three floats a node, m/s. With PBF and moving
/// solids the velocities of boundary samples follow.
pub const SOLID_DISTANCE: Buf<f32> = Buf::new("solid_distance");
/// Geometry of the static solids' signed-distance grid.
pub const SOLID_GRID: Buf<SolidGrid> = Buf::uniform("solid_grid");
/// Geometry and motion of all solids' signed-distance grids.
pub const POSED_SOLIDS: Buf<PosedSolids> = Buf::uniform("posed_solids");
/// Velocities behind the first `floats` of [`SOLID_DISTANCE`], m/s: of the surface of a solid whose
/// shape changes, at each node, or of each boundary sample of PBF.
pub fn velocities_behind(floats: usize) -> Buf<[f32; 3]> {
    SOLID_DISTANCE.after(floats).retyped()
}
