//! Buffers of the renderer, and what each holds.

use super::uniform::{
    Band, Block, Camera, Caustics, Cloud, Fill, Flow, FlowLevel, Material, Narrow, Page, Particle,
    Path, Rays, Sea, SetNode, Shading, Shape, SprayParams, Thickness, Tile, Triangle, Whitewater,
    WhitewaterParams,
};
use swell_gpu::buffer::{Buf, Windows, Workgroups};

/// The camera of the sample that is drawn.
pub(super) const CAMERA: Buf<Camera> = Buf::uniform("camera");
/// That of the frame after.
pub(super) const NEXT_CAMERA: Buf<Camera> = Buf::uniform("next_camera");
/// Light, water and set.
pub(super) const SHADING: Buf<Shading> = Buf::uniform("shading");
/// Colours of materials.
pub(super) const PALETTE: Buf<[f32; 4]> = Buf::uniform("palette");
/// Materials of solids.
pub(super) const MATERIALS: Buf<Material> = Buf::uniform("materials");
/// The sea beyond the box.
pub(super) const SEA: Buf<Sea> = Buf::uniform("sea");
/// Its waves, and the heights of its edge.
pub(super) const SEA_VALUES: Buf<[f32; 4]> = Buf::new("sea_values");
/// From the world to the shadow map.
pub(super) const SHADOW_FROM_WORLD: Buf<[[f32; 4]; 4]> = Buf::uniform("shadow_from_world");

/// What is opaque.
pub(super) const TRIANGLES: Buf<Triangle> = Buf::new("triangles");
/// Corner and size of each tile in which solids are drawn.
pub(super) const TILES: Windows<Tile> = Windows::new("tile", "tiles");
/// Depth of the solids, of each pixel of the padded frame.
pub(super) const SOLID_DEPTH: Buf<f32> = Buf::new("solid_depth");
/// Their normals and materials.
pub(super) const SOLID_PACKED: Buf<u32> = Buf::new("solid_packed");

/// Particles of a frame that may be seen.
pub(super) const PARTICLES: Buf<Particle> = Buf::new("particles");
/// How each of them goes about the frame's instant.
pub(super) const PATHS: Buf<Path> = Buf::new("paths");
/// What each of them is splatted as.
pub(super) const SHAPES: Buf<Shape> = Buf::new("shapes");
/// Which of them each dispatch sees.
pub(super) const PAGES: Windows<Page> = Windows::new("page", "pages");
/// How many particles hold air, and which: those that spray is splatted of.
pub(super) const AIRED: Buf<u32> = Buf::new("aired");
/// Workgroups of a dispatch over those that hold air.
pub(super) const AIRED_GROUPS: Buf<Workgroups> = Buf::new("aired_groups");
/// Workgroups of a dispatch over all particles that may be seen.
pub(super) const PARTICLE_GROUPS: Buf<Workgroups> = Buf::new("particle_groups");
/// Blocks of water that stand for particles which other water hides.
pub(super) const BLOCKS: Buf<Block> = Buf::new("blocks");
/// Workgroups of a dispatch over them.
pub(super) const BLOCK_GROUPS: Buf<Workgroups> = Buf::new("block_groups");
/// What a particle adds to thickness.
pub(super) const THICKNESS_PARAMS: Buf<Thickness> = Buf::uniform("thickness_params");
/// Length of the line of sight in water, at half the resolution on both sides.
pub(super) const THICKNESS: Buf<u32> = Buf::new("thickness");
/// Aerated water and whitewater before the surface: planes of the frame at half the resolution on both sides.
pub(super) const SPRAY: Buf<u32> = Buf::new("spray");
/// What stands in these sums.
pub(super) const SPRAY_PARAMS: Buf<SprayParams> = Buf::uniform("spray_params");
/// Spray, foam and bubbles of a frame.
pub(super) const WHITEWATER: Buf<Whitewater> = Buf::new("whitewater");
/// How they are drawn.
pub(super) const WHITEWATER_PARAMS: Buf<WhitewaterParams> = Buf::uniform("whitewater_params");
/// Workgroups of a dispatch of a thread for each.
pub(super) const WHITEWATER_GROUPS: Buf<Workgroups> = Buf::new("whitewater_groups");
/// Whose sphere is the nearest, of each pixel.
pub(super) const OWNER: Buf<u32> = Buf::new("owner");

