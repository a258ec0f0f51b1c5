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
