//! Passes recorded as data, and the executor that runs them.

use std::cell::Cell;

use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, CommandEncoder, ComputePass, TextureView,
};

use super::{
    adapter::Context,
    buffer::{Buf, Workgroups},
    error::GpuError,
    operations::{Operations, count},
    program::Program,
    raster::{self, BoundDraw, CopyTexture, Draw, Target},
    reflect::{Access, Binding},
};

pub use super::{buffer::Bind, timer::Timer};

/// Number of workgroups of a dispatch.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Groups {
    /// Enough for this many threads, in two dimensions beyond the limit of one.
    Threads(u64),
    /// Enough for one thread per pixel of an image of this size.
    Pixels([u32; 2]),
    /// [`Workgroups`] read from a buffer; zeros make the dispatch empty.
    Indirect {
        /// Buffer name.
        buffer: String,
        /// Byte offset in the buffer.
        offset: u64,
    },
}

impl Groups {
    /// Workgroup counts at an index of a buffer.
    pub fn at(buffer: &Buf<Workgroups>, index: usize) -> Self {
        Self::within(buffer, index * size_of::<Workgroups>())
    }

    /// Workgroup counts that are a member of a struct in a buffer, `member` bytes from
    /// its beginning.
    pub fn within<T>(buffer: &Buf<T>, member: usize) -> Self {
        Self::Indirect {
            buffer: buffer.name().to_owned(),
            offset: member as u64,
        }
    }
}

/// A command for the device.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Runs a compute pass.
    Dispatch {
        /// Pass name.
        pass: &'static str,
        /// Renamed or windowed bindings.
        binds: Vec<Bind>,
        /// Number of workgroups.
        groups: Groups,
    },
    /// Fills a buffer with zeros.
    Clear(String),
    /// Runs a raster pass.
    Draw(Draw),
    /// Sets every texel of a depth texture.
    ClearDepth(Target),
    /// Copies a texture into a buffer.
    CopyTexture(CopyTexture),
}

impl Command {
    /// Fills `buffer` with zeros.
    pub fn clear<T>(buffer: &Buf<T>) -> Self {
        Self::Clear(buffer.name().to_owned())
    }

    /// Runs `pass` in `groups` workgroups.
    pub fn in_groups(pass: &'static str, groups: Groups, binds: Vec<Bind>) -> Self {
        Self::Dispatch {
            pass,
            binds,
            groups,
        }
    }

    /// Returns the name of the pass that the command runs, if it runs one.
    pub fn pass(&self) -> Option<&'static str> {
        match self {
            Self::Dispatch { pass, .. } => Some(pass),
            Self::Draw(draw) => Some(draw.raster.name),
            Self::Clear(_) | Self::ClearDepth(_) | Self::CopyTexture(_) => None,
        }
    }

    /// Runs `pass` over `threads` threads, with every variable bound to the buffer of its own name.
    pub fn over(pass: &'static str, threads: usize) -> Self {
        Self::Dispatch {
            pass,
            binds: Vec::new(),
            groups: Groups::Threads(threads as u64),
        }
    }

    /// Same as [`Self::over`] with renamed bindings.
    pub fn with(pass: &'static str, threads: usize, binds: Vec<Bind>) -> Self {
        Self::Dispatch {
            pass,
            binds,
            groups: Groups::Threads(threads as u64),
        }
    }
}

/// Interval at which the operations of a dispatch are counted after its first run; runs in between
/// are assumed to do the same. A counted run takes twice as long.
const COUNTED_ONE_IN: u32 = 7;
/// 2³² over the golden ratio. Its multiples modulo 2³² are evenly distributed even over every
/// second or every seventh run, so that no periodicity of a solver coincides with the counting
/// (Weyl's equidistribution).
const GOLDEN: u32 = 0x9E37_79B9;

