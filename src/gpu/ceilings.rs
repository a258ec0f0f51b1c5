//! Measures the peak performance of a device, with which passes are compared.

use super::{
    adapter::Context,
    buffer::Buf,
    error::GpuError,
    operations::Operations,
    program::Program,
    recording::{Command, Recording, Timer},
    sort::plain_pass,
};

const COPYING: &str = "measure/copy";
const COPIED: Buf<[f32; 4]> = Buf::new("copied");
const COPY: Buf<[f32; 4]> = Buf::new("copy");
/// Bytes of each of the two buffers, if the adapter supports it: more than the caches of today's
/// processors and GPUs.
const BYTES: u64 = 256 << 20;

const COMPUTING: &str = "measure/arithmetic";
const ESCAPED: Buf<[f32; 4]> = Buf::new("escaped");
/// Threads of the first and of the last attempt.
const THREADS: [usize; 2] = [1 << 14, 1 << 24];
/// Run time that is long enough to be distinguished from the launch overhead, seconds.
const LONG: f64 = 0.02;

/// Number of runs; the first one pays for pages that were never touched.
const RUNS: usize = 6;

/// Peak performance of a device, as in the roofline model (Williams, Waterman and Patterson 2009).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ceilings {
    /// Bytes per second of a pass that reads one buffer and writes another (McCalpin 1995, copy).
    pub bandwidth: f64,
    /// Operations per second ([`super::operations::Operations`]) of a pass that only multiplies and
    /// adds f32.
    pub arithmetic: f64,
    /// Time of a pass with one workgroup and next to no work, seconds, by the clock that
    /// times passes.
    pub start: f64,
}

impl Ceilings {
    /// Measures the best of several runs of each. Temporarily allocates two buffers of up to
    /// 256 MiB.
    ///
    /// # Errors
    /// [`GpuError::Shader`], [`GpuError::Lost`].
    pub fn measure(context: &Context) -> Result<Self, GpuError> {
        let mut context = context.clone();
        context.counts_operations = false;
        let limits = &context.limits;
        let bytes = BYTES
            .min(limits.max_storage_buffer_binding_size)
            .min(limits.max_buffer_size);
        let count = bytes as usize / size_of::<[f32; 4]>();
        let buffers = [COPIED.sized(count), COPY.sized(count)];
        let program = Program::new(&context, &buffers, &[plain_pass(COPYING)], &[])?;
        let bandwidth = best(&program, COPYING, count, |seconds, bytes, _| {
            bytes as f64 / seconds
        })?;
        let start = -best(&program, COPYING, 1, |seconds, _, _| -seconds)?;
        drop(program);
        Ok(Self {
            bandwidth,
            arithmetic: arithmetic(&context)?,
            start,
        })
    }
}

fn arithmetic(context: &Context) -> Result<f64, GpuError> {
    let mut context = context.clone();
    context.counts_operations = true;
    let buffers = [ESCAPED.sized(1)];
    let program = Program::new(&context, &buffers, &[plain_pass(COMPUTING)], &[])?;
    let [mut threads, most] = THREADS;
    while threads < most && -best(&program, COMPUTING, threads, |seconds, _, _| -seconds)? < LONG {
        threads *= 2;
    }
    best(&program, COMPUTING, threads, |seconds, _, operations| {
        operations.iter().sum::<u64>() as f64 / seconds
    })
}

/// Largest value of `told(seconds, bytes, operations)` over single runs of a pass with
/// `threads` threads.
fn best(
    program: &Program,
    pass: &'static str,
    threads: usize,
    told: impl Fn(f64, u64, Operations) -> f64,
) -> Result<f64, GpuError> {
    let recording = Recording::new(program, &[Command::over(pass, threads)]);
    let mut best = f64::NEG_INFINITY;
    for _ in 0..RUNS {
        let mut timer = Timer::new(&program.context);
        recording.run(program, Some(&mut timer))?;
        let rates = timer.times(|_, seconds, _, bytes, counted| {
            told(seconds, bytes, counted.unwrap_or_default())
        });
        best = rates.into_iter().fold(best, f64::max);
    }
    Ok(best)
}
