//! Position of the water's front along an axis, and run-up height.

use std::ops::Range;

use super::SUPPORT;
use crate::particles::Particles;

/// Returns the coordinate along `axis` (0, 1, 2 for x, y, z) behind which the fraction `quantile`
/// of the water lies, metres; `None` without water. For `sign` 1 the rest lies at larger
/// coordinates, for −1 at smaller ones.
///
/// Each particle counts as a slab one `spacing` wide around its centre, so that the front of a
/// block from 0 to L is `quantile` · L, and its end for a quantile of 1. A quantile below 1
/// excludes spray, however far it flies, without a threshold of depth, which would miss a thin
/// tongue on a dry floor.
pub fn front(
    particles: &Particles,
    spacing: f64,
    axis: usize,
    sign: f64,
    quantile: f64,
) -> Option<f64> {
    let places = particles.position.iter();
    let mut ends: Vec<f64> = places
        .map(|x| sign * f64::from(x[axis]) + 0.5 * spacing)
        .collect();
    ends.sort_by(|a, b| b.total_cmp(a));
    let ahead = (1.0 - quantile) * ends.len() as f64;
    let mut at = *ends.first()?;
    // Slabs entered and slabs left, from the foremost back, and the water ahead of `at` that
    // they hold.
    let (mut begun, mut over, mut passed) = (0, 0, 0.0);
    while over < ends.len() {
        let next = ends[over] - spacing;
        let next = ends.get(begun).map_or(next, |&begin| begin.max(next));
        let rate = (begun - over) as f64 / spacing;
        let gain = rate * (at - next);
        if passed + gain >= ahead {
            let back = if rate > 0.0 {
                (ahead - passed) / rate
            } else {
                0.0
            };
            return Some(sign * (at - back));
        }
        (at, passed) = (next, passed + gain);
        if ends.get(begun) == Some(&next) {
            begun += 1;
        } else {
            over += 1;
        }
    }
    Some(sign * at)
}

/// Returns the height of the highest water that is connected to the main body, metres above the
/// world's y = 0: [`front`] upward over the particles of that body. `None` without water.
///
/// The body is the largest set of particles in which each is nearer than two spacings to another:
/// as for [`elevation`](super::elevation), water counts as continuous across such gaps. Detached
/// drops do not count, so a quantile of 1 is useful here.
pub fn run_up(particles: &Particles, spacing: f64, quantile: f64) -> Option<f64> {
    let body = Particles {
        position: body(&particles.position, SUPPORT * spacing),
        ..Particles::default()
    };
    front(&body, spacing, 1, 1.0, quantile)
}

/// Returns the height that the highest water connected to the main body reaches over half of a
/// flume's width, metres above the world's y = 0: the median over rows of particles side by side
/// from `sides[0]` to `sides[1]` along z. `None` without water. The highest particle alone, as in
/// [`run_up`] with a quantile of 1, is up to a spacing higher than the water, by chance.
pub fn run_up_across(particles: &Particles, spacing: f64, sides: [f64; 2]) -> Option<f64> {
    let body = body(&particles.position, SUPPORT * spacing);
    let rows = ((sides[1] - sides[0]) / spacing).round().max(1.0);
    let mut tops = vec![f64::NEG_INFINITY; rows as usize];
    for [_, y, z] in body.iter().map(|x| x.map(f64::from)) {
        let across = (z - sides[0]) / (sides[1] - sides[0]);
        let row = (across * rows).clamp(0.0, rows - 1.0) as usize;
        tops[row] = tops[row].max(y + 0.5 * spacing);
    }
    tops.sort_by(f64::total_cmp);
    let found = 0.5 * (tops[(tops.len() - 1) / 2] + tops[tops.len() / 2]);
    found.is_finite().then_some(found)
}

