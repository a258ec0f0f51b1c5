//! Compute passes with their bindings, buffers, and times on the device.

use std::collections::BTreeMap;
use std::num::NonZeroU64;

use wgpu::util::DeviceExt;
use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, BindingType, Buffer, BufferBindingType,
    BufferUsages, CommandEncoder, ComputePipeline, ShaderStages,
};

use crate::gpu::adapter::{Context, GpuError};
use crate::gpu::program::source;

/// What stands at a binding; bindings count up from 0 in group 0.
#[derive(Clone, Copy)]
pub(super) enum Slot {
    Uniform,
    Read,
    Write,
    Texture,
    DepthTexture,
    Sampler,
    CompareSampler,
}

pub(super) fn layout(
    context: &Context,
    label: &str,
    stages: ShaderStages,
    slots: &[Slot],
) -> BindGroupLayout {
    let buffer = |ty| BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None::<NonZeroU64>,
    };
    let texture = |sample_type| BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let entries: Vec<_> = (0u32..)
        .zip(slots)
        .map(|(binding, slot)| wgpu::BindGroupLayoutEntry {
            binding,
            visibility: stages,
            ty: match slot {
                Slot::Uniform => buffer(BufferBindingType::Uniform),
                Slot::Read => buffer(BufferBindingType::Storage { read_only: true }),
                Slot::Write => buffer(BufferBindingType::Storage { read_only: false }),
                Slot::Texture => texture(wgpu::TextureSampleType::Float { filterable: true }),
                Slot::DepthTexture => texture(wgpu::TextureSampleType::Depth),
                Slot::Sampler => BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                Slot::CompareSampler => BindingType::Sampler(wgpu::SamplerBindingType::Comparison),
            },
            count: None,
        })
        .collect();
    context
        .device
        .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(label),
            entries: &entries,
        })
}

pub(super) fn bind(
    context: &Context,
    layout: &BindGroupLayout,
    resources: Vec<BindingResource<'_>>,
) -> BindGroup {
    let entries: Vec<_> = (0u32..)
        .zip(resources)
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    context
        .device
        .create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout,
            entries: &entries,
        })
}

/// Pass `name`, compiled from the shader `file`.
pub(super) fn module(
    context: &Context,
    name: &str,
    file: &str,
    defines: &[&str],
) -> Result<wgpu::ShaderModule, GpuError> {
    let text = source(context, name, file, defines)?;
    // A fault is reported here with its place, not later as a lost device.
    naga::front::wgsl::parse_str(&text).map_err(|error| GpuError::Shader {
        name: name.to_owned(),
        message: error.emit_to_string(&text),
    })?;
    Ok(context
        .device
        .create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source: wgpu::ShaderSource::Wgsl(text.into()),
        }))
}

/// One compute shader, ready to be bound.
pub(super) struct ComputePass {
    pub(super) name: &'static str,
    pub(super) pipeline: ComputePipeline,
    pub(super) layout: BindGroupLayout,
}

impl ComputePass {
    /// `name` is what the pass is called in plans and timings; `file` is its shader.
    pub(super) fn new(
        context: &Context,
        name: &'static str,
        file: &str,
        defines: &[&str],
        slots: &[Slot],
    ) -> Result<Self, GpuError> {
        let module = module(context, name, file, defines)?;
        let layout = layout(context, name, ShaderStages::COMPUTE, slots);
        let pipeline_layout =
            context
                .device
                .create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                    label: Some(name),
                    bind_group_layouts: &[Some(&layout)],
                    immediate_size: 0,
                });
        let pipeline = context
            .device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(name),
                layout: Some(&pipeline_layout),
                module: &module,
                entry_point: Some("main"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                cache: None,
            });
        Ok(Self {
            name,
            pipeline,
            layout,
        })
    }

    pub(super) fn bind(&self, context: &Context, resources: Vec<BindingResource<'_>>) -> BindGroup {
        bind(context, &self.layout, resources)
    }

    pub(super) fn run(
        &self,
        encoder: &mut CommandEncoder,
        timer: &mut Timer,
        group: &BindGroup,
        [x, y]: [u32; 2],
    ) {
        if x == 0 || y == 0 {
            return;
        }
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some(self.name),
            timestamp_writes: timer.compute(self.name),
        });
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, group, &[]);
        pass.dispatch_workgroups(x, y, 1);
        drop(pass);
        timer.split(self.name, encoder);
    }
}

/// Workgroups of 16 × 4 threads that cover `size`.
pub(super) fn tiles(size: [u32; 2]) -> [u32; 2] {
    [size[0].div_ceil(16), size[1].div_ceil(4)]
}

/// `count` workgroups, folded into two dimensions where one would pass the limit of 65 535.
pub(super) fn folded(count: u32) -> [u32; 2] {
    const ROW: u32 = 32768;
    if count <= ROW {
        [count, 1]
    } else {
        [ROW, count.div_ceil(ROW)]
    }
}

pub(super) fn uniform<T: bytemuck::Pod>(context: &Context, label: &str, value: &T) -> Buffer {
    context
        .device
        .create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(label),
            contents: bytemuck::bytes_of(value),
            usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        })
}

