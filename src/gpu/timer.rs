//! Time per pass.

use std::{collections::BTreeMap, time::Instant};

use wgpu::{CommandEncoder, QuerySet};

use super::{
    adapter::Context,
    error::GpuError,
    operations::Operations,
    program::Program,
    recording::{Recorded, Recording, dispatch, encode},
};

/// Time per pass, summed over runs.
pub struct Timer {
    clock: Clock,
    /// Whether operations are counted as well: [`Context::counts_operations`].
    counts: bool,
    total: BTreeMap<&'static str, Total>,
}

/// Totals over all runs of a pass.
#[derive(Clone, Copy)]
struct Total {
    seconds: f64,
    runs: u64,
    bytes: u64,
    operations: Option<Operations>,
}

enum Clock {
    /// Device timestamps.
    Device(Queries),
    /// Host clock: each command is submitted and waited for separately.
    Host,
}

struct Queries {
    set: QuerySet,
    resolved: wgpu::Buffer,
    staging: wgpu::Buffer,
    seconds_per_tick: f64,
}

/// Commands between two readbacks; each takes two queries.
const TIMED_AT_ONCE: usize = wgpu::QUERY_SET_MAX_QUERIES as usize / 2;

impl Timer {
    /// Uses device timestamps; the host clock on adapters without them, and on software adapters,
    /// whose timestamps tell when a pass was queued.
    pub fn new(context: &Context) -> Self {
        let is_software = context.is_software;
        let clock = match context.has_timestamps && !is_software {
            true => Clock::Device(Queries::new(context)),
            false => Clock::Host,
        };
        Self {
            clock,
            counts: context.counts_operations,
            total: BTreeMap::new(),
        }
    }

    /// Calls `made` for each pass, by name, with its seconds, its runs, the bytes that its runs
    /// move if each binding is read and written once as far as the pass reads and writes it (0 for
    /// raster passes), and the operations of its runs. Operations of a dispatch are counted at its
    /// first run and at one in seven after it, and assumed to be the same in between; `None` for
    /// raster passes, if counting is off, and if the adapter does not support one buffer more than
    /// the pass has.
    pub fn times<T>(
        &self,
        made: impl Fn(&'static str, f64, u64, u64, Option<Operations>) -> T,
    ) -> Vec<T> {
        let total = self.total.iter();
        total
            .map(|(pass, of)| made(pass, of.seconds, of.runs, of.bytes, of.operations))
            .collect()
    }

    pub(super) fn run(&mut self, recording: &Recording, program: &Program) -> Result<(), GpuError> {
        let (counts, total) = (self.counts, &mut self.total);
        let mut add = |step: &Recorded, seconds: f64| {
            if let Some(pass) = step.pass() {
                let total = total.entry(pass).or_insert(Total {
                    seconds: 0.0,
                    runs: 0,
                    bytes: 0,
                    operations: counts.then_some([0; 2]),
                });
                total.seconds += seconds;
                total.runs += 1;
                total.bytes += step.bytes();
                if counts {
                    let both = total.operations.zip(step.ran());
                    total.operations = both.map(|(sum, more)| [sum[0] + more[0], sum[1] + more[1]]);
                }
            }
        };
        let is_due = |step: &Recorded| counts && step.is_due();
        for steps in recording.steps.chunk_by(|_, next| !is_due(next)) {
            if let Some(first) = steps.first().filter(|first| is_due(first)) {
                first.count(program)?;
            }
            match &self.clock {
                Clock::Device(queries) => steps
                    .chunks(TIMED_AT_ONCE)
                    .try_for_each(|steps| queries.run(steps, program, &mut add))?,
                Clock::Host => steps
                    .iter()
                    .try_for_each(|step| run_alone(step, program, &mut add))?,
            }
        }
        Ok(())
    }
}

fn run_alone(
    step: &Recorded,
    program: &Program,
    add: &mut impl FnMut(&Recorded, f64),
) -> Result<(), GpuError> {
    let context = &program.context;
    let mut encoder = context.device.create_command_encoder(&Default::default());
    encode(std::slice::from_ref(step), program, &mut encoder);
    let begin = Instant::now();
    context.queue.submit([encoder.finish()]);
    context.wait()?;
    add(step, begin.elapsed().as_secs_f64());
    Ok(())
}

impl Queries {
    fn new(context: &Context) -> Self {
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
        Self {
            set: device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("pass times"),
                ty: wgpu::QueryType::Timestamp,
                count: wgpu::QUERY_SET_MAX_QUERIES,
            }),
            resolved: buffer(wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC),
            staging: buffer(wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ),
            seconds_per_tick: f64::from(context.queue.get_timestamp_period()) * 1e-9,
        }
    }

    fn run(
        &self,
        steps: &[Recorded],
        program: &Program,
        add: &mut impl FnMut(&Recorded, f64),
    ) -> Result<(), GpuError> {
        let context = &program.context;
        let mut encoder = context.device.create_command_encoder(&Default::default());
        let mut timed = Vec::new();
        for step in steps {
            if self.encode(step, program, &mut encoder, 2 * timed.len() as u32) {
                timed.push(step);
            }
        }
        let count = 2 * timed.len();
        encoder.resolve_query_set(&self.set, 0..count as u32, &self.resolved, 0);
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
            for (step, pair) in timed.iter().zip(ticks.chunks_exact(2)) {
                let elapsed = pair[1].saturating_sub(pair[0]) as f64;
                add(step, elapsed * self.seconds_per_tick);
            }
        }
        self.staging.unmap();
        Ok(())
    }

    /// Encodes a command; a pass writes its begin and end to the query `first` and the next one.
    /// Returns whether it is a pass.
    fn encode(
        &self,
        step: &Recorded,
        program: &Program,
        encoder: &mut CommandEncoder,
        first: u32,
    ) -> bool {
        let (beginning, end) = (Some(first), Some(first + 1));
        match step {
            Recorded::Dispatch { pass: name, .. } => {
                let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
                    label: Some(name),
                    timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                        query_set: &self.set,
                        beginning_of_pass_write_index: beginning,
                        end_of_pass_write_index: end,
                    }),
                });
                dispatch(program, &mut pass, step);
            }
            Recorded::Draw(drawn) => {
                let timestamps = wgpu::RenderPassTimestampWrites {
                    query_set: &self.set,
                    beginning_of_pass_write_index: beginning,
                    end_of_pass_write_index: end,
                };
                drawn.encode(program, encoder, Some(timestamps));
            }
            Recorded::Clear(_) | Recorded::ClearDepth(_) | Recorded::CopyTexture(_) => {
                encode(std::slice::from_ref(step), program, encoder);
                return false;
            }
        }
        true
    }
}