/// Depths of the water, of each pixel of the padded frame: splats go into the first, and smoothing goes to and fro.
pub(super) const DEPTHS: [Buf<f32>; 2] = [Buf::new("depth"), Buf::new("smoothed_depth")];
/// Settings of the curvature flow.
pub(super) const FLOW: Buf<Flow> = Buf::uniform("flow");
/// Level and number of each of its dispatches.
pub(super) const FLOW_LEVELS: Windows<FlowLevel> = Windows::new("level", "flow_levels");
/// Settings of the narrow-range filter, of each axis.
pub(super) const NARROW_RANGE: Windows<Narrow> = Windows::new("params", "narrow_range");

/// Where the map of bent sunlight lies, and the rays that it is made from.
pub(super) const CAUSTICS: Buf<Caustics> = Buf::uniform("caustics");
/// Where each of them comes into the water: normal, and distance.
pub(super) const SUN_RAYS: Buf<[f32; 4]> = Buf::new("sun_rays");
/// Where each of them lands in the map, with its light and layer.
pub(super) const SUN_HITS: Buf<[f32; 4]> = Buf::new("sun_hits");
/// Sums of the light in each texel, in fixed point.
pub(super) const LIGHT_SUMS: Buf<u32> = Buf::new("light_sums");

/// Box, bricks and set of the rays.
pub(super) const RAYS: Buf<Rays> = Buf::uniform("rays");
/// What the level set says of each brick.
pub(super) const LEVEL_TABLE: Buf<u32> = Buf::new("level_table");
/// Its values, brick by brick.
pub(super) const LEVEL_VALUES: Buf<f32> = Buf::new("level_values");
/// Metres that sunlight has gone through water, on a coarse lattice.
pub(super) const SUN_PATHS: Buf<f32> = Buf::new("sun_paths");
/// Grid of drops and bubbles.
pub(super) const CLOUD: Buf<Cloud> = Buf::uniform("cloud");
/// Its table, the lattice of optical depths towards the sun, and its values, brick by brick.
pub(super) const CLOUD_WORDS: Buf<u32> = Buf::new("cloud_words");
/// Depth of what each ray meets first, before which drops are splatted.
pub(super) const FIRST_DEPTH: Buf<f32> = Buf::new("first_depth");
/// Tree over what is opaque.
pub(super) const SET_NODES: Buf<SetNode> = Buf::new("set_nodes");
/// Its triangles, leaf by leaf.
pub(super) const SET_TRIANGLES: Buf<Triangle> = Buf::new("set_triangles");

/// Rows of each band of the picture.
pub(super) const BANDS: Windows<Band> = Windows::new("band", "bands");
/// Word and count of each fill.
pub(super) const FILLS: Windows<Fill> = Windows::new("params", "fills");

/// Tiles of a part of the frame, by whether there is water in them.
pub(super) fn tiles(part: &str) -> Buf<u32> {
    Buf::named(format!("tiles.{part}"))
}

/// Workgroups of dispatches over those with water, and over the others.
pub(super) fn tile_groups(part: &str) -> Buf<Workgroups> {
    Buf::named(format!("tile_groups.{part}"))
}

/// A band of the picture: linear radiance and coverage, and behind them, for each pixel, the parts of the light that are asked for.
pub(super) fn picture(band: usize) -> Buf<[f32; 4]> {
    Buf::named(format!("picture.{band}"))
}

/// A band of what a sample sees first: its code, and the bits of the part of it that spray covers.
pub(super) fn objects(band: usize) -> Buf<[u32; 2]> {
    Buf::named(format!("objects.{band}"))
}

/// A band of the channels beside it: Z, N, P, forward, thickness.
pub(super) fn aovs(band: usize) -> Buf<[f32; 10]> {
    Buf::named(format!("aovs.{band}"))
}
