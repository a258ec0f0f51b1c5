//! Which points of a surface have water near them.

use std::ops::Range;

use glam::{DVec3, Vec3};
use rayon::slice::ParallelSliceMut as _;

use crate::{parallel, period::Period};

/// Water of an instant, by which points are in contact.
#[derive(Debug)]
pub struct Contact {
    /// Contact distance, metres, which is also the edge of the cells.
    distance: f64,
    /// Least corner of the box.
    corner: DVec3,
    period: Period,
    /// Particles by cell, relative to the corner, with z the fastest: three cells of a column are
    /// one contiguous run.
    sorted: Vec<([i32; 3], DVec3)>,
}

impl Contact {
    /// Sorts particles of a box with its least corner at `corner`, metres.
    pub fn with(particles: &[[f32; 3]], corner: DVec3, distance: f64, period: Period) -> Self {
        let mut sorted = parallel::map_slice(particles, |particle| {
            let position = wide(particle) - corner;
            (cell(position, distance), position)
        });
        // Particles of one cell in any order: contact asks whether there is one.
        sorted.par_sort_unstable_by_key(|(cell, _)| *cell);
        Self {
            distance,
            corner,
            period,
            sorted,
        }
    }

    /// Returns for each point, in the particles' coordinates, whether a particle is within the
    /// contact distance.
    pub fn of(&self, points: &[[f32; 3]]) -> Vec<bool> {
        parallel::map_slice(points, |point| self.is_near(wide(point) - self.corner))
    }

    fn is_near(&self, point: DVec3) -> bool {
        images(point, self.distance, self.period).any(|point| self.finds(point))
    }

    fn finds(&self, point: DVec3) -> bool {
        let [x, y, z] = cell(point, self.distance);
        (0..9).any(|column| {
            let [x, y] = [x - 1 + column / 3, y - 1 + column % 3];
            let run = self.run([x, y, z - 1], [x, y, z + 1]);
            let mut found = self.sorted[run].iter();
            found.any(|(_, particle)| {
                particle.distance_squared(point) <= self.distance * self.distance
            })
        })
    }

    /// Particles from one cell to another of a column.
    fn run(&self, first: [i32; 3], last: [i32; 3]) -> Range<usize> {
        let start = self.sorted.partition_point(|(cell, _)| *cell < first);
        let rest = &self.sorted[start..];
        start..start + rest.partition_point(|(cell, _)| *cell <= last)
    }
}

fn wide(point: &[f32; 3]) -> DVec3 {
    Vec3::from(*point).as_dvec3()
}

fn cell(position: DVec3, edge: f64) -> [i32; 3] {
    (position / edge).floor().as_ivec3().to_array()
}

/// A point in the box and its periodic images within `reach` of the box.
fn images(point: DVec3, reach: f64, period: Period) -> impl Iterator<Item = DVec3> {
    let point = period.wrap(point);
    let shifts = [0, 1, 2].map(|axis| {
        let (x, length) = (point[axis], period.0[axis]);
        let joined = length > 0.0;
        [
            Some(0.0),
            (joined && x < reach).then_some(length),
            (joined && x > length - reach).then_some(-length),
        ]
    });
    let [xs, ys, zs] = shifts.map(|shifts| shifts.into_iter().flatten());
    xs.flat_map(move |x| {
        let zs = zs.clone();
        ys.clone().flat_map(move |y| {
            let zs = zs.clone();
            zs.map(move |z| point + DVec3::new(x, y, z))
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random() -> impl FnMut() -> f64 {
        let mut seed = 11u32;
        move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(seed >> 8) / 16_777_216.0
        }
    }

    fn cloud(count: usize, random: &mut impl FnMut() -> f64) -> Vec<[f32; 3]> {
        (0..count)
            .map(|_| [random(), random(), random()].map(|x| x as f32))
            .collect()
    }

    /// Against every pair, also across the joint of a periodic box.
    #[test]
    fn contact_agrees_with_every_pair() {
        let mut random = random();
        let water = cloud(200, &mut random);
        let points: Vec<[f32; 3]> = (cloud(400, &mut random).iter())
            .map(|p| p.map(|x| 1.4 * x - 0.2))
            .collect();
        let corner = DVec3::new(-0.01, 0.0, 0.0);
        let mut found = Vec::new();
        for period in [DVec3::ZERO, DVec3::new(1.02, 0.0, 1.0)].map(Period) {
            let contact = Contact::with(&water, corner, 0.12, period);
            let near = |point: &[f32; 3]| {
                let apart = |q: &[f32; 3]| period.shortest(wide(point) - wide(q)).length();
                water.iter().any(|q| apart(q) <= 0.12)
            };
            let expected: Vec<bool> = points.iter().map(near).collect();
            assert_eq!(contact.of(&points), expected);
            found.push(expected.iter().filter(|it| **it).count());
        }
        // Controls: neither all nor none, and the joint brings more.
        assert!(
            found[0] > 50 && found[0] < found[1] && found[1] < 350,
            "{found:?}"
        );
    }

    /// A wall beside a lattice of water: contact up to the level, none above it, whatever the
    /// lattice's phase along the wall.
    #[test]
    fn a_wall_is_wet_where_water_lies_against_it() {
        let spacing = 0.1;
        for phase in [0.0, 0.03, 0.05, 0.09] {
            let half = |k: i32| (f64::from(k) + 0.5) * spacing;
            let lattice: Vec<[f32; 3]> = (0..1000)
                .map(|k| {
                    let [x, y, z] = [k % 10, k / 10 % 10, k / 100].map(half);
                    [x, y, z + phase].map(|x| x as f32)
                })
                .collect();
            let distance = super::super::CONTACT * spacing;
            let contact = Contact::with(&lattice, DVec3::ZERO, distance, Period::default());
            // The highest particles are at 0.95; from there contact reaches √(1 − ½²) spacings at
            // most, and at the worst phase √(1 − ½² − ½²) of them.
            let at = |y: f32| contact.of(&[[0.0, y, 0.52]])[0];
            assert!(at(0.02) && at(0.5) && at(0.95 + 0.07), "{phase}");
            assert!(!at(0.95 + 0.087) && !at(2.0), "{phase}");
            // Behind a wall one spacing thick nothing is wet.
            assert!(!contact.of(&[[-0.1, 0.5, 0.52]])[0]);
        }
    }
}
