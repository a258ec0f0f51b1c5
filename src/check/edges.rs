//! Compares the water's outline in pictures with the outline from f64 rays.
//!
//! An edge point is the midpoint between two adjacent pixels, side by side or one above the other,
//! of which exactly one shows water. It belongs to a silhouette if what the dry pixel shows is
//! `BEHIND` spacings or more behind the water, and to a waterline if it is closer. If it is in
//! front of the water, the edge is not the water's and is left out. Each edge point of a picture
//! has a distance to the ground truth's nearest edge point, positive where the truth has no water.
//! Offset is the mean of these distances over the outline. Roughness is their root mean square
//! about their local mean, a Gaussian average of `NEARBY` spacings along the outline. A wave of the
//! water itself is in both outlines and in neither figure; beads of splats one spacing apart count
//! as roughness.

use glam::DVec2;
use swell_domain::parallel;

/// Least distance of a background behind the water for a silhouette, spacings; closer ones form a
/// waterline.
const BEHIND: f64 = 3.0;
/// An opaque surface at least this far in front of the water, spacings, makes the edge its own.
const BEFORE: f64 = 0.5;
/// An edge point has no counterpart in the truth if the nearest one is farther away than this,
/// spacings.
const REACH: f64 = 2.0;
/// Standard deviation of the local mean about which roughness is measured, spacings. It removes
/// waves of one spacing from the mean, except for a factor of exp(−½ (2π · 1.5)²).
const NEARBY: f64 = 1.5;

/// Depths along the optical axis of the water and of what is behind it, per pixel.
#[derive(Clone, Debug)]
pub struct Outlined {
    /// Pixels per row.
    pub width: usize,
    /// Depth of the water, metres; infinite where a pixel shows none.
    pub water: Vec<f64>,
    /// Depth of the first opaque surface, metres; infinite in the sky.
    pub opaque: Vec<f64>,
}

/// Kind of an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum EdgeKind {
    Silhouette,
    Waterline,
}

#[derive(Clone, Copy, Debug)]
struct EdgePoint {
    /// Position, pixels from the upper left pixel's centre.
    at: DVec2,
    kind: EdgeKind,
    /// Pixels per spacing at the water's depth.
    scale: f64,
    /// The two pixels.
    pair: [usize; 2],
}

impl Outlined {
    fn is_wet(&self, pixel: usize) -> bool {
        self.water[pixel].is_finite()
    }

    /// Returns the edge points. `unit` is the size of a spacing in pixels at a depth of one metre;
    /// `spacing` is in metres.
    fn points(&self, unit: f64, spacing: f64) -> Vec<EdgePoint> {
        let mut points = Vec::new();
        let height = self.water.len() / self.width.max(1);
        for y in 0..height {
            for x in 0..self.width {
                let pixel = y * self.width + x;
                let right = (x + 1 < self.width).then_some((pixel + 1, DVec2::X));
                let below = (y + 1 < height).then_some((pixel + self.width, DVec2::Y));
                for (other, step) in right.into_iter().chain(below) {
                    let (wet, dry) = match [self.is_wet(pixel), self.is_wet(other)] {
                        [true, false] => (pixel, other),
                        [false, true] => (other, pixel),
                        _ => continue,
                    };
                    let depth = self.water[wet];
                    let gap = (self.opaque[dry] - depth) / spacing;
                    if gap < -BEFORE {
                        continue;
                    }
                    points.push(EdgePoint {
                        at: DVec2::new(x as f64, y as f64) + 0.5 * step,
                        kind: match gap >= BEHIND {
                            true => EdgeKind::Silhouette,
                            false => EdgeKind::Waterline,
                        },
                        scale: unit / depth,
                        pair: [wet, dry],
                    });
                }
            }
        }
        points
    }

