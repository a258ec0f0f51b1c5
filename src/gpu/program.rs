//! Passes and buffers by name, built on a device.

use std::{
    borrow::Cow,
    collections::BTreeMap,
    sync::{Arc, OnceLock},
};

use wgpu::{BindGroupLayout, Buffer, BufferUsages, ComputePipeline};

use super::{
    adapter::{Context, InjectedFault},
    bindings,
    buffer::{Buf, BufferSpec, Element, Windows},
    edited,
    error::GpuError,
    operations::Counting,
    raster::RasterPass,
    readback::{Copied, Mapped, Readback, Staging},
    reflect::{Access, Binding, Reflection, Stage, reflect, reflect_at},
    shader::Composed,
    uniforms,
};

/// Description of a compute pass to compile.
#[derive(Clone, Debug, PartialEq)]
pub struct PassSpec {
    /// Shader file without extension, such as `pbf/predict`.
    pub name: &'static str,
    /// Names for which `#ifdef` holds.
    pub defines: Vec<&'static str>,
    /// Values of its `override` constants.
    pub constants: Vec<(&'static str, f64)>,
}

/// A compiled pass.
#[derive(Debug)]
pub struct Pass {
    /// Name as in [`PassSpec`].
    pub name: &'static str,
    /// Compiled pipeline.
    pub pipeline: ComputePipeline,
    /// Layout of group 0.
    pub layout: BindGroupLayout,
    /// Reflected bindings.
    pub bindings: Vec<Binding>,
    /// Threads per workgroup along each axis.
    pub workgroup_size: [u32; 3],
    /// Names for which `#ifdef` holds, as in [`PassSpec`].
    pub(super) defines: Vec<&'static str>,
    /// Values of the `override` constants that the pass declares.
    pub(super) constants: Vec<(&'static str, f64)>,
    counting: OnceLock<Option<Counting>>,
}

impl Pass {
    /// Returns the instrumented version that counts operations, compiled on first use; `None` if
    /// the adapter does not support one buffer more.
    ///
    /// # Errors
    /// [`GpuError::Shader`].
    pub(super) fn counting(&self, context: &Context) -> Result<Option<&Counting>, GpuError> {
        if self.counting.get().is_none() {
            let made = Counting::new(context, self)?;
            return Ok(self.counting.get_or_init(|| made).as_ref());
        }
        Ok(self.counting.get().and_then(Option::as_ref))
    }
}

/// Named passes, buffers, textures and samplers on one device.
#[derive(Debug)]
pub struct Program {
    /// The device.
    pub context: Context,
    shared: Vec<(&'static str, f64)>,
    passes: BTreeMap<&'static str, Arc<Pass>>,
    buffers: BTreeMap<String, Buffer>,
    pub(super) rasters: BTreeMap<&'static str, Arc<RasterPass>>,
    pub(super) textures: BTreeMap<String, wgpu::Texture>,
    pub(super) samplers: BTreeMap<&'static str, wgpu::Sampler>,
    staging: Staging,
}

impl Program {
    /// Compiles the passes and allocates the buffers, filled with zeros. `shared` constants go to
    /// every pass that declares them.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] and [`GpuError::NoF64`] before anything is allocated,
    /// [`GpuError::Shader`], [`GpuError::Lost`].
    pub fn new(
        context: &Context,
        buffers: &[BufferSpec],
        passes: &[PassSpec],
        shared: &[(&'static str, f64)],
    ) -> Result<Self, GpuError> {
        check_sizes(context, buffers)?;
        let passes = passes
            .iter()
            .map(|spec| Ok((spec.name, compile(context, spec, shared, buffers)?)))
            .collect::<Result<_, GpuError>>()?;
        let buffers = buffers
            .iter()
            .map(|spec| (spec.name.clone(), allocate(context, spec)))
            .collect();
        context.check()?;
        Ok(Self {
            context: context.clone(),
            shared: shared.to_vec(),
            passes,
            buffers,
            rasters: BTreeMap::new(),
            textures: BTreeMap::new(),
            samplers: BTreeMap::new(),
            staging: Staging::default(),
        })
    }

    /// Changes the program to other buffers and passes: allocates buffers, filled with zeros,
    /// that are new or whose size changed, and compiles new passes. Earlier recordings keep the
    /// old buffers.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`] before anything is allocated, [`GpuError::Shader`],
    /// [`GpuError::Lost`].
    pub fn refit(&mut self, buffers: &[BufferSpec], passes: &[PassSpec]) -> Result<(), GpuError> {
        check_sizes(&self.context, buffers)?;
        for spec in passes {
            if !self.passes.contains_key(spec.name) {
                let pass = compile(&self.context, spec, &self.shared, buffers)?;
                self.passes.insert(spec.name, pass);
            }
        }
        for spec in buffers {
            let size = self.buffers.get(&spec.name).map(Buffer::size);
            if size != Some(allocated(spec)) {
                let buffer = allocate(&self.context, spec);
                self.buffers.insert(spec.name.clone(), buffer);
            }
        }
        self.context.check()
    }

    /// Returns the pass with this name.
    ///
    /// # Panics
    /// If the program has none: a recording that its plan does not cover is a bug.
    pub fn pass(&self, name: &str) -> &Pass {
        self.passes
            .get(name)
            .unwrap_or_else(|| panic!("pass `{name}` is not in the program"))
    }

    /// Returns the buffer with this name.
    ///
    /// # Panics
    /// If the program has none: a recording that its plan does not cover is a bug.
    pub fn buffer(&self, name: &str) -> &Buffer {
        self.buffers
            .get(name)
            .unwrap_or_else(|| panic!("buffer `{name}` is not in the program"))
    }

    /// Returns whether there is a buffer with this name.
    pub fn has(&self, name: &str) -> bool {
        self.buffers.contains_key(name)
    }

    /// Returns the names of the passes and of the buffers, sorted.
    pub fn names(&self) -> (Vec<&str>, Vec<&str>) {
        (
            self.passes.keys().copied().collect(),
            self.buffers.keys().map(String::as_str).collect(),
        )
    }

    /// Writes `data` to a buffer from value `first` on, ordered before later submissions.
    pub fn upload<T: bytemuck::NoUninit>(&self, buffer: Buf<T>, first: usize, data: &[T]) {
        self.write(
            buffer.name(),
            buffer.place(first),
            bytemuck::cast_slice(data),
        );
    }

    /// Writes `values` into the first windows of a uniform buffer, ordered before
    /// later submissions.
    pub fn upload_windows<T: Element>(&self, windows: &Windows<T>, values: &[T]) {
        self.write(windows.name(), 0, &Windows::bytes(values));
    }

    fn write(&self, name: &str, offset: u64, bytes: &[u8]) {
        if !bytes.is_empty() {
            let queue = &self.context.queue;
            queue.write_buffer(self.buffer(name), offset, bytes);
        }
    }

    /// Reads the first `count` values of a buffer; waits for the device.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn read<T: bytemuck::Pod>(&self, buffer: Buf<T>, count: usize) -> Result<Vec<T>, GpuError> {
        self.download(buffer.first(count))
    }

    /// Reads the first values of several buffers, with a single wait for the device.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn download<W: Readback>(&self, wanted: W) -> Result<W::Values, GpuError> {
        Ok(W::values(self.map(wanted)?.views()?))
    }

