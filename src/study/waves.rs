//! Measurements of signals, curves and profiles for benchmarks with a known answer: pure functions,
//! independent of any scene.

use std::f64::consts::TAU;

use glam::DVec2;

use crate::least_squares::least_squares;

/// One harmonic of a signal, a + c cos(ωt) + s sin(ωt) = a + A cos(ωt − φ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// Mean a, in the signal's unit.
    pub mean: f64,
    /// Amplitude A ≥ 0, in the signal's unit.
    pub amplitude: f64,
    /// Phase φ, radians, from −π to π.
    pub phase: f64,
}

/// Fits the harmonic of angular frequency `omega` (rad/s) to samples (seconds, value) by least
/// squares. There is no trend term, which a slow drift would otherwise share with the wave. `None`
/// if fewer than four samples or too short a time leave the fit undetermined.
pub fn harmonic(samples: &[(f64, f64)], omega: f64) -> Option<Harmonic> {
    if samples.len() < 4 {
        return None;
    }
    let row = |&(t, value): &(f64, f64)| [1.0, (omega * t).cos(), (omega * t).sin(), value];
    let [mean, cos, sin] = least_squares(samples.iter().map(row), 0.0)?;
    Some(Harmonic {
        mean,
        amplitude: cos.hypot(sin),
        phase: sin.atan2(cos),
    })
}

/// Samples of the last whole periods that begin after `after`, seconds.
pub fn whole_periods(samples: &[(f64, f64)], period: f64, after: f64) -> &[(f64, f64)] {
    let Some(&(end, _)) = samples.last() else {
        return samples;
    };
    let periods = ((end - after) / period + 1e-9).floor();
    // Leaves out the sample at the beginning, which has the same phase as the last one.
    let from = end - periods * period + 1e-9 * period;
    &samples[samples.partition_point(|(t, _)| *t <= from)..]
}

/// Length of a wave that passes two gauges, metres. `first` and `second` are its phases there (that
/// of [`Harmonic`]), `apart` their distance, which must be less than a wavelength.
pub fn wave_length(first: f64, second: f64, apart: f64) -> f64 {
    TAU * apart / (second - first).rem_euclid(TAU)
}

/// Reflection coefficient K = |reflected| / |incident| of a wave with wavenumber `k` (1/m).
///
/// Takes the gauges' positions along x (metres) and the wave's harmonic there, by least squares
/// (Mansard and Funke 1980; for two gauges Goda and Suzuki 1976). `None` if the gauges are half a
/// wavelength apart, which cannot separate the two waves.
pub fn reflection(gauges: &[(f64, Harmonic)], k: f64) -> Option<f64> {
    // Complex numbers as vectors: the incident wave is A exp(i(kx + δ)), the reflected one A
    // exp(i(δ − kx)).
    let count = gauges.len() as f64;
    let turns = |times: f64| {
        gauges
            .iter()
            .map(move |(x, _)| DVec2::from_angle(times * k * x))
    };
    let signal = || {
        gauges
            .iter()
            .map(|(_, of)| of.amplitude * DVec2::from_angle(of.phase))
    };
    let twice: DVec2 = turns(2.0).sum();
    let mixed = count * count - twice.length_squared();
    if mixed < 0.02 * count * count {
        return None;
    }
    let of_incident: DVec2 = turns(-1.0).zip(signal()).map(|(e, c)| e.rotate(c)).sum();
    let of_reflected: DVec2 = turns(1.0).zip(signal()).map(|(e, c)| e.rotate(c)).sum();
    let back = DVec2::new(twice.x, -twice.y);
    let incident = count * of_incident - back.rotate(of_reflected);
    let reflected = count * of_reflected - twice.rotate(of_incident);
    Some(reflected.length() / incident.length())
}

