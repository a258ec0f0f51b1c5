//! Path of a body between the states of two frames.
//!
//! A cubic Hermite curve, as for particles: it passes through both states with their velocities.
//! The remainder is x'''' t² (t − h)² / 24, at most x'''' h⁴ / 384 between states h apart. The
//! rotation is such a curve of the rotation vector θ from the first state, whose derivative follows
//! from the angular velocity ω by the inverse of the left Jacobian of SO(3) (Barfoot 2017, 7.1.5),
//! θ' = ω − θ × ω / 2 + (1 − |θ|/2 · cot(|θ|/2)) / |θ|² · θ × (θ × ω).

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::{Body, BodyState, Freedom};
use crate::pose::Pose;

/// Angle below which the series of a coefficient is exact to f64, rad.
const SMALL: f64 = 1e-4;

impl Body {
    /// Returns the pose at time `t`, seconds, on the path from one state to another. At the time of
    /// either state it is the pose of that state.
    pub fn pose_between(&self, [from, to]: [&BodyState; 2], t: f64) -> Pose {
        if t == from.time || t == to.time {
            return self.pose(if t == from.time { from } else { to });
        }
        let (h, s) = (to.time - from.time, t - from.time);
        let way = curve(from.velocity, to.centre - from.centre, to.velocity, h);
        let angle = rotation_between([from, to], h);
        let turned = curve(from.spin, angle, rate_of(angle, to.spin), h);
        let turn = DQuat::from_scaled_axis(at(turned, s)) * from.turn;
        let centre = match self.freedom {
            Freedom::Hinge { at, .. } => at + turn * (self.mass.centre - at),
            Freedom::Axes { .. } => from.centre + at(way, s),
        };
        Pose {
            rest: self.mass.centre,
            centre,
            turn: turn.normalize(),
        }
    }
}

/// Coefficients of t, t² and t³ of the curve that begins with velocity `v0` and, after `h` seconds,
/// has displacement `way` and velocity `v1`.
fn curve(v0: DVec3, way: DVec3, v1: DVec3, h: f64) -> [DVec3; 3] {
    let mean = way / h;
    let square = (3.0 * mean - 2.0 * v0 - v1) / h;
    [v0, square, (v0 + v1 - 2.0 * mean) / (h * h)]
}

fn at([a, b, c]: [DVec3; 3], s: f64) -> DVec3 {
    s * (a + s * (b + s * c))
}

/// Rotation vector that leads from one state to the other within `h` seconds: of those that differ
/// by whole turns, the one nearest to what the mean spin makes.
fn rotation_between([from, to]: [&BodyState; 2], h: f64) -> DVec3 {
    let step = to.turn * from.turn.conjugate();
    let shortest = if step.w < 0.0 { -step } else { step }.to_scaled_axis();
    let spun = 0.5 * h * (from.spin + to.spin);
    let axis = shortest.try_normalize().or(spun.try_normalize());
    let axis = axis.unwrap_or(DVec3::X);
    let turns = ((spun - shortest).dot(axis) / TAU).round();
    shortest + turns * TAU * axis
}

