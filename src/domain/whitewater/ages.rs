//! Deaths: foam has a limited lifetime, which is shorter where it is crowded.

use rayon::prelude::*;

use super::{AGE, CompleteSettings, KIND, LIFE, WhitewaterKind};
use crate::{parallel, particles::Particles};

/// Advances ages by `seconds` and reduces the life of foam, by a factor that rises with the number
/// of foam particles about it once there are more than `settings.crowd` on a square metre, counted
/// in its cube of one spacing: foam is a layer no thicker. Removes particles without life left, and
/// returns how many.
pub fn grow_older(
    settings: &CompleteSettings,
    particles: &mut Particles,
    spacing: f64,
    seconds: f64,
) -> usize {
    let crowds = Crowds::of(particles, spacing);
    let most = settings.crowd * spacing * spacing;
    let loss: Vec<f32> = parallel::map(0..particles.len(), |k| match is_foam(particles, k) {
        true => {
            let crowd = crowds.about(particles.position[k]) as f64 / most;
            (seconds * crowd.max(1.0)) as f32
        }
        false => 0.0,
    });
    let column = |name: &str, particles: &mut Particles, by: &dyn Fn(usize) -> f32| {
        let values = particles.attributes.get_mut(name).into_iter().flatten();
        values.enumerate().for_each(|(k, value)| *value += by(k));
    };
    column(AGE, particles, &|_| seconds as f32);
    column(LIFE, particles, &|k| -loss[k]);
    let before = particles.len();
    let lives: Vec<bool> = particles.attributes[LIFE]
        .iter()
        .map(|&life| life > 0.0)
        .collect();
    particles.retain(&lives);
    before - particles.len()
}

fn is_foam(particles: &Particles, k: usize) -> bool {
    particles.attributes[KIND][k] == WhitewaterKind::Foam.number()
}

/// The cubes that contain foam, sorted, one entry per particle.
struct Crowds {
    spacing: f64,
    cubes: Vec<[i32; 3]>,
}

impl Crowds {
    fn of(particles: &Particles, spacing: f64) -> Self {
        let mut cubes: Vec<[i32; 3]> = parallel::flat_map(0..particles.len(), |k| {
            is_foam(particles, k).then(|| cube_of(particles.position[k], spacing))
        });
        cubes.par_sort_unstable();
        Self { spacing, cubes }
    }

    /// Number of foam particles in the cube of a position.
    fn about(&self, place: [f32; 3]) -> usize {
        let cube = cube_of(place, self.spacing);
        let end = self.cubes.partition_point(|other| *other <= cube);
        end - self.cubes.partition_point(|other| *other < cube)
    }
}

fn cube_of(position: [f32; 3], spacing: f64) -> [i32; 3] {
    position.map(|x| (f64::from(x) / spacing).floor() as i32)
}

#[cfg(test)]
mod tests {
    use super::super::{RADIUS, none, tests_support::settings};
    use super::*;

    fn crowd(count: u32, kind: WhitewaterKind, life: f32) -> Particles {
        let mut all = none();
        for id in 0..count {
            all.position.push([0.05, 0.05, 0.05]);
            all.velocity.push([0.0; 3]);
            all.id.push(id);
            for (name, value) in [
                (AGE, 0.0),
                (KIND, kind.number()),
                (LIFE, life),
                (RADIUS, 0.01),
            ] {
                all.attributes
                    .entry(name.to_owned())
                    .or_default()
                    .push(value);
            }
        }
        all
    }

    #[test]
    fn foam_ages_and_the_others_only_grow_older() {
        let settings = settings();
        let mut foam = crowd(2, WhitewaterKind::Foam, 1.0);
        assert_eq!(grow_older(&settings, &mut foam, 0.1, 0.25), 0);
        assert_eq!(foam.attributes[LIFE], [0.75, 0.75]);
        assert_eq!(foam.attributes[AGE], [0.25, 0.25]);
        assert_eq!(grow_older(&settings, &mut foam, 0.1, 0.75), 2);
        assert!(foam.is_empty() && foam.attributes[AGE].is_empty());
        for kind in [WhitewaterKind::Spray, WhitewaterKind::Bubble] {
            let mut other = crowd(1, kind, 0.1);
            assert_eq!(grow_older(&settings, &mut other, 0.1, 5.0), 0);
            assert_eq!(other.attributes[LIFE], [0.1]);
        }
    }

    #[test]
    fn crowded_foam_dies_sooner() {
        let settings = settings();
        // Cubes of 0.1 m are full with 4 on their 0.01 m².
        let full = 4;
        let mut packed = crowd(3 * full, WhitewaterKind::Foam, 1.0);
        assert_eq!(grow_older(&settings, &mut packed, 0.1, 0.25), 0);
        assert!((packed.attributes[LIFE][0] - 0.25).abs() < 1e-6);
        // As many in a cube of half the spacing, a quarter of the area, age four times as fast.
        let mut dense = crowd(full, WhitewaterKind::Foam, 1.0);
        assert_eq!(grow_older(&settings, &mut dense, 0.05, 0.1), 0);
        assert!((dense.attributes[LIFE][0] - 0.6).abs() < 1e-6);
        // Bubbles in the same position do not crowd foam.
        let mut few = crowd(full, WhitewaterKind::Foam, 1.0);
        let mut bubbles = crowd(3 * full, WhitewaterKind::Bubble, 1.0);
        few.position.append(&mut bubbles.position);
        few.velocity.append(&mut bubbles.velocity);
        few.id.extend(full..4 * full);
        for (name, column) in &mut bubbles.attributes {
            few.attributes
                .entry(name.clone())
                .or_default()
                .append(column);
        }
        grow_older(&settings, &mut few, 0.1, 0.25);
        assert!((few.attributes[LIFE][0] - 0.75).abs() < 1e-6);
    }

    #[test]
    fn who_is_left_keeps_what_it_has() {
        let settings = settings();
        let mut some = crowd(3, WhitewaterKind::Foam, 1.0);
        some.attributes.entry(LIFE.to_owned()).or_default()[1] = 0.1;
        some.position[2] = [0.07, 0.05, 0.05];
        assert_eq!(grow_older(&settings, &mut some, 0.1, 0.5), 1);
        assert_eq!(some.id, [0, 2]);
        assert_eq!(some.position[1], [0.07, 0.05, 0.05]);
    }
}
