//! GPU buffers of the renderer.

use super::uniform::{
    Band, Block, Camera, Carried, Caustics, Cloud, Fill, Flow, FlowLevel, Material, Moment, Narrow,
    Page, Particle, Path, Rays, Sea, SetNode, Shading, Shape, SprayParams, Thickness, Tile,
    Triangle, Whitewater, WhitewaterParams,
};
use swell_gpu::buffer::{Buf, Windows, Workgroups};

/// Camera of the current sample.
pub(super) const CAMERA: Buf<Camera> = Buf::uniform("camera");
/// Moments of the current sample's rays, where the shutter is open and rays are cast.
pub(super) const MOMENTS: Buf<Moment> = Buf::uniform("moments");
/// Camera of the next frame, for motion vectors.
pub(super) const NEXT_CAMERA: Buf<Camera> = Buf::uniform("next_camera");
/// Lights, water and scene settings of shading.
pub(super) const SHADING: Buf<Shading> = Buf::uniform("shading");
/// Colours of materials.
pub(super) const PALETTE: Buf<[f32; 4]> = Buf::uniform("palette");
/// Materials of solids.
pub(super) const MATERIALS: Buf<Material> = Buf::uniform("materials");
/// Settings of the sea beyond the simulated box.
pub(super) const SEA: Buf<Sea> = Buf::uniform("sea");
/// Wave components of the sea, then the heights along the box's edge.
pub(super) const SEA_VALUES: Buf<[f32; 4]> = Buf::new("sea_values");
/// Transform from world space to the shadow map.
pub(super) const SHADOW_FROM_WORLD: Buf<[[f32; 4]; 4]> = Buf::uniform("shadow_from_world");

/// Triangles of opaque geometry.
pub(super) const TRIANGLES: Buf<Triangle> = Buf::new("triangles");
/// Motion of solids and wave makers to the next frame.
pub(super) const CARRIED: Buf<Carried> = Buf::uniform("carried");
/// Corner and size of each tile in which solids are rasterised.
pub(super) const TILES: Windows<Tile> = Windows::new("tile", "tiles");
/// Depth of solids for each pixel of the padded frame.
pub(super) const SOLID_DEPTH: Buf<f32> = Buf::new("solid_depth");
/// Packed normal and material of solids for each pixel of the padded frame.
pub(super) const SOLID_PACKED: Buf<u32> = Buf::new("solid_packed");

/// Particles of the frame that may be visible.
pub(super) const PARTICLES: Buf<Particle> = Buf::new("particles");
/// Path of each particle about the frame's instant.
pub(super) const PATHS: Buf<Path> = Buf::new("paths");
/// Ellipsoid as which each particle is splatted.
pub(super) const SHAPES: Buf<Shape> = Buf::new("shapes");
/// Range of particles that each dispatch covers.
pub(super) const PAGES: Windows<Page> = Windows::new("page", "pages");
/// Number of particles that hold air, then their indices: the particles from which spray is
/// splatted.
pub(super) const AIRED: Buf<u32> = Buf::new("aired");
/// Workgroup counts of an indirect dispatch over the particles that hold air.
pub(super) const AIRED_GROUPS: Buf<Workgroups> = Buf::new("aired_groups");
/// Workgroup counts of an indirect dispatch over all particles that may be visible.
pub(super) const PARTICLE_GROUPS: Buf<Workgroups> = Buf::new("particle_groups");
/// Blocks of water that replace particles hidden behind other water.
pub(super) const BLOCKS: Buf<Block> = Buf::new("blocks");
/// Workgroup counts of an indirect dispatch over the blocks.
pub(super) const BLOCK_GROUPS: Buf<Workgroups> = Buf::new("block_groups");
/// Settings of the thickness that a particle adds.
pub(super) const THICKNESS_PARAMS: Buf<Thickness> = Buf::uniform("thickness_params");
/// Length of the line of sight in water, at half the resolution along both axes.
pub(super) const THICKNESS: Buf<u32> = Buf::new("thickness");
/// Aerated water and whitewater in front of the surface: planes of the frame at half the resolution
/// along both axes.
pub(super) const SPRAY: Buf<u32> = Buf::new("spray");
/// Layout of the planes of `SPRAY`.
pub(super) const SPRAY_PARAMS: Buf<SprayParams> = Buf::uniform("spray_params");
/// Spray, foam and bubbles of the frame.
pub(super) const WHITEWATER: Buf<Whitewater> = Buf::new("whitewater");
/// Settings with which whitewater is drawn.
pub(super) const WHITEWATER_PARAMS: Buf<WhitewaterParams> = Buf::uniform("whitewater_params");
/// Workgroup counts of an indirect dispatch with one thread per whitewater particle.
pub(super) const WHITEWATER_GROUPS: Buf<Workgroups> = Buf::new("whitewater_groups");
/// Index of the particle with the nearest sphere, for each pixel.
pub(super) const OWNER: Buf<u32> = Buf::new("owner");

