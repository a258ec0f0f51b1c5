//! PIC/FLIP (Zhu and Bridson 2005) and APIC (Jiang et al. 2015), the same model as on the GPU.
//!
//! Positions are relative to the domain's minimum corner, in metres. Grids use the same bricks as
//! on the GPU, so that arrays compare element by element; faces are stored as one vector per cell
//! (see [`planes`]). A function with the name of a GPU pass is its reference pass; where the GPU
//! splits a pass for speed, one function covers both halves. [`Flip`] runs whole frames.

mod bodies;
mod contraction;
mod deep;
pub mod effects;
mod forces;
mod gaps;
mod grid;
mod model;
mod pressure;
mod projection;
mod rotation;
mod solids;
mod solver;
mod sort;
mod state;
mod to_grid;
mod to_particles;
mod trace;
mod wall_friction;
mod water;

pub use bodies::{BodyCells, carry_bodies, couple_bodies};
pub use contraction::{MOST, find_contraction};
pub use deep::{DeepCells, Motion, carry_deep, fill_deep, place_deep};
pub use forces::{push_drops, push_faces, work_by_cells};
pub use gaps::{Unprojected, close_gaps};
pub use grid::planes;
pub use model::{FlipSubstep, Model};
pub use pressure::{Waters, density_source};
pub use projection::Projected;
pub use rotation::{grid_confinement, grid_curl};
pub use solids::Solid;
pub use solver::Flip;
pub use sort::{Cloud, Sorted, Survey, assign_cells, reorder, survey};
pub use to_grid::{Faces, OpenSpace, cut_cells, gather_faces, growth_over};
pub use to_particles::{
    GridTransfer, Moved, Paths, advect, aim, extrapolate, find_change, grid_to_particle, push_apart,
};
pub use trace::Trace;
pub use wall_friction::{friction_rates, wall_friction};
pub use water::{
    Centers, Depth, LEAST_FILM, Sensitivity, find_buried, find_depth, find_excess, find_water,
    gather_centers, is_filling, is_near_half, let_in, sensitivity,
};