/// A command with its bindings created on a device.
pub(super) enum Recorded {
    Dispatch {
        pass: &'static str,
        binds: Vec<Bind>,
        group: BindGroup,
        size: Size,
        /// Bytes moved if all of its bindings are used: [`moved`].
        bytes: u64,
        /// Operations at the last count; `None` if there was none.
        operations: Cell<Option<Operations>>,
        /// Number of runs while operations were counted.
        runs: Cell<u32>,
    },
    Draw(BoundDraw),
    Clear(String),
    ClearDepth(Target),
    CopyTexture(CopyTexture),
}

pub(super) enum Size {
    Direct([u32; 3]),
    Indirect(String, u64),
}

/// Point in time of a traced dispatch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TracePoint {
    /// Before a dispatch: the buffers hold its inputs.
    Before,
    /// After a dispatch: the buffers hold its outputs.
    After,
}

/// Commands with their bind groups, to be run many times.
pub struct Recording {
    pub(super) steps: Vec<Recorded>,
}

impl Recording {
    /// Binds all commands to the program's buffers.
    pub fn new(program: &Program, commands: &[Command]) -> Self {
        Self {
            steps: commands
                .iter()
                .filter_map(|command| record(program, command))
                .collect(),
        }
    }

    /// Iterates over the names of the passes that it runs, in order.
    pub fn passes(&self) -> impl Iterator<Item = &'static str> {
        self.steps.iter().filter_map(Recorded::pass)
    }

    /// Submits all commands; returns without waiting unless `timer` measures them.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn run(&self, program: &Program, timer: Option<&mut Timer>) -> Result<(), GpuError> {
        Self::run_all(&[self], program, timer)
    }

    /// Submits several recordings, one after the other, in a single submission; otherwise
    /// like [`Self::run`].
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn run_all(
        recordings: &[&Self],
        program: &Program,
        timer: Option<&mut Timer>,
    ) -> Result<(), GpuError> {
        program.context.counters.submitted();
        if let Some(timer) = timer {
            return recordings
                .iter()
                .try_for_each(|recording| timer.run(recording, program));
        }
        let mut encoder = program
            .context
            .device
            .create_command_encoder(&Default::default());
        for recording in recordings {
            encode(&recording.steps, program, &mut encoder);
        }
        program.context.queue.submit([encoder.finish()]);
        program.context.check()
    }

    /// Runs one command at a time; `observe` is called before and after each dispatch, and may read
    /// any buffer.
    ///
    /// # Errors
    /// [`GpuError::Lost`], and the errors of `observe`.
    pub fn trace<E: From<GpuError>>(
        &self,
        program: &Program,
        mut observe: impl FnMut(TracePoint, &'static str, &[Bind]) -> Result<(), E>,
    ) -> Result<(), E> {
        for step in &self.steps {
            if let Recorded::Dispatch { pass, binds, .. } = step {
                observe(TracePoint::Before, pass, binds)?;
            }
            let mut encoder = program
                .context
                .device
                .create_command_encoder(&Default::default());
            encode(std::slice::from_ref(step), program, &mut encoder);
            program.context.queue.submit([encoder.finish()]);
            program.context.check()?;
            if let Recorded::Dispatch { pass, binds, .. } = step {
                observe(TracePoint::After, pass, binds)?;
            }
        }
        Ok(())
    }
}

pub(super) fn encode(steps: &[Recorded], program: &Program, encoder: &mut CommandEncoder) {
    let mut steps = steps.iter().peekable();
    while let Some(step) = steps.next() {
        match step {
            Recorded::Draw(drawn) => drawn.encode(program, encoder, None),
            Recorded::Clear(buffer) => encoder.clear_buffer(program.buffer(buffer), 0, None),
            Recorded::ClearDepth(target) => raster::clear_depth(program, encoder, target),
            Recorded::CopyTexture(copy) => raster::copy(program, encoder, copy),
            Recorded::Dispatch { .. } => {
                let mut pass = encoder.begin_compute_pass(&Default::default());
                dispatch(program, &mut pass, step);
                while let Some(next) =
                    steps.next_if(|next| matches!(next, Recorded::Dispatch { .. }))
                {
                    dispatch(program, &mut pass, next);
                }
            }
        }
    }
}

