//! What a frame's passes write, at the size of the padded frame.

use wgpu::{Buffer, BufferUsages};

use crate::{
    gpu::adapter::Context,
    render::{RenderError, frame::Extent, pass::storage, uniform},
    scene::look::{AovSpec, Look},
};

/// Buffers of the whole padded frame.
pub(super) struct Buffers {
    pub(super) depth: [Buffer; 2],
    pub(super) thickness: Buffer,
    pub(super) solid_depth: Buffer,
    pub(super) solid_packed: Buffer,
    pub(super) spray: Option<Buffer>,
    pub(super) owner: Option<Buffer>,
}

impl Buffers {
    /// Those that the look calls for.
    pub(super) fn new(
        context: &Context,
        look: &Look,
        extent: &Extent,
    ) -> Result<Self, RenderError> {
        let pixels = extent.pixels();
        let spray = match look.spec().water.spray {
            Some(_) => Some(storage(context, "spray", pixels)?),
            None => None,
        };
        let owner = match look.wants(AovSpec::Forward) {
            true => Some(storage(context, "owner", 4 * pixels)?),
            false => None,
        };
        Ok(Self {
            depth: [
                storage(context, "depth", 4 * pixels)?,
                storage(context, "depth", 4 * pixels)?,
            ],
            // Half the resolution on both sides, four bytes a cell.
            thickness: storage(context, "thickness", pixels)?,
            solid_depth: storage(context, "solid depth", 4 * pixels)?,
            solid_packed: storage(context, "solid normal", 4 * pixels)?,
            spray,
            owner,
        })
    }
}

/// A uniform for one camera.
pub(super) fn camera_buffer(context: &Context) -> Buffer {
    context.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("camera"),
        size: size_of::<uniform::Camera>() as u64,
        usage: BufferUsages::UNIFORM | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}
