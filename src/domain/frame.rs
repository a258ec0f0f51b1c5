//! A domain that moves: what its water feels in a frame of reference that goes with it.
//!
//! With X = c + R (x − p) for the position of a point x of the domain, whose pivot p is at c, a
//! particle that only gravity g accelerates has, in the domain,
//!
//! a = Rᵀ (g − c̈) − 2 Ω × v − Ω × (Ω × y) − Ω̇ × y, y = x − p,
//!
//! with the angular velocity Ω about a fixed axis. The solvers apply g themselves, so the rest is a
//! force: the part that depends on the velocity, Coriolis's, turns velocities by −2 Ω Δt, and the
//! others are an [`Inertia`].

use glam::{DQuat, DVec3};

use super::motion::Motion;

/// Motion of a domain relative to a frame at rest.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameMotion {
    /// Direction, whose length is ignored, and the way along it, metres.
    pub slide: Option<(DVec3, Motion)>,
    /// Rotation.
    pub turn: Option<FrameTurn>,
    /// Gravity at the start, m/s².
    pub gravity: DVec3,
    /// Greatest distance of a point of the domain from the pivot, metres.
    pub reach: f64,
}

/// Rotation of a domain about an axis that moves along with it.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameTurn {
    /// A point of the axis at the start, metres.
    pub pivot: DVec3,
    /// Direction of the axis; its length is ignored.
    pub axis: DVec3,
    /// Angle, degrees, counter-clockwise as seen against the axis.
    pub motion: Motion,
}

/// Acceleration in a moving domain that does not depend on the velocity, as a mean over a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inertia {
    /// Acceleration at the pivot, m/s².
    pub at_pivot: DVec3,
    /// Pivot, metres.
    pub pivot: DVec3,
    /// Unit vector along the axis; zero without a rotation.
    pub axis: DVec3,
    /// Square of the angular velocity, 1/s².
    pub square: f64,
    /// Angular acceleration, 1/s².
    pub angular: f64,
}

impl Inertia {
    /// Returns the acceleration at `p`, m/s².
    pub fn at(&self, p: DVec3) -> DVec3 {
        let y = p - self.pivot;
        let outward = y - self.axis * self.axis.dot(y);
        self.at_pivot + self.square * outward - self.angular * self.axis.cross(y)
    }

    /// Returns the largest change of the acceleration with the position, 1/s².
    pub fn slope(&self) -> f64 {
        self.square + self.angular.abs()
    }
}

impl FrameMotion {
    /// Returns the mean acceleration over `length` seconds from `start`. Accelerations are
    /// differences of velocities, so that the impulse of a step is exact, and none acts before the
    /// start; the rest is by Simpson's rule.
    pub fn inertia(&self, (start, length): (f64, f64)) -> Inertia {
        let (start, end) = (start.max(0.0), (start + length).max(0.0));
        let middle = 0.5 * (start + end);
        let mean = |of: &dyn Fn(f64) -> DVec3| (of(start) + 4.0 * of(middle) + of(end)) / 6.0;
        let rate = |motion: &Motion| match end > start {
            true => (motion.velocity(end) - motion.velocity(start)) / length,
            false => 0.0,
        };
        let slide = self.slide.as_ref();
        let pushed = slide.map_or(DVec3::ZERO, |(direction, motion)| {
            direction.normalize() * rate(motion)
        });
        let gravity = mean(&|t| self.turned(t).inverse() * self.gravity) - self.gravity;
        let mut inertia = Inertia {
            at_pivot: gravity - self.turned(middle).inverse() * pushed,
            ..Inertia::default()
        };
        if let Some(turn) = &self.turn {
            let speed = |t: f64| DVec3::splat(turn.motion.velocity(t).to_radians().powi(2));
            inertia.pivot = turn.pivot;
            inertia.axis = turn.axis.normalize();
            inertia.square = mean(&speed).x;
            inertia.angular = rate(&turn.motion).to_radians();
        }
        inertia
    }

    /// Returns the rotation of velocities by Coriolis's acceleration over `length` seconds from
    /// `start`: unit axis and angle, radians; `None` for a domain that does not rotate. Half of a
    /// step's before the other accelerations and half after them is of second order.
    pub fn velocity_turn(&self, (start, length): (f64, f64)) -> Option<(DVec3, f64)> {
        let turn = self.turn.as_ref()?;
        let angle = |t: f64| turn.motion.displacement(t.max(0.0)).to_radians();
        let turned = -2.0 * (angle(start + length) - angle(start));
        Some((turn.axis.normalize(), turned))
    }

    /// Returns how the domain is turned at a time, seconds.
    pub fn turned(&self, t: f64) -> DQuat {
        self.turn.as_ref().map_or(DQuat::IDENTITY, |turn| {
            let angle = turn.motion.displacement(t).to_radians();
            DQuat::from_axis_angle(turn.axis.normalize(), angle)
        })
    }

