//! A pinhole camera at one instant.

use glam::DVec3;

/// Position, orientation and focal length of a pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eye {
    /// Position, metres.
    pub position: DVec3,
    /// Unit vector to the right of the image.
    pub right: DVec3,
    /// Unit vector to the top of the image.
    pub up: DVec3,
    /// Unit vector into the scene, along the optical axis.
    pub forward: DVec3,
    /// Focal length in pixels.
    pub focal: f64,
    /// Offset of the optical axis from the centre of the image, pixels to the right and down.
    pub axis: [f64; 2],
    /// Width and height of the image, pixels.
    pub size: [u32; 2],
}

impl Eye {
    /// Returns the direction through the centre of a pixel, counted in rows from the top. It is not
    /// normalised: its component along `forward` is 1.
    pub fn ray(&self, pixel: usize) -> DVec3 {
        let [width, height] = self.size.map(|n| n as usize);
        let [across, down] = self.axis;
        let x = (pixel % width) as f64 + 0.5 - 0.5 * width as f64 - across;
        let y = 0.5 * height as f64 - 0.5 - (pixel / width) as f64 + down;
        self.forward + (self.right * x + self.up * y) / self.focal
    }
}
