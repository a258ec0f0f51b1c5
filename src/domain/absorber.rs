//! State of absorbing walls between the ends of two frames; part of the simulation's state.

use serde::{Deserialize, Serialize};

/// Largest number of absorbing walls: all faces of the domain.
pub const MOST: usize = 6;

/// Displacement of an absorbing wall from its prescribed path, from one update to the next: a
/// uniformly accelerated motion.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AbsorberState {
    /// Time at which this state begins, seconds from the start of the shot.
    pub start: f64,
    /// Displacement at `start`, metres inward.
    pub displacement: f64,
    /// Velocity at `start`, m/s inward.
    pub velocity: f64,
    /// Constant acceleration from `start` on, m/s² inward.
    pub acceleration: f64,
    /// Water level beside the wall at `start`, less the level of the waves that the wall itself
    /// makes, metres; `None` if there was no water.
    pub level: Option<f64>,
    /// Running mean of `level` since water first arrived, metres.
    pub mean: f64,
}

/// States of a scene's walls, in the order of its wave makers; `None` for walls that do not absorb,
/// and before the first frame.
pub type AbsorberStates = [Option<AbsorberState>; MOST];

impl AbsorberState {
    /// Returns the displacement, metres inward, and the velocity, m/s inward, at time `t`, seconds.
    pub fn state(&self, t: f64) -> (f64, f64) {
        let s = t - self.start;
        let way = s * (self.velocity + 0.5 * self.acceleration * s);
        (
            self.displacement + way,
            self.velocity + self.acceleration * s,
        )
    }

    /// Returns the largest speed between times `t0` and `t1`, m/s.
    pub fn peak_speed(&self, t0: f64, t1: f64) -> f64 {
        self.state(t0).1.abs().max(self.state(t1).1.abs())
    }
}
