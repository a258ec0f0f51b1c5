//! Times of the rays of a picture with an open shutter, for who casts the same rays, and the opaque
//! geometry at these times.

use swell_scene::look::Look;

use super::{
    Mover, RenderScene,
    frame::Extent,
    samples::{Moments, samples_of},
};

/// Times of the rays of a sample: each pixel has one of `seconds`, by a hash of its position.
#[derive(Clone, Debug, PartialEq)]
pub struct RayTimes {
    /// Seconds from the frame's instant; each as many pixels see as any other.
    pub seconds: Vec<f64>,
    /// Seed of the hash.
    pub seed: u32,
    /// Position from which the hash counts the image's upper left pixel.
    pub first: [u32; 2],
}

impl RayTimes {
    /// Returns the times of the first sample of a frame's picture by rays.
    pub fn of(look: &Look, frame: u32, frames_per_second: f64) -> Option<Self> {
        let sample = *samples_of(look).first()?;
        let moments = Moments::of(look, &sample);
        let Extent { margin, corner, .. } = Extent::of(look);
        Some(Self {
            seconds: moments
                .instants
                .map(|frames| frames / frames_per_second)
                .to_vec(),
            seed: seed(frame, 0),
            first: [0, 1].map(|axis| margin[axis].wrapping_sub(corner[axis])),
        })
    }
}

/// Seed of the hash for a sample of a frame.
pub(super) fn seed(frame: u32, sample: u32) -> u32 {
    frame.wrapping_mul(0x9E37_79B1) ^ sample.wrapping_mul(0x85EB_CA77)
}

impl RenderScene {
    /// Returns the scene with its solids and wave makers where they are `seconds` after the frame's
    /// instant; none of them moves.
    #[must_use]
    pub fn standing_at(&self, seconds: f64) -> Self {
        let mut scene = self.clone();
        for motion in std::mem::take(&mut scene.moving) {
            let Some(way) = motion.path.way(seconds) else {
                continue;
            };
            match motion.mover {
                Mover::Solid(index) => {
                    for vertex in &mut scene.solids[index].vertices {
                        *vertex = way.transform_point3(*vertex);
                    }
                }
                Mover::WaveMaker(index) => {
                    let (wall, inward) = &mut scene.wave_makers[index];
                    let way = way.translation[wall.axis];
                    *inward += if wall.is_max { -way } else { way };
                }
            }
        }
        scene
    }
}
