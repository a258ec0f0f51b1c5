//! What is opaque: the scene's solids and the look's quay walls, drawn and in the sun's shadow map.

use glam::{DVec3, Mat4, Vec3};
use wgpu::util::DeviceExt;
use wgpu::{Buffer, CommandEncoder, ShaderStages, TextureFormat, TextureUsages, TextureView};

use super::frame::{Extent, FAR};
use super::pass::{Slot, Timer, bind, layout, module, uniform};
use super::uniform::{Tile, Triangle};
use super::{RenderError, RenderScene};
use crate::gpu::adapter::{Context, GpuError};
use crate::scene::look::Look;

/// Texels along a side of the shadow map.
const SHADOW_SIZE: u32 = 2048;

/// Scene solids and quay walls, relative to the domain's least corner.
pub(super) fn triangles(look: &Look, scene: &RenderScene) -> Result<Vec<Triangle>, RenderError> {
    let origin = scene.domain.min;
    let mut out = Vec::new();
    let mut push = |corners: [DVec3; 3], material: u32| {
        let [a, b, c] = corners.map(|p| (p - origin).as_vec3().to_array());
        out.push(Triangle {
            a,
            material,
            b,
            pad0: 0,
            c,
            pad1: 0,
        });
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
            if area.length() > 1e-12 {
                push(points, 0);
            }
        }
    }
    if let Some(basin) = &look.spec().basin {
        let (min, max) = (scene.domain.min, scene.domain.max);
        let top = min.y + basin.height_m;
        // Past the domain's ends, so that no end of a wall is in the picture.
        let (start, end) = (min.x - 2.0 * scene.domain.size().x, max.x);
        for (near, far) in [
            (min.z - basin.thickness_m, min.z - 1e-3),
            (max.z + 1e-3, max.z + basin.thickness_m),
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
    let margin = Vec3::splat(0.5);
    let (low, high) = (low - margin, high + margin);
    // Quay walls reach far; in front of the box they must still be seen by it, so depth gets room.
    let (near, far) = (low.z - 60.0, high.z + 60.0);
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

struct TileTargets {
    corner: [u32; 2],
    size: [u32; 2],
    group: wgpu::BindGroup,
    depth: wgpu::Texture,
    packed: wgpu::Texture,
    order: TextureView,
}

/// Draws the solids, tile by tile, into the frame's buffers.
pub(super) struct Set {
    pipeline: wgpu::RenderPipeline,
    tiles: Vec<TileTargets>,
    vertices: u32,
}

fn texture(
    context: &Context,
    label: &str,
    [width, height]: [u32; 2],
    format: TextureFormat,
    usage: TextureUsages,
) -> wgpu::Texture {
    context.device.create_texture(&wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    })
}

pub(super) fn upload(context: &Context, triangles: &[Triangle]) -> Buffer {
    context
        .device
        .create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("triangles"),
            contents: bytemuck::cast_slice(triangles),
            usage: wgpu::BufferUsages::STORAGE,
        })
}

struct Raster<'a> {
    name: &'static str,
    slots: &'a [Slot],
    targets: &'a [Option<wgpu::ColorTargetState>],
    compare: wgpu::CompareFunction,
    has_fragment: bool,
}

fn pipeline(
    context: &Context,
    raster: &Raster<'_>,
) -> Result<(wgpu::RenderPipeline, wgpu::BindGroupLayout), GpuError> {
    let module = module(context, raster.name, raster.name, &[])?;
    let layout = layout(
        context,
        raster.name,
        ShaderStages::VERTEX_FRAGMENT,
        raster.slots,
    );
    let device = &context.device;
    let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some(raster.name),
        bind_group_layouts: &[Some(&layout)],
        immediate_size: 0,
    });
    let options = wgpu::PipelineCompilationOptions::default;
    let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(raster.name),
        layout: Some(&pipeline_layout),
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some("vertex"),
            compilation_options: options(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: Some(wgpu::DepthStencilState {
            format: TextureFormat::Depth32Float,
            depth_write_enabled: Some(true),
            depth_compare: Some(raster.compare),
            stencil: wgpu::StencilState::default(),
            bias: wgpu::DepthBiasState::default(),
        }),
        multisample: wgpu::MultisampleState::default(),
        fragment: raster.has_fragment.then(|| wgpu::FragmentState {
            module: &module,
            entry_point: Some("fragment"),
            compilation_options: options(),
            targets: raster.targets,
        }),
        multiview_mask: None,
        cache: None,
    });
    Ok((pipeline, layout))
}

