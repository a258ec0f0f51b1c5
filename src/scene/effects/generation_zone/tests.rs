use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::{Settings, Waves};
use crate::open_waves::Regular;
use crate::{Wall, effects::zone::Zone};

type Complex = DVec2;

/// Error of the generated waves and reflected part of an outgoing wave, relative to the waves'
/// height, for a zone of this many wavelengths in shallow water.
///
/// The classical Runge–Kutta method integrates u″ + k² (1 + i r/ω) u = 0 from the wall to the
/// beginning of the zone. The error equals the waves at the wall and leaves the zone, u′ = iku; the
/// reflected wave vanishes at the wall. Lengths are in 1/k.
fn wrong_and_turned_back(wave_lengths: f64, rate: f64) -> [f64; 2] {
    let walls = [Wall {
        axis: 0,
        is_max: false,
    }];
    let zone = Zone {
        walls: &walls,
        length: TAU * wave_lengths,
        rate,
    };
    let slope = |x: f64, [u, v]: [Complex; 2]| {
        // For a step this short the fraction is r Δt.
        let r = zone.led(DVec3::splat(1e3), DVec3::splat(x), 1e-9) / 1e-9;
        [v, -(u + r * u.perp())]
    };
    let run = |start: [Complex; 2]| {
        let (steps, mut x, mut y) = (2000, 0.0, start);
        let h = zone.length / f64::from(steps);
        let add = |y: [Complex; 2], by: f64, k: [Complex; 2]| [y[0] + by * k[0], y[1] + by * k[1]];
        for _ in 0..steps {
            let k1 = slope(x, y);
            let k2 = slope(x + 0.5 * h, add(y, 0.5 * h, k1));
            let k3 = slope(x + 0.5 * h, add(y, 0.5 * h, k2));
            let k4 = slope(x + h, add(y, h, k3));
            let sum = |i: usize| k1[i] + 2.0 * (k2[i] + k3[i]) + k4[i];
            y = [y[0] + h / 6.0 * sum(0), y[1] + h / 6.0 * sum(1)];
            x += h;
        }
        y
    };
    // (u, u′) = (1, 0), then (0, 1), at the wall.
    let one = run([Complex::X, Complex::ZERO]);
    let other = run([Complex::ZERO, Complex::X]);
    // Solves (one + c other)′ = i (one + c other).
    let off = |y: [Complex; 2]| y[0].perp() - y[1];
    let (top, bottom) = (off(one), -off(other));
    let c = Complex::new(bottom.x, -bottom.y).rotate(top) / bottom.length_squared();
    let wrong = (one[0] + c.rotate(other[0])).length();
    // 2a = u − iu′ and 2b = u + iu′, up to phases.
    let [u, v] = other;
    let (a, b) = ((u - v.perp()).length(), (u + v.perp()).length());
    [wrong, a.min(b) / a.max(b)]
}

#[test]
fn waves_in_shallow_water_are_as_right_as_documented() {
    // A period of 2π s makes the angular frequency 1.
    let settings = Settings {
        walls: Vec::new(),
        length: 1.0,
        waves: Waves::Stokes(Regular {
            height: 0.1,
            period: TAU,
            depth: 1.0,
            simulated_depth: None,
            ramp: None,
            direction_degrees: 0.0,
        }),
    };
    let own = settings.zone().rate;
    for (rate, wave_lengths, expected) in [
        (own, 1.5, [0.012, 0.006]),
        (own, 1.0, [0.059, 0.041]),
        (2.5, 1.5, [0.046, 0.001]),
        (2.5, 1.0, [0.140, 0.018]),
        (6.0, 1.5, [0.003, 0.020]),
        (6.0, 1.0, [0.023, 0.073]),
    ] {
        let found = wrong_and_turned_back(wave_lengths, rate);
        for (found, expected) in found.into_iter().zip(expected) {
            let off = (found - expected).abs();
            assert!(off < 6e-4, "{rate} {wave_lengths}: {found} {expected}");
        }
    }
}
