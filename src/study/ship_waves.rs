//! Stationary waves behind a body in a current, fitted by linear theory.
//!
//! In the body's frame of reference waves stand still whose phase speed is the current's component
//! across their crests, √(g tanh(kd)/k) = U cos θ (Kelvin 1887; Wehausen and Laitone 1960, §13).
//! Whatever the body is, the elevation far behind it is a sum of such waves over θ, symmetric in z:
//! η = ∫ [a(θ) cos(k x cos θ) + b(θ) sin(k x cos θ)] cos(k z sin θ) dθ. Stationary phase confines
//! them to a wedge whose half-angle is arcsin ⅓ in deep water.

use crate::least_squares::least_squares;

/// Largest tangent of θ, the angle of propagation of a wave to the current; that at the wedge's
/// edge is 1/√2.
const MOST: f64 = 1.8;

/// Number of values of tan θ at which a and b are free, and linear in between.
const KNOTS: usize = 7;

/// Values of a and b there, and the mean elevation.
const UNKNOWNS: usize = 2 * KNOTS + 1;

/// Waves from one of these to the next.
const BETWEEN: usize = 12;

/// Share of the mean square of all waves that is added to the square of each, so that the equations
/// of waves that hardly differ at the stations are not singular.
const RIDGE: f64 = 1e-6;

/// Iterations of the dispersion relation; each more than halves the error where kd is 1 or more.
const ITERATIONS: usize = 60;

/// Relative steps of the search, the first and the last.
const STEPS: [f64; 2] = [0.08, 0.001];

/// What is fitted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShipWaves {
    /// 2πU²/g, metres: in deep water the length of the waves straight behind the body.
    pub length: f64,
    /// Half-angle of the wedge, degrees: that of theory after the stretch along z that fits best.
    pub half_angle: f64,
    /// Root mean square of the part of the elevation that is no such wave, over that of the
    /// elevation.
    pub misfit: f64,
}

/// Fits stationary waves to elevations at stations, each x behind the body, z from its path, and η;
/// metres. `depth` is that of the water, and the search for the length begins at `length`. `None`
/// if there are too few stations or all are equal.
pub fn fit(stations: &[[f64; 3]], depth: f64, length: f64) -> Option<ShipWaves> {
    let [mut step, last] = STEPS;
    let mut best = (length, 1.0, misfit(stations, depth, length, 1.0)?);
    while step > last {
        let [of_length, of_stretch] = [best.0, best.1];
        let around = (0..9).filter(|k| *k != 4).map(|k| {
            let moved = |value: f64, by: usize| value * (1.0 + step * (by as f64 - 1.0));
            (moved(of_length, k / 3), moved(of_stretch, k % 3))
        });
        let mut next = best;
        for (length, stretch) in around {
            let off = misfit(stations, depth, length, stretch)?;
            if off < next.2 {
                next = (length, stretch, off);
            }
        }
        if next == best {
            step *= 0.5;
        }
        best = next;
    }
    let (length, stretch, misfit) = best;
    let half_angle = (1.0 / (8.0f64.sqrt() * stretch)).atan().to_degrees();
    Some(ShipWaves {
        length,
        half_angle,
        misfit,
    })
}

/// Part of the elevation that the waves of this length, with z times `stretch`, leave.
fn misfit(stations: &[[f64; 3]], depth: f64, length: f64, stretch: f64) -> Option<f64> {
    let waves = waves(std::f64::consts::TAU / length, depth);
    let row = |[x, z, elevation]: &[f64; 3]| -> [f64; UNKNOWNS + 1] {
        let mut row = [0.0; UNKNOWNS + 1];
        for (k, [along, across]) in waves.iter().enumerate() {
            let (knot, part) = (k / BETWEEN, (k % BETWEEN) as f64 + 0.5);
            let part = part / BETWEEN as f64;
            let (sin, cos) = (along * x).sin_cos();
            let beside = (across * stretch * z).cos();
            row[knot] += (1.0 - part) * cos * beside;
            row[knot + 1] += part * cos * beside;
            row[KNOTS + knot] += (1.0 - part) * sin * beside;
            row[KNOTS + knot + 1] += part * sin * beside;
        }
        row[2 * KNOTS] = BETWEEN as f64;
        row[UNKNOWNS] = *elevation;
        row
    };
    let rows: Vec<_> = stations.iter().map(row).collect();
    let found: [f64; UNKNOWNS] = least_squares(rows.iter().copied(), RIDGE)?;
    let left = rows.iter().map(|row| {
        let of_waves: f64 = row.iter().zip(found).map(|(a, b)| a * b).sum();
        (row[UNKNOWNS] - of_waves).powi(2)
    });
    let left: f64 = left.sum();
    let mean = stations.iter().map(|it| it[2]).sum::<f64>() / stations.len() as f64;
    let all: f64 = stations.iter().map(|it| (it[2] - mean).powi(2)).sum();
    let differ = stations.iter().any(|it| it[2] != stations[0][2]);
    (differ && stations.len() > UNKNOWNS).then(|| (left / all).sqrt())
}

