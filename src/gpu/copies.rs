//! Copies between the buffers of two programs on one device.

use super::{buffer::Buf, program::Program};

/// A copy between buffers of two programs.
pub struct BufferCopy {
    source: String,
    first: u64,
    target: String,
    place: u64,
    bytes: u64,
}

impl BufferCopy {
    /// The first `count` values of `source`, to the beginning of `target`.
    pub fn of<T>(source: &Buf<T>, target: &Buf<T>, count: usize) -> Self {
        Self {
            source: source.name().to_owned(),
            first: source.place(0),
            target: target.name().to_owned(),
            place: target.place(0),
            bytes: (count * size_of::<T>()) as u64,
        }
    }
}

impl Program {
    /// Copies values of buffers of another program on the same device into buffers of this one, in
    /// a single submission.
    pub fn copy_from(&self, from: &Self, copies: &[BufferCopy]) {
        let mut encoder = (self.context.device).create_command_encoder(&Default::default());
        for copy in copies {
            let [source, to] = [from.buffer(&copy.source), self.buffer(&copy.target)];
            encoder.copy_buffer_to_buffer(source, copy.first, to, copy.place, copy.bytes);
        }
        self.context.queue.submit([encoder.finish()]);
        self.context.counters.submitted();
    }
}
