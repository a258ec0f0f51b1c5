//! Passes recorded as data, and the one executor that runs them.

use std::collections::BTreeMap;

use wgpu::{BindGroup, CommandEncoder, ComputePass, QuerySet};

use super::{
    adapter::{Context, GpuError},
    buffer::{Buf, Workgroups},
    program::{Pass, Program},
};

/// Where a shader variable finds its data, when not in the buffer of its own name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bind {
    /// WGSL variable.
    pub variable: &'static str,
    /// Buffer name.
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
#[derive(Clone, Debug, PartialEq, Eq)]
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
}

impl Command {
    /// Zeroes `buffer`.
    pub fn clear<T>(buffer: &Buf<T>) -> Self {
        Self::Clear(buffer.name().to_owned())
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

enum Step {
    Dispatch {
        pass: &'static str,
        binds: Vec<Bind>,
        group: BindGroup,
        size: Size,
    },
    Clear(String),
}

enum Size {
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
    steps: Vec<Step>,
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
        self.steps.iter().filter_map(|step| match step {
            Step::Dispatch { pass, .. } => Some(*pass),
            Step::Clear(_) => None,
        })
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
            if let Step::Dispatch { pass, binds, .. } = step {
                observe(Moment::Before, pass, binds)?;
            }
            let mut encoder = program
                .context
                .device
                .create_command_encoder(&Default::default());
            encode(std::slice::from_ref(step), program, &mut encoder);
            program.context.queue.submit([encoder.finish()]);
            program.context.check()?;
            if let Step::Dispatch { pass, binds, .. } = step {
                observe(Moment::After, pass, binds)?;
            }
        }
        Ok(())
    }
}

fn encode(steps: &[Step], program: &Program, encoder: &mut CommandEncoder) {
    let mut steps = steps.iter().peekable();
    while let Some(step) = steps.peek() {
        if let Step::Clear(buffer) = step {
            encoder.clear_buffer(program.buffer(buffer), 0, None);
            steps.next();
            continue;
        }
        let mut pass = encoder.begin_compute_pass(&Default::default());
        while let Some(step @ Step::Dispatch { .. }) = steps.peek() {
            dispatch(program, &mut pass, step);
            steps.next();
        }
    }
}

fn record(program: &Program, command: &Command) -> Option<Step> {
    match command {
        Command::Clear(buffer) => Some(Step::Clear(buffer.clone())),
        Command::Dispatch {
            pass: name,
            binds,
            groups,
        } => {
            let pass = program.pass(name);
            let size = match groups {
                Groups::Threads(0) => return None,
                Groups::Threads(threads) => {
                    Size::Direct(spread(&program.context, pass.workgroup_size, *threads))
                }
                Groups::Indirect { buffer, offset } => Size::Indirect(buffer.clone(), *offset),
            };
            Some(Step::Dispatch {
                pass: name,
                binds: binds.clone(),
                group: bind(program, pass, binds),
                size,
            })
        }
    }
}

/// Workgroups for `threads`, in two dimensions where one cannot hold them; `shared/thread.wgsl` undoes it.
pub fn spread(context: &Context, workgroup_size: u32, threads: u64) -> [u32; 3] {
    let groups = threads.div_ceil(u64::from(workgroup_size));
    let most = u64::from(context.limits.max_compute_workgroups_per_dimension);
    let rows = groups.div_ceil(most);
    [groups.div_ceil(rows) as u32, rows as u32, 1]
}

fn bind(program: &Program, pass: &Pass, binds: &[Bind]) -> BindGroup {
    let entries: Vec<wgpu::BindGroupEntry<'_>> = pass
        .bindings
        .iter()
        .map(|binding| {
            let special = binds.iter().find(|bind| bind.variable == binding.name);
            let buffer =
                program.buffer(special.map_or(binding.name.as_str(), |bind| bind.buffer.as_str()));
            let window = special.and_then(|bind| bind.window);
            wgpu::BindGroupEntry {
                binding: binding.index,
                resource: wgpu::BindingResource::Buffer(wgpu::BufferBinding {
                    buffer,
                    offset: window.map_or(0, |(offset, _)| offset),
                    size: window.and_then(|(_, size)| std::num::NonZeroU64::new(size)),
                }),
            }
        })
        .collect();
    program
        .context
        .device
        .create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(pass.name),
            layout: &pass.layout,
            entries: &entries,
        })
}

