//! What walls that absorb do from one frame's end to the next: a part of the state.

use serde::{Deserialize, Serialize};

/// Most walls that absorb: all of the domain's.
pub const MOST: usize = 6;

/// How far a wall has come off its own way, from one answer to the next.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Answer {
    /// When it begins, seconds from the shot's start.
    pub start: f64,
    /// Then, metres inward.
    pub displacement: f64,
    /// Then, m/s inward.
    pub velocity: f64,
    /// From then on, m/s² inward.
    pub acceleration: f64,
    /// By how much the water beside the wall then stood over what the wall's own waves have there, metres; `None` where there was
    /// none.
    pub level: Option<f64>,
    /// What that was on the mean since there was water, metres.
    pub mean: f64,
}

/// Those of the walls of a scene, in the order of its wave makers; `None` of walls that do not absorb, and before the first frame.
pub type Answers = [Option<Answer>; MOST];

impl Answer {
    /// Metres inward and m/s inward at a time, seconds.
    pub fn state(&self, t: f64) -> (f64, f64) {
        let s = t - self.start;
        let way = s * (self.velocity + 0.5 * self.acceleration * s);
        (
            self.displacement + way,
            self.velocity + self.acceleration * s,
        )
    }

    /// The greatest speed between two times, m/s.
    pub fn peak_speed(&self, t0: f64, t1: f64) -> f64 {
        self.state(t0).1.abs().max(self.state(t1).1.abs())
    }
}
