//! Buffers of FLIP, without those of the projection.
//!
//! "Cells" are arrays with 512 values per brick slot, all zero in slot 0. "Planes" are three such
//! arrays in sequence, one per component, with a value for the lower face of each cell.

use crate::params::{DeviceBrick, FlipParams, Inlets, SurveyHead};
use swell_gpu::buffer::{Buf, Windows};

pub use crate::{
    buffers::*,
    grid::{FACE_VELOCITY, GROUPS},
};

/// Parameters of a substep.
pub const PARAMS: Buf<FlipParams> = Buf::uniform("params");
/// Index of the axis that a dispatch works on.
pub const AXES: Windows<[u32; 4]> = Windows::new("axis", "axes");
/// Index of the layer that velocities are extrapolated to.
pub const LAYERS: Windows<[u32; 4]> = Windows::new("layer", "layers");
/// Data from which the host chooses the length of a substep.
pub const SURVEY: Buf<SurveyHead> = Buf::new("survey");
/// Whether each brick of the domain holds water; stored behind [`SURVEY`].
pub const SURVEY_IS_WET: Buf<u32> = Buf::behind::<SurveyHead>("survey");
/// Topology of the bricks, one record per slot.
pub const BRICKS: Buf<DeviceBrick> = Buf::new("bricks");
/// Slot of each brick of the domain; 0 if the brick is absent.
pub const BRICK_SLOT: Buf<u32> = Buf::new("brick_slot");

/// Position of each particle, in sorted order.
pub const SORTED_POSITION: Buf<[f32; 3]> = Buf::new("sorted_position");
/// 1 for each of `n` particles that is an isolated droplet, far from all water with a pressure,
/// else 0; in sorted order, behind [`SORTED_VELOCITY`].
pub fn is_drop(n: usize) -> Buf<f32> {
    SORTED_VELOCITY.after(n).retyped()
}
/// Nine velocity gradients per particle, in storage order, 1/s. APIC only.
pub const AFFINE: Buf<f32> = Buf::new("affine");
/// Nine velocity gradients per particle, in sorted order, 1/s. APIC only.
pub const SORTED_AFFINE: Buf<f32> = Buf::new("sorted_affine");
/// Velocity that advects each particle, in sorted order, m/s. If particles are pushed apart, their
/// displacements by the density correction and by the repulsion between close particles follow,
/// metres.
pub const CARRIED: Buf<[f32; 3]> = Buf::new("carried");

/// Sums over the particles of a cell, in planes of cells with water. For the 18 faces of one
/// component that the particles reach: momentum for the nine faces before the cell and the nine
/// after it, and the same for weights. Later the arrays hold weights for the 27 cell centres that
/// the particles reach: the first array those of the layer after the cell, the last two those of
/// the layer before it and of its own layer.
pub const PARTIAL_SUMS: [Buf<f32>; 4] = [
    Buf::new("momentum_before"),
    Buf::new("momentum_after"),
    Buf::new("weight_before"),
    Buf::new("weight_after"),
];
/// Planes: displacement of water by the density correction, metres; 0 on faces that are closed or
/// touch no water. Follows three planes of `stride` velocities.
pub fn face_displacement(stride: usize) -> Buf<f32> {
    FACE_VELOCITY.after(3 * stride)
}
/// Planes: first the velocity before forces and projection, then the change by these, m/s.
pub const FACE_CHANGE: Buf<f32> = Buf::new("face_change");
/// Planes: open fraction of the face, 0 to 1.
pub const FACE_OPEN: Buf<f32> = Buf::new("face_open");
/// Cells: extrapolation layer of each of the three lower faces, packed.
pub const FACE_LAYER: Buf<u32> = Buf::new("face_layer");
/// Cells: air, fluid or solid, numbered as in `domain::poisson`.
pub const CELL_KIND: Buf<u32> = Buf::new("cell_kind");
/// Cells: Σ ± (1 − f) u_solid over the six faces with open fraction f, outward positive, m/s.
pub const SOLID_FLUX: Buf<f32> = Buf::new("solid_flux");
/// Cells: flux that makes up for the contraction of water on straight paths, m/s. Follows `stride`
/// values of [`SOLID_FLUX`], unless the domain turns or another solver moves the particles.
pub fn contraction(stride: usize) -> Buf<f32> {
    SOLID_FLUX.after(stride)
}
/// Slots: weight of the midpoint rule in particles' paths by the strain before forces, 0 to 1, as
/// a float's bits. Exists with [`contraction`].
pub const STRAIN_BEND: Buf<u32> = Buf::new("strain_bend");
/// Slots: that part by the projected velocities as well. Follows the slots of all `bricks` in
/// [`BRICK_SLOT`]; exists with [`contraction`].
pub fn path_bend(bricks: usize) -> Buf<f32> {
    BRICK_SLOT.after(bricks).retyped()
}
/// Cells: density over target density, minus 1. Exists only with the density correction.
pub const DENSITY_EXCESS: Buf<f32> = Buf::new("density_excess");
/// Cells: signed distance to the surface, metres, negative in water. Exists only with the
/// ghost-fluid surface.
pub const LIQUID_DISTANCE: Buf<f32> = Buf::new("liquid_distance");
/// Cells: open fraction of the volume. Exists only with solids.
pub const OPEN_VOLUME: Buf<f32> = Buf::new("open_volume");
/// Cells: integral of the hat function around the cell's centre over the open volume, as a fraction
/// of the integral with walls only. Exists only with solids.
pub const OPEN_HATS: Buf<f32> = Buf::new("open_hats");
/// Cells that solids cut: the same of the hat's four layers, half a cell thick, from the lowest up,
/// as two pairs of 16 bits. Exists only with solids.
pub const OPEN_LAYERS: Buf<[u32; 2]> = Buf::new("open_layers");
/// Planes: weight of the face in the transfer to particles: its open fraction, or, where a solid
/// closes it, how much it faces the solid. Exists only with solids.
pub const FACE_WEIGHT: Buf<f32> = Buf::new("face_weight");
/// Planes: velocity of the solid that closes a face, m/s. Exists only with moving solids.
pub const CLOSED_VELOCITY: Buf<f32> = Buf::new("closed_velocity");
/// Velocity and depth of the water that has moved, ready for the next substep: by brick with water,
/// in the layout of the substep before, the three components on the least faces, m/s, and the depth
/// of the centres below the free surface, cells. Exists only with a band.
pub const DEEP: Buf<f32> = Buf::new("deep");
/// Slot of each brick in the layout of [`DEEP`]; 0 where it was not. Exists only with a band.
pub const DEEP_SLOT: Buf<u32> = Buf::new("deep_slot");
/// Cells: depth below the free surface, cells; 0 where it is not known. Exists only with a band.
pub const DEEP_DEPTH: Buf<f32> = Buf::new("deep_depth");
/// Values of [`DEEP`] for each cell.
pub const DEEP_VALUES: usize = 4;
/// Boxes where water enters. Exists only with emitters that have a velocity.
pub const INLETS: Buf<Inlets> = Buf::uniform("inlets");
