//! The piston that makes regular waves of finite height: Stokes' second order without a free wave of twice the frequency (Madsen
//! 1971, "On the generation of long waves", J. Geophys. Res. 76(36), eq. 21).

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use super::{
    piston_height_ratio,
    sines::{Sine, Sines},
    wave_number,
};

/// Waves as a scene asks for them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegularWaves {
    /// From trough to crest, metres.
    pub height: f64,
    /// Seconds.
    pub period: f64,
    /// Still water, metres.
    pub depth: f64,
    /// m/s², positive.
    pub gravity: f64,
    /// Seconds until the motion's full size, above 0.
    pub ramp: f64,
}

impl RegularWaves {
    /// Metres, by linear theory.
    pub fn length(&self) -> f64 {
        TAU / self.number()
    }

    fn number(&self) -> f64 {
        wave_number(TAU / self.period, self.depth, self.gravity)
    }

    /// H L² / h³ over 8π²/3: above 1 the trough of a wave of second order has a crest of its own, and its theory does not hold
    /// (Madsen 1971).
    pub fn nonlinearity(&self) -> f64 {
        self.height * self.length().powi(2) / self.depth.powi(3) * 3.0 / (8.0 * PI * PI)
    }

    /// Half of the wall's way at its period and at half of it, metres: S/2 = H/2 over the height ratio of linear theory, and
    /// (H²/32h) (3 cosh kh / sinh³ kh − 2/m) with m the height ratio.
    pub fn strokes(&self) -> [f64; 2] {
        let kh = self.number() * self.depth;
        let ratio = piston_height_ratio(self.number(), self.depth);
        // Both grow as exp, and their quotient vanishes.
        let long = if kh > 100.0 {
            0.0
        } else {
            3.0 * kh.cosh() / kh.sinh().powi(3)
        };
        let second = self.height.powi(2) / (32.0 * self.depth) * (long - 2.0 / ratio);
        [0.5 * self.height / ratio, second]
    }
}

/// A wall's motion that makes them: r(t) (X − S/2 cos ωt − E sin 2ωt) with the ramp r.
#[derive(Clone, Debug, PartialEq)]
pub struct Stokes {
    asked: RegularWaves,
    pub(super) sines: Sines,
}

impl Stokes {
    /// The wall's motion for these waves.
    pub fn new(asked: RegularWaves) -> Self {
        let frequency = TAU / asked.period;
        let [first, second] = asked.strokes();
        let mut sines = Sines {
            lines: vec![
                Sine {
                    amplitude: first,
                    frequency,
                    phase: -FRAC_PI_2,
                },
                Sine {
                    amplitude: -second,
                    frequency: 2.0 * frequency,
                    phase: 0.0,
                },
            ],
            mean: 0.0,
            ramp: asked.ramp,
            whole: asked.period,
        };
        sines.mean = -sines.least();
        Self { asked, sines }
    }

    /// What was asked for.
    pub fn asked(&self) -> &RegularWaves {
        &self.asked
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waves(height: f64, period: f64) -> RegularWaves {
        RegularWaves {
            height,
            period,
            depth: 0.4,
            gravity: 9.81,
            ramp: 2.0 * period,
        }
    }

    /// Madsen's own form: ξ = −ξ₀ (cos ωt + (a / 2 n h) (3 / (4 sinh² kh) − n/2) sin 2ωt), ξ₀ = a n / tanh kh,
    /// 2n = 1 + 2kh / sinh 2kh. The code has that of its later users, of another shape.
    #[test]
    fn strokes_are_madsens() {
        for (height, period) in [(0.1, 2.0), (0.05, 1.2), (0.08, 2.7)] {
            let waves = waves(height, period);
            let kh = waves.number() * 0.4;
            let n = 0.5 * (1.0 + 2.0 * kh / (2.0 * kh).sinh());
            let first = 0.5 * height * n / kh.tanh();
            let bracket = 3.0 / (4.0 * kh.sinh().powi(2)) - 0.5 * n;
            let second = first * 0.5 * height / (2.0 * n * 0.4) * bracket;
            let found = waves.strokes();
            assert!((found[0] / first - 1.0).abs() < 1e-12, "{found:?} {first}");
            assert!(
                (found[1] / second - 1.0).abs() < 1e-12,
                "{found:?} {second}"
            );
            // Control: with the factor of another power the second is off.
            let spoiled = second / n;
            assert!((found[1] / spoiled - 1.0).abs() > 1e-3);
        }
    }

    /// In long waves the wall goes with the water, whose mean speed is c η / h: the wall's speed is that of a wave of second order,
    /// η = a cos θ + (3 a² / 4 k² h³) cos 2θ (Stokes' limit for kh → 0), met to the order of kh² = 0.4 %.
    #[test]
    fn long_waves_move_as_their_wall() {
        let waves = RegularWaves {
            height: 2e-6,
            period: 20.0,
            ..waves(0.0, 1.0)
        };
        let kh = waves.number() * 0.4;
        let (a, omega) = (1e-6, TAU / 20.0);
        let celerity = omega / waves.number();
        let bound = 0.75 * a * a / (kh * kh * 0.4);
        // The wall's place moves as well: to second order u(ξ, t) = u + ξ u_x adds −a² / 2h … cos 2θ, a part kh² of the bound wave.
        let [first, second] = waves.strokes();
        let speeds = [first * omega, 2.0 * second * omega];
        let expected = [celerity * a / 0.4, celerity * bound / 0.4];
        for (speed, expected) in speeds.iter().zip(expected) {
            assert!(
                (speed / expected - 1.0).abs() < 2.0 * kh * kh,
                "{speed} {expected}"
            );
        }
    }

    #[test]
    fn the_wall_begins_at_rest_and_stays_in_the_domain() {
        for (height, period) in [(0.1, 2.0), (0.02, 0.7), (0.12, 2.4)] {
            let stokes = Stokes::new(waves(height, period));
            let all = (0..20_000).map(|i| stokes.sines.state(1e-3 * f64::from(i)).0);
            let least = all.clone().skip(8_000).fold(f64::INFINITY, f64::min);
            let most = all.fold(0.0, f64::max);
            assert!(least >= 0.0 && least < 0.03 * most, "{least} {most}");
            assert!(stokes.sines.state(1e-6).1.abs() < 1e-6);
        }
    }

    #[test]
    fn waves_that_are_too_long_for_their_height_are_told() {
        // H L² / h³ = 8π²/3 = 26.3 at the edge.
        let edge = waves(
            26.318_945 * 0.4f64.powi(3) / waves(0.1, 2.0).length().powi(2),
            2.0,
        );
        assert!(
            (edge.nonlinearity() - 1.0).abs() < 1e-6,
            "{}",
            edge.nonlinearity()
        );
    }
}