impl Recorded {
    /// Whether operations are to be counted before the next run: before the first, and before one
    /// in seven after it.
    pub(super) fn is_due(&self) -> bool {
        let turn = |runs: &Cell<u32>| runs.get().wrapping_mul(GOLDEN);
        matches!(self, Self::Dispatch { runs, .. } if turn(runs) < u32::MAX / COUNTED_ONE_IN)
    }

    /// Counts the operations of the next run, if this is a dispatch. Waits for the device.
    pub(super) fn count(&self, program: &Program) -> Result<(), GpuError> {
        if let Self::Dispatch {
            pass,
            binds,
            size,
            operations,
            ..
        } = self
        {
            operations.set(count(program, pass, binds, size)?);
        }
        Ok(())
    }

    /// Operations of a run while operations are counted, from the last count; `None` if counting
    /// was not possible.
    pub(super) fn ran(&self) -> Option<Operations> {
        let Self::Dispatch {
            operations, runs, ..
        } = self
        else {
            return None;
        };
        runs.set(runs.get().wrapping_add(1));
        operations.get()
    }

    /// Device memory traffic in bytes; 0 if unknown.
    pub(super) fn bytes(&self) -> u64 {
        match self {
            Self::Dispatch { bytes, .. } => *bytes,
            _ => 0,
        }
    }

    pub(super) fn pass(&self) -> Option<&'static str> {
        match self {
            Self::Dispatch { pass, .. } => Some(pass),
            Self::Draw(drawn) => Some(drawn.draw.raster.name),
            Self::Clear(_) | Self::ClearDepth(_) | Self::CopyTexture(_) => None,
        }
    }
}

fn record(program: &Program, command: &Command) -> Option<Recorded> {
    match command {
        Command::Draw(draw) => Some(Recorded::Draw(BoundDraw::new(program, draw))),
        Command::Clear(buffer) => Some(Recorded::Clear(buffer.clone())),
        Command::ClearDepth(target) => Some(Recorded::ClearDepth(target.clone())),
        Command::CopyTexture(copy) => Some(Recorded::CopyTexture(copy.clone())),
        Command::Dispatch {
            pass: name,
            binds,
            groups,
        } => {
            let pass = program.pass(name);
            let [columns, rows, _] = pass.workgroup_size;
            let size = match groups {
                Groups::Threads(0) => return None,
                Groups::Threads(threads) => {
                    Size::Direct(spread(&program.context, columns, *threads))
                }
                Groups::Pixels([width, height]) => {
                    Size::Direct([width.div_ceil(columns), height.div_ceil(rows), 1])
                }
                Groups::Indirect { buffer, offset } => Size::Indirect(buffer.clone(), *offset),
            };
            Some(Recorded::Dispatch {
                pass: name,
                binds: binds.clone(),
                group: bind(program, name, &pass.layout, &pass.bindings, binds, &[]),
                size,
                bytes: moved(program, &pass.bindings, binds),
                operations: Cell::default(),
                runs: Cell::default(),
            })
        }
    }
}

/// Returns the workgroups for `threads`, in two dimensions if one cannot hold them;
/// `shared/thread.wgsl` inverts this.
pub fn spread(context: &Context, workgroup_size: u32, threads: u64) -> [u32; 3] {
    let groups = threads.div_ceil(u64::from(workgroup_size));
    let most = u64::from(context.limits.max_compute_workgroups_per_dimension);
    let rows = groups.div_ceil(most).max(1);
    [groups.div_ceil(rows) as u32, rows as u32, 1]
}

