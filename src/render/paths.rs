//! Where particles are between frames.
//!
//! With the frames around it a particle's way is a cubic Hermite curve on either side of the frame's instant: through its places, with
//! its velocities there. The remainder is x'''' t² (t − h)² / 24, at most x'''' h⁴ / 384 between two frames h apart. On a side where
//! there is no frame, or the particle is not in it, it goes straight on with its velocity.

use glam::{DVec3, Vec3};
use rayon::prelude::*;

use super::{moment::Ids, uniform};
use swell_domain::particles::Particles;

/// How a particle goes about its frame's instant: x(t) = x + v t + (square + cube t) t², metres and seconds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Path {
    /// At the frame's instant.
    pub(super) velocity: Vec3,
    /// Before it: square and cube.
    pub(super) before: [Vec3; 2],
    /// After it.
    pub(super) after: [Vec3; 2],
}

impl Path {
    pub(super) fn straight(velocity: Vec3) -> Self {
        Self {
            velocity,
            ..Self::default()
        }
    }

    /// Metres from where it is at the frame's instant.
    pub(super) fn way(&self, seconds: f32) -> DVec3 {
        let [square, cube] = match seconds < 0.0 {
            true => self.before,
            false => self.after,
        };
        let [velocity, square, cube] = [self.velocity, square, cube].map(Vec3::as_dvec3);
        let t = f64::from(seconds);
        t * velocity + t * t * (square + t * cube)
    }

    /// For the device.
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

/// Square and cube of the curve that begins with velocity `v0` and is `way` farther with velocity `v1` after `h` seconds, which may be
/// negative.
fn bend(v0: Vec3, way: Vec3, v1: Vec3, h: f32) -> [Vec3; 2] {
    let mean = way / h;
    [
        (3.0 * mean - 2.0 * v0 - v1) / h,
        (v0 + v1 - 2.0 * mean) / (h * h),
    ]
}

/// Paths of a frame's particles, in their order, by the frames `seconds` before and after it; `size` is that of the domain, metres.
pub(super) fn paths(
    water: &Particles,
    around: [Option<&Particles>; 2],
    seconds: f32,
    size: DVec3,
) -> Vec<Path> {
    let others = around.map(|other| other.map(|other| (other, Ids::of(other))));
    let ids = Ids::of(water);
    // What goes farther came in again at the other side of a periodic domain.
    let farthest = 0.5 * size.as_vec3();
    let side = |index: usize, side: usize, h: f32| {
        let (other, at) = others[side].as_ref()?;
        let found = at.find(ids.id(index))?;
        let way = Vec3::from(other.position[found]) - Vec3::from(water.position[index]);
        let joins = way.is_finite() && way.abs().cmplt(farthest).all();
        let velocity = Vec3::from(water.velocity[index]);
        joins.then(|| bend(velocity, way, Vec3::from(other.velocity[found]), h))
    };
    (0..water.len())
        .into_par_iter()
        .map(|index| Path {
            velocity: Vec3::from(water.velocity[index]),
            before: side(index, 0, -seconds).unwrap_or_default(),
            after: side(index, 1, seconds).unwrap_or_default(),
        })
        .collect()
}

/// Where particles of the body are and how they go; without `paths` they go straight on.
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

    /// A twelfth of a circle of a metre a frame.
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

    /// How far a path is off the circle at most within half a frame, metres.
    fn off(path: &Path) -> f64 {
        let at = |part: f64| {
            let place = DVec3::X + path.way((part * SECONDS) as f32);
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
        // A tangent leaves it by 1 − cos and sin of half a turn's difference: ω²/8 and more.
        let straight = path([None, None]);
        assert!(
            off(&straight) > TURN * TURN / 8.0 * 0.9,
            "{}",
            off(&straight)
        );
        assert_eq!(straight, Path::straight(straight.velocity));
        // One side alone is followed where there is a frame.
        let half = path([None, Some(&after)]);
        assert_eq!(
            (half.before, half.after),
            (Default::default(), curved.after)
        );
        // Another particle is none, nor is the same one across a periodic domain of 1.5 m.
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
            let off = found.way(t as f32) - (v * t + 0.5 * g * t * t);
            assert!(off.length() < 1e-5, "{t}: {off}");
        }
    }
}