    /// Returns the distance of a point outside this outline, pixels; `edge` are the outline's edge
    /// points. `None` if none is near.
    fn distance(&self, edge: &[EdgePoint], point: &EdgePoint) -> Option<f64> {
        let sign = match point.pair.map(|pixel| self.is_wet(pixel)) {
            [true, true] => -1.0,
            [false, false] => 1.0,
            // The truth's edge passes here as well.
            _ => return Some(0.0),
        };
        let squared = |other: &EdgePoint| other.at.distance_squared(point.at);
        let nearest = edge.iter().map(squared).fold(f64::INFINITY, f64::min);
        (nearest.sqrt() <= REACH * point.scale).then(|| sign * nearest.sqrt())
    }
}

/// Deviations of an edge point, spacings.
#[derive(Clone, Copy, Debug)]
struct Deviation {
    kind: EdgeKind,
    /// Distance from the truth's edge; `None` if that is not near.
    off: Option<f64>,
    /// Distance from the local mean of `off`.
    rough: f64,
    /// Size of a pixel, spacings.
    pixel: f64,
}

/// Outlines of the pictures of some frames, compared with ground truth.
#[derive(Clone, Debug, Default)]
pub struct Outlines(Vec<Deviation>);

/// Statistics of edges of one kind.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Outline {
    /// Number of edge points with an edge point of the truth near them.
    pub points: usize,
    /// Mean distance outside the truth's edge, spacings.
    pub offset: f64,
    /// Root mean square of the distance about its local mean, spacings. Pixel quantization by
    /// itself gives 0.41 of a pixel.
    pub roughness: f64,
    /// Fraction of edge points without an edge point of the truth near them.
    pub astray: f64,
    /// Mean size of a pixel, spacings.
    pub pixel: f64,
}

impl Outlines {
    /// Adds a picture and its ground truth, with particles of `spacing` metres, seen with a focal
    /// length of `focal` pixels.
    pub fn add(&mut self, drawn: &Outlined, truth: &Outlined, focal: f64, spacing: f64) {
        let unit = focal * spacing;
        let [points, edge] = [drawn, truth].map(|picture| picture.points(unit, spacing));
        let off: Vec<Option<f64>> = parallel::map_slice(&points, |point| {
            Some(truth.distance(&edge, point)? / point.scale)
        });
        let known: Vec<(DVec2, f64)> = points
            .iter()
            .zip(&off)
            .filter_map(|(point, off)| Some((point.at, (*off)?)))
            .collect();
        let deviations = parallel::map(0..points.len(), |index| {
            let (point, off) = (&points[index], off[index]);
            let width = NEARBY * point.scale;
            let (mut sum, mut weight) = (0.0, 0.0);
            for (at, off) in &known {
                let away = at.distance_squared(point.at) / (width * width);
                if away < 16.0 {
                    let w = (-0.5 * away).exp();
                    sum += w * off;
                    weight += w;
                }
            }
            Deviation {
                kind: point.kind,
                off,
                rough: off.map_or(0.0, |off| off - sum / weight),
                pixel: 1.0 / point.scale,
            }
        });
        self.0.extend(deviations);
    }

    /// Returns the statistics of edges in front of a far background; `None` if there are none.
    pub fn silhouette(&self) -> Option<Outline> {
        self.of(EdgeKind::Silhouette)
    }

    /// Returns the statistics of edges where water meets an opaque surface; `None` if there are
    /// none.
    pub fn waterline(&self) -> Option<Outline> {
        self.of(EdgeKind::Waterline)
    }

