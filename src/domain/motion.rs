//! Wave-maker motion.

/// Displacement of a wave-maker over time.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// metres per second.
    ConstantVelocity {
        /// m/s.
        velocity: f64,
    },
}

impl Motion {
    /// Metres.
    pub fn displacement(&self, t: f64) -> f64 {
        let Self::ConstantVelocity { velocity } = self;
        velocity * t
    }
    /// m/s.
    pub fn peak_speed(&self, _t0: f64, _t1: f64) -> f64 {
        let Self::ConstantVelocity { velocity } = self;
        velocity.abs()
    }
}
