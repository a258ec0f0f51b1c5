//! Motion of wave makers.
//!
//! A displacement is measured from the domain's face, positive inward, metres; it is 0 at the start
//! and never negative, so that no water is ever behind the wall.

mod cnoidal;
mod complex;
mod elliptic;
mod linear_theory;
mod pairs;
mod regular;
mod sea;
mod second_order;
mod sines;
mod solitary;
mod spectrum;
mod stokes;
mod table;

use std::f64::consts::{FRAC_PI_2, PI, TAU};

pub use cnoidal::{Cnoidal, LEAST_CNOIDAL_LENGTH, NoCnoidal};
pub use linear_theory::{piston_elevation, piston_height_ratio, wave_number};
pub use pairs::DEEPEST;
use regular::Cycle as _;
pub use regular::RegularWaves;
pub use sea::{Phases, Sea, SeaParameters};
use solitary::Goring;
pub use spectrum::Spectrum;
pub use stokes::{MADSEN_LIMIT, Stokes};
use table::Segment;
pub use table::abrupt_end;

/// Displacement of a wave maker over time.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// No motion: a wall that only absorbs incoming waves.
    Still,
    /// Constant velocity from the start, with an abrupt stop.
    ConstantVelocity {
        /// Velocity, m/s, not negative.
        velocity: f64,
        /// Time at which the wall stops, seconds; `None` means never.
        until: Option<f64>,
    },
    /// x = stroke/2 · (1 − cos 2πt/period), multiplied by a smooth ramp from rest.
    Sine {
        /// Distance from the innermost to the outermost position, metres.
        stroke: f64,
        /// Period, seconds.
        period: f64,
        /// Time until the full stroke, seconds; 0 begins with the full stroke (still from rest, as
        /// 1 − cos is).
        ramp: f64,
    },
    /// One solitary wave (Goring 1978).
    Solitary {
        /// Height of the crest above still water, metres.
        height: f64,
        /// Depth of still water, metres.
        depth: f64,
        /// Acceleration of gravity, m/s², positive.
        gravity: f64,
    },
    /// Regular waves to second order (Schäffer 1996).
    Stokes(Stokes),
    /// Regular waves of permanent form in shallow water (Goring 1978).
    Cnoidal(Cnoidal),
    /// An irregular sea or a wave packet, from a spectrum.
    Sea(Sea),
    /// Interpolates given points by a monotone cubic (Fritsch and Carlson 1980), at rest before the
    /// first and after the last; the path never leaves the range of the two points around it.
    Table {
        /// Points (seconds, metres), with increasing times.
        points: Vec<[f64; 2]>,
    },
}

impl Motion {
    /// Returns the displacement at time `t` (seconds), metres inward from the domain's face.
    pub fn displacement(&self, t: f64) -> f64 {
        self.state(t).0
    }

    /// Returns the velocity at time `t` (seconds), m/s inward: the derivative of
    /// [`Self::displacement`].
    pub fn velocity(&self, t: f64) -> f64 {
        self.state(t).1
    }

    /// Displacement and velocity.
    fn state(&self, t: f64) -> (f64, f64) {
        if t <= 0.0 {
            return (0.0, 0.0);
        }
        match *self {
            Self::Still => (0.0, 0.0),
            Self::ConstantVelocity { velocity, until } => match until {
                Some(end) if t >= end => (velocity * end, 0.0),
                _ => (velocity * t, velocity),
            },
            Self::Sine {
                stroke,
                period,
                ramp,
            } => {
                let (amount, amount_rate) = smooth_ramp(t, ramp);
                let omega = TAU / period;
                let (sin, cos) = (omega * t).sin_cos();
                let half = 0.5 * stroke;
                (
                    amount * half * (1.0 - cos),
                    half * (amount_rate * (1.0 - cos) + amount * omega * sin),
                )
            }
            Self::Solitary {
                height,
                depth,
                gravity,
            } => Goring::new(height, depth, gravity).state(t),
            Self::Stokes(ref stokes) => stokes.state(t),
            Self::Cnoidal(ref cnoidal) => cnoidal.state(t),
            Self::Sea(ref sea) => sea.sines.state(t),
            Self::Table { ref points } => table::state(points, t),
        }
    }