impl Set {
    /// `tile_limit` is the most texels along a side of a texture.
    pub(super) fn new(
        context: &Context,
        extent: &Extent,
        tile_limit: u32,
        camera: &Buffer,
        triangles: &Buffer,
        count: usize,
    ) -> Result<Self, RenderError> {
        let target = |format: TextureFormat| Some(wgpu::ColorTargetState::from(format));
        let (pipeline, layout) = pipeline(
            context,
            &Raster {
                name: "ssfr/solid",
                slots: &[Slot::Uniform, Slot::Uniform, Slot::Read],
                targets: &[
                    target(TextureFormat::R32Float),
                    target(TextureFormat::R32Uint),
                ],
                // Near over depth: the nearest is the greatest.
                compare: wgpu::CompareFunction::Greater,
                has_fragment: true,
            },
        )?;
        let mut tiles = Vec::new();
        for y in (0..extent.size[1]).step_by(tile_limit as usize) {
            for x in (0..extent.size[0]).step_by(tile_limit as usize) {
                let size = [
                    tile_limit.min(extent.size[0] - x),
                    tile_limit.min(extent.size[1] - y),
                ];
                let tile = uniform(
                    context,
                    "tile",
                    &Tile {
                        corner: [x as f32, y as f32],
                        size: [size[0] as f32, size[1] as f32],
                    },
                );
                let buffers = [camera, &tile, triangles];
                let drawn = TextureUsages::RENDER_ATTACHMENT | TextureUsages::COPY_SRC;
                let order = texture(
                    context,
                    "solid order",
                    size,
                    TextureFormat::Depth32Float,
                    TextureUsages::RENDER_ATTACHMENT,
                );
                tiles.push(TileTargets {
                    corner: [x, y],
                    size,
                    group: bind(
                        context,
                        &layout,
                        buffers.map(Buffer::as_entire_binding).to_vec(),
                    ),
                    depth: texture(context, "solid depth", size, TextureFormat::R32Float, drawn),
                    packed: texture(context, "solid normal", size, TextureFormat::R32Uint, drawn),
                    order: order.create_view(&Default::default()),
                });
            }
        }
        Ok(Self {
            pipeline,
            tiles,
            vertices: 6 * count as u32,
        })
    }

    pub(super) fn run(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut Timer,
        extent: &Extent,
        [depth, packed]: [&Buffer; 2],
    ) {
        for tile in &self.tiles {
            let views = [&tile.depth, &tile.packed].map(|t| t.create_view(&Default::default()));
            let attachment = |view, clear| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color {
                            r: clear,
                            ..wgpu::Color::BLACK
                        }),
                        store: wgpu::StoreOp::Store,
                    },
                })
            };
            let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some("ssfr/solid"),
                color_attachments: &[
                    attachment(&views[0], f64::from(FAR)),
                    attachment(&views[1], 0.0),
                ],
                depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                    view: &tile.order,
                    depth_ops: Some(wgpu::Operations {
                        load: wgpu::LoadOp::Clear(0.0),
                        store: wgpu::StoreOp::Discard,
                    }),
                    stencil_ops: None,
                }),
                timestamp_writes: timer.render("ssfr/solid"),
                occlusion_query_set: None,
                multiview_mask: None,
            });
            pass.set_pipeline(&self.pipeline);
            pass.set_bind_group(0, &tile.group, &[]);
            pass.draw(0..self.vertices, 0..1);
            drop(pass);
            timer.split("ssfr/solid", encoder);
            for (texture, buffer) in [(&tile.depth, depth), (&tile.packed, packed)] {
                let at = u64::from(tile.corner[1]) * u64::from(extent.size[0])
                    + u64::from(tile.corner[0]);
                encoder.copy_texture_to_buffer(
                    texture.as_image_copy(),
                    wgpu::TexelCopyBufferInfo {
                        buffer,
                        layout: wgpu::TexelCopyBufferLayout {
                            offset: 4 * at,
                            bytes_per_row: Some(4 * extent.size[0]),
                            rows_per_image: None,
                        },
                    },
                    wgpu::Extent3d {
                        width: tile.size[0],
                        height: tile.size[1],
                        depth_or_array_layers: 1,
                    },
                );
            }
        }
    }
}

/// Draws the shadow map once; solids do not move. Without solids it is one texel that shades nothing.
pub(super) fn shadow_map(
    context: &Context,
    timer: &mut Timer,
    matrix: &Mat4,
    triangles: Option<(&Buffer, usize)>,
) -> Result<TextureView, RenderError> {
    let side = match triangles {
        Some(_) => SHADOW_SIZE.min(context.limits.max_texture_dimension_2d),
        None => 1,
    };
    let map = texture(
        context,
        "shadow map",
        [side, side],
        TextureFormat::Depth32Float,
        TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
    );
    let view = map.create_view(&Default::default());
    let recorded = match triangles {
        Some((buffer, count)) => {
            let raster = Raster {
                name: "ssfr/shadow",
                slots: &[Slot::Uniform, Slot::Read],
                targets: &[],
                compare: wgpu::CompareFunction::Less,
                has_fragment: false,
            };
            let (pipeline, layout) = pipeline(context, &raster)?;
            let matrix = uniform(context, "shadow", &matrix.to_cols_array_2d());
            let buffers = [&matrix, buffer];
            let group = bind(
                context,
                &layout,
                buffers.map(Buffer::as_entire_binding).to_vec(),
            );
            Some((pipeline, group, 3 * count as u32))
        }
        None => None,
    };
    let mut encoder = context.device.create_command_encoder(&Default::default());
    let timestamps = match recorded {
        Some(_) => timer.render("ssfr/shadow"),
        None => None,
    };
    let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("ssfr/shadow"),
        color_attachments: &[],
        depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
            view: &view,
            depth_ops: Some(wgpu::Operations {
                load: wgpu::LoadOp::Clear(1.0),
                store: wgpu::StoreOp::Store,
            }),
            stencil_ops: None,
        }),
        timestamp_writes: timestamps,
        occlusion_query_set: None,
        multiview_mask: None,
    });
    if let Some((pipeline, group, vertices)) = &recorded {
        pass.set_pipeline(pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.draw(0..*vertices, 0..1);
    }
    drop(pass);
    timer.resolve(&mut encoder);
    context.queue.submit([encoder.finish()]);
    timer.collect(context)?;
    Ok(view)
}
