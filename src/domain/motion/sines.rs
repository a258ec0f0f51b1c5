//! A sum of sines with a ramp: the displacement of a wall whose waves are known one by one.

use super::smooth_ramp;

/// Largest excess of a bound over the samples, relative to the root mean square: between two
/// samples a function differs from the straight line by at most an eighth of the squared step times
/// its greatest curvature.
const MISSED: f64 = 0.01;

/// A sin(ω t + φ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sine {
    /// Amplitude, metres, of either sign.
    pub(super) amplitude: f64,
    /// Angular frequency, rad/s.
    pub(super) frequency: f64,
    /// Phase at time 0, radians.
    pub(super) phase: f64,
}

/// r(t) (X + Σ Aᵢ sin(ωᵢ t + φᵢ)) with the ramp r; X keeps the displacement from falling below 0.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Sines {
    /// The terms of the sum.
    pub(super) lines: Vec<Sine>,
    /// X, metres.
    pub(super) mean: f64,
    /// Time until the full size, seconds, above 0.
    pub(super) ramp: f64,
    /// Period of the sum, seconds.
    pub(super) whole: f64,
}

impl Sines {
    /// A lower bound on Σ Aᵢ sin(ωᵢ t + φᵢ) over all times, metres.
    pub(super) fn least(&self) -> f64 {
        let curvature = self.most(2);
        let step = (8.0 * MISSED * self.root_mean_square(0) / curvature).sqrt();
        let count = (self.whole / step).ceil() as u64;
        // Rotated from one sample to the next: some 2e4 rotations, with an error of 2e4 ε of
        // the amplitude.
        let mut turning: Vec<[f64; 4]> = self
            .lines
            .iter()
            .map(|line| {
                let (sin, cos) = line.phase.sin_cos();
                let (turn_sin, turn_cos) = (line.frequency * step).sin_cos();
                [
                    line.amplitude * cos,
                    line.amplitude * sin,
                    turn_cos,
                    turn_sin,
                ]
            })
            .collect();
        let mut least = 0.0f64;
        for _ in 0..=count {
            let mut sum = 0.0;
            for [re, im, cos, sin] in &mut turning {
                sum += *im;
                (*re, *im) = (*re * *cos - *im * *sin, *re * *sin + *im * *cos);
            }
            least = least.min(sum);
        }
        least - curvature * step * step / 8.0
    }

    /// Σ |Aᵢ| ωᵢⁿ: an upper bound on the derivative of order n, m/sⁿ.
    pub(super) fn most(&self, order: i32) -> f64 {
        let of = |line: &Sine| line.amplitude.abs() * line.frequency.powi(order);
        self.lines.iter().map(of).sum()
    }

    /// Root mean square of the sum's derivative of order n, m/sⁿ.
    fn root_mean_square(&self, order: i32) -> f64 {
        let of = |line: &Sine| (line.amplitude * line.frequency.powi(order)).powi(2);
        (0.5 * self.lines.iter().map(of).sum::<f64>()).sqrt()
    }

    /// Displacement, metres, and velocity, m/s, at a time from 0 on.
    pub(super) fn state(&self, t: f64) -> (f64, f64) {
        let (amount, amount_rate) = smooth_ramp(t, self.ramp);
        let (mut way, mut rate) = (self.mean, 0.0);
        for line in &self.lines {
            let (sin, cos) = (line.frequency * t + line.phase).sin_cos();
            way += line.amplitude * sin;
            rate += line.amplitude * line.frequency * cos;
        }
        // 0 but for the rounding of `mean`.
        ((amount * way).max(0.0), amount * rate + amount_rate * way)
    }

    /// An upper bound on the displacement within `[0, t]`, metres.
    pub(super) fn peak_displacement(&self, t: f64) -> f64 {
        self.peak(0, 0.0, t)
    }

    /// An upper bound on |velocity| within `[t0, t1]`, m/s.
    pub(super) fn peak_speed(&self, t0: f64, t1: f64) -> f64 {
        self.peak(1, t0, t1)
    }

    /// An upper bound on the magnitude of the displacement's derivative of order 0 or 1. After the
    /// ramp the sum is periodic.
    fn peak(&self, order: i32, t0: f64, t1: f64) -> f64 {
        let ramp = self.ramp;
        // Derivatives of the ramp's quintic in t / ramp are at most 1.875, 10 / √3 and 60.
        let before = [
            1.0,
            1.875 / ramp,
            10.0 / 3f64.sqrt() / ramp.powi(2),
            60.0 / ramp.powi(3),
        ];
        let rising = match t0 < ramp {
            true => self.peak_of(order, [t0, t1.min(ramp)], before),
            false => 0.0,
        };
        let after = t0.max(ramp);
        let full = match after < t1 {
            true => {
                let end = t1.min(after + self.whole);
                self.peak_of(order, [after, end], [1.0, 0.0, 0.0, 0.0])
            }
            false => 0.0,
        };
        rising.max(full)
    }

    /// Same for ramp derivatives of at most `ramp`: from samples, and a bound on the curvature
    /// between them (Leibniz rule).
    fn peak_of(&self, order: i32, [t0, t1]: [f64; 2], ramp: [f64; 4]) -> f64 {
        let order_of_curvature = order + 2;
        let binomials = [[1.0, 2.0, 1.0, 0.0], [1.0, 3.0, 3.0, 1.0]][order as usize];
        let mean = |order: i32| if order == 0 { self.mean } else { 0.0 };
        let curvature: f64 = (0..=order_of_curvature)
            .map(|j| {
                let rest = order_of_curvature - j;
                binomials[j as usize] * ramp[j as usize] * (self.most(rest) + mean(rest))
            })
            .sum();
        let off = MISSED * self.root_mean_square(order);
        let step = (8.0 * off / curvature).sqrt();
        let count = ((t1 - t0) / step).ceil().max(1.0);
        let step = (t1 - t0) / count;
        let at = |i: u64| {
            let (way, rate) = self.state(t0 + step * i as f64);
            if order == 0 { way } else { rate.abs() }
        };
        let seen = (0..=count as u64).map(at).fold(0.0, f64::max);
        seen + curvature * step * step / 8.0
    }
}