/// Depth of the water for each pixel of the padded frame: splats go to the first buffer, and
/// smoothing alternates between the two.
pub(super) const DEPTHS: [Buf<f32>; 2] = [Buf::new("depth"), Buf::new("smoothed_depth")];
/// Settings of the curvature flow.
pub(super) const FLOW: Buf<Flow> = Buf::uniform("flow");
/// Level and iteration of each dispatch of the curvature flow.
pub(super) const FLOW_LEVELS: Windows<FlowLevel> = Windows::new("level", "flow_levels");
/// Settings of the narrow-range filter, one entry per axis.
pub(super) const NARROW_RANGE: Windows<Narrow> = Windows::new("params", "narrow_range");

/// Layout of the caustics map and of the sun rays it is made from.
pub(super) const CAUSTICS: Buf<Caustics> = Buf::uniform("caustics");
/// Entry of each sun ray into the water: normal and distance.
pub(super) const SUN_RAYS: Buf<[f32; 4]> = Buf::new("sun_rays");
/// Landing point of each sun ray in the map, with its light and layer.
pub(super) const SUN_HITS: Buf<[f32; 4]> = Buf::new("sun_hits");
/// Fixed-point sum of the light in each texel of the caustics map.
pub(super) const LIGHT_SUMS: Buf<u32> = Buf::new("light_sums");

/// Box, bricks and scene tree of ray casting.
pub(super) const RAYS: Buf<Rays> = Buf::uniform("rays");
/// Table of the level set's bricks; with an open shutter followed by the water's velocities.
pub(super) const LEVEL_TABLE: Buf<u32> = Buf::new("level_table");
/// Values of the level set, brick by brick.
pub(super) const LEVEL_VALUES: Buf<f32> = Buf::new("level_values");
/// Metres of water that sunlight passes through, on a coarse lattice; the caustics map follows it.
pub(super) const SUN_PATHS: Buf<f32> = Buf::new("sun_paths");
/// Grid of drops and bubbles, and columns of foam.
pub(super) const CLOUD: Buf<Cloud> = Buf::uniform("cloud");
/// Table of that grid, the lattice of optical depths towards the sun, the values brick by brick,
/// then the foam.
pub(super) const CLOUD_WORDS: Buf<u32> = Buf::new("cloud_words");
/// Depth of the first hit of each ray, in front of which drops are splatted.
pub(super) const FIRST_DEPTH: Buf<f32> = Buf::new("first_depth");
/// Bounding volume hierarchy over opaque geometry.
pub(super) const SET_NODES: Buf<SetNode> = Buf::new("set_nodes");
/// Triangles of the hierarchy, leaf by leaf.
pub(super) const SET_TRIANGLES: Buf<Triangle> = Buf::new("set_triangles");

/// Rows of each band of the picture.
pub(super) const BANDS: Windows<Band> = Windows::new("band", "bands");
/// Word and count of each fill.
pub(super) const FILLS: Windows<Fill> = Windows::new("params", "fills");

/// Tiles of a part of the frame in three lists: with water, with solids only, and with neither.
pub(super) fn tiles(part: &str) -> Buf<u32> {
    Buf::named(format!("tiles.{part}"))
}

/// Workgroup counts of indirect dispatches over these lists.
pub(super) fn tile_groups(part: &str) -> Buf<Workgroups> {
    Buf::named(format!("tile_groups.{part}"))
}

/// Band of the picture: linear radiance and coverage, followed for each pixel by the requested
/// light components.
pub(super) fn picture(band: usize) -> Buf<[f32; 4]> {
    Buf::named(format!("picture.{band}"))
}

/// Band of what a sample sees first: the code of the object and the bits of the fraction that spray
/// covers.
pub(super) fn objects(band: usize) -> Buf<[u32; 2]> {
    Buf::named(format!("objects.{band}"))
}

/// Band of the additional channels: Z, N, P, forward motion and thickness.
pub(super) fn aovs(band: usize) -> Buf<[f32; 10]> {
    Buf::named(format!("aovs.{band}"))
}
