//! Full-frame buffers, and the bands and tiles in which a large frame is drawn.
//!
//! What a pixel looks up elsewhere in the frame (depth, thickness, solids) lies in buffers of the whole
//! frame, four bytes a pixel, so no filter ever meets a tile's edge. Textures are drawn into only in
//! tiles, and the picture itself is gathered in bands of rows: those two are what limits apply to.

use wgpu::{BindGroup, Buffer};

use super::RenderError;
use super::pass::{ComputePass, Slot, Timer, folded, storage, uniform};
use super::uniform::{Band as BandUniform, Fill};
use crate::gpu::adapter::Context;

/// Sizes in pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Extent {
    pub(super) picture: [u32; 2],
    /// With a margin on all sides, so that filters have neighbours at the picture's edge. The width is a
    /// multiple of 64, which makes a row of four-byte texels one that textures can be copied to.
    pub(super) size: [u32; 2],
    pub(super) margin: [u32; 2],
}

impl Extent {
    pub(super) fn new(width: u32, height: u32) -> Self {
        // 4 % of the width: about the reach of the widest smoothing at the usual distances.
        let margin = (width / 25).max(16);
        let padded = (width + 2 * margin).next_multiple_of(64);
        let tall = (height + 2 * margin).next_multiple_of(4);
        Self {
            picture: [width, height],
            size: [padded, tall],
            margin: [(padded - width) / 2, (tall - height) / 2],
        }
    }

    pub(super) fn pixels(&self) -> u64 {
        u64::from(self.size[0]) * u64::from(self.size[1])
    }
}

/// Rows of the picture that share a buffer.
pub(super) struct Band {
    pub(super) rows: u32,
    pub(super) uniform: Buffer,
    pub(super) colour: Buffer,
    /// Ten floats a pixel; only where the look asks for AOVs.
    pub(super) aovs: Option<Buffer>,
}

/// Bytes of one pixel's AOVs.
pub(super) const AOV_BYTES: u64 = 40;

/// `row_limit` is the most rows in a band.
pub(super) fn bands(
    context: &Context,
    extent: &Extent,
    aovs: bool,
    row_limit: u32,
) -> Result<Vec<Band>, RenderError> {
    let [width, height] = extent.picture;
    let pixel = if aovs { AOV_BYTES } else { 16 };
    let binding = context.limits.max_storage_buffer_binding_size;
    let bytes = binding.min(context.limits.max_buffer_size);
    let fitting = u32::try_from(bytes / (pixel * u64::from(width))).unwrap_or(u32::MAX);
    let rows = fitting.min(row_limit).max(1);
    (0..height)
        .step_by(rows as usize)
        .map(|row| {
            let rows = rows.min(height - row);
            let pixels = u64::from(width) * u64::from(rows);
            Ok(Band {
                rows,
                uniform: uniform(
                    context,
                    "band",
                    &BandUniform {
                        row,
                        rows,
                        pad: [0; 2],
                    },
                ),
                colour: storage(context, "picture band", 16 * pixels)?,
                aovs: match aovs {
                    true => Some(storage(context, "AOV band", AOV_BYTES * pixels)?),
                    false => None,
                },
            })
        })
        .collect()
}

/// Sets every word of a buffer.
pub(super) struct Filler {
    pass: ComputePass,
}

pub(super) struct Filling {
    group: BindGroup,
    groups: [u32; 2],
}

impl Filler {
    pub(super) fn new(context: &Context) -> Result<Self, RenderError> {
        let slots = [Slot::Uniform, Slot::Write];
        let pass = ComputePass::new(context, "ssfr/fill", "ssfr/fill", &[], &slots)?;
        Ok(Self { pass })
    }

    pub(super) fn prepare(
        &self,
        context: &Context,
        buffer: &Buffer,
        word: u32,
        count: u64,
    ) -> Filling {
        let count = u32::try_from(count).unwrap_or(u32::MAX);
        let params = Fill {
            word,
            count,
            pad: [0; 2],
        };
        let params = uniform(context, "fill", &params);
        let group = self.pass.bind(
            context,
            vec![params.as_entire_binding(), buffer.as_entire_binding()],
        );
        Filling {
            group,
            groups: folded(count.div_ceil(64)),
        }
    }

    pub(super) fn run(
        &self,
        encoder: &mut wgpu::CommandEncoder,
        timer: &mut Timer,
        filling: &Filling,
    ) {
        self.pass
            .run(encoder, timer, &filling.group, filling.groups);
    }
}

/// `FAR` of `camera.wgsl`.
pub(super) const FAR: f32 = 1e30;