    /// Returns the largest acceleration of water at rest in the domain between two times, seconds,
    /// without the [jumps](Self::jump) of its velocity; m/s². From means over parts of the time, a
    /// sixteenth at most, and short against the periods of the motion.
    pub fn most(&self, start: f64, end: f64) -> f64 {
        let motions = self.slide.iter().map(|(_, motion)| motion);
        let motions = motions.chain(self.turn.iter().map(|turn| &turn.motion));
        let parts = motions.map(|motion| parts(motion, end - start)).max();
        let parts = parts.unwrap_or(1);
        let length = (end - start) / f64::from(parts);
        let part = |k: u32| {
            let from = start + f64::from(k) * length;
            let inertia = self.inertia((from, length));
            let whole = inertia.at_pivot.length() + inertia.slope() * self.reach;
            whole - self.jump(from, from + length) / length
        };
        (0..parts).map(part).fold(0.0, f64::max)
    }

    /// Returns by how much the velocity of a point of the domain jumps from `start` to `end`, both
    /// included, seconds, where a motion begins or ends abruptly, m/s.
    pub fn jump(&self, start: f64, end: f64) -> f64 {
        let of = |motion: &Motion| -> f64 {
            let times = abrupt(motion).into_iter();
            let times = times.filter(|t| (start..=end).contains(t));
            times
                .map(|t| (motion.velocity(t + MOMENT) - motion.velocity(t - MOMENT)).abs())
                .sum()
        };
        let slide = self.slide.as_ref().map_or(0.0, |(_, motion)| of(motion));
        let turn = self.turn.as_ref().map_or(0.0, |turn| of(&turn.motion));
        slide + turn.to_radians() * self.reach
    }

    /// Bounds the speed of a point of the domain between two times, seconds; m/s.
    pub fn peak_speed(&self, start: f64, end: f64) -> f64 {
        let slide = self.slide.as_ref();
        let slide = slide.map_or(0.0, |(_, motion)| motion.peak_speed(start, end));
        let turn = self.turn.as_ref();
        let turn = turn.map_or(0.0, |turn| turn.motion.peak_speed(start, end));
        slide + turn.to_radians() * self.reach
    }

    /// Moves the pivot by `way`, metres.
    pub fn carry(&mut self, way: DVec3) {
        if let Some(turn) = &mut self.turn {
            turn.pivot += way;
        }
    }
}

/// Time before and after a jump of the velocity, seconds.
const MOMENT: f64 = 1e-9;

/// Returns the times at which a motion's velocity may jump, seconds, each once.
fn abrupt(motion: &Motion) -> Vec<f64> {
    match motion {
        Motion::ConstantVelocity { until, .. } => [0.0].into_iter().chain(*until).collect(),
        Motion::Table { points } => {
            let ends = [points.first(), points.last()];
            ends.into_iter().flatten().map(|[time, _]| *time).collect()
        }
        _ => Vec::new(),
    }
}

/// Returns into how many parts `length` seconds have to be divided for a motion.
fn parts(motion: &Motion, length: f64) -> u32 {
    const LEAST: u32 = 16;
    let shortest = match motion {
        Motion::Sine { period, .. } => *period,
        Motion::Table { points } => {
            let steps = points.windows(2).map(|pair| pair[1][0] - pair[0][0]);
            steps.fold(f64::INFINITY, f64::min)
        }
        _ => f64::INFINITY,
    };
    let wanted = f64::from(LEAST) * length / shortest;
    (wanted.ceil() as u32).clamp(LEAST, 1 << 12)
}