    /// Returns an upper bound on |velocity| within `[t0, t1]`, m/s, which is tight as the
    /// interval shrinks.
    pub fn peak_speed(&self, t0: f64, t1: f64) -> f64 {
        if t1 <= 0.0 {
            return 0.0;
        }
        let t0 = t0.max(0.0);
        match *self {
            Self::Still => 0.0,
            Self::ConstantVelocity { velocity, until } => match until {
                Some(end) if t0 >= end => 0.0,
                _ => velocity.abs(),
            },
            Self::Sine {
                stroke,
                period,
                ramp,
            } => {
                // Interval arithmetic on half · (r'(1 − cos ωt) + r ω sin ωt).
                let omega = TAU / period;
                let (amount_low, rate_start) = smooth_ramp(t0, ramp);
                let (amount_high, rate_end) = smooth_ramp(t1, ramp);
                // The ramp's rate rises until its middle, then falls.
                let (_, rate_high) = smooth_ramp((0.5 * ramp).clamp(t0, t1), ramp);
                let rate_low = rate_start.min(rate_end);
                let (cos_low, cos_high) = cos_range(omega * t0, omega * t1);
                let (sin_low, sin_high) = cos_range(omega * t0 - FRAC_PI_2, omega * t1 - FRAC_PI_2);
                let upper = rate_high * (1.0 - cos_low)
                    + omega * (amount_high * sin_high).max(amount_low * sin_high);
                let lower = rate_low * (1.0 - cos_high)
                    + omega * (amount_high * sin_low).min(amount_low * sin_low);
                0.5 * stroke * upper.max(-lower)
            }
            Self::Solitary {
                height,
                depth,
                gravity,
            } => {
                let goring = Goring::new(height, depth, gravity);
                let peak = goring.crest_time();
                goring.state(peak.clamp(t0, t1)).1
            }
            Self::Stokes(ref stokes) => stokes.peak_speed(t0, t1),
            Self::Cnoidal(ref cnoidal) => cnoidal.peak_speed(t0, t1),
            Self::Sea(ref sea) => sea.sines.peak_speed(t0, t1),
            Self::Table { ref points } => points
                .windows(2)
                .enumerate()
                .filter(|(_, pair)| pair[0][0] <= t1 && pair[1][0] >= t0)
                .map(|(i, _)| Segment::new(points, i).peak_speed())
                .fold(0.0, f64::max),
        }
    }

    /// Returns an upper bound on the displacement within `[0, t]`, metres.
    pub fn peak_displacement(&self, t: f64) -> f64 {
        match *self {
            // These never move back.
            Self::Still | Self::ConstantVelocity { .. } | Self::Solitary { .. } => {
                self.displacement(t)
            }
            Self::Sine {
                stroke,
                period,
                ramp,
            } => {
                if t < 0.5 * period {
                    self.displacement(t)
                } else {
                    stroke * smooth_ramp(t, ramp).0
                }
            }
            Self::Stokes(ref stokes) => stokes.peak_displacement(t),
            Self::Cnoidal(ref cnoidal) => cnoidal.peak_displacement(t),
            Self::Sea(ref sea) => sea.sines.peak_displacement(t),
            Self::Table { ref points } => points
                .iter()
                .filter(|p| p[0] <= t)
                .map(|p| p[1])
                .fold(self.displacement(t), f64::max),
        }
    }
}

/// Least and greatest cosine over `[a, b]`.
fn cos_range(a: f64, b: f64) -> (f64, f64) {
    let holds = |phase: f64| ((b - phase) / TAU).floor() >= ((a - phase) / TAU).ceil();
    let (at_a, at_b) = (a.cos(), b.cos());
    (
        if holds(PI) { -1.0 } else { at_a.min(at_b) },
        if holds(0.0) { 1.0 } else { at_a.max(at_b) },
    )
}