    /// Like [`Self::download`], without a copy: the values are those of memory that the device
    /// wrote. Later submissions do not change them.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn map<W: Readback>(&self, wanted: W) -> Result<Mapped<W>, GpuError> {
        let context = &self.context;
        let mut encoder = context.device.create_command_encoder(&Default::default());
        let mut copies: Vec<Option<Copied>> = Vec::new();
        for (name, offset, bytes) in wanted.spans() {
            copies.push((bytes > 0).then(|| {
                let copy = self.staging.copy(&context.device, bytes);
                let (source, length) = (self.buffer(name), bytes.next_multiple_of(4) as u64);
                encoder.copy_buffer_to_buffer(source, offset, copy.buffer(), 0, length);
                copy
            }));
        }
        context.queue.submit([encoder.finish()]);
        context.counters.submitted();
        copies.iter().flatten().for_each(Copied::request);
        context.wait()?;
        let bytes = copies.iter().flatten().map(|copy| copy.len() as u64);
        context.counters.waited(bytes.sum());
        Mapped::new(context.clone(), copies)
    }
}

/// Checks that the adapter can allocate and bind these buffers.
///
/// # Errors
/// [`GpuError::TooLarge`] for the first one that it cannot.
pub fn check_sizes(context: &Context, buffers: &[BufferSpec]) -> Result<(), GpuError> {
    buffers
        .iter()
        .try_for_each(|spec| check_size(context, spec))
}

fn check_size(context: &Context, spec: &BufferSpec) -> Result<(), GpuError> {
    let limits = &context.limits;
    let (binding, binding_name) = if spec.is_uniform {
        (
            limits.max_uniform_buffer_binding_size,
            "max_uniform_buffer_binding_size",
        )
    } else {
        (
            limits.max_storage_buffer_binding_size,
            "max_storage_buffer_binding_size",
        )
    };
    // Windows are bound one at a time, so only the size of the whole buffer is limited.
    let is_windowed = spec.is_uniform || spec.is_windowed;
    let binding = if is_windowed { u64::MAX } else { binding };
    let (allowed, limit) = if binding < limits.max_buffer_size {
        (binding, binding_name)
    } else {
        (limits.max_buffer_size, "max_buffer_size")
    };
    if spec.bytes > allowed {
        return Err(GpuError::TooLarge {
            buffer: spec.name.clone(),
            needed: spec.bytes,
            allowed,
            limit,
            adapter: context.info.name.clone(),
        });
    }
    Ok(())
}

fn allocated(spec: &BufferSpec) -> u64 {
    spec.bytes.next_multiple_of(16).max(16)
}

fn allocate(context: &Context, spec: &BufferSpec) -> Buffer {
    let role = if spec.is_uniform {
        // Passes may bind it as storage on some drivers: see `uniforms`.
        BufferUsages::UNIFORM | BufferUsages::STORAGE
    } else {
        BufferUsages::STORAGE | BufferUsages::INDIRECT
    };
    context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(&spec.name),
        size: allocated(spec),
        usage: role | BufferUsages::COPY_SRC | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// WGSL of a pass, with the context's injected fault if it concerns this pass.
pub(super) fn source(
    context: &Context,
    name: &str,
    defines: &[&str],
) -> Result<Composed, GpuError> {
    let composed = context.shaders.compose_with_places(name, defines);
    let mut source = composed.map_err(|error| context.shaders.blamed(error))?;
    if let Some(spoil) = context.spoil {
        if spoil.pass == name {
            source.text = spoiled(&source.text, &spoil)?;
        } else if ["_dry", "_bare"]
            .map(|end| name.strip_suffix(end))
            .contains(&Some(spoil.pass))
        {
            source.text = source.text.replace(spoil.from, spoil.to);
        }
    }
    Ok(source)
}

fn spoiled(source: &str, spoil: &InjectedFault) -> Result<String, GpuError> {
    if !source.contains(spoil.from) {
        return Err(GpuError::Shader {
            name: spoil.pass.to_owned(),
            message: format!("`{}`, which is to be replaced, is not in it", spoil.from),
        });
    }
    Ok(source.replace(spoil.from, spoil.to))
}

/// A shader module and its layouts, from which pipelines are built.
pub(super) struct Shader {
    pub(super) module: wgpu::ShaderModule,
    pub(super) layout: BindGroupLayout,
    pub(super) pipeline_layout: wgpu::PipelineLayout,
    pub(super) reflection: Reflection,
}

pub(super) fn binding_type(access: Access) -> wgpu::BindingType {
    let buffer = |ty| wgpu::BindingType::Buffer {
        ty,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let storage = |read_only| buffer(wgpu::BufferBindingType::Storage { read_only });
    let texture = |sample_type| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    match access {
        Access::Uniform => buffer(wgpu::BufferBindingType::Uniform),
        Access::Read => storage(true),
        Access::ReadWrite => storage(false),
        Access::Texture => texture(wgpu::TextureSampleType::Float { filterable: true }),
        Access::DepthTexture => texture(wgpu::TextureSampleType::Depth),
        Access::Sampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
        Access::CompareSampler => wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Comparison),
    }
}

/// Runs `make`, which creates objects of pass `name` on the device, and attributes its validation
/// errors to that pass.
pub(super) fn checked<T>(
    context: &Context,
    name: &str,
    make: impl FnOnce() -> T,
) -> Result<T, GpuError> {
    let scope = context
        .device
        .push_error_scope(wgpu::ErrorFilter::Validation);
    let made = make();
    match pollster::block_on(scope.pop()) {
        Some(error) => Err(context.shaders.blamed(GpuError::Shader {
            name: name.to_owned(),
            message: error.to_string(),
        })),
        None => Ok(made),
    }
}

/// Composes and reflects the shader of pass `name` for a program with these buffers.
///
/// # Errors
/// [`GpuError::Shader`]; [`GpuError::NoF64`]; [`GpuError::TooManyBuffers`].
pub(super) fn shader(
    context: &Context,
    name: &str,
    defines: &[&str],
    buffers: &[BufferSpec],
) -> Result<Shader, GpuError> {
    let source = source(context, name, defines)?;
    let blamed = |error| context.shaders.blamed(error);
    let place = |line| source.location(line);
    let reflection = reflect_at(name, &source.text, &place).map_err(blamed)?;
    if let Some(shipped) = context.shaders.shipped_beside(name) {
        let known = reflect(name, &shipped.compose(name, defines)?)?;
        edited::check(&reflection, &known, buffers).map_err(|message| {
            let name = name.to_owned();
            blamed(GpuError::Shader { name, message })
        })?;
    }
    if reflection.has_f64 && !context.has_f64 {
        return Err(GpuError::NoF64 {
            adapter: context.info.name.clone(),
        });
    }
    bindings::check(context, name, &reflection.bindings)?;
    let visibility = match reflection.stage {
        Stage::Compute => wgpu::ShaderStages::COMPUTE,
        Stage::Raster { .. } => wgpu::ShaderStages::VERTEX_FRAGMENT,
    };
    let entries = entries(&reflection.bindings, visibility);
    let source = match &context.imprecision {
        Some(profile) => {
            let module = profile.applied(name, &source.text).map_err(blamed)?;
            wgpu::ShaderSource::Naga(Cow::Owned(module))
        }
        None => wgpu::ShaderSource::Wgsl(source.text.into()),
    };
    let (module, layout, pipeline_layout) = module(context, name, &entries, source)?;
    Ok(Shader {
        module,
        layout,
        pipeline_layout,
        reflection,
    })
}

/// Layout entries of group 0 for these bindings.
pub(super) fn entries(
    bindings: &[Binding],
    visibility: wgpu::ShaderStages,
) -> Vec<wgpu::BindGroupLayoutEntry> {
    let entry = |binding: &Binding| wgpu::BindGroupLayoutEntry {
        binding: binding.index,
        visibility,
        ty: binding_type(binding.access),
        count: None,
    };
    bindings.iter().map(entry).collect()
}

/// Creates the shader module of pass `name`, the layout of its group 0, and that of its pipeline.
///
/// # Errors
/// [`GpuError::Shader`].
pub(super) fn module(
    context: &Context,
    name: &str,
    entries: &[wgpu::BindGroupLayoutEntry],
    source: wgpu::ShaderSource<'_>,
) -> Result<(wgpu::ShaderModule, BindGroupLayout, wgpu::PipelineLayout), GpuError> {
    let device = &context.device;
    let (entries, source) = match context.most_uniforms {
        Some(most) => uniforms::limited(name, most, entries, source)?,
        None => (entries.to_vec(), source),
    };
    checked(context, name, || {
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some(name),
            entries: &entries,
        });
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(name),
            source,
        };
        let checks = wgpu::ShaderRuntimeChecks {
            force_loop_bounding: false,
            ..wgpu::ShaderRuntimeChecks::checked()
        };
        // SAFETY: every loop of these shaders, which the binary embeds, runs to a bound that is
        // fixed before it starts. All other checks stay on. Users who edit shaders must keep to
        // that, as must anyone who edits this source.
        let module = unsafe { device.create_shader_module_trusted(descriptor, checks) };
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some(name),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        (module, layout, pipeline_layout)
    })
}