/// Time and height of a crest, from the parabola that best fits the samples (seconds, elevation)
/// above `part` of the maximum. `None` if there are fewer than three, if they bend upwards, or if
/// the signal begins or ends that high, so that a part of the crest is missing.
pub fn crest(samples: &[(f64, f64)], part: f64) -> Option<(f64, f64)> {
    let most = samples
        .iter()
        .map(|s| s.1)
        .fold(f64::NEG_INFINITY, f64::max);
    let middle = samples.iter().position(|s| s.1 == most)?;
    // A single crest: as far as the signal stays that high.
    let is_high = |s: &&(f64, f64)| s.1 >= part * most;
    let before = samples[..middle].iter().rev().take_while(is_high).count();
    let after = samples[middle..].iter().take_while(is_high).count();
    let high = &samples[middle - before..middle + after];
    let is_whole = before < middle && middle + after < samples.len();
    if high.len() < 3 || !is_whole {
        return None;
    }
    let from = samples[middle].0;
    let width = (high[high.len() - 1].0 - high[0].0).max(f64::MIN_POSITIVE);
    let row = |&(t, value): &(f64, f64)| {
        let x = (t - from) / width;
        [1.0, x, x * x, value]
    };
    let [level, slope, bend] = least_squares(high.iter().map(row), 0.0)?;
    let x = -0.5 * slope / bend;
    (bend < 0.0 && x.abs() <= 1.0).then_some((from + x * width, level + 0.5 * slope * x))
}

/// Slope of the least-squares line through points; `None` for fewer than two, or if all have the
/// same x.
pub fn slope(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    let mean = |f: fn(&(f64, f64)) -> f64| points.iter().map(f).sum::<f64>() / n;
    let (mx, my) = (mean(|p| p.0), mean(|p| p.1));
    let spread: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let shared: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    (points.len() > 1 && spread > 0.0).then(|| shared / spread)
}

/// Order of convergence: the power of the resolution with which errors fall, by least squares of
/// the logarithms. Takes pairs of resolution and error.
pub fn order(errors: &[(f64, f64)]) -> Option<f64> {
    let logs: Vec<_> = errors.iter().map(|(r, e)| (r.ln(), e.abs().ln())).collect();
    slope(&logs)
        .map(|slope| -slope)
        .filter(|order| order.is_finite())
}

/// Order of convergence of (resolution, value) pairs without a known limit, from the changes over
/// two steps of the same ratio (Roache 1998). `None` unless there are exactly three, in steps of
/// one ratio, that change in one direction.
pub fn order_of_changes(numbers: &[(f64, f64)]) -> Option<f64> {
    let [(r0, a), (r1, b), (r2, c)] = *numbers else {
        return None;
    };
    let ratio = r1 / r0;
    let order = ((b - a) / (c - b)).ln() / ratio.ln();
    ((r2 / r1 - ratio).abs() < 1e-9 * ratio && order.is_finite()).then_some(order)
}

/// Mean period of a signal, seconds, from its zero crossings between swings of at least `least` to
/// either side; `None` if there are fewer than two.
pub fn period(samples: &[(f64, f64)], least: f64) -> Option<f64> {
    let mut crossings: Vec<f64> = Vec::new();
    let (mut side, mut through) = (0.0, 0.0);
    for w in samples.windows(2) {
        let [(t, a), (next, b)] = [w[0], w[1]];
        if (a < 0.0) != (b < 0.0) {
            through = t + (next - t) * a / (a - b);
        }
        if b.abs() >= least && b.signum() != side {
            if side != 0.0 {
                crossings.push(through);
            }
            side = b.signum();
        }
    }
    let (first, last) = (crossings.first()?, crossings.last()?);
    (crossings.len() > 1).then(|| 2.0 * (last - first) / (crossings.len() - 1) as f64)
}

/// Value of a curve with ascending x, linearly interpolated; `None` beyond its ends.
pub fn value_at(curve: &[(f64, f64)], x: f64) -> Option<f64> {
    let next = curve.partition_point(|p| p.0 < x);
    let b = *curve.get(next)?;
    if b.0 == x {
        return Some(b.1);
    }
    let a = *curve.get(next.checked_sub(1)?)?;
    Some(a.1 + (b.1 - a.1) * (x - a.0) / (b.0 - a.0))
}

