//! Buffers that both solvers have. Positions are metres from the domain's least corner, velocities m/s.

use swell_gpu::buffer::Buf;

pub use swell_gpu::sort::{CELL_OF, CELL_START, ELEMENT_COUNT, ID, ORDER, PLACED, SLOT_IN_CELL};

use super::params::{Counters, SolidGrid};

/// x, y, z of each particle, in storage order.
pub const POSITION: Buf<[f32; 3]> = Buf::new("position");
/// Of each particle, in storage order.
pub const VELOCITY: Buf<[f32; 3]> = Buf::new("velocity");
/// Id of each particle, in sorted order.
pub const SORTED_ID: Buf<u32> = Buf::new("sorted_id");
/// A word for the place of each particle, in sorted order, in steps of 1/256 of h or of a cell (shared/place.wgsl).
pub const PLACE: Buf<u32> = Buf::new("place");
/// Of each particle, in sorted order.
pub const SORTED_VELOCITY: Buf<[f32; 3]> = Buf::new("sorted_velocity");
/// 1 of each particle that is a drop, far from all water that has a pressure on the grid, else 0; in storage order. Not where
/// PBF has no grid.
pub const IS_DROP: Buf<u32> = Buf::new("is_drop");
/// Density over the rest density: of each particle in sorted order (PBF), or of each cell, 0 without water (FLIP).
pub const DENSITY: Buf<f32> = Buf::new("density");
/// What passes count over a frame.
pub const COUNTERS: Buf<Counters> = Buf::new("counters");
/// Sums over workgroups of what moving walls did: of PBF over a frame, over mass / Δt; of FLIP over a substep, over
/// Δx² Δt, W/m².
pub const BOUNDARY_WORK: Buf<f32> = Buf::new("boundary_work");
/// Signed distance at the nodes of the solids' grids, one grid after the other, x fastest, metres.
pub const SOLID_DISTANCE: Buf<f32> = Buf::new("solid_distance");
/// Where the nodes of solids that do not move stand.
pub const SOLID_GRID: Buf<SolidGrid> = Buf::uniform("solid_grid");
