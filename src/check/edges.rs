//! The water's outline in pictures against the one that rays in f64 have.
//!
//! An edge point is the middle between two pixels beside or above each other of which one alone shows water. Where what the dry one
//! shows stands `BEHIND` spacings or more behind the water it is of a silhouette, where it stands nearer of a waterline; where it
//! stands before the water, the edge is not the water's and is left out. Each point of a picture has a distance to the truth's nearest
//! edge point, which counts as positive where the truth has no water. Offset is the mean of these distances over the outline, and
//! roughness their root mean square about their own mean nearby: a Gaussian of `NEARBY` spacings along the outline. A wave of
//! the water's own is in both outlines and in neither number; beads of splats one spacing apart are roughness.

use glam::DVec2;
use rayon::prelude::*;

/// How far behind the water a background stands, spacings; less, and they meet at a waterline.
const BEHIND: f64 = 3.0;
/// How far before the water, spacings, what is opaque has to stand for the edge to be its own.
const BEFORE: f64 = 0.5;
/// Edge points have none of the truth's beside them if that is farther away, spacings.
const REACH: f64 = 2.0;
/// Standard deviation of the mean about which roughness is measured, spacings: what is as long as a spacing is left out of it
/// but for exp(−½ (2π · 1.5)²).
const NEARBY: f64 = 1.5;

/// A picture of depths along the optical axis, as far as water and what stands behind it go.
#[derive(Clone, Debug)]
pub struct Outlined {
    /// Pixels along a row.
    pub width: usize,
    /// Of the water, metres; infinite where a pixel shows none.
    pub water: Vec<f64>,
    /// Of what is opaque, metres; infinite in the sky.
    pub opaque: Vec<f64>,
}

/// What an edge is of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Silhouette,
    Waterline,
}

#[derive(Clone, Copy, Debug)]
struct Point {
    /// Pixels from the upper left pixel's centre.
    at: DVec2,
    kind: Kind,
    /// Pixels a spacing at the water's depth.
    scale: f64,
    /// The two pixels.
    pair: [usize; 2],
}

impl Outlined {
    fn is_wet(&self, pixel: usize) -> bool {
        self.water[pixel].is_finite()
    }

    /// Edge points; `unit` is a spacing in pixels at a depth of a metre, `spacing` is in metres.
    fn points(&self, unit: f64, spacing: f64) -> Vec<Point> {
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
                    points.push(Point {
                        at: DVec2::new(x as f64, y as f64) + 0.5 * step,
                        kind: match gap >= BEHIND {
                            true => Kind::Silhouette,
                            false => Kind::Waterline,
                        },
                        scale: unit / depth,
                        pair: [wet, dry],
                    });
                }
            }
        }
        points
    }

    /// Pixels by which a point lies outside of this outline, whose edge points are `edge`; `None` where none is near.
    fn distance(&self, edge: &[Point], point: &Point) -> Option<f64> {
        let sign = match point.pair.map(|pixel| self.is_wet(pixel)) {
            [true, true] => -1.0,
            [false, false] => 1.0,
            // The truth's edge runs here as well.
            _ => return Some(0.0),
        };
        let squared = |other: &Point| other.at.distance_squared(point.at);
        let nearest = edge.iter().map(squared).fold(f64::INFINITY, f64::min);
        (nearest.sqrt() <= REACH * point.scale).then(|| sign * nearest.sqrt())
    }
}

/// An edge point's distances, spacings.
#[derive(Clone, Copy, Debug)]
struct Deviation {
    kind: Kind,
    /// From the truth's edge; `None` where that is not near.
    off: Option<f64>,
    /// From the mean of `off` nearby.
    rough: f64,
    /// A pixel's edge, spacings.
    pixel: f64,
}

/// Outlines of pictures of some frames against the truth's.
#[derive(Clone, Debug, Default)]
pub struct Outlines(Vec<Deviation>);

/// What is told of edges of one kind.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Outline {
    /// Edge points that have one of the truth's near them.
    pub points: usize,
    /// Mean distance outside of the truth's edge, spacings.
    pub offset: f64,
    /// Root mean square of the distance about its mean nearby, spacings. Pixels alone make 0.41 of a pixel's edge.
    pub roughness: f64,
    /// Edge points that have none of the truth's near them, over all.
    pub astray: f64,
    /// A pixel's edge, spacings, on average.
    pub pixel: f64,
}

impl Outlines {
    /// Takes a picture and its truth, of particles of `spacing` metres, seen with a focal length of `focal` pixels.
    pub fn add(&mut self, drawn: &Outlined, truth: &Outlined, focal: f64, spacing: f64) {
        let unit = focal * spacing;
        let [points, edge] = [drawn, truth].map(|picture| picture.points(unit, spacing));
        let off: Vec<Option<f64>> = points
            .par_iter()
            .map(|point| Some(truth.distance(&edge, point)? / point.scale))
            .collect();
        let known: Vec<(DVec2, f64)> = points
            .iter()
            .zip(&off)
            .filter_map(|(point, off)| Some((point.at, (*off)?)))
            .collect();
        let deviations = points.par_iter().zip(&off).map(|(point, &off)| {
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
        self.0.par_extend(deviations);
    }

    /// Of the edges before what stands far behind; `None` where there are none.
    pub fn silhouette(&self) -> Option<Outline> {
        self.of(Kind::Silhouette)
    }

    /// Of the edges at which water meets what is opaque; `None` where there are none.
    pub fn waterline(&self) -> Option<Outline> {
        self.of(Kind::Waterline)
    }

    fn of(&self, kind: Kind) -> Option<Outline> {
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
    /// Pixels a spacing.
    const UNIT: f64 = 20.0;

    /// Water within `radius(angle)` pixels of the middle, before a background at `opaque` metres.
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

    /// Edges of pixels are where a curve is to ±½ pixel, evenly: 1/√12 of a pixel each, and twice that variance for two. Points and
    /// nearest points are on a grid of half pixels, which adds as much again where the curve is slanted.
    const PIXELS: f64 = 0.6 / UNIT;

    /// A disc 6 pixels wider than the truth's is 0.3 spacings off and smooth; beads of a spacing's length are rough by their
    /// amplitude over √2, and waves twenty times as long are not.
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
        // 47 beads on 2π 150 pixels are a spacing long each.
        let waved = |count: f64| {
            let waved = disc(|angle| RADIUS + 6.0 * (count * angle).cos(), sky);
            compared(&waved, &truth).silhouette().expect("edges")
        };
        let (beads, waves) = (waved(47.0), waved(2.0));
        // Of slanted flanks there are more edge points, of which fewer lie far from the mean.
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

    /// What stands a spacing behind makes a waterline, what stands before the water no edge of its own, and an outline far from the
    /// truth's is told as astray.
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