fn dispatch(program: &Program, compute: &mut ComputePass<'_>, step: &Step) {
    let Step::Dispatch {
        pass, group, size, ..
    } = step
    else {
        return;
    };
    compute.set_pipeline(&program.pass(pass).pipeline);
    compute.set_bind_group(0, group, &[]);
    match size {
        Size::Direct([x, y, z]) => compute.dispatch_workgroups(*x, *y, *z),
        Size::Indirect(buffer, offset) => {
            compute.dispatch_workgroups_indirect(program.buffer(buffer), *offset)
        }
    }
}

/// Time per pass on the device's own clock, summed over runs.
pub struct Timer {
    queries: QuerySet,
    resolved: wgpu::Buffer,
    staging: wgpu::Buffer,
    seconds_per_tick: f64,
    /// Seconds and runs by pass name.
    pub total: BTreeMap<&'static str, (f64, u64)>,
}

/// Dispatches between two readings; two queries each.
const TIMED_AT_ONCE: usize = wgpu::QUERY_SET_MAX_QUERIES as usize / 2;

impl Timer {
    /// `None` where the adapter has no timestamp queries.
    pub fn new(context: &Context) -> Option<Self> {
        if !context.has_timestamps {
            return None;
        }
        let device = &context.device;
        let bytes = u64::from(wgpu::QUERY_SET_MAX_QUERIES) * 8;
        let buffer = |usage| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: bytes,
                usage,
                mapped_at_creation: false,
            })
        };
        Some(Self {
            queries: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count: wgpu::QUERY_SET_MAX_QUERIES,
            }),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            staging: buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ),
            seconds_per_tick: f64::from(context.queue.get_timestamp_period()) * 1e-9,
            total: BTreeMap::new(),
        })
    }

    fn run(&mut self, recording: &Recording, program: &Program) -> Result<(), GpuError> {
        for steps in recording.steps.chunks(TIMED_AT_ONCE) {
            self.run_some(steps, program)?;
        }
        Ok(())
    }

    fn run_some(&mut self, steps: &[Step], program: &Program) -> Result<(), GpuError> {
        let context = &program.context;
        let mut encoder = context.device.create_command_encoder(&Default::default());
        let mut names = Vec::new();
        for step in steps {
            match step {
                Step::Clear(buffer) => encoder.clear_buffer(program.buffer(buffer), 0, None),
                Step::Dispatch { pass: name, .. } => {
                    let first = 2 * names.len() as u32;
                    let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                        label: Some(name),
                        timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                            query_set: &self.queries,
                            beginning_of_pass_write_index: Some(first),
                            end_of_pass_write_index: Some(first + 1),
                        }),
                    });
                    dispatch(program, &mut pass, step);
                    names.push(*name);
                }
            }
        }
        let count = 2 * names.len();
        encoder.resolve_query_set(&self.queries, 0..count as u32, &self.resolved, 0);
        encoder.copy_buffer_to_buffer(&self.resolved, 0, &self.staging, 0, 8 * count as u64);
        context.queue.submit([encoder.finish()]);
        self.staging.map_async(wgpu::MapMode::Read, .., |_| {});
        context.wait()?;
        {
            let view = self
                .staging
                .get_mapped_range(..)
                .map_err(|error| GpuError::Lost(error.to_string()))?;
            let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(&view[..8 * count]);
            for (name, pair) in names.iter().zip(ticks.chunks_exact(2)) {
                let entry = self.total.entry(name).or_default();
                entry.0 += pair[1].saturating_sub(pair[0]) as f64 * self.seconds_per_tick;
                entry.1 += 1;
            }
        }
        self.staging.unmap();
        Ok(())
    }
}
