//! The water of every frame of a bake, including frames whose particles were not kept.

use glam::{DVec3, Vec3};

use swell_cache::{CacheError, CacheReader};
use swell_domain::{particles::Particles, period::Period};

/// Reads frames in ascending order, and interpolates those between two kept frames.
pub(crate) struct WaterReader<'a> {
    cache: &'a CacheReader,
    period: Period,
    /// Frames read last, the older first.
    read: Vec<(u32, Particles)>,
}

impl<'a> WaterReader<'a> {
    pub(crate) fn of(cache: &'a CacheReader, period: Period) -> Self {
        Self {
            cache,
            period,
            read: Vec::new(),
        }
    }

    /// The particles of a frame, relative to the scene's origin. Between two kept frames, each
    /// particle follows the cubic Hermite curve through both frames' positions and velocities.
    pub(crate) fn at(&mut self, frame: u32) -> Result<Particles, CacheError> {
        let kept = |frame: &u32| self.cache.has_particles(*frame);
        let before = (self.cache.first_frame()..=frame).rev().find(kept);
        let after = (frame..=self.cache.last_frame()).find(kept);
        let (Some(before), Some(after)) = (before, after) else {
            // Returns the reader's error.
            return self.cache.read(frame);
        };
        self.read
            .retain(|(read, _)| *read == before || *read == after);
        for frame in [before, after] {
            if !self.read.iter().any(|(read, _)| *read == frame) {
                self.read.push((frame, self.cache.read(frame)?));
            }
        }
        let of = |frame: u32| self.read.iter().find(|(read, _)| *read == frame);
        let (Some((_, start)), Some((_, end))) = (of(before), of(after)) else {
            return self.cache.read(frame);
        };
        if before == after {
            return Ok(start.clone());
        }
        let time = |frame: u32| Ok::<_, CacheError>(self.cache.entry(frame)?.clock.time);
        let seconds = time(after)? - time(before)?;
        let part = (time(frame)? - time(before)?) / seconds;
        Ok(between(start, end, seconds, part, self.period))
    }
}

/// Interpolates particles that exist in both states, at the fraction `part` of the `seconds`
/// between them.
fn between(
    start: &Particles,
    end: &Particles,
    seconds: f64,
    part: f64,
    period: Period,
) -> Particles {
    let wide = |v: [f32; 3]| Vec3::from_array(v).as_dvec3();
    let mut made = Particles::default();
    let mut others = end.id.iter().enumerate().peekable();
    for (k, &id) in start.id.iter().enumerate() {
        // Both are sorted by id.
        while others.next_if(|(_, other)| **other < id).is_some() {}
        let Some((l, _)) = others.next_if(|(_, other)| **other == id) else {
            continue;
        };
        let (v0, v1) = (wide(start.velocity[k]), wide(end.velocity[l]));
        let x0 = wide(start.position[k]);
        let guess = 0.5 * seconds * (v0 + v1);
        let way = guess + period.shortest(wide(end.position[l]) - x0 - guess);
        let (x, v) = hermite(way, v0, v1, seconds, part);
        made.position.push((x0 + x).as_vec3().to_array());
        made.velocity.push(v.as_vec3().to_array());
        made.id.push(id);
    }
    made
}

/// Displacement and velocity at the fraction `part` of `seconds`, along the cubic with total
/// displacement `way` and end velocities `v0` and `v1`.
fn hermite(way: DVec3, v0: DVec3, v1: DVec3, seconds: f64, part: f64) -> (DVec3, DVec3) {
    let (s, s2, s3) = (part, part * part, part * part * part);
    let x = (3.0 * s2 - 2.0 * s3) * way + seconds * ((s - 2.0 * s2 + s3) * v0 + (s3 - s2) * v1);
    let v = 6.0 * (s - s2) / seconds * way
        + (1.0 - 4.0 * s + 3.0 * s2) * v0
        + (3.0 * s2 - 2.0 * s) * v1;
    (x, v)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn particle(id: u32, x: f32, v: f32) -> Particles {
        Particles {
            position: vec![[x, 0.0, 0.0]],
            velocity: vec![[v, 0.0, 0.0]],
            id: vec![id],
            ..Particles::default()
        }
    }

    /// A free fall is a parabola, which a cubic represents exactly.
    #[test]
    fn what_falls_is_where_it_falls_to() {
        let at = |t: f64| (2.0 * t - 4.905 * t * t, 2.0 - 9.81 * t);
        let (x0, v0) = at(0.0);
        let (x1, v1) = at(0.4);
        let [start, end] = [(x0, v0), (x1, v1)].map(|(x, v)| particle(7, x as f32, v as f32));
        let made = between(&start, &end, 0.4, 0.25, Period::default());
        let (x, v) = at(0.1);
        assert!((f64::from(made.position[0][0]) - x).abs() < 1e-6);
        assert!((f64::from(made.velocity[0][0]) - v).abs() < 1e-5);
        // Linear interpolation gives another position.
        assert!((x0 + 0.25 * (x1 - x0) - x).abs() > 0.1);
    }

    #[test]
    fn who_crosses_a_joint_goes_on() {
        let period = Period(DVec3::new(2.0, 0.0, 0.0));
        let (start, end) = (particle(1, 1.9, 1.0), particle(1, 0.1, 1.0));
        let made = between(&start, &end, 0.2, 0.5, period);
        assert!(
            (made.position[0][0] - 2.0).abs() < 1e-6,
            "{:?}",
            made.position
        );
    }

    #[test]
    fn who_is_in_one_frame_alone_is_left_out() {
        let join = |a: Particles, b: Particles| Particles {
            position: [a.position, b.position].concat(),
            velocity: [a.velocity, b.velocity].concat(),
            id: [a.id, b.id].concat(),
            ..Particles::default()
        };
        let start = join(particle(1, 0.0, 0.0), particle(3, 1.0, 0.0));
        let end = join(particle(2, 0.0, 0.0), particle(3, 1.0, 0.0));
        let made = between(&start, &end, 1.0, 0.5, Period::default());
        assert_eq!(made.id, [3]);
    }
}
