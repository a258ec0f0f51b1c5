//! Rasterises opaque geometry into the frame and into the sun's shadow map.

use glam::{DVec3, Mat4, Vec3};
use wgpu::{CompareFunction, TextureFormat};

use super::buffers::{PALETTE, SHADOW_FROM_WORLD, SOLID_DEPTH, SOLID_PACKED, TILES, TRIANGLES};
use super::cryptomatte::{PALETTE as OWN_COLOURS, SOLIDS};
use super::frame::FAR;
use super::opaque::MOST_COLOURS;
use super::plan::{Limits, Plan};
use super::uniform::{Tile, Triangle};
use swell_gpu::{
    raster::{CopyTexture, DEPTH, Draw, RasterSpec, Target},
    recording::Command,
    texture::TextureSpec,
};

/// Margins of the shadow map around the shadow casters, and along the light's direction, relative
/// to the domain's longer horizontal side. Quay walls reach far and must be in the depth range even
/// in front of the box.
const SHADOW_MARGIN: f32 = 0.02;
const SHADOW_DEPTH: f32 = 2.4;

/// Texels along a side of the shadow map.
const SHADOW_SIZE: u32 = 2048;

/// Orthographic projection along the sun's direction that covers solids and the domain.
pub(super) fn shadow_from_world(
    triangles: impl Iterator<Item = Triangle>,
    domain: DVec3,
    sun: DVec3,
) -> Mat4 {
    let forward = -sun.as_vec3();
    let helper = if forward.y.abs() > 0.99 {
        Vec3::X
    } else {
        Vec3::Y
    };
    let right = forward.cross(helper).normalize();
    let up = right.cross(forward);
    let mut low = Vec3::splat(f32::INFINITY);
    let mut high = Vec3::splat(f32::NEG_INFINITY);
    let mut take = |p: Vec3| {
        let q = Vec3::new(p.dot(right), p.dot(up), p.dot(forward));
        low = low.min(q);
        high = high.max(q);
    };
    let size = domain.as_vec3();
    for i in 0..8u32 {
        let pick = |axis: u32, length: f32| if i >> axis & 1 == 1 { length } else { 0.0 };
        // The ground receives shadows; the domain's ceiling casts none.
        take(Vec3::new(
            pick(0, size.x),
            pick(1, 0.3 * size.y),
            pick(2, size.z),
        ));
    }
    let is_solid = |triangle: &Triangle| {
        triangle.code() == 0 || (SOLIDS..OWN_COLOURS).contains(&triangle.code())
    };
    for triangle in triangles.filter(is_solid) {
        for p in [triangle.a, triangle.b, triangle.c] {
            take(p.into());
        }
    }
    let extent = size.x.max(size.z);
    let margin = Vec3::splat(SHADOW_MARGIN * extent);
    let (low, high) = (low - margin, high + margin);
    let room = SHADOW_DEPTH * extent;
    let (near, far) = (low.z - room, high.z + room);
    let scale = 2.0 / (high - low);
    let row = |axis: Vec3, scale: f32, shift: f32| (axis * scale).extend(shift);
    Mat4::from_cols(
        row(right, scale.x, -0.5 * (low.x + high.x) * scale.x),
        row(up, scale.y, -0.5 * (low.y + high.y) * scale.y),
        row(forward, 1.0 / (far - near), -near / (far - near)),
        glam::Vec4::W,
    )
    .transpose()
}

/// Plans the palette in the shading passes; does nothing where all materials have the look's own
/// colours.
pub(super) fn plan_palette(plan: &mut Plan, palette: &[[f32; 4]], passes: &[&'static str]) {
    if palette.is_empty() {
        return;
    }
    for pass in passes {
        plan.define(pass, "PALETTE");
    }
    let mut all = palette.to_vec();
    all.resize(MOST_COLOURS, [0.0; 4]);
    plan.values(&PALETTE, &all);
}

/// Writes depth, normal and material of the solids in a tile.
const SOLID: RasterSpec = RasterSpec {
    name: "ssfr/solid",
    colours: &[TextureFormat::R32Float, TextureFormat::R32Uint],
    // The depth value is near over depth: the nearest fragment has the greatest.
    compare: CompareFunction::Greater,
    defines: &[],
};

/// Writes depth and triangle index, from which everything else follows.
const INDEXED: RasterSpec = RasterSpec {
    defines: &["INDEXED"],
    ..SOLID
};

/// Writes depth only, as seen by the sun.
const SHADOW: RasterSpec = RasterSpec {
    name: "ssfr/shadow",
    colours: &[],
    compare: CompareFunction::Less,
    defines: &[],
};

/// Opaque geometry as its passes receive it.
#[derive(Clone, Copy)]
pub(super) struct Set<'a> {
    /// Triangles, at the start of the triangle buffer.
    pub(super) triangles: &'a [Triangle],
    /// Texture mappings, which follow the triangles.
    pub(super) places: &'a [Triangle],
    /// Whether shading needs the triangles: the look names materials or wet solids.
    pub(super) is_indexed: bool,
}

