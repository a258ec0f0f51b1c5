//! A pinhole camera at an instant.

use glam::DVec3;

/// Where it stands and looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Metres.
    pub position: DVec3,
    /// Unit vector to the picture's right.
    pub right: DVec3,
    /// Unit vector to its top.
    pub up: DVec3,
    /// Unit vector into it.
    pub forward: DVec3,
    /// Focal length in pixels.
    pub focal: f64,
    /// Where the optical axis meets the picture, pixels to the right of and below its middle.
    pub axis: [f64; 2],
    /// Width and height, pixels.
    pub size: [u32; 2],
}

impl Eye {
    /// Through the centre of a pixel, rows from the top; its part along the optical axis is 1.
    pub fn ray(&self, pixel: usize) -> DVec3 {
        let [width, height] = self.size.map(|n| n as usize);
        let [across, down] = self.axis;
        let x = (pixel % width) as f64 + 0.5 - 0.5 * width as f64 - across;
        let y = 0.5 * height as f64 - 0.5 - (pixel / width) as f64 + down;
        self.forward + (self.right * x + self.up * y) / self.focal
    }
}
