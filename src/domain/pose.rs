//! Where a rigid body stands, and how it goes from there to where it stands next.

use glam::{DAffine3, DQuat, DVec3};

use super::signed_distance::SignedDistance;

/// A place that a rigid body takes, seen from where it stood at the start: x = centre + turn (x₀ − rest).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// A point of the body where it stood at the start, metres.
    pub rest: DVec3,
    /// Where that point is now, metres.
    pub centre: DVec3,
    /// A unit quaternion: how the body is turned about it.
    pub turn: DQuat,
}

impl Pose {
    /// As it stood at the start.
    pub const START: Self = Self {
        rest: DVec3::ZERO,
        centre: DVec3::ZERO,
        turn: DQuat::IDENTITY,
    };

    /// Where the body's point is now that was at `x` at the start.
    pub fn place(&self, x: DVec3) -> DVec3 {
        self.centre + self.turn * (x - self.rest)
    }

    /// Where the body's point was at the start that is at `x` now.
    pub fn back(&self, x: DVec3) -> DVec3 {
        self.rest + self.turn.conjugate() * (x - self.centre)
    }

    /// [`Self::place`] as a map.
    pub fn affine(&self) -> DAffine3 {
        DAffine3::from_rotation_translation(self.turn, self.place(DVec3::ZERO))
    }

    /// With another origin of all coordinates: `way` is added to those of every point.
    pub fn moved(self, way: DVec3) -> Self {
        Self {
            rest: self.rest + way,
            centre: self.centre + way,
            ..self
        }
    }

    /// In a unit of which `1 / factor` are one of the old.
    pub fn scaled(self, factor: f64) -> Self {
        Self {
            rest: factor * self.rest,
            centre: factor * self.centre,
            ..self
        }
    }
}

/// A body's way from one pose to the next: its point of rest goes straight, and it turns the shorter way about that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Where it begins.
    pub start: Pose,
    /// How it is turned at the end; on the same side of the sphere as at the start.
    pub end_turn: DQuat,
    /// Of the point of rest, m/s.
    pub velocity: DVec3,
    /// Angular velocity, rad/s.
    pub spin: DVec3,
    /// Seconds.
    pub length: f64,
}

impl Passage {
    /// Of a body that does not move, in no time.
    pub fn resting(pose: Pose) -> Self {
        Self {
            start: pose,
            end_turn: pose.turn,
            velocity: DVec3::ZERO,
            spin: DVec3::ZERO,
            length: 0.0,
        }
    }

    /// From `start` to `end`, which have one point of rest, within `length` seconds. The velocities are those that take
    /// the body there, not those of the motion that it follows.
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

    /// Where it stands when `share` of the time is over. Both turns are known: between them it is the normalised mean,
    /// which stays on the arc and is less than angle³/240 off the even turn, of angles up to 1.5.
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

    /// Of the body's point that is at `x` while its point of rest is at `centre`, m/s.
    pub fn velocity_at(&self, x: DVec3, centre: DVec3) -> DVec3 {
        self.velocity + self.spin.cross(x - centre)
    }
}

/// Signed distances of a body that stands somewhere else than where they were sampled.
#[derive(Clone, Debug)]
pub struct Posed {
    /// As it stood at the start.
    pub grid: SignedDistance,
    /// Where it stands.
    pub pose: Pose,
}

impl Posed {
    /// Distance at `x`, metres, as [`SignedDistance::sample`] has it.
    pub fn sample(&self, x: DVec3) -> f64 {
        self.grid.sample(self.pose.back(x))
    }

    /// Its gradient, as [`SignedDistance::gradient`] has it.
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
        // By another origin: the same body.
        let way = DVec3::new(5.0, -3.0, 2.0);
        let moved = pose.moved(way).place(x + way) - way;
        assert!((moved - pose.place(x)).length() < 1e-14);
        assert_eq!(pose.place(pose.rest), pose.centre);
    }

    /// The velocity of a point is what its place changes by: by central differences about the middle, where the normalised
    /// mean turns at 1 + angle²/48 times the mean speed, here 1.0002.
    #[test]
    fn a_passage_ends_where_it_should_and_its_velocity_is_its_way() {
        let (length, angle) = (0.05, 0.1);
        let end = Pose {
            centre: DVec3::new(1.3, 2.0, 0.6),
            ..pose(0.7 + angle)
        };
        // The other sign is the same turn.
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
            // Control: with the other sense of turning it is not.
            let wrong = Passage {
                spin: -passage.spin,
                ..passage
            };
            let told = wrong.velocity_at(middle.place(x), middle.centre);
            assert!((found - told).length() > 0.5 * found.length());
        }
    }
}
