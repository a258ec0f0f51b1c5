//! Passes recorded as data, and the one executor that runs them.

use std::cell::Cell;

use wgpu::{
    BindGroup, BindGroupLayout, BindingResource, Buffer, CommandEncoder, ComputePass, TextureView,
};

use super::{
    adapter::{Context, GpuError},
    buffer::{Buf, Workgroups},
    operations::{Operations, count},
    program::Program,
    raster::{self, CopyTexture, Draw, Drawn, Target},
    reflect::{Access, Binding},
};

pub use super::timer::Timer;

/// Where a shader variable finds its data, when not in the buffer, texture or sampler of its own name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bind {
    /// WGSL variable.
    pub variable: &'static str,
    /// Name of the buffer, texture or sampler.
    pub buffer: String,
    /// Byte offset and length; the whole buffer where `None`.
    pub window: Option<(u64, u64)>,
}

impl Bind {
    /// `variable` in all of `buffer`.
    pub fn whole<T>(variable: &'static str, buffer: &Buf<T>) -> Self {
        Self {
            variable,
            buffer: buffer.name().to_owned(),
            window: None,
        }
    }
}

/// How many workgroups a dispatch has.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Groups {
    /// Enough for so many threads; past the limit of one dimension they go out in two.
    Threads(u64),
    /// Enough for a thread a pixel of a picture.
    Pixels([u32; 2]),
    /// [`Workgroups`] that stand in a buffer at a byte offset; zeros make the dispatch empty.
    Indirect {
        /// Buffer name.
        buffer: String,
        /// Bytes.
        offset: u64,
    },
}

impl Groups {
    /// Those that stand in a buffer.
    pub fn at(buffer: &Buf<Workgroups>, index: usize) -> Self {
        Self::within(buffer, index * size_of::<Workgroups>())
    }

    /// Those that are a member of a struct, so many bytes from its beginning, in a buffer.
    pub fn within<T>(buffer: &Buf<T>, member: usize) -> Self {
        Self::Indirect {
            buffer: buffer.name().to_owned(),
            offset: member as u64,
        }
    }
}

/// One thing for the device to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Runs a pass.
    Dispatch {
        /// Pass name.
        pass: &'static str,
        /// Renamed or windowed bindings.
        binds: Vec<Bind>,
        /// Size.
        groups: Groups,
    },
    /// Zeroes a buffer.
    Clear(String),
    /// Runs a raster pass.
    Draw(Draw),
    /// Sets every texel of a depth texture.
    ClearDepth(Target),
    /// Copies a texture into a buffer.
    CopyTexture(CopyTexture),
}

impl Command {
    /// Zeroes `buffer`.
    pub fn clear<T>(buffer: &Buf<T>) -> Self {
        Self::Clear(buffer.name().to_owned())
    }

    /// Runs `pass` in so many workgroups.
    pub fn in_groups(pass: &'static str, groups: Groups, binds: Vec<Bind>) -> Self {
        Self::Dispatch {
            pass,
            binds,
            groups,
        }
    }

    /// Name of the pass that it runs.
    pub fn pass(&self) -> Option<&'static str> {
        match self {
            Self::Dispatch { pass, .. } => Some(pass),
            Self::Draw(draw) => Some(draw.raster.name),
            Self::Clear(_) | Self::ClearDepth(_) | Self::CopyTexture(_) => None,
        }
    }

    /// Runs `pass` over `threads` threads with every binding in the buffer of its own name.
    pub fn over(pass: &'static str, threads: usize) -> Self {
        Self::Dispatch {
            pass,
            binds: Vec::new(),
            groups: Groups::Threads(threads as u64),
        }
    }

    /// The same with bindings of other names.
    pub fn with(pass: &'static str, threads: usize, binds: Vec<Bind>) -> Self {
        Self::Dispatch {
            pass,
            binds,
            groups: Groups::Threads(threads as u64),
        }
    }
}

/// A dispatch's operations are counted at its first run and then at one in so many, and taken to be as many in between: a run that is
/// counted takes as long again.
const COUNTED_ONE_IN: u32 = 7;
/// 2³² over the golden ratio: its multiples, as parts of 2³², lie evenly among every second or seventh run too, so that no rhythm of a
/// solver falls in with the count (Weyl's equidistribution).
const GOLDEN: u32 = 0x9E37_79B9;

