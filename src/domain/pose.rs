//! Poses of rigid bodies, and the motion from one pose to the next.

use glam::{DAffine3, DQuat, DVec3};

use super::signed_distance::SignedDistance;

/// Pose of a rigid body relative to the start: x = centre + turn (x₀ − rest).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// A point of the body in its position at the start, metres.
    pub rest: DVec3,
    /// Current position of that point, metres.
    pub centre: DVec3,
    /// Rotation of the body about that point, a unit quaternion.
    pub turn: DQuat,
}

impl Pose {
    /// The pose at the start.
    pub const START: Self = Self {
        rest: DVec3::ZERO,
        centre: DVec3::ZERO,
        turn: DQuat::IDENTITY,
    };

    /// Returns the current position of the body's point that was at `x` at the start.
    pub fn place(&self, x: DVec3) -> DVec3 {
        self.centre + self.turn * (x - self.rest)
    }

    /// Returns the position at the start of the body's point that is at `x` now.
    pub fn back(&self, x: DVec3) -> DVec3 {
        self.rest + self.turn.conjugate() * (x - self.centre)
    }

    /// Returns [`Self::place`] as an affine map.
    pub fn affine(&self) -> DAffine3 {
        DAffine3::from_rotation_translation(self.turn, self.place(DVec3::ZERO))
    }

    /// Returns the pose in coordinates with another origin: `way` is added to those of every point.
    pub fn moved(self, way: DVec3) -> Self {
        Self {
            rest: self.rest + way,
            centre: self.centre + way,
            ..self
        }
    }

    /// Returns the pose with all lengths multiplied by `factor`.
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            rest: factor * self.rest,
            centre: factor * self.centre,
            ..self
        }
    }
}

/// Motion of a body from one pose to the next: its rest point moves in a straight line, and it
/// turns the shorter way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Pose at the beginning.
    pub start: Pose,
    /// Rotation at the end, in the same hemisphere of quaternions as at the beginning.
    pub end_turn: DQuat,
    /// Velocity of the rest point, m/s.
    pub velocity: DVec3,
    /// Angular velocity, rad/s.
    pub spin: DVec3,
    /// Duration, seconds.
    pub length: f64,
}

impl Passage {
    /// Builds the passage of a body at rest, of duration 0.
    pub fn resting(pose: Pose) -> Self {
        Self {
            start: pose,
            end_turn: pose.turn,
            velocity: DVec3::ZERO,
            spin: DVec3::ZERO,
            length: 0.0,
        }
    }

    /// Builds the passage from `start` to `end`, which must have the same rest point, within
    /// `length` seconds. The velocities are those that take the body there, not those of the motion
    /// that it samples.
    pub fn between(start: Pose, end: Pose, length: f64) -> Self {
        let end_turn = match start.turn.dot(end.turn) < 0.0 {
            true => -end.turn,
            false => end.turn,
        };
        let step = end_turn * start.turn.conjugate();
        Self {
            start,
            end_turn,
            velocity: (end.centre - start.centre) / length,
            spin: step.to_scaled_axis() / length,
            length,
        }
    }

    /// Returns the pose after the fraction `share` of the duration. Between the ends the rotation
    /// is the normalised mean of both, which stays on the arc and differs from a uniform rotation
    /// by less than angle³/240, for angles up to 1.5.
    pub fn at(&self, share: f64) -> Pose {
        let turn = match share {
            0.0 => self.start.turn,
            1.0 => self.end_turn,
            _ => (self.start.turn * (1.0 - share) + self.end_turn * share).normalize(),
        };
        Pose {
            centre: self.start.centre + share * self.length * self.velocity,
            turn,
            ..self.start
        }
    }

    /// Returns the velocity of the body's point at `x` while its rest point is at `centre`, m/s.
    pub fn velocity_at(&self, x: DVec3, centre: DVec3) -> DVec3 {
        self.velocity + self.spin.cross(x - centre)
    }
}

/// Signed distance of a body in a pose other than the one it was sampled in.
#[derive(Clone, Debug)]
pub struct Posed {
    /// Distances in the pose at the start.
    pub grid: SignedDistance,
    /// Current pose.
    pub pose: Pose,
}

impl Posed {
    /// Returns the distance at `x`, metres, as [`SignedDistance::sample`].
    pub fn sample(&self, x: DVec3) -> f64 {
        self.grid.sample(self.pose.back(x))
    }

    /// Returns its gradient, as [`SignedDistance::gradient`].
    pub fn gradient(&self, x: DVec3) -> DVec3 {
        self.pose.turn * self.grid.gradient(self.pose.back(x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pose(angle: f64) -> Pose {
        Pose {
            rest: DVec3::new(1.0, 2.0, 0.5),
            centre: DVec3::new(1.2, 2.1, 0.5),
            turn: DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -2.0) / 3.0, angle),
        }
    }

    #[test]
    fn places_and_their_way_back_are_inverse() {
        let (pose, x) = (pose(0.7), DVec3::new(-0.3, 1.7, 4.0));
        assert!((pose.back(pose.place(x)) - x).length() < 1e-14);
        assert!((pose.affine().transform_point3(x) - pose.place(x)).length() < 1e-14);
        // The same body relative to another origin.
        let way = DVec3::new(5.0, -3.0, 2.0);
        let moved = pose.moved(way).place(x + way) - way;
        assert!((moved - pose.place(x)).length() < 1e-14);
        assert_eq!(pose.place(pose.rest), pose.centre);
    }

    /// The velocity of a point is the rate of change of its position: by central differences
    /// about the middle, where the normalised mean turns at 1 + angle²/48 times the mean rate,
    /// here 1.0002.
    #[test]
    fn a_passage_ends_where_it_should_and_its_velocity_is_its_way() {
        let (length, angle) = (0.05, 0.1);
        let end = Pose {
            centre: DVec3::new(1.3, 2.0, 0.6),
            ..pose(0.7 + angle)
        };
        // The quaternion of opposite sign is the same rotation.
        for end_turn in [end.turn, -end.turn] {
            let end = Pose {
                turn: end_turn,
                ..end
            };
            let passage = Passage::between(pose(0.7), end, length);
            assert!((passage.spin.length() * length - angle).abs() < 1e-12);
            let x = DVec3::new(-0.3, 1.7, 4.0);
            assert!((passage.at(1.0).place(x) - end.place(x)).length() < 1e-14);
            assert_eq!(passage.at(0.0), pose(0.7));
            let step = 1e-4;
            let [before, after] = [0.5 - step, 0.5 + step].map(|s| passage.at(s).place(x));
            let found = (after - before) / (2.0 * step * length);
            let middle = passage.at(0.5);
            let told = passage.velocity_at(middle.place(x), middle.centre);
            assert!(
                (found - told).length() < 1e-3 * told.length(),
                "{found} {told}"
            );
            // Control: with the opposite sense of rotation it differs.
            let wrong = Passage {
                spin: -passage.spin,
                ..passage
            };
            let told = wrong.velocity_at(middle.place(x), middle.centre);
            assert!((found - told).length() > 0.5 * found.length());
        }
    }
}
