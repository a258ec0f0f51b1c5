//! Positions of a frame's samples within the pixel, the shutter and the lens.

use std::f64::consts::PI;

use swell_scene::look::{CurveSpec, ImageSpec, Look};

/// Position of a sample within the pixel, the shutter and the lens.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sample {
    /// Offset from the pixel's centre, pixels.
    pub(super) jitter: [f64; 2],
    /// Offset from the frame's instant, frames.
    pub(super) instant: f64,
    /// Offset from the centre of the aperture, to the right and upward, in units of its radius.
    pub(super) aperture: [f64; 2],
    /// Weight in the pixel's mean.
    pub(super) weight: f64,
    /// Part of the shutter's light that the sample's rays see, as the fractions of it that have
    /// arrived before and after; both are equal where all rays see the sample's instant.
    pub(super) light: [f64; 2],
}

impl Sample {
    /// Sample through the pixel's centre and the centre of the lens at the frame's instant.
    pub(super) const STILL: Self = Self {
        jitter: [0.0; 2],
        instant: 0.0,
        aperture: [0.0; 2],
        weight: 1.0,
        light: [0.5; 2],
    };
}

/// Opening of a shutter over its time.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Curve {
    /// Fully open all the time.
    Box,
    /// Opens and closes linearly over these fractions of the time.
    Ramps([f64; 2]),
}

impl Curve {
    fn of(image: &ImageSpec) -> Self {
        match (image.shutter_curve, image.shutter_ramps) {
            (CurveSpec::Box, _) => Self::Box,
            (CurveSpec::Triangle, _) => Self::Ramps([0.5; 2]),
            (CurveSpec::Trapezoid, ramps) => Self::Ramps(ramps.unwrap_or([0.25; 2])),
        }
    }

    /// Instant at which a fraction `share` of all light has arrived, relative to the middle of the
    /// open time and in units of it.
    fn instant(self, share: f64) -> f64 {
        let Self::Ramps([open, close]) = self else {
            return share - 0.5;
        };
        // Largest opening, normalised so that all light is 1.
        let height = 1.0 / (1.0 - 0.5 * (open + close));
        let time = if share < 0.5 * height * open {
            (2.0 * open * share / height).sqrt()
        } else if share > 1.0 - 0.5 * height * close {
            1.0 - (2.0 * close * (1.0 - share) / height).sqrt()
        } else {
            0.5 * open + share / height
        };
        time - 0.5
    }
}

/// Number of moments among which the rays of a sample are divided.
pub(super) const MOMENTS: usize = 64;

/// Instants of the rays of a sample: of each moment, and of the beginning and the end of all of
/// them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moments {
    /// Offsets from the frame's instant, frames; each has the same share of the sample's light.
    pub(super) instants: [f64; MOMENTS],
    /// The same of the beginning and the end.
    pub(super) span: [f64; 2],
    /// The same of the sample.
    instant: f64,
}

impl Moments {
    /// Moments of a sample under a look's shutter.
    pub(super) fn of(look: &Look, sample: &Sample) -> Self {
        let image = &look.spec().image;
        Self::under(Curve::of(image), image.shutter, sample)
    }

    fn under(curve: Curve, shutter: f64, sample: &Sample) -> Self {
        let [first, last] = sample.light;
        let at = |part: f64| match first < last {
            true => curve.instant(first + (last - first) * part) * shutter,
            false => sample.instant,
        };
        let middle = |k: usize| (k as f64 + 0.5) / MOMENTS as f64;
        Self {
            instants: std::array::from_fn(|k| at(middle(k))),
            span: [at(0.0), at(1.0)],
            instant: sample.instant,
        }
    }

    /// Time from the sample's instant to a moment, over that of the whole span; 0 where the span is
    /// empty.
    pub(super) fn part(&self, moment: usize) -> f64 {
        let [start, end] = self.span;
        match end > start {
            true => (self.instants[moment] - self.instant) / (end - start),
            false => 0.0,
        }
    }
}

