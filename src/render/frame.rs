//! Full-frame buffers, and the bands and tiles in which a large frame is drawn.
//!
//! What a pixel looks up elsewhere in the frame (depth, thickness, solids) lies in buffers of the whole
//! frame, four bytes a pixel, so no filter ever meets a tile's edge. Textures are drawn into only in
//! tiles, and the picture itself is gathered in bands of rows: those two are what limits apply to.

use super::buffers::{aovs, picture};

/// Sizes in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
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

    pub(super) fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }
}

/// Rows of each band of the picture: as many as a storage buffer of `most` bytes holds, but no more than `row_limit`.
pub(super) fn bands(extent: &Extent, has_aovs: bool, most: u64, row_limit: u32) -> Vec<u32> {
    let [width, height] = extent.picture;
    let row = match has_aovs {
        true => aovs(0).sized(width as usize),
        false => picture(0).sized(width as usize),
    };
    let fitting = u32::try_from(most / row.bytes).unwrap_or(u32::MAX);
    let rows = fitting.min(row_limit).max(1);
    (0..height)
        .step_by(rows as usize)
        .map(|row| rows.min(height - row))
        .collect()
}

/// `FAR` of `camera.wgsl`.
pub(super) const FAR: f32 = 1e30;
