//! Compares surfaces in pictures with f64 rays.

use glam::DVec3;

use super::edges::{Outline, Outlined, Outlines};
use swell_domain::eye::Eye;
use swell_reference::rays::RayHit;
use swell_render::Image;

/// Water closer than this many spacings, plus this fraction of its depth, in front of an opaque
/// surface is left out: rounding decides which of the two is visible. A depth takes a dozen f32
/// roundings of lengths up to a hundred times the height above a distant ground.
const THINNEST: f64 = 0.05;
const ROUNDING: f64 = 100.0 * 12.0 * f32::EPSILON as f64;

/// The water's surface in pictures of some frames, and the ground truth.
#[derive(Clone, Debug, Default)]
pub struct Surfaces {
    /// Depth differences along the optical axis, spacings, where both have water.
    depths: Vec<f64>,
    /// Angles between normals, degrees, where both have water.
    angles: Vec<f64>,
    /// Number of pixels with water in either.
    either: usize,
    outlines: Outlines,
}

/// Statistics of the surfaces.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Summary {
    /// Number of pixels with water in both picture and truth.
    pub pixels: usize,
    /// Depth difference along the optical axis, spacings: median and 95th percentile.
    pub depth: [f64; 2],
    /// Angle between normals, degrees: median and 95th percentile.
    pub normal: [f64; 2],
    /// Pixels with water in both, divided by those with water in either.
    pub overlap: f64,
    /// The water's edge in front of a far background.
    pub silhouette: Option<Outline>,
    /// The water's edge at an opaque surface.
    pub waterline: Option<Outline>,
}

impl Surfaces {
    /// Adds a picture with depth and normals as seen by `eye`, with particles of `spacing` metres.
    ///
    /// # Panics Panics if the picture lacks these channels.
    pub fn add(&mut self, image: &Image, truth: &[RayHit], eye: &Eye, spacing: f64) {
        let z = image.aovs.z.as_ref().expect("a depth");
        let n = image.aovs.n.as_ref().expect("normals");
        let outline = || Outlined {
            width: image.width as usize,
            water: Vec::with_capacity(truth.len()),
            opaque: truth.iter().map(|seen| seen.opaque).collect(),
        };
        let [mut drawn, mut exact] = [outline(), outline()];
        for ((z, n), seen) in z.iter().zip(n).zip(truth) {
            let z = f64::from(*z);
            let (water, is_drawn) = in_sight(z, seen, spacing);
            drawn.water.push(if is_drawn { z } else { f64::INFINITY });
            exact.water.push(water.map_or(f64::INFINITY, |(t, _)| t));
            self.take(water, is_drawn.then_some((z, *n)), spacing);
        }
        self.outlines.add(&drawn, &exact, eye.focal, spacing);
    }

    /// Adds some pixels of such a picture, without their outlines.
    ///
    /// # Panics
    /// Panics if the picture lacks depth or normals.
    pub fn add_some(&mut self, image: &Image, pixels: &[usize], truth: &[RayHit], spacing: f64) {
        let z = image.aovs.z.as_ref().expect("a depth");
        let n = image.aovs.n.as_ref().expect("normals");
        for (&pixel, seen) in pixels.iter().zip(truth) {
            let z = f64::from(z[pixel]);
            let (water, is_drawn) = in_sight(z, seen, spacing);
            self.take(water, is_drawn.then_some((z, n[pixel])), spacing);
        }
    }

    /// Adds a pixel with the water that a ray in f64 meets and the one that is drawn.
    fn take(&mut self, water: Option<(f64, DVec3)>, drawn: Option<(f64, [f32; 3])>, spacing: f64) {
        self.either += usize::from(drawn.is_some() || water.is_some());
        let (Some((t, normal)), Some((z, n))) = (water, drawn) else {
            return;
        };
        self.depths.push((z - t).abs() / spacing);
        let cosine = DVec3::from(n.map(f64::from))
            .normalize_or_zero()
            .dot(normal);
        self.angles
            .push(cosine.clamp(-1.0, 1.0).acos().to_degrees());
    }

    /// Returns whether no pixel has water in either.
    pub fn is_empty(&self) -> bool {
        self.either == 0
    }

    /// Returns the statistics; `None` if no pixel has water in both.
    pub fn summary(mut self) -> Option<Summary> {
        Some(Summary {
            pixels: self.depths.len(),
            depth: percentiles(&mut self.depths)?,
            normal: percentiles(&mut self.angles)?,
            overlap: self.depths.len() as f64 / self.either as f64,
            silhouette: self.outlines.silhouette(),
            waterline: self.outlines.waterline(),
        })
    }
}

/// The water of a ray in f64 that counts as visible, and whether that of a picture at depth `z`
/// does.
fn in_sight(z: f64, seen: &RayHit, spacing: f64) -> (Option<(f64, DVec3)>, bool) {
    let before = seen.opaque * (1.0 - ROUNDING) - THINNEST * spacing;
    let water = seen.water.filter(|(t, _)| *t < before);
    (water, z < before && z < FAR)
}

/// Depths beyond this are those of the sky.
const FAR: f64 = 1e29;

/// Returns the median and the 95th percentile.
fn percentiles(values: &mut [f64]) -> Option<[f64; 2]> {
    values.sort_unstable_by(f64::total_cmp);
    let at =
        |part: f64| values.get((part * (values.len().checked_sub(1)? as f64)).round() as usize);
    Some([*at(0.5)?, *at(0.95)?])
}
