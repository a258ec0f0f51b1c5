//! Regular waves that a wall makes: their parameters, and what all such motions share.

use std::f64::consts::TAU;

use super::{smooth_ramp, wave_number};

/// Parameters of regular waves, as in a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegularWaves {
    /// Height from trough to crest, metres.
    pub height: f64,
    /// Period, seconds.
    pub period: f64,
    /// Depth of still water, metres.
    pub depth: f64,
    /// Acceleration of gravity, m/s², positive.
    pub gravity: f64,
    /// Time until the motion's full size, seconds; 0 begins with it, also from rest.
    pub ramp: f64,
}

impl RegularWaves {
    /// Returns the wavenumber by linear theory, rad/m.
    pub fn wave_number(&self) -> f64 {
        wave_number(TAU / self.period, self.depth, self.gravity)
    }

    /// Returns the Ursell number H L² / h³ with the length of linear theory (Ursell 1953): how far
    /// long waves are from sines.
    pub fn ursell(&self) -> f64 {
        let length_in_depths = TAU / (self.wave_number() * self.depth);
        self.height / self.depth * length_in_depths.powi(2)
    }
}

/// A periodic motion that begins at rest at its least displacement, 0, and is scaled by a ramp.
pub(super) trait Cycle {
    /// Time until the full size, seconds.
    fn ramp(&self) -> f64;

    /// Displacement, metres, and velocity, m/s, at full size.
    fn full(&self, t: f64) -> (f64, f64);

    /// Least and greatest velocity within `[t0, t1]` at full size, m/s.
    fn velocities(&self, t0: f64, t1: f64) -> [f64; 2];

    /// Time of the greatest displacement, seconds, until which the displacement increases, and that
    /// displacement at full size, metres.
    fn greatest(&self) -> (f64, f64);

    /// Displacement, metres, and velocity, m/s, at a time from 0 on.
    fn state(&self, t: f64) -> (f64, f64) {
        let (amount, amount_rate) = smooth_ramp(t, self.ramp());
        let (x, velocity) = self.full(t);
        (amount * x, amount * velocity + amount_rate * x)
    }

    /// Upper bound on |velocity| within `[t0, t1]`, m/s, by interval arithmetic on r v + r' x.
    fn peak_speed(&self, t0: f64, t1: f64) -> f64 {
        let ramp = self.ramp();
        let [slowest, fastest] = self.velocities(t0, t1);
        let (x, most) = (self.full(t0).0, self.greatest().1);
        let x_high = (x + fastest.max(0.0) * (t1 - t0)).min(most);
        let x_low = (x + slowest.min(0.0) * (t1 - t0)).max(0.0);
        let (amount_low, rate_start) = smooth_ramp(t0, ramp);
        let (amount_high, rate_end) = smooth_ramp(t1, ramp);
        // The ramp's rate rises until its middle, then falls.
        let (_, rate_high) = smooth_ramp((0.5 * ramp).clamp(t0, t1), ramp);
        let rate_low = rate_start.min(rate_end);
        let upper = rate_high * x_high + (amount_high * fastest).max(amount_low * fastest);
        let lower = rate_low * x_low + (amount_high * slowest).min(amount_low * slowest);
        upper.max(-lower)
    }

    /// Upper bound on the displacement within `[0, t]`, metres.
    fn peak_displacement(&self, t: f64) -> f64 {
        let (when, most) = self.greatest();
        if t < when {
            self.state(t).0
        } else {
            most * smooth_ramp(t, self.ramp()).0
        }
    }
}

/// Returns whether `phase` plus any whole number lies within `[from, to]`.
pub(super) fn comes_within(phase: f64, [from, to]: [f64; 2]) -> bool {
    (to - phase).floor() >= (from - phase).ceil()
}