/// Rate at which a rotation vector `angle` changes at the angular velocity `spin`.
fn rate_of(angle: DVec3, spin: DVec3) -> DVec3 {
    let size = angle.length();
    let factor = match size < SMALL {
        true => 1.0 / 12.0,
        false => (1.0 - 0.5 * size / (0.5 * size).tan()) / (size * size),
    };
    let across = angle.cross(spin);
    spin - 0.5 * across + factor * angle.cross(across)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{EDGES, body, brick};
    use super::*;
    use crate::body::MassProperties;

    const H: f64 = 1.0 / 24.0;

    /// State of a body that spins about `axis` by `rate` and whose centre moves on a parabola.
    fn state(t: f64, axis: DVec3, rate: f64) -> BodyState {
        let (v, g) = (DVec3::new(2.0, 4.0, -1.0), DVec3::new(0.0, -9.81, 0.0));
        BodyState {
            time: t,
            centre: DVec3::new(3.0, 1.0, 2.0) + v * t + 0.5 * t * t * g,
            turn: DQuat::from_scaled_axis(t * rate * axis) * DQuat::from_rotation_z(0.4),
            velocity: v + t * g,
            spin: rate * axis,
        }
    }

    /// Distance of a path's corner of the body from where it truly is, metres.
    fn off(found: Pose, truth: &BodyState, body: &Body) -> f64 {
        let corner = body.mass.centre + 0.5 * EDGES;
        found.place(corner).distance(body.pose(truth).place(corner))
    }

    #[test]
    fn a_thrown_and_spinning_body_is_followed() {
        let body = body(Freedom::ALL);
        let axis = DVec3::new(1.0, 2.0, -0.5).normalize();
        // A whole turn and a half within the step: its shortest rotation leads the other way.
        for rate in [0.0, 3.0, 3.0 * std::f64::consts::PI / H, -70.0] {
            let ends = [-H, 0.0].map(|t| state(t, axis, rate));
            for t in [-H, -0.8 * H, -0.5 * H, -0.1 * H, 0.0] {
                let found = body.pose_between([&ends[0], &ends[1]], t);
                let wrong = off(found, &state(t, axis, rate), &body);
                assert!(wrong < 1e-12, "{rate} {t}: {wrong}");
            }
        }
        // Control: a straight line and the shorter arc, half way.
        let ends = [-H, 0.0].map(|t| state(t, axis, -70.0));
        let middle = Pose {
            rest: body.mass.centre,
            centre: 0.5 * (ends[0].centre + ends[1].centre),
            turn: ends[0].turn.slerp(ends[1].turn, 0.5),
        };
        let wrong = off(middle, &state(-0.5 * H, axis, -70.0), &body);
        assert!(wrong > 1e-3, "{wrong}");
    }

    /// Spins about two axes one after the other: the path leaves and arrives with the spin of each
    /// state.
    #[test]
    fn the_path_has_the_velocities_of_both_states() {
        let body = body(Freedom::ALL);
        let from = state(0.0, DVec3::X, 9.0);
        let to = BodyState {
            spin: DVec3::new(1.0, -8.0, 4.0),
            turn: DQuat::from_scaled_axis(DVec3::new(0.2, -0.1, 0.3)) * from.turn,
            ..state(H, DVec3::X, 9.0)
        };
        let rates = |t: f64, e: f64| {
            let [a, b] = [t - e, t + e].map(|t| body.pose_between([&from, &to], t));
            let spin = (b.turn * a.turn.conjugate()).to_scaled_axis() / (2.0 * e);
            [(b.centre - a.centre) / (2.0 * e), spin]
        };
        // Central differences 2e away from an end have errors of the order of e times the
        // acceleration, which is below 1e4 rad/s² here.
        let e = 1e-7;
        for (state, t) in [(&from, 2.0 * e), (&to, H - 2.0 * e)] {
            let [velocity, spin] = rates(t, e);
            assert!((velocity - state.velocity).length() < 0.01, "{velocity}");
            assert!((spin - state.spin).length() < 0.01, "{spin}");
        }
        // Control: without the Jacobian the spin at the end is another.
        let angle = rotation_between([&from, &to], H);
        assert!((rate_of(angle, to.spin) - to.spin).length() > 0.5);
        // A rotation vector of either size has the same rate where the formulas meet.
        let rate = |size: f64| rate_of(size * DVec3::Y, DVec3::new(3.0, 2.0, 1.0));
        assert!((rate(0.999 * SMALL) - rate(1.001 * SMALL)).length() < 1e-6);
    }

    #[test]
    fn a_hinged_body_stays_on_its_arc() {
        let mesh = brick(DVec3::new(3.0, -1.0, 2.0), EDGES);
        let mut body = body(Freedom::Hinge {
            at: DVec3::new(2.0, 0.0, 1.0),
            axis: DVec3::Z,
        });
        body.mass = MassProperties::of_mesh(&mesh, 500.0);
        body.velocity[5] = 20.0;
        let ends = [0.0, H].map(|t| body.moved(&body.at_start(), t));
        let radius = |pose: Pose| pose.centre.distance(DVec3::new(2.0, 0.0, 1.0));
        let start = radius(body.pose(&ends[0]));
        for k in 0..=10 {
            let t = 0.1 * f64::from(k) * H;
            let pose = body.pose_between([&ends[0], &ends[1]], t);
            assert!((radius(pose) - start).abs() < 1e-12, "{t}");
            let truth = body.pose(&body.moved(&body.at_start(), t));
            assert!(pose.centre.distance(truth.centre) < 1e-9, "{t}");
        }
    }
}