/// A storage buffer, refused where the adapter would not bind it.
pub(super) fn storage(context: &Context, label: &str, bytes: u64) -> Result<Buffer, GpuError> {
    let limits = &context.limits;
    let binding = limits.max_storage_buffer_binding_size;
    for (allowed, limit) in [
        (binding, "max_storage_buffer_binding_size"),
        (limits.max_buffer_size, "max_buffer_size"),
    ] {
        if bytes > allowed {
            return Err(GpuError::TooLarge {
                buffer: label.to_owned(),
                needed: bytes,
                allowed,
                limit,
                adapter: context.info.name.clone(),
            });
        }
    }
    Ok(context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: bytes.max(64),
        usage: BufferUsages::STORAGE | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    }))
}

/// Copies a buffer's first bytes to the host; waits for the device.
pub(super) fn read<T: bytemuck::Pod>(
    context: &Context,
    buffer: &Buffer,
    bytes: u64,
) -> Result<Vec<T>, GpuError> {
    let staging = context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("staging"),
        size: bytes,
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = context.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes);
    context.queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |_| {});
    context.wait()?;
    let view = staging
        .get_mapped_range(..)
        .map_err(|error| GpuError::Lost(error.to_string()))?;
    Ok(bytemuck::pod_collect_to_vec(&view))
}

/// Pairs of timestamps, and which pass each belongs to.
pub(super) struct Timer {
    context: Context,
    /// When set, every pass is submitted and waited for by itself, and timed by the host's clock.
    one_by_one: Option<std::time::Instant>,
    queries: Option<(wgpu::QuerySet, Buffer)>,
    names: Vec<&'static str>,
    period_s: f64,
    /// Seconds and runs by pass.
    pub(super) totals: BTreeMap<&'static str, (f64, u32)>,
}

/// Pairs that one submission may hold; passes past them go untimed, and are still counted.
const PAIRS: u32 = 512;

impl Timer {
    pub(super) fn new(context: &Context) -> Self {
        let queries = context.has_timestamps.then(|| {
            let set = context.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count: 2 * PAIRS,
            });
            let buffer = context.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("pass times"),
                size: u64::from(2 * PAIRS) * 8,
                usage: BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            (set, buffer)
        });
        Self {
            context: context.clone(),
            one_by_one: None,
            queries,
            names: Vec::new(),
            period_s: f64::from(context.queue.get_timestamp_period()) * 1e-9,
            totals: BTreeMap::new(),
        }
    }

    fn next(&mut self, name: &'static str) -> Option<(&wgpu::QuerySet, u32)> {
        self.totals.entry(name).or_default().1 += 1;
        if self.one_by_one.is_some() {
            return None;
        }
        let (set, _) = self.queries.as_ref()?;
        let index = u32::try_from(self.names.len()).ok()?;
        if index >= PAIRS {
            return None;
        }
        self.names.push(name);
        Some((set, 2 * index))
    }

    pub(super) fn compute(
        &mut self,
        name: &'static str,
    ) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        self.next(name)
            .map(|(query_set, index)| wgpu::ComputePassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(index),
                end_of_pass_write_index: Some(index + 1),
            })
    }

    pub(super) fn render(
        &mut self,
        name: &'static str,
    ) -> Option<wgpu::RenderPassTimestampWrites<'_>> {
        self.next(name)
            .map(|(query_set, index)| wgpu::RenderPassTimestampWrites {
                query_set,
                beginning_of_pass_write_index: Some(index),
                end_of_pass_write_index: Some(index + 1),
            })
    }

    /// Times passes one by one from here on: slower, but honest on a software adapter, whose timestamps tell
    /// when a dispatch was queued.
    pub(super) fn time_one_by_one(&mut self) {
        self.one_by_one = Some(std::time::Instant::now());
        self.totals.clear();
    }

    /// Call after each pass.
    pub(super) fn split(&mut self, name: &'static str, encoder: &mut CommandEncoder) {
        if let Some(since) = &mut self.one_by_one {
            let fresh = self
                .context
                .device
                .create_command_encoder(&Default::default());
            let full = std::mem::replace(encoder, fresh);
            self.context.queue.submit([full.finish()]);
            // A lost device is reported by the wait at the end of the sample.
            let _ = self.context.wait();
            self.totals.entry(name).or_default().0 += since.elapsed().as_secs_f64();
            *since = std::time::Instant::now();
        }
    }

    /// Call before the encoder is finished.
    pub(super) fn resolve(&self, encoder: &mut CommandEncoder) {
        if let (Some((set, buffer)), count @ 1..) = (&self.queries, self.names.len() as u32) {
            encoder.resolve_query_set(set, 0..2 * count, buffer, 0);
        }
    }

    /// Call after the submission; waits for it.
    pub(super) fn collect(&mut self, context: &Context) -> Result<(), GpuError> {
        if let (Some((_, buffer)), count @ 1..) = (&self.queries, self.names.len() as u64) {
            let stamps: Vec<u64> = read(context, buffer, count * 16)?;
            for (name, pair) in self.names.drain(..).zip(stamps.chunks_exact(2)) {
                let seconds = pair[1].saturating_sub(pair[0]) as f64 * self.period_s;
                self.totals.entry(name).or_default().0 += seconds;
            }
        }
        Ok(())
    }
}
