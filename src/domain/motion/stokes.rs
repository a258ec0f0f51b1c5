//! Piston motion for regular waves to second order, without a free wave of twice the frequency.

use std::f64::consts::{PI, TAU};

use super::{
    piston_height_ratio,
    regular::{Cycle, RegularWaves, comes_within},
    second_order::second_harmonic,
};

/// Largest H L² / h³ for which the second order holds (Madsen 1971). Beyond it, in shallow water,
/// the second harmonic of the elevation is more than a quarter of the first, and a second crest
/// appears in the trough.
pub const MADSEN_LIMIT: f64 = 8.0 * PI * PI / 3.0;

/// Number of intervals per turn in which zeros are searched for. Two harmonics have at most
/// four zeros.
const PARTS: u32 = 64;

/// Wall motion for regular waves to second order.
///
/// The displacement from the wall's mean position is A sin φ + B sin 2φ + C cos 2φ with
/// φ = ωt + φ₀. A = H / 2n, where n = H/S is the ratio of linear theory (Dean and Dalrymple 1991,
/// §6); B and C are those of the full second order (Schäffer 1996). In shallow water C is 0 and B
/// is Madsen's (1971) H² / 32h · (3 cosh kh / sinh³ kh − 2 / n), which is 5 % low at kh = 0.5, 20 %
/// at 0.7, and of the wrong sign above 1.16.
#[derive(Clone, Debug, PartialEq)]
pub struct Stokes {
    waves: RegularWaves,
    /// Wavenumber, rad/m.
    number: f64,
    /// Angular frequency, rad/s.
    frequency: f64,
    /// A, B and C, metres.
    harmonics: [f64; 3],
    /// Phases at which the wall is farthest out (φ₀), and next farthest in.
    ends: [f64; 2],
    /// Phases, from 0 to 2π, at which the wall is fastest or slowest.
    turns: Vec<f64>,
    /// Mean position of the wall, metres.
    mean: f64,
}

impl Stokes {
    /// Computes the wall's motion for waves whose H L² / h³ is below [`MADSEN_LIMIT`].
    pub fn new(waves: RegularWaves) -> Self {
        let number = waves.wave_number();
        let frequency = TAU / waves.period;
        let first = 0.5 * waves.height / piston_height_ratio(number, waves.depth);
        let second = second_harmonic(frequency, waves.depth, waves.gravity);
        let [sin, cos] = second.map(|factor| factor * first * first);
        let harmonics = [first, sin, cos];
        let way = |phase: &f64| harmonic(harmonics, *phase)[0];
        let ends = zeros(|phase| harmonic(harmonics, phase)[1]);
        let by_way = |a: &&f64, b: &&f64| way(a).total_cmp(&way(b));
        // The derivative changes its sign at least twice.
        let out = ends.iter().min_by(by_way).copied().unwrap_or_default();
        let far = ends.iter().max_by(by_way).copied().unwrap_or_default();
        Self {
            waves,
            number,
            frequency,
            harmonics,
            ends: [out, out + (far - out).rem_euclid(TAU)],
            turns: zeros(|phase| harmonic(harmonics, phase)[2]),
            mean: -way(&out),
        }
    }

    /// Returns the waves that this motion was derived from.
    pub fn waves(&self) -> &RegularWaves {
        &self.waves
    }

    /// Returns the wave length by linear theory, metres.
    pub fn wave_length(&self) -> f64 {
        TAU / self.number
    }

    /// Returns the elevation to second order at `distance` from the domain's face after the ramp,
    /// metres: a cos φ + a₂ cos 2φ with a = H/2 and a₂ = k a² / 4 · (3 − tanh² kh) / tanh³ kh
    /// (Stokes 1847).
    pub fn elevation(&self, distance: f64, t: f64) -> f64 {
        let amplitude = 0.5 * self.waves.height;
        let tanh = (self.number * self.waves.depth).tanh();
        let second = 0.25 * self.number * amplitude.powi(2) * (3.0 - tanh * tanh) / tanh.powi(3);
        let phase = self.phase(t) - self.number * (distance - self.mean);
        amplitude * phase.cos() + second * (2.0 * phase).cos()
    }

    /// Phase φ.
    fn phase(&self, t: f64) -> f64 {
        self.frequency * t + self.ends[0]
    }

    /// Velocity at phase φ, m/s.
    fn velocity(&self, phase: f64) -> f64 {
        self.frequency * harmonic(self.harmonics, phase)[1]
    }
}

impl Cycle for Stokes {
    fn ramp(&self) -> f64 {
        self.waves.ramp
    }

