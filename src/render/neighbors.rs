//! How much of a neighbourhood a particle has.

use std::ops::Range;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use swell_domain::lanes::{LANES, widely};

/// Distances, in spacings, over which a neighbour stops counting: half of it is left at two.
const NEAR: [f32; 2] = [1.5, 2.5];
/// Weight beyond which no more neighbours are looked for.
const ENOUGH: f32 = 32.0;

/// 0 up to `low`, 1 from `high` on, and steadily between.
pub(super) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// What neighbours of each particle weigh in all, at most [`ENOUGH`].
pub(super) fn weights(positions: &[[f32; 3]], spacing: f32) -> Vec<f32> {
    let span = NEAR.map(|part| part * spacing);
    let reach = span[1];
    let cell = |p: &[f32; 3]| p.map(|x| (x / reach).floor() as i32);
    // Sorted by cell, with z the fastest: three cells of a column are one contiguous run.
    let mut order: Vec<([i32; 3], u32)> = positions
        .par_iter()
        .zip(0u32..positions.len() as u32)
        .map(|(position, index)| (cell(position), index))
        .collect();
    order.par_sort_unstable();
    let sorted = [0, 1, 2].map(|axis| {
        let of = |&(_, index): &([i32; 3], u32)| positions[index as usize][axis];
        order.par_iter().map(of).collect::<Vec<f32>>()
    });
    // A cell's particles have the same others about them.
    let found: Vec<f32> = order
        .par_chunk_by(|a, b| a.0 == b.0)
        .flat_map_iter(|own| {
            let about = About::cell(own[0].0, &order, &sorted);
            let of = |&(_, index): &([i32; 3], u32)| {
                let place = positions[index as usize];
                widely(Weigh {
                    about: &about,
                    place,
                    span,
                })
            };
            own.iter().map(of).collect::<Vec<f32>>()
        })
        .collect();
    let mut weights = vec![0.0; positions.len()];
    for ((_, index), weight) in order.iter().zip(found) {
        weights[*index as usize] = weight;
    }
    weights
}

/// Lanes after which it is asked whether that is enough: about as many as water at rest has about a cell.
const OFTEN: usize = 64;

/// Places of a cell and about it, an axis each, filled up to whole lanes with some that weigh nothing.
struct About([Vec<f32>; 3]);

impl About {
    /// Of a cell and the 26 about it; `sorted` are in the order of cells.
    fn cell(cell: [i32; 3], order: &[([i32; 3], u32)], sorted: &[Vec<f32>; 3]) -> Self {
        let columns = columns(order, cell);
        let count = columns.iter().map(Range::len).sum::<usize>();
        let whole = count.next_multiple_of(LANES);
        Self(sorted.each_ref().map(|of| {
            let mut about = Vec::with_capacity(whole);
            for run in &columns {
                about.extend_from_slice(&of[run.clone()]);
            }
            about.resize(whole, f32::INFINITY);
            about
        }))
    }
}

/// What those about a place weigh: 1 up to the first distance of the span, and nothing from the second on.
struct Weigh<'a> {
    about: &'a About,
    place: [f32; 3],
    span: [f32; 2],
}

impl WithSimd for Weigh<'_> {
    type Output = f32;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f32 {
        let ([px, py, pz], [near, reach]) = (self.place, self.span);
        let scale = 1.0 / (reach - near);
        let mut sums = [0.0; LANES];
        let weight = |sums: &[f32; LANES]| {
            // It is no neighbour of its own.
            (sums.iter().sum::<f32>() - 1.0).min(ENOUGH)
        };
        let [xs, ys, zs] = (self.about.0)
            .each_ref()
            .map(|of| of.as_chunks::<LANES>().0);
        for (k, ((x, y), z)) in xs.iter().zip(ys).zip(zs).enumerate() {
            for lane in 0..LANES {
                let d = [px - x[lane], py - y[lane], pz - z[lane]];
                let square: f32 = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
                let t = ((square.sqrt() - near) * scale).clamp(0.0, 1.0);
                sums[lane] += 1.0 - t * t * (3.0 - 2.0 * t);
            }
            // Among a clump of particles each would look at all of them.
            if k % OFTEN == OFTEN - 1 && weight(&sums) >= ENOUGH {
                return ENOUGH;
            }
        }
        weight(&sums)
    }
}

/// Where in `order` the particles of the nine columns of three cells about a cell stand.
fn columns(order: &[([i32; 3], u32)], [x, y, z]: [i32; 3]) -> [Range<usize>; 9] {
    std::array::from_fn(|k| {
        let [x, y] = [x - 1 + k as i32 / 3, y - 1 + k as i32 % 3];
        let from = |z: i32| order.partition_point(|&(key, _)| key < [x, y, z]);
        from(z - 1)..from(z + 2)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random() -> impl FnMut() -> f32 {
        let mut seed = 7u32;
        move || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / 16_777_216.0 * 2.0 - 1.0
        }
    }

    #[test]
    fn weights_agree_with_every_pair() {
        let mut random = random();
        let places: Vec<[f32; 3]> = (0..300).map(|_| [random(), random(), random()]).collect();
        let found = weights(&places, 0.2);
        let mut least = f64::INFINITY;
        for (p, weight) in places.iter().zip(found) {
            let others = places.iter().filter(|q| *q != p);
            let all: f64 = others
                .map(|q| {
                    let square: f64 = (0..3).map(|i| f64::from(p[i] - q[i]).powi(2)).sum();
                    let t = ((square.sqrt() / 0.2 - 1.5) / 1.0).clamp(0.0, 1.0);
                    1.0 - t * t * (3.0 - 2.0 * t)
                })
                .sum();
            // A dozen terms of f32.
            assert!(
                (f64::from(weight) - all.min(32.0)).abs() < 1e-4,
                "{weight} {all}"
            );
            least = least.min(all);
        }
        assert!(least < 32.0, "none was counted to its end");
    }

    /// Of a clump no particle looks at all the others: with as many in one place as would take hours otherwise.
    #[test]
    fn a_clump_is_heavy_and_soon_weighed() {
        let clump = vec![[0.5f32; 3]; 400_000];
        assert!(weights(&clump, 0.1).iter().all(|&weight| weight == ENOUGH));
        // The control: a few in one place are told apart from enough.
        assert_eq!(weights(&clump[..20], 0.1), [19.0; 20]);
    }

    /// A lattice's bulk and half space weigh what their neighbours within two spacings are, 32 and 20, to a tenth.
    #[test]
    fn weights_are_numbers_of_neighbours() {
        let lattice: Vec<[f32; 3]> = (0..1000)
            .map(|i| [i % 10, i / 10 % 10, i / 100].map(|x| x as f32 * 0.1))
            .collect();
        let found = weights(&lattice, 0.1);
        // In the middle, and in the middle of a face.
        let (bulk, surface) = (found[555], found[55]);
        assert!((28.8..=32.0).contains(&bulk), "{bulk}");
        assert!((18.0..=22.0).contains(&surface), "{surface}");
    }
}