/// Plans the shadow map and returns the command that draws it: for each sample where solids move
/// within the shutter, else once. Without opaque geometry the map is a single texel at the far
/// plane.
pub(super) fn plan_shadow(
    plan: &mut Plan,
    set: &Set<'_>,
    shadow_from_world: &Mat4,
    limits: &Limits,
) -> Command {
    let triangles = set.triangles;
    let side = match triangles.is_empty() {
        true => 1,
        false => SHADOW_SIZE.min(limits.texture),
    };
    plan.textures.push(TextureSpec {
        name: "shadow_map".into(),
        size: [side, side],
        format: DEPTH,
    });
    let shadow_map = Target {
        texture: "shadow_map".into(),
        clear: 1.0,
        is_kept: true,
    };
    if triangles.is_empty() {
        return Command::ClearDepth(shadow_map);
    }
    plan.values(&TRIANGLES, &[triangles, set.places].concat());
    plan.values(&SHADOW_FROM_WORLD, &[shadow_from_world.to_cols_array_2d()]);
    Command::Draw(Draw {
        raster: SHADOW,
        binds: Vec::new(),
        vertices: 3 * triangles.len() as u32,
        colours: Vec::new(),
        depth: shadow_map,
    })
}

/// Plans the commands that draw the solids into the frame's buffers, tile by tile.
pub(super) fn plan_solids(plan: &mut Plan, set: &Set<'_>, limits: &Limits) -> Vec<Command> {
    let triangles = set.triangles;
    let pixels = plan.extent.pixels();
    plan.buffer(&SOLID_DEPTH, pixels);
    plan.buffer(&SOLID_PACKED, pixels);
    if triangles.is_empty() {
        if set.is_indexed {
            plan.values(&TRIANGLES, &[Triangle::default()]);
        }
        return vec![plan.fill(&SOLID_DEPTH, FAR.to_bits(), pixels)];
    }
    let mut tiles = Vec::new();
    let [width, height] = plan.extent.size;
    for y in (0..height).step_by(limits.tile as usize) {
        for x in (0..width).step_by(limits.tile as usize) {
            let size = [limits.tile.min(width - x), limits.tile.min(height - y)];
            tiles.push(([x, y], size));
        }
    }
    let float = |[x, y]: [u32; 2]| [x as f32, y as f32];
    let uniforms: Vec<Tile> = tiles
        .iter()
        .map(|&(corner, size)| Tile {
            corner: float(corner),
            size: float(size),
        })
        .collect();
    plan.windows(&TILES, &uniforms);
    let raster = if set.is_indexed { INDEXED } else { SOLID };
    let vertices = 6 * triangles.len() as u32;
    tiles
        .into_iter()
        .enumerate()
        .flat_map(|(index, (corner, size))| {
            draw_tile(plan, index, (corner, size), (raster, vertices))
        })
        .collect()
}

/// Draws one tile and copies it to its position in the frame.
fn draw_tile(
    plan: &mut Plan,
    index: usize,
    ([x, y], size): ([u32; 2], [u32; 2]),
    (raster, vertices): (RasterSpec, u32),
) -> [Command; 3] {
    let mut target = |part: &str, format, clear, is_kept| {
        let texture = format!("{part}.{index}");
        plan.textures.push(TextureSpec {
            name: texture.clone(),
            size,
            format,
        });
        Target {
            texture,
            clear,
            is_kept,
        }
    };
    let depth = target("solid_depth", SOLID.colours[0], f64::from(FAR), true);
    let packed = target("solid_packed", SOLID.colours[1], 0.0, true);
    let order = target("solid_order", DEPTH, 0.0, false);
    let width = plan.extent.size[0];
    let copy = |target: &Target, buffer: &str| {
        Command::CopyTexture(CopyTexture {
            texture: target.texture.clone(),
            buffer: buffer.to_owned(),
            offset: 4 * (u64::from(y) * u64::from(width) + u64::from(x)),
            bytes_per_row: 4 * width,
        })
    };
    let copies = [
        copy(&depth, SOLID_DEPTH.name()),
        copy(&packed, SOLID_PACKED.name()),
    ];
    let draw = Command::Draw(Draw {
        raster,
        binds: vec![TILES.bind(index)],
        vertices,
        colours: vec![depth, packed],
        depth: order,
    });
    let [copy_depth, copy_packed] = copies;
    [draw, copy_depth, copy_packed]
}
