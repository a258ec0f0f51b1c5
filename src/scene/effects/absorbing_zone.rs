//! Absorbing zones in front of walls, in which waves are damped instead of reflected: a sponge
//! layer (Israeli and Orszag 1981).

use serde::{Deserialize, Serialize};

use super::{Absorbs, Effect, zone::Zone};
use crate::Wall;

/// Relaxation rate at the wall over the angular frequency of the waves.
///
/// In shallow water the velocity in the zone satisfies u″ + k² (1 − i r/ω) u = 0 and vanishes
/// at the wall. A zone of 1.5 wavelengths then reflects 0.1 % of a wave's height, one of a
/// wavelength 1.8 % and one of three quarters 7.7 %. (A rate of 1.5 reflects 1.2, 5.8 and 11
/// %, and so does 5.)
const RATE: f64 = 2.5;

/// Least length in wavelengths. In shallow water such a zone reflects 4 % of a wave's height, one
/// of 0.3 wavelengths a quarter.
const LEAST: f64 = 0.5;

/// `absorbing_zone = { walls = ["+x"], length = 9.4, period = 2.3 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Walls with a zone, each listed once.
    pub walls: Vec<Wall>,
    /// Length of each zone from its wall, metres.
    pub length: f64,
    /// Period of the longest waves to absorb, s.
    pub period: f64,
}

impl Settings {
    /// Returns the zones with their relaxation rate.
    pub fn zone(&self) -> Zone<'_> {
        Zone {
            walls: &self.walls,
            length: self.length,
            rate: RATE * std::f64::consts::TAU / self.period,
        }
    }
}

impl Effect for Settings {
    fn absorbs(&self) -> Option<Absorbs<'_>> {
        Some(Absorbs {
            zone: self.zone(),
            period: self.period,
            least: LEAST,
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Part of a wave's height that a zone of this many wavelengths reflects in shallow water. The
    /// classical Runge-Kutta method integrates u″ + k² (1 − i r/ω) u = 0 from the wall, where u =
    /// 0, to the beginning of the zone, where u = a exp(ikx) + b exp(−ikx). Lengths are in 1/k;
    /// complex numbers are pairs.
    fn turned_back(wave_lengths: f64, rate_over_frequency: f64) -> f64 {
        use std::f64::consts::TAU;
        let zone = Settings {
            walls: vec![Wall {
                axis: 0,
                is_max: false,
            }],
            length: TAU * wave_lengths,
            period: TAU,
        };
        // For a step this short the fraction is r Δt.
        let step = 1e-9;
        let lost = |x: f64| {
            let part = zone.zone().led(DVec3::splat(1e3), DVec3::splat(x), step) / step;
            part * rate_over_frequency / RATE
        };
        // (u, u′), each as real and imaginary part.
        let slope = |x: f64, [u, v, p, q]: [f64; 4]| {
            let r = lost(x);
            [p, q, -(u + r * v), -(v - r * u)]
        };
        let (steps, mut x, mut y) = (2000, 0.0, [0.0, 0.0, 1.0, 0.0]);
        let h = zone.length / f64::from(steps);
        let add = |y: [f64; 4], by: f64, k: [f64; 4]| std::array::from_fn(|i| y[i] + by * k[i]);
        for _ in 0..steps {
            let k1 = slope(x, y);
            let k2 = slope(x + 0.5 * h, add(y, 0.5 * h, k1));
            let k3 = slope(x + 0.5 * h, add(y, 0.5 * h, k2));
            let k4 = slope(x + h, add(y, h, k3));
            y = std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i]));
            x += h;
        }
        // 2a = u − iu′ and 2b = u + iu′, up to phases.
        let [u, v, p, q] = y;
        let (a, b) = ((u + q).hypot(v - p), (u - q).hypot(v + p));
        a.min(b) / a.max(b)
    }

    #[test]
    fn shallow_water_is_turned_back_as_documented() {
        for (rate, wave_lengths, expected) in [
            (RATE, 1.5, 0.001),
            (RATE, 1.0, 0.018),
            (RATE, 0.75, 0.077),
            (1.5, 1.5, 0.012),
            (1.5, 0.75, 0.110),
            (5.0, 1.5, 0.012),
            (5.0, 0.75, 0.111),
        ] {
            let found = turned_back(wave_lengths, rate);
            assert!(
                (found - expected).abs() < 5e-4,
                "{rate} {wave_lengths}: {found}"
            );
        }
    }
}