/// Creates the pipeline of a compute pass.
pub(super) fn pipeline(
    context: &Context,
    name: &str,
    layout: &wgpu::PipelineLayout,
    module: &wgpu::ShaderModule,
    constants: &[(&str, f64)],
) -> ComputePipeline {
    (context.device).create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(name),
        layout: Some(layout),
        module,
        entry_point: None,
        compilation_options: wgpu::PipelineCompilationOptions {
            constants,
            zero_initialize_workgroup_memory: false,
        },
        cache: None,
    })
}

fn compile(
    context: &Context,
    spec: &PassSpec,
    shared: &[(&'static str, f64)],
    buffers: &[BufferSpec],
) -> Result<Arc<Pass>, GpuError> {
    let own = || compile_own(context, spec, shared, buffers);
    let compiled = || {
        if context.shaders.edited().is_some() {
            return Ok(Arc::new(own()?));
        }
        let text = source(context, spec.name, &spec.defines)?.text;
        let constants = spec.constants.iter().chain(shared);
        context.compiled.pass(spec.name, constants, text, own)
    };
    compiled().map_err(|error| context.shaders.blamed(error))
}

fn compile_own(
    context: &Context,
    spec: &PassSpec,
    shared: &[(&'static str, f64)],
    buffers: &[BufferSpec],
) -> Result<Pass, GpuError> {
    let shader = shader(context, spec.name, &spec.defines, buffers)?;
    let reflection = shader.reflection;
    let declared = |name: &str| reflection.overrides.iter().any(|constant| constant == name);
    let mut constants = spec.constants.clone();
    constants.extend(shared.iter().filter(|(name, _)| declared(name)));
    let pipeline = checked(context, spec.name, || {
        let layout = &shader.pipeline_layout;
        pipeline(context, spec.name, layout, &shader.module, &constants)
    })?;
    Ok(Pass {
        name: spec.name,
        pipeline,
        layout: shader.layout,
        bindings: reflection.bindings,
        workgroup_size: reflection.workgroup_size,
        defines: spec.defines.clone(),
        constants,
        counting: OnceLock::new(),
    })
}