/// Samples of a frame of a look.
pub(super) fn samples_of(look: &Look) -> Vec<Sample> {
    let image = &look.spec().image;
    // A camera file has a lens at all times or never.
    let has_lens = look.lens(0.0).is_some();
    samples(image.samples, image.shutter, Curve::of(image), has_lens)
}

/// Generates the samples of a frame: Halton points over the pixel, instants that divide the
/// shutter's light equally and, where there is a lens, points of a spiral over its aperture.
fn samples(count: u32, shutter: f64, curve: Curve, has_lens: bool) -> Vec<Sample> {
    let points = pixel_points(count);
    let apertures = match has_lens {
        true => aperture_points(count, &points),
        false => vec![[0.0; 2]; points.len()],
    };
    (points.into_iter().zip(apertures).zip(0u32..))
        .map(|((jitter, aperture), i)| {
            let share = (f64::from(i) + 0.5) / f64::from(count);
            Sample {
                jitter,
                instant: curve.instant(share) * shutter,
                aperture,
                weight: 1.0 / f64::from(count),
                light: [i, i + 1].map(|k| f64::from(k) / f64::from(count)),
            }
        })
        .collect()
}

fn pixel_points(count: u32) -> Vec<[f64; 2]> {
    let halton = |base: u32, index: u32| {
        let (mut value, mut scale, mut rest) = (0.0, 1.0, index);
        while rest > 0 {
            scale /= f64::from(base);
            value += scale * f64::from(rest % base);
            rest /= base;
        }
        value
    };
    let points = (1..=count).map(|i| [halton(2, i), halton(3, i)]).collect();
    // The first points of the sequence are not centred, which would shift the picture.
    centred(points)
}

fn centred(mut points: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    let count = points.len() as f64;
    let mean = [0, 1].map(|axis| points.iter().map(|point| point[axis]).sum::<f64>() / count);
    for point in &mut points {
        *point = [point[0] - mean[0], point[1] - mean[1]];
    }
    points
}

/// Number of orders of the aperture points among which the best is chosen.
const ORDERS: u32 = 64;

/// Points over the unit disc, each with the same share of its area (Vogel 1979), in an order in
/// which neither their positions nor their distances from the centre correlate with the samples'
/// positions in the pixel or with their instants.
fn aperture_points(count: u32, pixel: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let golden = PI * (3.0 - 5f64.sqrt());
    let points: Vec<[f64; 2]> = (0..count)
        .map(|k| {
            let radius = ((f64::from(k) + 0.5) / f64::from(count)).sqrt();
            let (sin, cos) = (f64::from(k) * golden).sin_cos();
            [radius * cos, radius * sin]
        })
        .collect();
    let points = centred(points);
    let ordered = |m: u32| {
        // Ranks of the multiples of an irrational number modulo 1 give a permutation with little
        // structure.
        let step = (f64::from(m) * 2f64.sqrt()).fract();
        let key = |i: &usize| ((*i + 1) as f64 * step).fract();
        let mut order: Vec<usize> = (0..points.len()).collect();
        order.sort_by(|a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
        let mut found = vec![[0.0; 2]; points.len()];
        for (place, point) in order.into_iter().zip(&points) {
            found[place] = *point;
        }
        found
    };
    let orders = (1..=ORDERS).map(|m| {
        let found = ordered(m);
        (dependence(&found, pixel), found)
    });
    let best = orders.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, points)| points).unwrap_or_default()
}

/// Largest absolute correlation of aperture points with positions in the pixel and with instants.
fn dependence(aperture: &[[f64; 2]], pixel: &[[f64; 2]]) -> f64 {
    let column = |points: &[[f64; 2]], value: fn(&[f64; 2]) -> f64| -> Vec<f64> {
        points.iter().map(value).collect()
    };
    let on_lens = [
        column(aperture, |a| a[0]),
        column(aperture, |a| a[1]),
        column(aperture, |a| a[0] * a[0] + a[1] * a[1]),
    ];
    let others = [
        column(pixel, |p| p[0]),
        column(pixel, |p| p[1]),
        (0..pixel.len()).map(|i| i as f64).collect(),
    ];
    let pairs = on_lens
        .iter()
        .flat_map(|a| others.iter().map(|b| correlation(a, b).abs()));
    pairs.fold(0.0, f64::max)
}