/// The x at which a curve first reaches `level` from below, linearly interpolated.
pub fn reaches(curve: &[(f64, f64)], level: f64) -> Option<f64> {
    let next = curve.iter().position(|p| p.1 >= level)?;
    let b = curve[next];
    match next.checked_sub(1) {
        None => Some(b.0),
        Some(before) => {
            let a = curve[before];
            Some(a.0 + (b.0 - a.0) * (level - a.1) / (b.1 - a.1))
        }
    }
}

/// Mean of |curve / point − 1| over points (x, y), with the curve shifted by `shift` towards
/// greater x; `None` if it does not cover all of them.
pub fn mean_error(curve: &[(f64, f64)], points: &[[f64; 2]], shift: f64) -> Option<f64> {
    let mut sum = 0.0;
    for [x, y] in points {
        sum += (value_at(curve, x - shift)? / y - 1.0).abs();
    }
    (!points.is_empty()).then(|| sum / points.len() as f64)
}

/// Step of the tried shifts; for x of order 1, finer than measured points are known.
const SHIFT_STEP: f64 = 0.005;

/// The shift of at most `most` in either direction with the least [`mean_error`], and that error.
pub fn fitted_shift(curve: &[(f64, f64)], points: &[[f64; 2]], most: f64) -> Option<(f64, f64)> {
    let steps = (most / SHIFT_STEP).round() as i32;
    let tried = (-steps..=steps).map(|k| SHIFT_STEP * f64::from(k));
    let errors = tried.filter_map(|shift| Some((shift, mean_error(curve, points, shift)?)));
    errors.min_by(|a, b| a.1.total_cmp(&b.1))
}

/// The largest mean of a signal over a window of `window` seconds that lies within the samples;
/// each sample holds until the next.
pub fn largest_mean(samples: &[(f64, f64)], window: f64) -> Option<f64> {
    let mut most: Option<f64> = None;
    for (k, &(from, _)) in samples.iter().enumerate() {
        let end = from + window * (1.0 + 1e-9);
        let inside = &samples[k..];
        let inside = &inside[..inside.partition_point(|(t, _)| *t < end - 2e-9 * window)];
        let Some(&(beyond, _)) = samples.get(k + inside.len()) else {
            break;
        };
        let mut sum = 0.0;
        for (i, &(t, value)) in inside.iter().enumerate() {
            let until = inside.get(i + 1).map_or(beyond.min(from + window), |s| s.0);
            sum += value * (until - t);
        }
        most = Some(most.map_or(sum / window, |m| m.max(sum / window)));
    }
    most
}

/// Depth at x of water released over a dry bed without friction, a time t after the dam at 0 is
/// removed (Ritter 1892).
///
/// `depth` h0 up to x = −t √(g h0), then (2 √(g h0) − x/t)² / 9g up to x = 2 t √(g h0), and 0
/// beyond.
pub fn ritter(x: f64, t: f64, depth: f64, gravity: f64) -> f64 {
    let celerity = (gravity * depth).sqrt();
    let u = x / t;
    if u <= -celerity {
        depth
    } else if u >= 2.0 * celerity {
        0.0
    } else {
        (2.0 * celerity - u).powi(2) / (9.0 * gravity)
    }
}

