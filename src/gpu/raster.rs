//! Raster passes: triangles drawn into textures.
//!
//! A raster pass is a WGSL file with a vertex entry point and, if it draws colours, a fragment
//! entry point. It has no vertex buffers: it reads its data from bound buffers by vertex index.

use wgpu::{
    BindGroup, BindGroupLayout, Color, CommandEncoder, CompareFunction, LoadOp, Operations,
    RenderPassTimestampWrites, StoreOp, TextureFormat, TextureView,
};

use super::{
    adapter::Context,
    compiled::compiled_raster,
    error::GpuError,
    program::{Program, checked, shader},
    recording::{Bind, bind},
    reflect::{Binding, Stage},
};

/// Format of all depth textures.
pub const DEPTH: TextureFormat = TextureFormat::Depth32Float;

/// Description of a raster pass to compile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RasterSpec {
    /// Shader file without extension, such as `ssfr/solid`.
    pub name: &'static str,
    /// Formats of the textures that its fragments are written to, by location.
    pub colours: &'static [TextureFormat],
    /// Depth comparison function.
    pub compare: CompareFunction,
    /// Names for which `#ifdef` holds in its shader.
    pub defines: &'static [&'static str],
}

/// A texture to draw into.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// Texture name.
    pub texture: String,
    /// Initial value of the first channel, or of the depth.
    pub clear: f64,
    /// Whether the result is stored for later reads.
    pub is_kept: bool,
}

/// Draws triangles with a raster pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Draw {
    /// The raster pass.
    pub raster: RasterSpec,
    /// Renamed or windowed bindings.
    pub binds: Vec<Bind>,
    /// Number of vertices, three per triangle.
    pub vertices: u32,
    /// Targets for the pass's colours, by location.
    pub colours: Vec<Target>,
    /// Depth target.
    pub depth: Target,
}

/// Copies a texture into a buffer that holds a larger image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CopyTexture {
    /// Source texture, copied completely; four bytes per texel.
    pub texture: String,
    /// Destination buffer.
    pub buffer: String,
    /// Byte offset of the first row in the buffer.
    pub offset: u64,
    /// Bytes from one row to the next in the buffer, a multiple of 256.
    pub bytes_per_row: u32,
}

/// A compiled raster pass.
#[derive(Debug)]
pub struct RasterPass {
    pipeline: wgpu::RenderPipeline,
    layout: BindGroupLayout,
    bindings: Vec<Binding>,
}

impl Program {
    /// Compiles raster passes into the program.
    ///
    /// # Errors
    /// [`GpuError::Shader`].
    pub fn with_rasters(mut self, specs: &[RasterSpec]) -> Result<Self, GpuError> {
        for spec in specs {
            let pass = compiled_raster(&self.context, spec, || compile(&self.context, spec))?;
            self.rasters.insert(spec.name, pass);
        }
        Ok(self)
    }

    /// Returns the raster pass with this name.
    ///
    /// # Panics
    /// If the program has none: a recording that its plan does not cover is a bug.
    fn raster(&self, name: &str) -> &RasterPass {
        self.rasters
            .get(name)
            .unwrap_or_else(|| panic!("raster pass `{name}` is not in the program"))
    }
}

fn compile(context: &Context, spec: &RasterSpec) -> Result<RasterPass, GpuError> {
    let shader = shader(context, spec.name, spec.defines, &[])?;
    let has_fragment = match shader.reflection.stage {
        Stage::Raster { has_fragment } if has_fragment != spec.colours.is_empty() => has_fragment,
        stage => {
            return Err(context.shaders.blamed(GpuError::Shader {
                name: spec.name.to_owned(),
                message: format!("{stage:?} does not draw {} colours", spec.colours.len()),
            }));
        }
    };
    let targets: Vec<Option<wgpu::ColorTargetState>> = spec
        .colours
        .iter()
        .map(|&format| Some(format.into()))
        .collect();
    let pipeline = checked(context, spec.name, || {
        (context.device).create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(spec.name),
            layout: Some(&shader.pipeline_layout),
            vertex: wgpu::VertexState {
                module: &shader.module,
                entry_point: None,
                compilation_options: Default::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: Some(wgpu::DepthStencilState {
                format: DEPTH,
                depth_write_enabled: Some(true),
                depth_compare: Some(spec.compare),
                stencil: wgpu::StencilState::default(),
                bias: wgpu::DepthBiasState::default(),
            }),
            multisample: wgpu::MultisampleState::default(),
            fragment: has_fragment.then(|| wgpu::FragmentState {
                module: &shader.module,
                entry_point: None,
                compilation_options: Default::default(),
                targets: &targets,
            }),
            multiview_mask: None,
            cache: None,
        })
    })?;
    Ok(RasterPass {
        pipeline,
        layout: shader.layout,
        bindings: shader.reflection.bindings,
    })
}