/// Positions of the largest set connected by links shorter than `reach`; of equal sets, the one
/// with the first particle.
fn body(places: &[[f32; 3]], reach: f64) -> Vec<[f32; 3]> {
    let cell_of = |x: &[f32; 3]| x.map(|x| (f64::from(x) / reach).floor() as i64);
    let mut order: Vec<([i64; 3], u32)> = (places.iter().map(cell_of)).zip(0..).collect();
    order.sort_unstable();
    let cells: Vec<_> = order.chunk_by(|a, b| a.0 == b.0).collect();
    let cell_at = |cell: [i64; 3]| {
        let found = cells.binary_search_by_key(&cell, |members| members[0].0);
        found.map_or(&[][..], |k| cells[k])
    };
    let is_near = |a: u32, b: u32| {
        let (a, b) = (places[a as usize], places[b as usize]);
        let square = |k: usize| (f64::from(a[k]) - f64::from(b[k])).powi(2);
        square(0) + square(1) + square(2) < reach * reach
    };
    let mut sets = Sets((0..places.len() as u32).collect());
    for members in &cells {
        let cell = members[0].0;
        for (k, &(_, a)) in members.iter().enumerate() {
            let own = members[k + 1..].iter();
            for &(_, b) in own.filter(|&&(_, b)| is_near(a, b)) {
                sets.join(a, b);
            }
        }
        for side in AFTER {
            let others = cell_at([0, 1, 2].map(|k| cell[k] + AROUND[side / POWERS[k] % 3]));
            for &(_, a) in members.iter() {
                for &(_, b) in others.iter().filter(|&&(_, b)| is_near(a, b)) {
                    sets.join(a, b);
                }
            }
        }
    }
    sets.largest().map(|k| places[k as usize]).collect()
}

/// Half of the 26 cells around a cell, so that each pair of neighbours is visited once.
const AFTER: Range<usize> = 14..27;
const AROUND: [i64; 3] = [-1, 0, 1];
const POWERS: [usize; 3] = [9, 3, 1];

/// Disjoint sets named by their least member: union–find with path halving.
struct Sets(Vec<u32>);

impl Sets {
    fn first(&mut self, mut a: u32) -> u32 {
        while self.0[a as usize] != a {
            let above = self.0[a as usize];
            self.0[a as usize] = self.0[above as usize];
            a = above;
        }
        a
    }

    fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.first(a), self.first(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// Members of the largest set in order; of equal sets, the one with the least member.
    fn largest(mut self) -> impl Iterator<Item = u32> {
        let all: Vec<u32> = (0..self.0.len() as u32).map(|a| self.first(a)).collect();
        let mut sizes = vec![0usize; all.len()];
        all.iter().for_each(|&first| sizes[first as usize] += 1);
        // `max_by_key` returns the last of equal elements, so iterate backwards.
        let largest = (0..sizes.len()).rev().max_by_key(|&first| sizes[first]);
        let members = (0..).zip(all);
        members.filter_map(move |(a, first)| (Some(first as usize) == largest).then_some(a))
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::tests::block;
    use super::*;

    /// The fraction of a block from 0.02 to 1.22 along x behind its front is the quantile, to the
    /// rounding of f32 positions, from either side and both within a slab and between two.
    #[test]
    fn the_front_of_a_block_is_where_its_quantile_ends() {
        let particles = block([12, 3, 4], DVec3::new(0.02, 0.0, 0.0));
        for quantile in [1.0, 0.995, 0.9, 0.5, 0.37, 0.01] {
            let ahead = front(&particles, 0.1, 0, 1.0, quantile).unwrap();
            assert!(
                (ahead - (0.02 + 1.2 * quantile)).abs() < 1e-6,
                "{quantile}: {ahead}"
            );
            let behind = front(&particles, 0.1, 0, -1.0, quantile).unwrap();
            assert!(
                (behind - (1.22 - 1.2 * quantile)).abs() < 1e-6,
                "{quantile}: {behind}"
            );
        }
        let up = front(&particles, 0.1, 1, 1.0, 1.0).unwrap();
        assert!((up - 0.3).abs() < 1e-6, "{up}");
        assert_eq!(front(&Particles::default(), 0.1, 0, 1.0, 0.995), None);
    }

    /// A wedge whose particle density is proportional to x: the fraction behind x is (x / L)².
    #[test]
    fn the_front_of_a_wedge_is_the_root_of_its_quantile() {
        let mut particles = Particles::default();
        for column in 0..100usize {
            for _ in 0..=2 * column {
                particles
                    .position
                    .push([0.01 * (column as f32 + 0.5), 0.0, 0.0]);
            }
        }
        for quantile in [0.25f64, 0.64, 0.9801] {
            let found = front(&particles, 0.01, 0, 1.0, quantile).unwrap();
            assert!(
                (found - quantile.sqrt()).abs() < 1e-6,
                "{quantile}: {found}"
            );
        }
    }

    /// One drop in 1000 far ahead: with a quantile of 1 the front is the drop's, with 99.5 % it is
    /// the block's to half of a per cent of its length.
    #[test]
    fn a_drop_ahead_is_no_front() {
        let mut particles = block([10, 10, 10], DVec3::ZERO);
        particles.position.push([9.0, 0.5, 0.5]);
        assert!((front(&particles, 0.1, 0, 1.0, 1.0).unwrap() - 9.05).abs() < 1e-6);
        let found = front(&particles, 0.1, 0, 1.0, 0.995).unwrap();
        assert!((0.995..1.0).contains(&found), "{found}");
    }

    /// On a block 12 particles wide, a further particle in each of 5 rows does not count, in 6 it
    /// counts by half, and in 7 in full. Control: the highest particle counts in all cases.
    #[test]
    fn a_run_up_across_takes_no_single_particles() {
        for (more, found) in [(0, 0.3), (5, 0.3), (6, 0.35), (7, 0.4), (12, 0.4)] {
            let mut particles = block([3, 3, 12], DVec3::ZERO);
            for k in 0..more {
                particles.position.push([0.05, 0.35, 0.05 + 0.1 * k as f32]);
            }
            let across = run_up_across(&particles, 0.1, [0.0, 1.2]).unwrap();
            assert!((across - found).abs() < 1e-6, "{more}: {across}");
            let highest = run_up(&particles, 0.1, 1.0).unwrap();
            assert!(more == 0 || (highest - 0.4).abs() < 1e-6, "{highest}");
        }
        assert_eq!(run_up_across(&Particles::default(), 0.1, [0.0, 1.2]), None);
    }

    /// A column at a wall connected to the block by a film sets the run-up; a higher drop does not,
    /// unless the gap to it is narrower than two spacings.
    #[test]
    fn the_run_up_hangs_together_with_the_body() {
        let mut particles = block([12, 4, 6], DVec3::ZERO);
        for k in 0..6 {
            // Each one 1.5 spacings above the one below.
            particles
                .position
                .push([0.05, 0.35 + 0.15 * (k as f32 + 1.0), 0.25]);
        }
        let film = 0.35 + 0.15 * 6.0 + 0.05;
        let found = run_up(&particles, 0.1, 1.0).unwrap();
        assert!((found - film).abs() < 1e-6, "{found}");
        for (gap, top) in [(0.201, film), (0.199, film + 0.199)] {
            let mut with_drop = particles.clone();
            with_drop
                .position
                .push([0.05, (film - 0.05 + gap) as f32, 0.25]);
            let found = run_up(&with_drop, 0.1, 1.0).unwrap();
            assert!((found - top).abs() < 1e-6, "{gap}: {found} {top}");
        }
        // The quantile applies to the body: half of a block 0.4 high lies below its middle.
        let half = run_up(&block([12, 4, 6], DVec3::ZERO), 0.1, 0.5).unwrap();
        assert!((half - 0.2).abs() < 1e-6, "{half}");
        assert_eq!(run_up(&Particles::default(), 0.1, 1.0), None);
    }

    /// Compares with the sets found by testing each pair, for points scattered at twice a
    /// lattice's spacing.
    #[test]
    fn the_body_is_that_of_all_pairs() {
        let hash =
            |k: u32| f64::from(k.wrapping_mul(2_654_435_761).rotate_left(7) % 10_007) / 10_007.0;
        let places: Vec<[f32; 3]> = (0..400)
            .map(|k| [0, 1, 2].map(|axis| (hash(3 * k + axis) - 0.5) as f32))
            .collect();
        for reach in [0.05, 0.09, 0.11, 0.3] {
            let mut label: Vec<usize> = (0..places.len()).collect();
            let distance = |a: usize, b: usize| {
                let [a, b] = [places[a], places[b]].map(|x| DVec3::from(x.map(f64::from)));
                a.distance(b)
            };
            for a in 0..places.len() {
                for b in 0..a {
                    if distance(a, b) < reach && label[a] != label[b] {
                        let (from, to) = (label[a].max(label[b]), label[a].min(label[b]));
                        label
                            .iter_mut()
                            .filter(|l| **l == from)
                            .for_each(|l| *l = to);
                    }
                }
            }
            let size = |first: usize| label.iter().filter(|&&l| l == first).count();
            let largest = (0..places.len())
                .rev()
                .max_by_key(|&first| size(first))
                .unwrap();
            let expected: Vec<_> = (0..places.len())
                .filter(|&k| label[k] == largest)
                .map(|k| places[k])
                .collect();
            let found = body(&places, reach);
            println!("{} of {} at {reach}", found.len(), places.len());
            assert_eq!(found, expected, "{reach}");
        }
    }
}
