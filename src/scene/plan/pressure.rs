//! What the pressure projection needs on the device.

use crate::{
    gpu::program::{BufferSpec, PassSpec},
    scene::flip::Flip,
};

pub(super) fn buffers(_settings: &Flip, slots: usize) -> Vec<BufferSpec> {
    vec![crate::gpu::sort::storage("face_displacement", 12 * 512 * slots as u64)]
}

pub(super) fn passes(_settings: &Flip) -> Vec<PassSpec> {
    Vec::new()
}
