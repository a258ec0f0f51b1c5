//! Weights of particles' neighbourhoods.

use std::ops::Range;

use pulp::{Simd, WithSimd};
use rayon::prelude::*;

use swell_domain::lanes::{LANES, widely};
use swell_domain::parallel;

/// Distances, in spacings, between which a neighbour's weight falls from 1 to 0; it is one half at
/// two.
const NEAR: [f32; 2] = [1.5, 2.5];
/// Largest weight; the search for neighbours stops there.
const ENOUGH: f32 = 32.0;

/// Smooth Hermite step: 0 up to `low`, 1 from `high` on.
pub(super) fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Sum of the weights of each particle's neighbours, at most [`ENOUGH`].
pub(super) fn weights(positions: &[[f32; 3]], spacing: f32) -> Vec<f32> {
    let span = NEAR.map(|part| part * spacing);
    let reach = span[1];
    let cell = |p: &[f32; 3]| p.map(|x| (x / reach).floor() as i32);
    // Sorted by cell, with z the fastest: three cells of a column are one contiguous run.
    let mut order: Vec<([i32; 3], u32)> =
        parallel::map(0..positions.len(), |k| (cell(&positions[k]), k as u32));
    order.par_sort_unstable();
    let sorted = [0, 1, 2].map(|axis| {
        let of = |&(_, index): &([i32; 3], u32)| positions[index as usize][axis];
        parallel::map_slice(&order, of)
    });
    // All particles of a cell share the same candidates.
    let found: Vec<f32> = order
        .par_chunk_by(|a, b| a.0 == b.0)
        .flat_map_iter(|own| {
            let about = PaddedPositions::cell(own[0].0, &order, &sorted);
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

/// Number of SIMD batches between tests for an early end; about as many as hold the particles
/// around a cell of water at rest.
const OFTEN: usize = 64;

/// Positions in and around a cell, one list per axis, padded to whole SIMD lanes with positions of
/// zero weight.
struct PaddedPositions([Vec<f32>; 3]);

impl PaddedPositions {
    /// Gathers the positions of a cell and its 26 neighbours; `sorted` is in the order of cells.
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

/// Sums the weights of candidates around a point: 1 up to the first distance of the span, 0 from
/// the second on.
struct Weigh<'a> {
    about: &'a PaddedPositions,
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
            // Subtracts the particle's own weight.
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
            // In a dense clump, each particle would otherwise visit all others.
            if k % OFTEN == OFTEN - 1 && weight(&sums) >= ENOUGH {
                return ENOUGH;
            }
        }
        weight(&sums)
    }
}

/// Ranges in `order` of the particles of the nine columns, of three cells each, around a cell.
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
            // Sums of about a dozen f32 terms.
            assert!(
                (f64::from(weight) - all.min(32.0)).abs() < 1e-4,
                "{weight} {all}"
            );
            least = least.min(all);
        }
        assert!(least < 32.0, "none was counted to its end");
    }

    /// In a dense clump no particle visits all the others, which would take hours with this many.
    #[test]
    fn a_clump_is_heavy_and_soon_weighed() {
        let clump = vec![[0.5f32; 3]; 400_000];
        assert!(weights(&clump, 0.1).iter().all(|&weight| weight == ENOUGH));
        // Control: fewer than enough at one position are counted exactly.
        assert_eq!(weights(&clump[..20], 0.1), [19.0; 20]);
    }

    /// In a lattice's bulk and half space, weights are within a tenth of the numbers of neighbours
    /// within two spacings, 32 and 20.
    #[test]
    fn weights_are_numbers_of_neighbours() {
        let lattice: Vec<[f32; 3]> = (0..1000)
            .map(|i| [i % 10, i / 10 % 10, i / 100].map(|x| x as f32 * 0.1))
            .collect();
        let found = weights(&lattice, 0.1);
        // Particles in the middle of the bulk and in the middle of a face.
        let (bulk, surface) = (found[555], found[55]);
        assert!((28.8..=32.0).contains(&bulk), "{bulk}");
        assert!((18.0..=22.0).contains(&surface), "{surface}");
    }
}
