//! Positions of particles between frames.
//!
//! Given the neighbouring frames, a particle's path is a cubic Hermite curve on either side of the
//! frame's instant, through its positions with its velocities there. The remainder is x'''' t² (t −
//! h)² / 24, at most x'''' h⁴ / 384 between two frames h apart. On a side where the frame is
//! missing or lacks the particle, the path continues straight with the particle's velocity.

use glam::{DVec3, Vec3};

use super::{inputs::Ids, uniform};
use swell_domain::{parallel, particles::Particles};

/// Path of a particle about its frame's instant: x(t) = x + v t + (square + cube t) t², in metres
/// and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Path {
    /// Velocity at the frame's instant, m/s.
    pub(super) velocity: Vec3,
    /// Coefficients `square` and `cube` before the instant.
    pub(super) before: [Vec3; 2],
    /// Coefficients after it.
    pub(super) after: [Vec3; 2],
}

impl Path {
    pub(super) fn straight(velocity: Vec3) -> Self {
        Self {
            velocity,
            ..Self::default()
        }
    }

    /// Displacement from the position at the frame's instant, metres.
    pub(super) fn displacement(&self, seconds: f32) -> DVec3 {
        let [square, cube] = match seconds < 0.0 {
            true => self.before,
            false => self.after,
        };
        let [velocity, square, cube] = [self.velocity, square, cube].map(Vec3::as_dvec3);
        let t = f64::from(seconds);
        t * velocity + t * t * (square + t * cube)
    }

    /// Converts the path to the device's layout.
    pub(super) fn packed(&self) -> uniform::Path {
        let [[a, b], [c, d]] = [self.before, self.after].map(|side| side.map(|v| v.to_array()));
        uniform::Path {
            before_square: a,
            pad0: 0.0,
            before_cube: b,
            pad1: 0.0,
            after_square: c,
            pad2: 0.0,
            after_cube: d,
            pad3: 0.0,
        }
    }
}

/// Coefficients `square` and `cube` of the curve that begins with velocity `v0` and, after `h`
/// seconds, has displacement `way` and velocity `v1`; `h` may be negative.
fn bend(v0: Vec3, way: Vec3, v1: Vec3, h: f32) -> [Vec3; 2] {
    let mean = way / h;
    [
        (3.0 * mean - 2.0 * v0 - v1) / h,
        (v0 + v1 - 2.0 * mean) / (h * h),
    ]
}

/// Paths of a frame's particles, in their order, from the frames `seconds` before and after; `size`
/// is that of the domain, metres.
pub(super) fn paths(
    water: &Particles,
    around: [Option<&Particles>; 2],
    seconds: f32,
    size: DVec3,
) -> Vec<Path> {
    let others = around.map(|other| other.map(|other| (other, Ids::of(other))));
    let ids = Ids::of(water);
    // A larger displacement means that the particle crossed a periodic boundary.
    let farthest = 0.5 * size.as_vec3();
    let side = |index: usize, side: usize, h: f32| {
        let (other, at) = others[side].as_ref()?;
        let found = at.find(ids.id(index))?;
        let way = Vec3::from(other.position[found]) - Vec3::from(water.position[index]);
        let joins = way.is_finite() && way.abs().cmplt(farthest).all();
        let velocity = Vec3::from(water.velocity[index]);
        joins.then(|| bend(velocity, way, Vec3::from(other.velocity[found]), h))
    };
    parallel::map(0..water.len(), |index| Path {
        velocity: Vec3::from(water.velocity[index]),
        before: side(index, 0, -seconds).unwrap_or_default(),
        after: side(index, 1, seconds).unwrap_or_default(),
    })
}

/// Positions and paths of the particles of the body; without `paths` they move in straight lines.
pub(super) fn body_of(particles: &[uniform::Particle], paths: &[Path]) -> Vec<(Vec3, Path)> {
    let body = (particles.iter().enumerate()).filter(|(_, particle)| particle.tag & 1 == 1);
    body.map(|(index, particle)| {
        let straight = || Path::straight(particle.velocity.into());
        let path = paths.get(index).copied().unwrap_or_else(straight);
        (particle.position.into(), path)
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    fn one(position: DVec3, velocity: DVec3, id: u32) -> Particles {
        Particles {
            position: vec![position.as_vec3().to_array()],
            velocity: vec![velocity.as_vec3().to_array()],
            id: vec![id],
            ..Particles::default()
        }
    }

    /// Angle per frame: a twelfth of a circle with a radius of one metre.
    const TURN: f64 = TAU / 12.0;
    const SECONDS: f64 = 1.0 / 24.0;

    fn circling(frame: f64, id: u32) -> Particles {
        let (sin, cos) = (TURN * frame).sin_cos();
        let speed = TURN / SECONDS;
        one(
            DVec3::new(cos, sin, 0.0),
            speed * DVec3::new(-sin, cos, 0.0),
            id,
        )
    }

    /// Largest distance of a path from the circle within half a frame, metres.
    fn off(path: &Path) -> f64 {
        let at = |part: f64| {
            let place = DVec3::X + path.displacement((part * SECONDS) as f32);
            let (sin, cos) = (TURN * part).sin_cos();
            (place - DVec3::new(cos, sin, 0.0)).length()
        };
        (-50..=50)
            .map(|k| at(0.01 * f64::from(k)))
            .fold(0.0, f64::max)
    }

    fn path(around: [Option<&Particles>; 2]) -> Path {
        let size = DVec3::splat(10.0);
        paths(&circling(0.0, 7), around, SECONDS as f32, size)[0]
    }

    #[test]
    fn a_circle_is_followed_and_a_straight_line_leaves_it() {
        let (before, after) = (circling(-1.0, 7), circling(1.0, 7));
        // x'''' is ω⁴ in either coordinate; f32 adds 1e-6.
        let bound = 2f64.sqrt() * TURN.powi(4) / 384.0 + 2e-6;
        let curved = path([Some(&before), Some(&after)]);
        assert!(off(&curved) < bound, "{} {bound}", off(&curved));
        // The tangent deviates by at least 1 − cos of half a frame's angle, about ω²/8.
        let straight = path([None, None]);
        assert!(
            off(&straight) > TURN * TURN / 8.0 * 0.9,
            "{}",
            off(&straight)
        );
        assert_eq!(straight, Path::straight(straight.velocity));
        // A side with a frame is followed when the other has none.
        let half = path([None, Some(&after)]);
        assert_eq!(
            (half.before, half.after),
            (Default::default(), curved.after)
        );
        // A different particle is ignored, and so is the same one across a periodic domain of 0.8
        // m.
        let stranger = circling(1.0, 8);
        assert_eq!(path([None, Some(&stranger)]), straight);
        let small = paths(
            &circling(0.0, 7),
            [None, Some(&after)],
            SECONDS as f32,
            DVec3::splat(0.8),
        );
        assert_eq!(small[0], straight);
    }

    #[test]
    fn a_parabola_is_its_own_curve() {
        let (v, g) = (DVec3::new(3.0, 5.0, -1.0), DVec3::new(0.0, -9.81, 0.0));
        let at = |t: f64| one(v * t + 0.5 * g * t * t, v + g * t, 1);
        let found = paths(
            &at(0.0),
            [Some(&at(-0.1)), Some(&at(0.1))],
            0.1,
            DVec3::splat(10.0),
        )[0];
        for t in [-0.05, -0.02, 0.03, 0.1] {
            let off = found.displacement(t as f32) - (v * t + 0.5 * g * t * t);
            assert!(off.length() < 1e-5, "{t}: {off}");
        }
    }
}