/// A command with its bindings made on a device.
pub(super) enum Recorded {
    Dispatch {
        pass: &'static str,
        binds: Vec<Bind>,
        group: BindGroup,
        size: Size,
        /// What it moves at least where all of its bindings are used: [`moved`].
        bytes: u64,
        /// Operations that it did when they were last counted, where they were.
        operations: Cell<Option<Operations>>,
        /// How often it ran while operations were counted.
        runs: Cell<u32>,
    },
    Draw(Drawn),
    Clear(String),
    ClearDepth(Target),
    CopyTexture(CopyTexture),
}

pub(super) enum Size {
    Direct([u32; 3]),
    Indirect(String, u64),
}

/// Where a traced recording stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// A dispatch is about to run: its inputs stand in the buffers.
    Before,
    /// It has run: its outputs do.
    After,
}

/// Commands with their bind groups, to be run many times.
pub struct Recording {
    pub(super) steps: Vec<Recorded>,
}

impl Recording {
    /// Binds every command to the program's buffers.
    pub fn new(program: &Program, commands: &[Command]) -> Self {
        Self {
            steps: commands
                .iter()
                .filter_map(|command| record(program, command))
                .collect(),
        }
    }

    /// Names of the passes that it runs, in order.
    pub fn passes(&self) -> impl Iterator<Item = &'static str> {
        self.steps.iter().filter_map(Recorded::pass)
    }

    /// Submits all of it; returns without waiting unless `timer` measures.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn run(&self, program: &Program, timer: Option<&mut Timer>) -> Result<(), GpuError> {
        Self::run_all(&[self], program, timer)
    }

    /// Submits one recording after the other at once, like [`Self::run`].
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn run_all(
        recordings: &[&Self],
        program: &Program,
        timer: Option<&mut Timer>,
    ) -> Result<(), GpuError> {
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

    /// Runs dispatch by dispatch; `observe` is called before and after each, and may read any buffer.
    ///
    /// # Errors
    /// [`GpuError::Lost`], and what `observe` returns.
    pub fn trace<E: From<GpuError>>(
        &self,
        program: &Program,
        mut observe: impl FnMut(Moment, &'static str, &[Bind]) -> Result<(), E>,
    ) -> Result<(), E> {
        for step in &self.steps {
            if let Recorded::Dispatch { pass, binds, .. } = step {
                observe(Moment::Before, pass, binds)?;
            }
            let mut encoder = program
                .context
                .device
                .create_command_encoder(&Default::default());
            encode(std::slice::from_ref(step), program, &mut encoder);
            program.context.queue.submit([encoder.finish()]);
            program.context.check()?;
            if let Recorded::Dispatch { pass, binds, .. } = step {
                observe(Moment::After, pass, binds)?;
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
    /// Whether its operations are to be counted before its next run: before the first, and before one in so many after it.
    pub(super) fn is_due(&self) -> bool {
        let turn = |runs: &Cell<u32>| runs.get().wrapping_mul(GOLDEN);
        matches!(self, Self::Dispatch { runs, .. } if turn(runs) < u32::MAX / COUNTED_ONE_IN)
    }

    /// Counts what its next run does, where it is a dispatch. Waits for the device.
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

    /// Operations of a run that was made while operations are counted, as last counted; `None` where that was not possible.
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

    /// What of the device's memory it moves at least; 0 where that is not known.
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
        Command::Draw(draw) => Some(Recorded::Draw(Drawn::new(program, draw))),
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

/// Workgroups for `threads`, in two dimensions where one cannot hold them; `shared/thread.wgsl` undoes it.
pub fn spread(context: &Context, workgroup_size: u32, threads: u64) -> [u32; 3] {
    let groups = threads.div_ceil(u64::from(workgroup_size));
    let most = u64::from(context.limits.max_compute_workgroups_per_dimension);
    let rows = groups.div_ceil(most).max(1);
    [groups.div_ceil(rows) as u32, rows as u32, 1]
}

/// Bytes that pass over the device's memory if each buffer that is bound, or its window, is read once where the pass reads it and written
/// once where it writes it.
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

/// The buffer that a variable is bound to, and the bytes of it: where they begin, and how many.
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

/// The bind group of pass `name`; of bindings in `apart`, by index, with the buffer there in place of the program's.
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

/// So many workgroups of the pass that is set.
pub(super) fn dispatch_sized(program: &Program, compute: &mut ComputePass<'_>, size: &Size) {
    match size {
        Size::Direct([x, y, z]) => compute.dispatch_workgroups(*x, *y, *z),
        Size::Indirect(buffer, offset) => {
            compute.dispatch_workgroups_indirect(program.buffer(buffer), *offset)
        }
    }
}