    fn of(&self, kind: EdgeKind) -> Option<Outline> {
        let all: Vec<&Deviation> = self.0.iter().filter(|it| it.kind == kind).collect();
        let near: Vec<(f64, &Deviation)> =
            all.iter().filter_map(|it| Some((it.off?, *it))).collect();
        let count = near.len() as f64;
        let mean =
            |value: &dyn Fn(&(f64, &Deviation)) -> f64| near.iter().map(value).sum::<f64>() / count;
        (!near.is_empty()).then(|| Outline {
            points: near.len(),
            offset: mean(&|(off, _)| *off),
            roughness: mean(&|(_, it)| it.rough * it.rough).sqrt(),
            astray: 1.0 - count / all.len() as f64,
            pixel: mean(&|(_, it)| it.pixel),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIDE: usize = 400;
    /// Metres.
    const DEPTH: f64 = 10.0;
    const SPACING: f64 = 0.1;
    /// Pixels per spacing.
    const UNIT: f64 = 20.0;

    /// Water within `radius(angle)` pixels of the centre, in front of a background at `opaque`
    /// metres.
    fn disc(radius: impl Fn(f64) -> f64, opaque: f64) -> Outlined {
        let depth = |pixel: usize| {
            let at = DVec2::new((pixel % SIDE) as f64, (pixel / SIDE) as f64) - 199.5;
            match at.length() < radius(at.y.atan2(at.x)) {
                true => DEPTH,
                false => f64::INFINITY,
            }
        };
        Outlined {
            width: SIDE,
            water: (0..SIDE * SIDE).map(depth).collect(),
            opaque: vec![opaque; SIDE * SIDE],
        }
    }

    fn compared(drawn: &Outlined, truth: &Outlined) -> Outlines {
        let mut outlines = Outlines::default();
        outlines.add(drawn, truth, UNIT * DEPTH / SPACING, SPACING);
        outlines
    }

    /// Edges between pixels locate a curve to ±½ pixel, uniformly distributed: 1/√12 of a pixel
    /// each, and twice that variance for two. Points and nearest points are on a grid of half
    /// pixels, which adds as much again where the curve is slanted.
    const PIXELS: f64 = 0.6 / UNIT;

    /// A disc 6 pixels wider than the truth's has an offset of 0.3 spacings and is smooth. Beads of
    /// the length of a spacing have a roughness of their amplitude over √2; waves twenty times as
    /// long are smooth.
    #[test]
    fn beads_are_rough_and_waves_are_not() {
        const RADIUS: f64 = 150.0;
        let sky = f64::INFINITY;
        let truth = disc(|_| RADIUS, sky);
        let same = compared(&truth, &truth).silhouette().expect("edges");
        assert_eq!((same.offset, same.roughness), (0.0, 0.0));
        let wide = compared(&disc(|_| RADIUS + 6.0, sky), &truth);
        let wide = wide.silhouette().expect("edges");
        assert!((wide.offset - 0.3).abs() < PIXELS, "{wide:?}");
        assert!(wide.roughness < PIXELS, "{wide:?}");
        // 47 beads on 2π 150 pixels are one spacing long each.
        let waved = |count: f64| {
            let waved = disc(|angle| RADIUS + 6.0 * (count * angle).cos(), sky);
            compared(&waved, &truth).silhouette().expect("edges")
        };
        let (beads, waves) = (waved(47.0), waved(2.0));
        // Slanted flanks have more edge points, of which fewer are far from the mean.
        let amplitude = 0.3 / 2f64.sqrt();
        assert!(
            (0.75 * amplitude..1.1 * amplitude).contains(&beads.roughness),
            "{beads:?}"
        );
        assert!(
            waves.roughness < 0.2 * beads.roughness,
            "{waves:?} {beads:?}"
        );
    }

    /// A background one spacing behind makes a waterline, a surface in front of the water no edge
    /// of the water, and an outline far from the truth's is reported as astray.
    #[test]
    fn edges_are_told_apart_by_what_is_behind() {
        let near = disc(|_| 100.0, DEPTH + SPACING);
        let outlines = compared(&near, &near);
        assert!(outlines.silhouette().is_none() && outlines.waterline().is_some());
        let before = disc(|_| 100.0, DEPTH - SPACING);
        let outlines = compared(&before, &before);
        assert!(outlines.silhouette().is_none() && outlines.waterline().is_none());
        let sky = f64::INFINITY;
        let astray = compared(&disc(|_| 100.0, sky), &disc(|_| 190.0, sky));
        assert!(astray.silhouette().is_none(), "nothing near");
        let half = disc(|angle| if angle > 0.0 { 100.0 } else { 180.0 }, sky);
        let half = compared(&half, &disc(|_| 180.0, sky));
        let half = half.silhouette().expect("one half is near");
        assert!((0.3..0.6).contains(&half.astray), "{half:?}");
    }
}