/// Elevation of a solitary wave relative to its height, at a distance from its crest (Boussinesq
/// 1872): sech²(√(3H/4d) x/d). `distance` and `height` are in depths.
pub fn solitary(distance: f64, height: f64) -> f64 {
    ((0.75 * height).sqrt() * distance).cosh().powi(-2)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(from: f64, until: f64, step: f64, of: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
        let count = ((until - from) / step).round() as usize;
        (0..=count)
            .map(|k| from + step * k as f64)
            .map(|t| (t, of(t)))
            .collect()
    }

    #[test]
    fn a_harmonic_is_found_below_its_overtone_and_not_beside_another_frequency() {
        let omega = TAU / 2.0;
        let wave = |t: f64| 1.0 + 0.3 * (omega * t - 0.7).cos() + 0.1 * (2.0 * omega * t).sin();
        let samples = sampled(0.0, 10.0, 0.05, wave);
        let samples = whole_periods(&samples, 2.0, 1.0);
        // Four periods of 40 samples, the last one at the end.
        assert_eq!(samples.len(), 160);
        let found = harmonic(samples, omega).unwrap();
        assert!((found.mean - 1.0).abs() < 1e-12, "{found:?}");
        assert!((found.amplitude - 0.3).abs() < 1e-12, "{found:?}");
        assert!((found.phase - 0.7).abs() < 1e-12, "{found:?}");
        // Negative control: a frequency 5 % off loses a part of the amplitude.
        let other = harmonic(samples, 1.05 * omega).unwrap();
        assert!((other.amplitude - 0.3).abs() > 0.01, "{other:?}");
        assert_eq!(harmonic(&samples[..3], omega), None);
        assert_eq!(harmonic(&[(1.0, 1.0); 8], omega), None);
    }

    #[test]
    fn two_gauges_know_the_wave_length() {
        let (length, omega) = (6.0, TAU / 2.3);
        let at = |x: f64| {
            let wave = |t: f64| (omega * t - TAU * x / length).cos();
            harmonic(&sampled(0.0, 2.3 * 4.0 - 0.1, 0.1, wave), omega)
        };
        let [a, b] = [2.0, 5.0].map(|x| at(x).unwrap().phase);
        assert!((wave_length(a, b, 3.0) - length).abs() < 1e-9);
        // Negative control: swapped gauges see a wave in the opposite direction.
        assert!((wave_length(b, a, 2.0) - length).abs() > 1.0);
    }

    #[test]
    fn gauges_tell_what_comes_from_what_runs_back() {
        let (k, omega) = (1.1, 2.0);
        let found = |places: &[f64], part: f64| {
            let at = |&x: &f64| {
                let wave =
                    |t: f64| (omega * t - k * x).cos() + part * (omega * t + k * x - 0.4).cos();
                (
                    x,
                    harmonic(&sampled(0.0, TAU / omega * 3.0 - 0.05, 0.05, wave), omega).unwrap(),
                )
            };
            reflection(&places.iter().map(at).collect::<Vec<_>>(), k)
        };
        for part in [0.0, 0.05, 0.7] {
            for places in [&[3.0, 4.0][..], &[3.0, 4.0, 5.3]] {
                let is = found(places, part).unwrap();
                assert!((is - part).abs() < 1e-9, "{places:?}: {is}, {part}");
            }
        }
        // Half a wavelength apart, both waves look alike.
        assert_eq!(found(&[3.0, 3.0 + TAU / k / 2.0], 0.05), None);
        // Negative control: more is reflected than arrives.
        assert!(found(&[3.0, 4.0], 20.0).unwrap() > 19.9);
    }

    #[test]
    fn a_crest_is_between_its_samples() {
        let sech = |t: f64| 0.2 * (1.3 * (t - 2.03)).cosh().powi(-2);
        for step in [0.05, 0.11] {
            let (time, height) = crest(&sampled(0.0, 5.0, step, sech), 0.8).unwrap();
            // Symmetric to within a tenth of a step; a parabola through the upper fifth is 0.4 %
            // lower.
            assert!((time - 2.03).abs() < 0.1 * step, "{time}");
            assert!((height / 0.2 - 1.0).abs() < 0.008, "{height}");
        }
        // A second, lower crest does not count; nor does a rise without end.
        let two = |t: f64| sech(t) + 0.19 * (1.3 * (t - 8.0)).cosh().powi(-2);
        let (time, _) = crest(&sampled(0.0, 10.0, 0.05, two), 0.8).unwrap();
        assert!((time - 2.03).abs() < 0.01, "{time}");
        assert_eq!(crest(&sampled(0.0, 1.0, 0.1, |t| t * t), 0.8), None);
        // Cut off shortly after its maximum, or before it.
        assert_eq!(crest(&sampled(0.0, 2.1, 0.05, sech), 0.8), None);
        assert_eq!(crest(&sampled(1.95, 5.0, 0.05, sech), 0.8), None);
    }

    #[test]
    fn a_slope_and_an_order_are_those_of_a_power() {
        let errors = [10.0f64, 20.0, 40.0].map(|r| (r, -3.0 * r.powf(-1.7)));
        assert!((order(&errors).unwrap() - 1.7).abs() < 1e-12);
        // An error that does not fall.
        assert!(order(&[(10.0, 0.1), (20.0, 0.1)]).unwrap().abs() < 1e-12);
        assert_eq!(order(&errors[..1]), None);
        assert_eq!(slope(&[(1.0, 1.0), (1.0, 2.0)]), None);
        // Values whose limit is not given.
        let numbers = errors.map(|(r, error)| (r, 5.0 + error));
        assert!((order_of_changes(&numbers).unwrap() - 1.7).abs() < 1e-9);
        let [a, b, _] = numbers;
        assert_eq!(order_of_changes(&[a, b]), None);
        assert_eq!(order_of_changes(&[a, b, (30.0, 5.0)]), None);
        assert_eq!(order_of_changes(&[a, b, (40.0, a.1)]), None);
    }

    #[test]
    fn a_period_is_that_between_swings() {
        let wave = |t: f64| (-0.1 * t).exp() * (TAU * t / 0.8).cos();
        let found = period(&sampled(0.0, 3.0, 0.01, wave), 0.1).unwrap();
        assert!((found - 0.8).abs() < 1e-3, "{found}");
        // Ripples through 0 that stay below the threshold are not swings.
        let ripple = |t: f64| wave(t) + 0.03 * (TAU * t / 0.03).cos();
        let found = period(&sampled(0.0, 3.0, 0.01, ripple), 0.1).unwrap();
        assert!((found - 0.8).abs() < 0.02, "{found}");
        assert_eq!(period(&sampled(0.0, 0.3, 0.01, wave), 0.1), None);
    }

    #[test]
    fn a_curve_is_straight_between_its_points() {
        let curve = [(0.0, 1.0), (1.0, 2.0), (2.0, 4.0)];
        assert_eq!(value_at(&curve, 1.5), Some(3.0));
        assert_eq!(value_at(&curve, 0.0), Some(1.0));
        assert_eq!(value_at(&curve, 2.1), None);
        assert_eq!(value_at(&curve, -0.1), None);
        assert_eq!(reaches(&curve, 3.0), Some(1.5));
        assert_eq!(reaches(&curve, 0.5), Some(0.0));
        assert_eq!(reaches(&curve, 5.0), None);
    }

    #[test]
    fn a_late_front_is_one_shift_away() {
        let front = |t: f64| 1.0 + 0.5 * t * t;
        let curve = sampled(0.0, 5.0, 0.01, front);
        let points = [1.0, 2.0, 3.0].map(|t| [t + 0.3, front(t)]);
        let raw = mean_error(&curve, &points, 0.0).unwrap();
        assert!(raw > 0.1, "{raw}");
        let (shift, error) = fitted_shift(&curve, &points, 1.0).unwrap();
        assert!(
            (shift - 0.3).abs() < 1e-9 && error < 1e-4,
            "{shift} {error}"
        );
        // Negative control: no shift compensates for a slower front.
        let slow = sampled(0.0, 5.0, 0.01, |t| front(0.8 * t));
        assert!(fitted_shift(&slow, &points, 1.0).unwrap().1 > 0.02);
        assert_eq!(mean_error(&curve[..50], &points, 0.0), None);
    }

    #[test]
    fn a_mean_over_a_window_is_less_than_a_peak() {
        // 2 ms of 1000 Pa, then 400.
        let signal = |t: f64| match t {
            t if !(0.01..0.05).contains(&t) => 0.0,
            t if t < 0.0119 => 1000.0,
            _ => 400.0,
        };
        let samples = sampled(0.0, 0.1, 0.001, signal);
        let found = largest_mean(&samples, 0.01).unwrap();
        assert!(
            (found - (2.0 * 1000.0 + 8.0 * 400.0) / 10.0).abs() < 1e-6,
            "{found}"
        );
        // Samples as far apart as the window are their own means; fewer do not span one.
        let apart = [(0.0, 1.0), (0.01, 7.0), (0.02, 2.0)];
        assert!((largest_mean(&apart, 0.01).unwrap() - 7.0).abs() < 1e-9);
        assert_eq!(largest_mean(&apart[..1], 0.01), None);
        // A window that ends within a sample takes its part of it.
        let half = largest_mean(&[(0.0, 1.0), (0.01, 7.0), (0.02, 3.0), (0.03, 0.0)], 0.015);
        assert!(
            (half.unwrap() - (7.0 * 0.01 + 3.0 * 0.005) / 0.015).abs() < 1e-9,
            "{half:?}"
        );
    }

    /// Depth and flow at the dam in closed form, and conservation of mass and momentum: the
    /// shallow-water equations by central differences, u = 2 (x/t + √(g h0)) / 3.
    #[test]
    fn ritters_profile_solves_the_shallow_water_equations() {
        let (depth, gravity) = (1.3, 9.81);
        let h = |x: f64, t: f64| ritter(x, t, depth, gravity);
        let celerity = (gravity * depth).sqrt();
        let u = |x: f64, t: f64| 2.0 / 3.0 * (x / t + celerity);
        assert!((h(0.0, 1.0) - 4.0 / 9.0 * depth).abs() < 1e-12);
        let flow = h(0.0, 1.0) * u(0.0, 1.0);
        assert!((flow - 8.0 / 27.0 * depth * celerity).abs() < 1e-12);
        let (e, t) = (1e-5, 0.9);
        for x in [-2.0, 0.5, 3.0] {
            let rate = (h(x, t + e) - h(x, t - e)) / (2.0 * e);
            let q = |x: f64| h(x, t) * u(x, t);
            let spread = (q(x + e) - q(x - e)) / (2.0 * e);
            assert!((rate + spread).abs() < 1e-6, "{x}");
            let along = |f: &dyn Fn(f64) -> f64| (f(x + e) - f(x - e)) / (2.0 * e);
            let faster = (u(x, t + e) - u(x, t - e)) / (2.0 * e);
            let pushed = u(x, t) * along(&|x| u(x, t)) + gravity * along(&|x| h(x, t));
            assert!((faster + pushed).abs() < 1e-6, "{x}");
            // Negative control: with another gravity it does not.
            let other = u(x, t) * along(&|x| u(x, t)) + 1.01 * gravity * along(&|x| h(x, t));
            assert!((faster + other).abs() > 1e-3, "{x}");
        }
        assert_eq!(h(-celerity, 1.0), depth);
        assert_eq!(h(2.0 * celerity, 1.0), 0.0);
    }

    /// Volume 4 H d / 3 k with k = √(3H/4d) / d, here in depths.
    #[test]
    fn a_solitary_wave_has_its_volume() {
        let height = 0.2;
        let volume: f64 = (-4000..=4000)
            .map(|k| 0.01 * height * solitary(0.01 * f64::from(k), height))
            .sum();
        let expected = 2.0 * height / (0.75f64 * height).sqrt();
        assert!(
            (volume / expected - 1.0).abs() < 1e-9,
            "{volume} {expected}"
        );
    }
}