/// Ramp 6u⁵ − 15u⁴ + 10u³ with u = t/ramp, and its derivative: from zero to one without a jump in
/// velocity or acceleration.
pub(super) fn smooth_ramp(t: f64, ramp: f64) -> (f64, f64) {
    if t >= ramp {
        return (1.0, 0.0);
    }
    let u = (t / ramp).max(0.0);
    let amount = u * u * u * (u * (6.0 * u - 15.0) + 10.0);
    let rate = 30.0 * u * u * (u - 1.0).powi(2) / ramp;
    (amount, rate)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn regular(ramp: f64) -> RegularWaves {
        RegularWaves {
            height: 0.1,
            period: 2.0,
            depth: 0.6,
            gravity: 9.81,
            ramp,
        }
    }

    fn cnoidal(ramp: f64) -> Motion {
        let waves = RegularWaves {
            period: 4.0,
            ..regular(ramp)
        };
        Motion::Cnoidal(Cnoidal::new(waves).expect("long enough"))
    }

    fn motions() -> Vec<Motion> {
        vec![
            Motion::Stokes(Stokes::new(regular(0.0))),
            Motion::Stokes(Stokes::new(regular(4.0))),
            Motion::Stokes(Stokes::new(RegularWaves {
                period: 0.9,
                ..regular(2.0)
            })),
            cnoidal(0.0),
            cnoidal(5.0),
            Motion::ConstantVelocity {
                velocity: 2.0,
                until: Some(1.5),
            },
            Motion::ConstantVelocity {
                velocity: 0.7,
                until: None,
            },
            Motion::Sine {
                stroke: 1.5,
                period: 3.0,
                ramp: 4.0,
            },
            Motion::Sine {
                stroke: 1.5,
                period: 0.8,
                ramp: 0.0,
            },
            Motion::Solitary {
                height: 0.3,
                depth: 1.0,
                gravity: 9.81,
            },
            Motion::Table {
                points: vec![[0.0, 0.0], [0.5, 0.2], [0.9, 2.0], [2.0, 2.0], [5.0, 0.5]],
            },
            Motion::Sea(Sea::new(SeaParameters {
                spectrum: Spectrum::Tma,
                peak_period: 1.5,
                peak_enhancement: 3.3,
                shortest_period: 0.5,
                depth: 0.6,
                gravity: 9.81,
                ramp: 2.0,
                phases: Phases::Random {
                    significant_height: 0.1,
                    seed: 5,
                },
                second_order: false,
            })),
            Motion::Sea(Sea::new(SeaParameters {
                spectrum: Spectrum::Tma,
                peak_period: 1.5,
                peak_enhancement: 3.3,
                shortest_period: 0.5,
                depth: 0.6,
                gravity: 9.81,
                ramp: 2.0,
                phases: Phases::Focused {
                    height: 0.1,
                    at: 2.0,
                    time: 7.0,
                },
                second_order: true,
            })),
        ]
    }

    #[test]
    fn velocity_is_the_derivative_of_displacement() {
        // Central differences are off by step²/6 · x''' ≤ 1e-10/6 · 500 m/s³ (a ramped sine with
        // ω = 8 rad/s), and by round-off 1e-16 · 3 m / 1e-5 s.
        let step = 1e-5;
        for motion in motions() {
            for i in 0..900 {
                let t = 0.003 + 0.01 * f64::from(i);
                let difference =
                    (motion.displacement(t + step) - motion.displacement(t - step)) / (2.0 * step);
                let error = (difference - motion.velocity(t)).abs();
                assert!(error < 2e-8, "{motion:?} at {t}: {error}");
            }
        }
    }

    #[test]
    fn motions_start_from_zero_and_never_leave_the_domain() {
        for motion in motions() {
            assert_eq!(motion.displacement(0.0), 0.0, "{motion:?}");
            let mut seen = 0.0f64;
            for i in 0..2000 {
                let t = 0.005 * f64::from(i);
                let x = motion.displacement(t);
                assert!(x >= 0.0, "{motion:?} {t}");
                seen = seen.max(x);
                if i % 100 == 0 {
                    let bound = motion.peak_displacement(t);
                    assert!(seen <= bound + 1e-15, "{motion:?} {t}");
                }
            }
        }
    }

    #[test]
    fn peak_speed_bounds_every_interval_and_is_tight_on_short_ones() {
        for motion in motions() {
            for i in 0..200 {
                let t0 = 0.037 * f64::from(i);
                for length in [1e-4, 0.05, 1.0] {
                    let bound = motion.peak_speed(t0, t0 + length);
                    let seen = (0..=50)
                        .map(|k| motion.velocity(t0 + length * f64::from(k) / 50.0).abs())
                        .fold(0.0, f64::max);
                    assert!(seen <= bound * (1.0 + 1e-12), "{motion:?} {t0} {length}");
                    let is_smooth = !matches!(motion, Motion::Table { .. });
                    if length < 1e-3 && is_smooth {
                        // Within 1e-4 s the velocity changes by at most x'' · 1e-4 s, 8 mm/s; a
                        // constant velocity jumps once.
                        let jumps = matches!(motion, Motion::ConstantVelocity { .. });
                        assert!(
                            jumps || bound <= seen + 8e-3,
                            "{motion:?} {t0} {bound} {seen}"
                        );
                    }
                }
            }
        }
    }

    /// A sine between its ends: the whole stroke at half a period, half of it at a quarter, where
    /// the wall is fastest.
    #[test]
    fn a_sine_goes_the_whole_stroke_and_its_ramp_is_the_quintic() {
        let sine = |ramp| Motion::Sine {
            stroke: 1.2,
            period: 4.0,
            ramp,
        };
        let full = sine(0.0);
        for (t, x, v) in [
            (1.0, 0.6, 0.15 * TAU),
            (2.0, 1.2, 0.0),
            (3.0, 0.6, -0.15 * TAU),
            (4.0, 0.0, 0.0),
            (10.0, 1.2, 0.0),
        ] {
            assert!((full.displacement(t) - x).abs() < 1e-14, "{t}");
            assert!((full.velocity(t) - v).abs() < 1e-14, "{t}");
        }
        // 6u⁵ − 15u⁴ + 10u³ is 106/1024 at a quarter, one half at a half, and 918/1024 at
        // three quarters.
        let slow = sine(8.0);
        for (t, part) in [(2.0, 106.0 / 1024.0), (4.0, 0.5), (6.0, 918.0 / 1024.0)] {
            assert!(
                (slow.displacement(t) - part * full.displacement(t)).abs() < 1e-14,
                "{t}"
            );
        }
        assert_eq!(slow.displacement(9.0), full.displacement(9.0));
    }

    #[test]
    fn a_steady_wall_goes_its_speed_times_the_time_and_stands() {
        let motion = Motion::ConstantVelocity {
            velocity: 2.0,
            until: Some(1.5),
        };
        for (t, x, v) in [
            (0.5, 1.0, 2.0),
            (1.25, 2.5, 2.0),
            (1.5, 3.0, 0.0),
            (9.0, 3.0, 0.0),
        ] {
            assert_eq!((motion.displacement(t), motion.velocity(t)), (x, v));
        }
    }
}
