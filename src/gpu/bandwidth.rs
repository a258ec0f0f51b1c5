//! What a device's memory gives, measured.

use super::{
    adapter::{Context, GpuError},
    buffer::Buf,
    program::Program,
    recording::{Command, Recording, Timer},
    sort::plain_pass,
};

const PASS: &str = "measure/copy";
const COPIED: Buf<[f32; 4]> = Buf::new("copied");
const COPY: Buf<[f32; 4]> = Buf::new("copy");

/// Bytes of each of the two buffers where the adapter binds so many: more than the caches of today's processors and GPUs hold.
const BYTES: u64 = 256 << 20;
/// The first run pays for pages that were never touched.
const RUNS: usize = 6;

/// Bytes a second that a pass reaches which reads one buffer and writes another: the best of some runs (McCalpin 1995, copy). Two buffers of
/// up to 256 MiB are made for it, and given back.
///
/// # Errors
/// [`GpuError::Shader`], [`GpuError::Lost`].
pub fn measure(context: &Context) -> Result<f64, GpuError> {
    let limits = &context.limits;
    let bytes = BYTES
        .min(limits.max_storage_buffer_binding_size)
        .min(limits.max_buffer_size);
    let count = bytes as usize / size_of::<[f32; 4]>();
    let buffers = [COPIED.sized(count), COPY.sized(count)];
    let program = Program::new(context, &buffers, &[plain_pass(PASS)], &[])?;
    let recording = Recording::new(&program, &[Command::over(PASS, count)]);
    let mut best = 0.0f64;
    for _ in 0..RUNS {
        let mut timer = Timer::new(context);
        recording.run(&program, Some(&mut timer))?;
        let rates = timer.times(|_, seconds, _, bytes| bytes as f64 / seconds);
        best = rates.into_iter().fold(best, f64::max);
    }
    Ok(best)
}
