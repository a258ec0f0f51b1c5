//! The velocities between two states of a body.

use glam::{DQuat, DVec3};
use swell_domain::body::{Body, BodyState, Freedom};

/// Returns `start` with the velocities with which [`Body::moved`] takes it to the pose of `end`
/// within `length` seconds.
pub(crate) fn between(body: &Body, start: &BodyState, end: &BodyState, length: f64) -> BodyState {
    let spin = scaled_axis(end.turn * start.turn.conjugate()) / length;
    let velocity = match body.freedom {
        Freedom::Axes { .. } => (end.centre - start.centre) / length,
        Freedom::Hinge { at, .. } => spin.cross(start.centre - at),
    };
    body.constrained(BodyState {
        velocity,
        spin,
        ..*start
    })
}

/// Returns the axis times the angle of a rotation, at most π. [`DQuat::to_scaled_axis`] returns 0
/// for small angles.
fn scaled_axis(turn: DQuat) -> DVec3 {
    let turn = if turn.w < 0.0 { -turn } else { turn };
    let sine = DVec3::new(turn.x, turn.y, turn.z);
    let length = sine.length();
    match length > 0.0 {
        true => 2.0 * length.atan2(turn.w) / length * sine,
        false => DVec3::ZERO,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_axis_of_a_rotation_is_found_at_any_angle() {
        let axis = DVec3::new(2.0, -1.0, 2.0) / 3.0;
        for angle in [0.0, 1e-12, 1e-5, 0.3, 2.0, 3.1] {
            let turn = DQuat::from_axis_angle(axis, angle);
            for turn in [turn, -turn] {
                let found = scaled_axis(turn);
                assert!((found - angle * axis).length() <= 1e-15 + 1e-14 * angle);
            }
        }
    }
}