/// Returns the change of a velocity that turns by `angle`, radians, about the unit vector `axis`,
/// m/s.
pub fn change_by_turn((axis, angle): (DVec3, f64), velocity: DVec3) -> DVec3 {
    let across = axis.cross(velocity);
    let half = (0.5 * angle).sin();
    angle.sin() * across + 2.0 * half * half * axis.cross(across)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn motion() -> FrameMotion {
        FrameMotion {
            slide: Some((
                DVec3::new(2.0, 0.0, 1.0),
                Motion::Sine {
                    stroke: 0.4,
                    period: 1.7,
                    ramp: 1.0,
                },
            )),
            turn: Some(FrameTurn {
                pivot: DVec3::new(0.3, -0.2, 0.5),
                axis: DVec3::new(1.0, 2.0, -0.5),
                motion: Motion::Sine {
                    stroke: 50.0,
                    period: 2.3,
                    ramp: 1.0,
                },
            }),
            gravity: DVec3::new(0.0, -9.81, 0.0),
            reach: 2.0,
        }
    }

    /// Position in the frame at rest of a point of the domain.
    fn outside(motion: &FrameMotion, t: f64, x: DVec3) -> DVec3 {
        let (direction, way) = motion.slide.as_ref().unwrap();
        let pivot = motion.turn.as_ref().unwrap().pivot;
        let moved = direction.normalize() * way.displacement(t);
        pivot + moved + motion.turned(t) * (x - pivot)
    }

    /// A free particle, stepped in the domain, flies the parabola that it flies outside. The error
    /// falls with the square of the step.
    #[test]
    fn a_free_particle_flies_its_parabola() {
        let error = |motion: &FrameMotion, is_turned: bool, steps: u32| {
            let (mut x, v) = (DVec3::new(0.8, 0.9, -0.3), DVec3::new(0.5, 2.0, -1.0));
            let start = x;
            let step = 1.5 / f64::from(steps);
            // Kicks act from the middle of a step to that of the next, as in the solvers.
            let mut v = v;
            for k in 0..steps {
                let t = f64::from(k) * step;
                let kick = match k {
                    0 => (0.0, 0.5 * step),
                    _ => (t - 0.5 * step, step),
                };
                let half = |from: f64| {
                    let turn = motion.velocity_turn((from, 0.5 * kick.1));
                    turn.filter(|_| is_turned)
                };
                if let Some(turn) = half(kick.0) {
                    v += change_by_turn(turn, v);
                }
                v += kick.1 * (motion.gravity + motion.inertia(kick).at(x));
                if let Some(turn) = half(kick.0 + 0.5 * kick.1) {
                    v += change_by_turn(turn, v);
                }
                x += step * v;
            }
            let end = 1.5;
            // At the start the domain is at rest, so velocities are the same in both frames.
            let first = DVec3::new(0.5, 2.0, -1.0);
            let free = start + end * first + 0.5 * end * end * motion.gravity;
            (outside(motion, end, x) - free).length()
        };
        let all = motion();
        let [coarse, fine] = [400, 800].map(|steps| error(&all, true, steps));
        assert!(fine < 2e-4, "{coarse:e} {fine:e}");
        let order = (coarse / fine).log2();
        assert!(order > 1.5, "{coarse:e} {fine:e} {order}");
        // Controls: no Coriolis acceleration, another pivot, a turn the other way.
        assert!(error(&all, false, 800) > 0.1);
        let mut moved = motion();
        moved.carry(DVec3::new(0.0, 0.1, 0.0));
        let mixed = |wrong: &FrameMotion| {
            let own = FrameMotion {
                turn: wrong.turn.clone(),
                ..motion()
            };
            (own.inertia((0.4, 0.1)).at(DVec3::X) - all.inertia((0.4, 0.1)).at(DVec3::X)).length()
        };
        assert!(mixed(&moved) > 1e-3);
    }

    /// An abrupt start is a jump and no acceleration, and vibrations are seen.
    #[test]
    fn jumps_are_no_accelerations() {
        let sliding = |motion| FrameMotion {
            slide: Some((DVec3::X, motion)),
            turn: None,
            ..motion_at_rest()
        };
        let steady = sliding(Motion::ConstantVelocity {
            velocity: 3.0,
            until: Some(0.5),
        });
        assert_eq!(steady.jump(-0.01, 0.04), 3.0);
        assert_eq!(steady.jump(0.49, 0.51), 3.0);
        assert_eq!(steady.jump(0.1, 0.4), 0.0);
        for start in [-0.02, 0.0, 0.2, 0.48] {
            assert!(steady.most(start, start + 0.04) < 1e-9, "{start}");
        }
        // Control: that is what the parts have without it.
        assert!(steady.inertia((0.0, 0.0025)).at_pivot.length() > 1000.0);
        let shaken = sliding(Motion::Sine {
            stroke: 0.02,
            period: 1.0 / 384.0,
            ramp: 0.0,
        });
        let peak = 0.01 * (2.0 * std::f64::consts::PI * 384.0).powi(2);
        let found = shaken.most(0.0, 1.0 / 24.0);
        // A mean over a sixteenth of a period, at most half of it beside the peak.
        assert!((found / peak - 1.0).abs() < 0.03, "{found} {peak}");
        let table = sliding(Motion::Table {
            points: vec![[0.1, 0.0], [0.2, 0.1], [0.3, 0.2]],
        });
        // A table of few points begins and ends at rest.
        assert!(table.jump(0.05, 0.35) < 1e-6);
        assert!((1.0..1.5).contains(&table.peak_speed(0.0, 1.0)));
    }

    fn motion_at_rest() -> FrameMotion {
        FrameMotion {
            slide: None,
            turn: None,
            gravity: DVec3::new(0.0, -9.81, 0.0),
            reach: 2.0,
        }
    }

    #[test]
    fn the_largest_acceleration_bounds_all() {
        let motion = motion();
        for k in 0..30 {
            let t = 0.1 * f64::from(k);
            let most = motion.most(t, t + 0.1);
            let inertia = motion.inertia((t + 0.04, 0.01));
            for corner in [DVec3::X, DVec3::NEG_Y, DVec3::Z] {
                let at = inertia.pivot + motion.reach * corner;
                assert!(inertia.at(at).length() < 1.1 * most + 0.1, "{t}");
            }
        }
    }
}