/// Bytes of memory traffic if each bound buffer, or its window, is read once if the pass reads it,
/// and written once if the pass writes it.
fn moved(program: &Program, bindings: &[Binding], binds: &[Bind]) -> u64 {
    let bytes = |binding: &Binding| {
        let (_, _, length) = bound(program, binding, binds);
        length * (u64::from(binding.is_read) + u64::from(binding.is_written))
    };
    let storage = bindings
        .iter()
        .filter(|binding| binding.access.is_storage());
    storage.map(bytes).sum()
}

/// Buffer that a variable is bound to, and the byte offset and length of the bound range.
pub(super) fn bound<'a>(
    program: &'a Program,
    binding: &Binding,
    binds: &[Bind],
) -> (&'a Buffer, u64, u64) {
    let bind = binds.iter().find(|bind| bind.variable == binding.name);
    let buffer = program.buffer(bind.map_or(&binding.name, |bind| &bind.buffer));
    let window = bind.and_then(|bind| bind.window);
    let (offset, length) = window.unwrap_or((0, buffer.size()));
    (buffer, offset, length)
}

/// Creates the bind group of pass `name`; bindings listed in `apart`, by index, use the buffer
/// there instead of the program's.
pub(super) fn bind(
    program: &Program,
    name: &str,
    layout: &BindGroupLayout,
    bindings: &[Binding],
    binds: &[Bind],
    apart: &[(u32, Buffer)],
) -> BindGroup {
    let found = |binding: &Binding| binds.iter().find(|bind| bind.variable == binding.name);
    let target = |binding: &Binding| match found(binding) {
        Some(bind) => bind.buffer.clone(),
        None => binding.name.clone(),
    };
    // Entries borrow their views.
    let views: Vec<Option<TextureView>> = bindings
        .iter()
        .map(|binding| {
            let is_texture = matches!(binding.access, Access::Texture | Access::DepthTexture);
            let texture = is_texture.then(|| program.texture(&target(binding)));
            texture.map(|texture| texture.create_view(&Default::default()))
        })
        .collect();
    let resource = |binding: &Binding| match binding.access {
        Access::Sampler | Access::CompareSampler => {
            BindingResource::Sampler(program.sampler(&target(binding)))
        }
        _ => {
            let (buffer, offset, length) = bound(program, binding, binds);
            BindingResource::Buffer(wgpu::BufferBinding {
                buffer,
                offset,
                size: std::num::NonZeroU64::new(length),
            })
        }
    };
    let entries: Vec<wgpu::BindGroupEntry<'_>> = bindings
        .iter()
        .zip(&views)
        .filter(|(binding, _)| apart.iter().all(|(index, _)| *index != binding.index))
        .map(|(binding, view)| wgpu::BindGroupEntry {
            binding: binding.index,
            resource: match view {
                Some(view) => BindingResource::TextureView(view),
                None => resource(binding),
            },
        })
        .chain(apart.iter().map(|(binding, buffer)| wgpu::BindGroupEntry {
            binding: *binding,
            resource: buffer.as_entire_binding(),
        }))
        .collect();
    let descriptor = wgpu::BindGroupDescriptor {
        label: Some(name),
        layout,
        entries: &entries,
    };
    program.context.device.create_bind_group(&descriptor)
}

pub(super) fn dispatch(program: &Program, compute: &mut ComputePass<'_>, step: &Recorded) {
    let Recorded::Dispatch {
        pass, group, size, ..
    } = step
    else {
        return;
    };
    compute.set_pipeline(&program.pass(pass).pipeline);
    compute.set_bind_group(0, group, &[]);
    dispatch_sized(program, compute, size);
}

/// Dispatches `size` workgroups of the current pipeline.
pub(super) fn dispatch_sized(program: &Program, compute: &mut ComputePass<'_>, size: &Size) {
    match size {
        Size::Direct([x, y, z]) => compute.dispatch_workgroups(*x, *y, *z),
        Size::Indirect(buffer, offset) => {
            compute.dispatch_workgroups_indirect(program.buffer(buffer), *offset)
        }
    }
}
