//! Full-frame buffers, and the bands and tiles in which a large frame is drawn.
//!
//! Depth, thickness and solids, which filters and shading look up at other pixels, are in buffers
//! of the whole frame at four bytes per pixel, so that no filter meets a tile's edge. Only textures
//! are drawn in tiles, and only the picture is gathered in bands of rows, because device limits
//! apply to these two.

use super::buffers::{aovs, picture};
use swell_scene::look::{Look, Window};

/// Layout of the padded frame, in pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Extent {
    /// Columns and rows that are shaded.
    pub(super) picture: [u32; 2],
    /// Size with a margin on all sides, so that filters have neighbours at the picture's edge. The
    /// width is a multiple of 64, so that rows of four-byte texels satisfy the alignment of texture
    /// copies.
    pub(super) size: [u32; 2],
    /// Padding left of and above the shaded pixels.
    pub(super) margin: [u32; 2],
    /// Origin of the padded frame of the image without overscan. Positions are counted from it, so
    /// that pixels of the image get bitwise equal positions with and without overscan.
    pub(super) corner: [u32; 2],
    /// Offset from that origin to the image's upper left pixel, and the size of the image.
    pub(super) image: [[u32; 2]; 2],
}

/// The padding before a frame with overscan is a multiple of this, which preserves pairs of pixels
/// and the alignment of texture rows.
const STEP: u32 = 64;

impl Extent {
    /// Computes the layout for a look. A crop is shaded within the frame of the whole image, so
    /// that its pixels can look up what lies beyond it.
    pub(super) fn of(look: &Look) -> Self {
        let image = &look.spec().image;
        Self::new([image.width, image.height], image.overscan, look.window())
    }

    fn new([width, height]: [u32; 2], overscan: u32, window: Window) -> Self {
        // 4 % of the width: about the reach of the widest smoothing at the usual distances.
        let margin = (width / 25).max(16);
        let padded = (width + 2 * margin).next_multiple_of(64);
        let tall = (height + 2 * margin).next_multiple_of(4);
        let own = [(padded - width) / 2, (tall - height) / 2];
        let before = overscan.next_multiple_of(STEP);
        Self {
            picture: window.size,
            size: [padded, tall].map(|side| side + 2 * before),
            margin: [0, 1]
                .map(|axis| (before + own[axis]).saturating_add_signed(window.corner[axis])),
            corner: [before; 2],
            image: [own, [width, height]],
        }
    }

    /// Number of shaded pixels.
    pub(super) fn shaded(&self) -> usize {
        self.picture[0] as usize * self.picture[1] as usize
    }

    pub(super) fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }
}

/// Number of rows in each band of the picture at `stride` vectors per pixel: as many as fit a
/// storage buffer of `most` bytes, but no more than `row_limit`.
pub(super) fn bands(
    extent: &Extent,
    (stride, has_aovs): (usize, bool),
    most: u64,
    row_limit: u32,
) -> Vec<u32> {
    let [width, height] = extent.picture;
    let beside = match has_aovs {
        true => aovs(0).sized(width as usize).bytes,
        false => 0,
    };
    let row = picture(0).sized(stride * width as usize).bytes.max(beside);
    let fitting = u32::try_from(most / row).unwrap_or(u32::MAX);
    let rows = fitting.min(row_limit).max(1);
    (0..height)
        .step_by(rows as usize)
        .map(|row| rows.min(height - row))
        .collect()
}

/// Depth of the background; `FAR` of `camera.wgsl`.
pub(super) const FAR: f32 = 1e30;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_images_pixels_have_the_same_places_with_overscan_and_crop() {
        let size = [640, 360];
        let whole = Window {
            corner: [0, 0],
            size,
        };
        let plain = Extent::new(size, 0, whole);
        assert_eq!((plain.size, plain.margin), ([704, 412], [32, 26]));
        let wide = Window {
            corner: [-40, -40],
            size: [720, 440],
        };
        let wide = Extent::new(size, 40, wide);
        let part = Window {
            corner: [100, 30],
            size: [50, 20],
        };
        let part = Extent::new(size, 0, part);
        // Position of an image pixel in the padded frame, counted from the origin.
        let place = |extent: &Extent, window: [i32; 2], pixel: [i32; 2]| {
            [0, 1].map(|axis| {
                let shaded = pixel[axis] - window[axis];
                extent.margin[axis] as i32 + shaded - extent.corner[axis] as i32
            })
        };
        for pixel in [[100, 30], [149, 49]] {
            let expected = place(&plain, [0, 0], pixel);
            assert_eq!(place(&wide, [-40, -40], pixel), expected);
            assert_eq!(place(&part, [100, 30], pixel), expected);
        }
        assert_eq!(part.size, plain.size);
        // The padding around the shaded pixels is no less than that around the plain image.
        assert!([0, 1].iter().all(|&axis| {
            let after = wide.size[axis] - wide.margin[axis] - wide.picture[axis];
            wide.margin[axis] >= plain.margin[axis] && after >= plain.margin[axis]
        }));
        assert!(wide.corner[0].is_multiple_of(STEP) && wide.size[0].is_multiple_of(STEP));
    }
}
