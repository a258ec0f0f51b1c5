//! The largest speed that a motion may have.

use swell_scene::words::shown;

/// Largest speed of a motion, m/s; equal to the largest `velocity`.
const MAX_SPEED: f64 = 1e5;

/// Checks that the speed that results from all keys of a motion is within the range of a velocity.
pub(super) fn check_speed(speed: f64) -> Result<(), String> {
    if speed <= MAX_SPEED {
        return Ok(());
    }
    Err(format!(
        "it moves at {} m/s; allowed: up to {} m/s",
        shown(speed),
        shown(MAX_SPEED)
    ))
}