/// Wave numbers along and across the current of stationary waves, rad/m, over tan θ at the middles
/// of equal intervals.
fn waves(number: f64, depth: f64) -> Vec<[f64; 2]> {
    let count = (KNOTS - 1) * BETWEEN;
    let wave = |k: usize| {
        let tangent = (k as f64 + 0.5) * MOST / count as f64;
        let deep = number * (1.0 + tangent * tangent);
        let mut number = deep;
        for _ in 0..ITERATIONS {
            number = 0.5 * (number + deep * (number * depth).tanh());
        }
        let cos = 1.0 / tangent.hypot(1.0);
        [number * cos, number * tangent * cos]
    };
    (0..count).map(wave).collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::{FRAC_PI_2, TAU};

    use super::*;

    /// Waves of a ball at a depth of a third of a wave length, by Havelock's integral for deep
    /// water (1919): the amplitude is sec⁴θ exp(−k f), and θ goes from one side to the other.
    fn behind_a_ball(length: f64, stretch: f64) -> Vec<[f64; 3]> {
        let count = 2000;
        let elevation = |x: f64, z: f64| -> f64 {
            let wave = |k: usize| {
                let angle = ((k as f64 + 0.5) / count as f64 - 0.5) * 2.0 * FRAC_PI_2;
                let secant = 1.0 / angle.cos();
                let number = TAU / length * secant * secant;
                let amplitude = secant.powi(4) * (-number * length / 3.0).exp();
                amplitude * (number * (x * angle.cos() + z * angle.sin())).cos()
            };
            (0..count).map(wave).sum()
        };
        let places = (0..1200).map(|k| {
            let (x, z) = (
                1.0 + f64::from(k / 20) / 16.0,
                0.3 + f64::from(k % 20) / 16.0,
            );
            let [x, z] = [x, z].map(|v| v * length);
            [x, z, 0.02 + elevation(x, stretch * z)]
        });
        places.collect()
    }

    #[test]
    fn length_and_wedge_of_havelocks_waves_are_found() {
        let kelvin = (1.0f64 / 3.0).asin().to_degrees();
        // The amplitude is linear only from knot to knot.
        for length in [0.7, 1.0] {
            let found = fit(&behind_a_ball(length, 1.0), 1e3, 0.93 * length).unwrap();
            assert!((found.length / length - 1.0).abs() < 0.005, "{found:?}");
            assert!((found.half_angle - kelvin).abs() < 0.2, "{found:?}");
            assert!(found.misfit < 0.02, "{found:?}");
        }
        // Negative controls: a wedge that is 2.2 degrees narrower, and noise without waves.
        let narrow = fit(&behind_a_ball(1.0, 1.13), 1e3, 1.0).unwrap();
        let expected = (8.0f64.sqrt() * 1.13).recip().atan().to_degrees();
        assert!((narrow.half_angle - expected).abs() < 0.2, "{narrow:?}");
        assert!(narrow.half_angle < kelvin - 1.5, "{narrow:?}");
        let mut noise = behind_a_ball(1.0, 1.0);
        for (k, station) in noise.iter_mut().enumerate() {
            station[2] = ((k * 7919) % 1009) as f64;
        }
        assert!(fit(&noise, 1e3, 1.0).unwrap().misfit > 0.9);
        assert_eq!(fit(&[[1.0, 0.3, 0.1]; 40], 1e3, 1.0), None);
    }

    /// In shallow water a wave of the same speed is longer: k = k₀ tanh(k d).
    #[test]
    fn waves_have_the_currents_speed() {
        for [along, across] in waves(TAU, 0.4) {
            let number = f64::hypot(along, across);
            let speed = ((number * 0.4).tanh() / number).sqrt();
            let current = TAU.sqrt().recip();
            assert!((speed / (current * along / number) - 1.0).abs() < 1e-9);
        }
    }
}