/// A [`Draw`] with its bind group.
pub(super) struct BoundDraw {
    pub(super) draw: Draw,
    group: BindGroup,
}

impl BoundDraw {
    pub(super) fn new(program: &Program, draw: &Draw) -> Self {
        let pass = program.raster(draw.raster.name);
        let name = draw.raster.name;
        Self {
            draw: draw.clone(),
            group: bind(
                program,
                name,
                &pass.layout,
                &pass.bindings,
                &draw.binds,
                &[],
            ),
        }
    }

    pub(super) fn encode(
        &self,
        program: &Program,
        encoder: &mut CommandEncoder,
        timestamps: Option<RenderPassTimestampWrites<'_>>,
    ) {
        let Draw {
            raster,
            colours,
            depth,
            ..
        } = &self.draw;
        let views: Vec<TextureView> = colours
            .iter()
            .map(|target| view(program, &target.texture))
            .collect();
        let attachments: Vec<_> = colours
            .iter()
            .zip(&views)
            .map(|(target, view)| {
                Some(wgpu::RenderPassColorAttachment {
                    view,
                    depth_slice: None,
                    resolve_target: None,
                    ops: operations(
                        target,
                        Color {
                            r: target.clear,
                            ..Color::BLACK
                        },
                    ),
                })
            })
            .collect();
        let depth_view = view(program, &depth.texture);
        let mut pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some(raster.name),
            color_attachments: &attachments,
            depth_stencil_attachment: Some(depth_attachment(depth, &depth_view)),
            timestamp_writes: timestamps,
            occlusion_query_set: None,
            multiview_mask: None,
        });
        pass.set_pipeline(&program.raster(raster.name).pipeline);
        pass.set_bind_group(0, &self.group, &[]);
        pass.draw(0..self.draw.vertices, 0..1);
    }
}

fn view(program: &Program, texture: &str) -> TextureView {
    program.texture(texture).create_view(&Default::default())
}

fn operations<V>(target: &Target, clear: V) -> Operations<V> {
    Operations {
        load: LoadOp::Clear(clear),
        store: match target.is_kept {
            true => StoreOp::Store,
            false => StoreOp::Discard,
        },
    }
}

fn depth_attachment<'a>(
    target: &Target,
    view: &'a TextureView,
) -> wgpu::RenderPassDepthStencilAttachment<'a> {
    wgpu::RenderPassDepthStencilAttachment {
        view,
        depth_ops: Some(operations(target, target.clear as f32)),
        stencil_ops: None,
    }
}

/// Sets every texel of a depth texture to the target's clear value.
pub(super) fn clear_depth(program: &Program, encoder: &mut CommandEncoder, target: &Target) {
    let view = view(program, &target.texture);
    encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
        label: Some("clear depth"),
        color_attachments: &[],
        depth_stencil_attachment: Some(depth_attachment(target, &view)),
        timestamp_writes: None,
        occlusion_query_set: None,
        multiview_mask: None,
    });
}

pub(super) fn copy(program: &Program, encoder: &mut CommandEncoder, copy: &CopyTexture) {
    let texture = program.texture(&copy.texture);
    encoder.copy_texture_to_buffer(
        texture.as_image_copy(),
        wgpu::TexelCopyBufferInfo {
            buffer: program.buffer(&copy.buffer),
            layout: wgpu::TexelCopyBufferLayout {
                offset: copy.offset,
                bytes_per_row: Some(copy.bytes_per_row),
                rows_per_image: None,
            },
        },
        texture.size(),
    );
}
