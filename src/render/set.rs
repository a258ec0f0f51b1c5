//! What is opaque: the scene's solids and the look's quay walls, drawn and in the sun's shadow map.

use glam::{DVec3, Mat4, Vec3};
use wgpu::{CompareFunction, TextureFormat};

use super::buffers::{SHADOW_FROM_WORLD, SOLID_DEPTH, SOLID_PACKED, TILES, TRIANGLES};
use super::frame::FAR;
use super::plan::{Limits, Plan};
use super::uniform::{Tile, Triangle};
use super::{RenderError, RenderScene};
use crate::domain::mesh::TriangleMesh;
use crate::gpu::{
    raster::{CopyTexture, DEPTH, Draw, RasterSpec, Target},
    recording::Command,
    texture::TextureSpec,
};
use crate::scene::look::Look;

/// Between the domain's sides and the quay walls, particle spacings.
const QUAY_GAP: f64 = 0.006;

/// About what throws shadows, and before and behind it, over the domain's longer side on the ground: quay walls reach far, and in
/// front of the box they must still be seen by it.
const SHADOW_MARGIN: f32 = 0.02;
const SHADOW_DEPTH: f32 = 2.4;

/// Texels along a side of the shadow map.
const SHADOW_SIZE: u32 = 2048;

/// Scene solids and quay walls, relative to the domain's least corner: corners and material.
fn opaque_triangles(
    look: &Look,
    scene: &RenderScene,
) -> Result<Vec<([DVec3; 3], u32)>, RenderError> {
    let origin = scene.domain.min;
    let mut out = Vec::new();
    let mut push = |corners: [DVec3; 3], material: u32| {
        out.push((corners.map(|p| p - origin), material));
    };
    for mesh in &scene.solids {
        for corners in &mesh.triangles {
            let mut points = [DVec3::ZERO; 3];
            for (point, &index) in points.iter_mut().zip(corners) {
                *point = *mesh.vertices.get(index as usize).ok_or_else(|| {
                    RenderError::Scene(format!(
                        "a triangle names vertex {index}, which is not there"
                    ))
                })?;
            }
            // A triangle without area has no normal, and nothing of it would be seen.
            let area = (points[1] - points[0]).cross(points[2] - points[0]);
            if area.length() > 1e-10 * scene.particle_spacing.powi(2) {
                push(points, 0);
            }
        }
    }
    if let Some(basin) = &look.spec().basin {
        let (min, max) = (scene.domain.min, scene.domain.max);
        let top = min.y + basin.height_m;
        let gap = QUAY_GAP * scene.particle_spacing;
        // Past the domain's ends, so that no end of a wall is in the picture.
        let (start, end) = (min.x - 2.0 * scene.domain.size().x, max.x);
        for (near, far) in [
            (min.z - basin.thickness_m, min.z - gap),
            (max.z + gap, max.z + basin.thickness_m),
        ] {
            let low = DVec3::new(start, min.y, near);
            let high = DVec3::new(end + basin.thickness_m, top, far);
            for corners in box_triangles(low, high) {
                push(corners, 1);
            }
        }
    }
    Ok(out)
}

/// The same for the device.
pub(super) fn triangles(look: &Look, scene: &RenderScene) -> Result<Vec<Triangle>, RenderError> {
    let all = opaque_triangles(look, scene)?.into_iter();
    let packed = all.map(|(corners, material)| {
        let [a, b, c] = corners.map(|p| p.as_vec3().to_array());
        Triangle {
            a,
            material,
            b,
            pad0: 0,
            c,
            pad1: 0,
        }
    });
    Ok(packed.collect())
}

/// What a look and a scene have that is opaque, beside the ground, as one mesh, metres from the domain's least corner.
///
/// # Errors
/// A mesh that names vertices it lacks.
pub fn opaque(look: &Look, scene: &RenderScene) -> Result<TriangleMesh, RenderError> {
    let all = opaque_triangles(look, scene)?;
    let triangles = (0..all.len() as u32).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]);
    Ok(TriangleMesh {
        triangles: triangles.collect(),
        vertices: all.into_iter().flat_map(|(corners, _)| corners).collect(),
    })
}

/// Twelve triangles, counter-clockwise from outside.
fn box_triangles(low: DVec3, high: DVec3) -> Vec<[DVec3; 3]> {
    let corner = |i: usize| {
        DVec3::new(
            if i & 1 == 0 { low.x } else { high.x },
            if i & 2 == 0 { low.y } else { high.y },
            if i & 4 == 0 { low.z } else { high.z },
        )
    };
    [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ]
    .iter()
    .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
    .map(|face| face.map(corner))
    .collect()
}

/// The sun's view of everything opaque, and of the domain: an orthographic box.
pub(super) fn shadow_from_world(triangles: &[Triangle], domain: DVec3, sun: DVec3) -> Mat4 {
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
        // Shadows fall on the ground; the domain's ceiling throws none.
        take(Vec3::new(
            pick(0, size.x),
            pick(1, 0.3 * size.y),
            pick(2, size.z),
        ));
    }
    for triangle in triangles.iter().filter(|triangle| triangle.material == 0) {
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

/// Depth, normal and material of the solids in a tile.
const SOLID: RasterSpec = RasterSpec {
    name: "ssfr/solid",
    colours: &[TextureFormat::R32Float, TextureFormat::R32Uint],
    // Near over depth: the nearest is the greatest.
    compare: CompareFunction::Greater,
};

/// Depth alone, as the sun sees it.
const SHADOW: RasterSpec = RasterSpec {
    name: "ssfr/shadow",
    colours: &[],
    compare: CompareFunction::Less,
};

/// Plans the shadow map, and gives what draws it: once, since solids do not move. Without solids it is one texel that shades nothing.
pub(super) fn plan_shadow(
    plan: &mut Plan,
    triangles: &[Triangle],
    shadow_from_world: &Mat4,
    limits: &Limits,
) -> Command {
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
    plan.values(&TRIANGLES, triangles);
    plan.values(&SHADOW_FROM_WORLD, &[shadow_from_world.to_cols_array_2d()]);
    Command::Draw(Draw {
        raster: SHADOW,
        binds: Vec::new(),
        vertices: 3 * triangles.len() as u32,
        colours: Vec::new(),
        depth: shadow_map,
    })
}

/// Plans what draws the solids into the frame's buffers, tile by tile.
pub(super) fn plan_solids(
    plan: &mut Plan,
    triangles: &[Triangle],
    limits: &Limits,
) -> Vec<Command> {
    let pixels = plan.extent.pixels();
    plan.buffer(&SOLID_DEPTH, pixels);
    plan.buffer(&SOLID_PACKED, pixels);
    if triangles.is_empty() {
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
    let vertices = 6 * triangles.len() as u32;
    tiles
        .into_iter()
        .enumerate()
        .flat_map(|(index, (corner, size))| draw_tile(plan, index, corner, size, vertices))
        .collect()
}

/// Draws one tile and copies it to its place in the frame.
fn draw_tile(
    plan: &mut Plan,
    index: usize,
    [x, y]: [u32; 2],
    size: [u32; 2],
    vertices: u32,
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
        raster: SOLID,
        binds: vec![TILES.bind(index)],
        vertices,
        colours: vec![depth, packed],
        depth: order,
    });
    let [copy_depth, copy_packed] = copies;
    [draw, copy_depth, copy_packed]
}