    fn full(&self, t: f64) -> (f64, f64) {
        let phase = self.phase(t);
        let way = harmonic(self.harmonics, phase)[0];
        // 0 at the start but for rounding.
        ((self.mean + way).max(0.0), self.velocity(phase))
    }

    fn velocities(&self, t0: f64, t1: f64) -> [f64; 2] {
        let within = [t0, t1].map(|t| self.phase(t) / TAU);
        let turns = self.turns.iter();
        turns
            .filter(|turn| comes_within(*turn / TAU, within))
            .map(|turn| self.velocity(*turn))
            .chain([t0, t1].map(|t| self.velocity(self.phase(t))))
            .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], v| {
                [low.min(v), high.max(v)]
            })
    }

    fn greatest(&self) -> (f64, f64) {
        let [out, far] = self.ends;
        let most = self.mean + harmonic(self.harmonics, far)[0];
        ((far - out) / self.frequency, most)
    }
}

/// A sin φ + B sin 2φ + C cos 2φ and its first two derivatives with respect to φ.
fn harmonic([a, b, c]: [f64; 3], phase: f64) -> [f64; 3] {
    let (sin, cos) = phase.sin_cos();
    let (sin_2, cos_2) = (2.0 * phase).sin_cos();
    [
        a * sin + b * sin_2 + c * cos_2,
        a * cos + 2.0 * (b * cos_2 - c * sin_2),
        -a * sin - 4.0 * (b * sin_2 + c * cos_2),
    ]
}