/// Pearson correlation; 0 where either list is constant.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let mean = |x: &[f64]| x.iter().sum::<f64>() / x.len() as f64;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let sums = a.iter().zip(b).fold([0.0; 3], |[ab, aa, bb], (x, y)| {
        let (x, y) = (x - mean_a, y - mean_b);
        [ab + x * y, aa + x * x, bb + y * y]
    });
    match sums[1] * sums[2] {
        product if product > 0.0 => sums[0] / product.sqrt(),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_centred_on_pixel_shutter_and_lens() {
        for count in [1, 2, 3, 4, 16] {
            for curve in [Curve::Box, Curve::Ramps([0.5; 2]), Curve::Ramps([0.2; 2])] {
                let samples = samples(count, 0.5, curve, true);
                let sum = |value: fn(&Sample) -> f64| samples.iter().map(value).sum::<f64>();
                assert!(sum(|s| s.jitter[0]).abs() < 1e-12);
                assert!(sum(|s| s.jitter[1]).abs() < 1e-12);
                assert!(sum(|s| s.instant).abs() < 1e-12);
                assert!(sum(|s| s.aperture[0]).abs() < 1e-12);
                assert!(sum(|s| s.aperture[1]).abs() < 1e-12);
                assert!((sum(|s| s.weight) - 1.0).abs() < 1e-12);
                assert!(samples.iter().all(|s| s.instant.abs() < 0.25));
            }
        }
        assert!(
            samples(4, 0.0, Curve::Box, false)
                .iter()
                .all(|s| { s.instant == 0.0 && s.aperture == [0.0; 2] })
        );
    }

    /// Mean and mean square of the time at which light arrives, from the moment of opening, in
    /// closed form over both ramps and the time between them.
    fn moments([open, close]: [f64; 2]) -> [f64; 2] {
        let height = 1.0 / (1.0 - 0.5 * (open + close));
        let end = 1.0 - close;
        [
            height
                * (open * open / 3.0 + (end * end - open * open) / 2.0 + close / 2.0
                    - close * close / 3.0),
            height
                * (open.powi(3) / 4.0 + (end.powi(3) - open.powi(3)) / 3.0 + close / 2.0
                    - 2.0 * close * close / 3.0
                    + close.powi(3) / 4.0),
        ]
    }

    #[test]
    fn instants_have_the_mean_and_the_variance_of_the_shutters_curve() {
        const COUNT: u32 = 1000;
        // At the midpoint of a step, a monotone function differs from its mean over the step by at
        // most half of its rise there: by 1 / 2 N over all steps, for times and for their squares.
        let bound = 0.5 / f64::from(COUNT);
        for ramps in [[0.5, 0.5], [0.25, 0.25], [0.1, 0.6], [0.0, 1.0], [0.0, 0.0]] {
            let found = samples(COUNT, 0.5, Curve::Ramps(ramps), false);
            let times = || found.iter().map(|s| 2.0 * s.instant + 0.5);
            let mean = times().sum::<f64>() / f64::from(COUNT);
            let square = times().map(|t| t * t).sum::<f64>() / f64::from(COUNT);
            let off = |ramps| {
                let [first, second] = moments(ramps);
                (mean - first).abs().max((square - second).abs())
            };
            assert!(off(ramps) < bound, "{ramps:?}: {}", off(ramps));
            // Control: a ramp that differs by a tenth.
            let other = [ramps[0], (ramps[1] - 0.1f64).abs()];
            assert!(off(other) > 3.0 * bound, "{ramps:?}: {}", off(other));
        }
        // Well-known variances of a box and of a triangle.
        let variance = |ramps| {
            let [first, second] = moments(ramps);
            second - first * first
        };
        assert!((variance([0.0; 2]) - 1.0 / 12.0).abs() < 1e-12);
        assert!((variance([0.5; 2]) - 1.0 / 24.0).abs() < 1e-12);
        let boxed = samples(COUNT, 0.5, Curve::Box, false);
        let square: f64 = boxed.iter().map(|s| 4.0 * s.instant * s.instant).sum();
        assert!((square / f64::from(COUNT) - 1.0 / 12.0).abs() < bound);
    }

    /// The moments of all samples together are those of as many samples with one instant each, and
    /// follow each other without gaps.
    #[test]
    fn moments_divide_the_light_of_the_shutter() {
        const COUNT: u32 = 5;
        let all = COUNT * MOMENTS as u32;
        for curve in [Curve::Box, Curve::Ramps([0.5; 2]), Curve::Ramps([0.1, 0.6])] {
            let fine = samples(all, 0.5, curve, false);
            let coarse = samples(COUNT, 0.5, curve, false);
            let moments: Vec<Moments> = (coarse.iter())
                .map(|sample| Moments::under(curve, 0.5, sample))
                .collect();
            let instants = moments.iter().flat_map(|it| it.instants);
            let off = |shift: f64| {
                let pairs = instants.clone().zip(&fine);
                let off = pairs.map(|(found, fine)| (found + shift - fine.instant).abs());
                off.fold(0.0, f64::max)
            };
            assert!(off(0.0) < 1e-12, "{curve:?}: {}", off(0.0));
            // Control: a shift by one of the instants.
            assert!(off(0.5 / f64::from(all)) > 1e-4);
            for (before, after) in moments.iter().zip(&moments[1..]) {
                assert_eq!(before.span[1], after.span[0]);
            }
            let parts = |it: &Moments| [0, MOMENTS - 1].map(|k| it.part(k));
            assert!(
                moments
                    .iter()
                    .map(parts)
                    .all(|[a, b]| a < -0.1 && 0.1 < b && b - a < 1.0)
            );
        }
        let still = Moments::under(Curve::Ramps([0.1, 0.6]), 0.5, &Sample::STILL);
        assert_eq!((still.instants, still.span), ([0.0; MOMENTS], [0.0; 2]));
        assert_eq!(still.part(7), 0.0);
    }

    #[test]
    fn points_on_the_lens_are_spread_and_go_with_nothing() {
        for count in [8, 16, 24, 64, 100, 256] {
            let found = samples(count, 0.5, Curve::Box, true);
            let n = f64::from(count);
            let apertures: Vec<[f64; 2]> = found.iter().map(|s| s.aperture).collect();
            let jitters: Vec<[f64; 2]> = found.iter().map(|s| s.jitter).collect();
            // The mean square distance from the centre is one half on a disc of radius 1 and on the
            // spiral, except for the square of the mean that is subtracted.
            let square = apertures.iter().map(|a| a[0] * a[0] + a[1] * a[1]);
            let square = square.sum::<f64>() / n;
            assert!((square - 0.5).abs() < 1.0 / n, "{count}: {square}");
            // The least distance is at least half that of n points on a square lattice over the
            // disc.
            let nearest = |i: usize| {
                let others = apertures.iter().enumerate().filter(|other| other.0 != i);
                others
                    .map(|(_, b)| (apertures[i][0] - b[0]).hypot(apertures[i][1] - b[1]))
                    .fold(f64::INFINITY, f64::min)
            };
            let least = (0..apertures.len())
                .map(nearest)
                .fold(f64::INFINITY, f64::min);
            assert!(least > 0.5 * (PI / n).sqrt(), "{count}: {least}");
            // The expected maximum of nine correlations of independent samples is about 2/√n.
            let found = dependence(&apertures, &jitters);
            assert!(found < 1.5 / n.sqrt(), "{count}: {found}");
            // Control: in the spiral's own order, distant points come last.
            let spiral: Vec<[f64; 2]> = {
                let mut sorted = apertures.clone();
                sorted.sort_by(|a, b| a[0].hypot(a[1]).total_cmp(&b[0].hypot(b[1])));
                sorted
            };
            let control = dependence(&spiral, &jitters);
            assert!(control > 2.0 / n.sqrt(), "{count}: {control}");
        }
    }
}
