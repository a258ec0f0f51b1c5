//! Buffers that FLIP has beside the projection's own.
//!
//! "Cells" are arrays of 512 values a brick slot, slot 0 zeros; "planes" are three such arrays one after the other, a
//! component each, of the cells' lower faces.

use crate::params::{DeviceBrick, FlipParams, Inlets, SolidGrids, SurveyHead};
use swell_gpu::buffer::{Buf, Windows, Workgroups};

pub use crate::buffers::*;

/// What a substep's passes know.
pub const PARAMS: Buf<FlipParams> = Buf::uniform("params");
/// Number of an axis.
pub const AXES: Windows<[u32; 4]> = Windows::new("axis", "axes");
/// Number of a layer that velocities are carried outward to.
pub const LAYERS: Windows<[u32; 4]> = Windows::new("layer", "layers");
/// Of passes over cells of water, over cells within reach too, and over each further layer.
pub const GROUPS: Buf<Workgroups> = Buf::new("groups");
/// What the host needs to choose a step.
pub const SURVEY: Buf<SurveyHead> = Buf::new("survey");
/// Whether a brick of the domain holds water, behind [`SURVEY`].
pub const SURVEY_IS_WET: Buf<u32> = Buf::behind::<SurveyHead>("survey");
/// Records of the bricks, one a slot.
pub const BRICKS: Buf<DeviceBrick> = Buf::new("bricks");
/// Slot of each brick of the domain, 0 where there is none.
pub const BRICK_SLOT: Buf<u32> = Buf::new("brick_slot");

/// Position of each particle, in sorted order.
pub const SORTED_POSITION: Buf<[f32; 3]> = Buf::new("sorted_position");
/// Nine slopes a particle, in storage order, 1/s; with APIC alone.
pub const AFFINE: Buf<f32> = Buf::new("affine");
/// The same in sorted order.
pub const SORTED_AFFINE: Buf<f32> = Buf::new("sorted_affine");
/// Velocity that moves each particle, in sorted order, m/s.
pub const CARRIED: Buf<[f32; 3]> = Buf::new("carried");
/// Displacement of each particle by the density correction and by what pushes it apart from others, in sorted order, metres;
/// with one of them alone.
pub const PUSHED: Buf<[f32; 3]> = Buf::new("pushed");

/// Sums over a cell's particles for the 18 faces of one component that they reach, in planes of cells with water: momentum for the
/// nine before the cell and the nine after it, and the same of weights. Then weights for the 27 centres that they reach: in the first
/// of these for the layer after the cell, in the last two for the one before it and its own.
pub const PARTIAL_SUMS: [Buf<f32>; 4] = [
    Buf::new("momentum_before"),
    Buf::new("momentum_after"),
    Buf::new("weight_before"),
    Buf::new("weight_after"),
];
/// Planes, m/s; a face that is closed holds the solid's velocity.
pub const FACE_VELOCITY: Buf<f32> = Buf::new("face_velocity");
/// Planes: the velocity before forces and projection, then what these changed, m/s.
pub const FACE_CHANGE: Buf<f32> = Buf::new("face_change");
/// Planes: open fraction, 0 to 1.
pub const FACE_OPEN: Buf<f32> = Buf::new("face_open");
/// Cells: layer of each of the three lower faces, packed.
pub const FACE_LAYER: Buf<u32> = Buf::new("face_layer");
/// Cells: air, fluid or solid, as `domain::poisson` numbers them.
pub const CELL_KIND: Buf<u32> = Buf::new("cell_kind");
/// Cells: Σ ± (1 − f) u_solid over the six faces, outward positive, m/s.
pub const SOLID_FLUX: Buf<f32> = Buf::new("solid_flux");
/// Cells: density over what it is to be, − 1; with the density correction alone.
pub const DENSITY_EXCESS: Buf<f32> = Buf::new("density_excess");
/// Cells: metres to the surface, negative in water; with the ghost-fluid surface alone.
pub const LIQUID_DISTANCE: Buf<f32> = Buf::new("liquid_distance");
/// Cells: open fraction of the volume; with solids alone.
pub const OPEN_VOLUME: Buf<f32> = Buf::new("open_volume");
/// Cells: part of the hat about the centre that solids leave of what walls do; with solids alone.
pub const OPEN_HATS: Buf<f32> = Buf::new("open_hats");
/// Planes: velocity of what closes a face, m/s; with solids that move alone.
pub const CLOSED_VELOCITY: Buf<f32> = Buf::new("closed_velocity");
/// Rooms in which water enters; with emitters that have a velocity alone.
pub const INLETS: Buf<Inlets> = Buf::uniform("inlets");
/// Where the nodes of all solids stand, and how they move.
pub const SOLID_GRIDS: Buf<SolidGrids> = Buf::uniform("solid_grids");