/// Zeros of a function of phase within a turn, by bisection.
fn zeros(of: impl Fn(f64) -> f64) -> Vec<f64> {
    let part = TAU / f64::from(PARTS);
    let below: Vec<bool> = (0..PARTS).map(|i| of(part * f64::from(i)) < 0.0).collect();
    // The last interval ends with the first one's own start, so a zero at 0 lies in one of both,
    // however it is rounded.
    let ends = below.iter().cycle().skip(1);
    let changes = below.iter().zip(ends).zip(0u32..);
    changes
        .filter(|((start, end), _)| start != end)
        .map(|((&rises, _), i)| {
            let start = part * f64::from(i);
            let (mut low, mut high) = (start, start + part);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                if (of(middle) < 0.0) == rises {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            low
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asked(height: f64, period: f64) -> RegularWaves {
        RegularWaves {
            height,
            period,
            depth: 0.8,
            gravity: 9.81,
            ramp: 0.0,
        }
    }

    /// Amplitudes of a harmonic of the displacement: of sin nφ and cos nφ, with φ = 0 at the zero
    /// crossing of the first.
    fn part(waves: &Stokes, n: f64) -> [f64; 2] {
        let mut sum = [0.0, 0.0];
        let (samples, period) = (512, waves.waves.period);
        for i in 0..samples {
            let t = 3.0 + period * f64::from(i) / f64::from(samples);
            let phase = waves.phase(t);
            let x = waves.state(t).0 * 2.0 / f64::from(samples);
            sum[0] += x * (n * phase).sin();
            sum[1] += x * (n * phase).cos();
        }
        sum
    }

    /// k bisected from ω² = g k tanh kh, and H/S = 4 sinh² kh / (sinh 2kh + 2kh).
    fn linear(period: f64) -> (f64, f64) {
        let (mut low, mut high) = (1e-6, 1e3);
        for _ in 0..100 {
            let k: f64 = 0.5 * (low + high);
            match 9.81 * k * (k * 0.8).tanh() < (TAU / period).powi(2) {
                true => low = k,
                false => high = k,
            }
        }
        let kh = 0.8 * low;
        (kh, 4.0 * kh.sinh().powi(2) / ((2.0 * kh).sinh() + 2.0 * kh))
    }

    #[test]
    fn the_first_harmonic_is_linear_theorys_stroke_and_the_second_madsens_in_shallow_water() {
        for (height, period) in [(0.005, 9.0), (0.02, 6.0), (0.1, 2.5), (0.2, 1.2)] {
            let waves = Stokes::new(asked(height, period));
            let (kh, ratio) = linear(period);
            let first = part(&waves, 1.0);
            let off = |stroke: f64| f64::hypot(first[0] - 0.5 * stroke, first[1]) / stroke;
            assert!(off(height / ratio) < 1e-12, "{period}: {first:?}");
            assert!(off(1.01 * height / ratio) > 1e-3);
            // Madsen 1971 neglects terms of fourth order in kh.
            let second = part(&waves, 2.0);
            let madsen =
                height.powi(2) / (32.0 * 0.8) * (3.0 * kh.cosh() / kh.sinh().powi(3) - 2.0 / ratio);
            let off = f64::hypot(second[0] - madsen, second[1]) / madsen.abs();
            if kh < 0.5 {
                assert!(off < 0.8 * kh.powi(4), "{kh}: {off}");
                assert!((1.1 * second[0] / madsen - 1.0).abs() > 0.05);
            } else {
                assert!(off > 0.4, "{kh}: {off}");
            }
            assert!(part(&waves, 3.0).iter().all(|x| x.abs() < 1e-14));
        }
        // By hand: 0.1 m and 4 s on 0.8 m have kh = 0.46418 and n = 0.46372, so Madsen gives
        // 0.01 / 25.6 · (29.909 − 4.313) = 9.9985 mm.
        let [sin, _] = part(&Stokes::new(asked(0.1, 4.0)), 2.0);
        assert!((1.03..1.04).contains(&(sin / 9.9985e-3)), "{sin}");
    }

    #[test]
    fn it_starts_at_rest_farthest_out_and_goes_as_far_in_as_it_says() {
        for (height, period) in [(0.02, 6.0), (0.1, 2.5), (0.2, 1.2)] {
            let waves = Stokes::new(asked(height, period));
            let (x, v) = waves.state(0.0);
            assert!(x.abs() < 1e-15 && v.abs() < 1e-12, "{x} {v}");
            let (when, most) = waves.greatest();
            let at = |i: u32| waves.state(period * f64::from(i) / 5000.0).0;
            let seen = (0..5000).map(at).fold(0.0, f64::max);
            // Half a step from the maximum loses (2π/10⁴)²/2 of it.
            assert!((seen / most - 1.0).abs() < 4e-7 && seen <= most * (1.0 + 1e-14));
            assert!((waves.state(when).0 / most - 1.0).abs() < 1e-14);
            assert!(waves.state(0.9 * when).0 < 0.99 * most);
        }
    }

    /// Crest and trough of the elevation differ by the height, as the second harmonic is equal at
    /// both, and the crest moves at ω/k.
    #[test]
    fn the_elevation_is_stokes_wave_that_leaves_the_walls_mean_place() {
        let waves = Stokes::new(asked(0.1, 2.5));
        let (kh, _) = linear(2.5);
        let length = TAU * 0.8 / kh;
        // When the first harmonic of the displacement crosses zero inward, a crest is at the
        // mean position.
        let t = -waves.ends[0] / waves.frequency;
        let at = |x: f64| waves.elevation(waves.mean + x, t);
        assert!((at(0.0) - at(0.5 * length) - 0.1).abs() < 1e-12);
        // k a² / 4 · (3 − tanh²) / tanh³ of cos 2φ.
        let second = 0.5 * (at(0.0) + at(0.5 * length));
        let expected = kh / 0.8 * 0.05 * 0.05 * kh.cosh() * (2.0 + (2.0 * kh).cosh())
            / (4.0 * kh.sinh().powi(3));
        assert!((second / expected - 1.0).abs() < 1e-10, "{second}");
        let later = waves.elevation(waves.mean + 0.3 * length, t + 0.3 * 2.5);
        assert!((later - at(0.0)).abs() < 1e-12);
        assert!((waves.elevation(waves.mean + 0.3 * length, t) - at(0.0)).abs() > 0.01);
    }

    /// On shallow water C is almost 0, so that the wall is fastest at the boundary between
    /// two turns.
    #[test]
    fn both_turns_of_the_velocity_are_found_on_shallow_water() {
        for height in [1e-9, 1e-7, 1e-3] {
            let waves = Stokes::new(asked(height, 20.0));
            assert_eq!(waves.turns.len(), 2, "{height}: {:?}", waves.turns);
            let seen = (0..2000).map(|i| waves.state(0.01 * f64::from(i)).1.abs());
            let seen = seen.fold(0.0, f64::max);
            let bound = waves.peak_speed(0.0, 20.0);
            assert!(seen <= bound && bound < 1.001 * seen, "{seen} {bound}");
        }
    }

    /// At Madsen's limit, in shallow water, the second harmonic is a quarter of the first:
    /// H L² / h³ = 8π²/3.
    #[test]
    fn madsens_limit_is_where_a_second_crest_begins() {
        let waves = |height: f64| Stokes::new(asked(height, 12.0));
        let limit = 1e-3 * MADSEN_LIMIT / asked(1e-3, 12.0).ursell();
        // Curvature in the trough, φ = π: positive without a second crest.
        let curvature = |height: f64| {
            let waves = waves(height);
            let of = |turn: f64| {
                let x = waves.mean + turn * PI / waves.number;
                waves.elevation(x, -waves.ends[0] / waves.frequency)
            };
            of(0.95) + of(1.05) - 2.0 * of(1.0)
        };
        assert!(curvature(0.9 * limit) > 0.0);
        assert!(curvature(1.1 * limit) < 0.0);
    }
}
