//! Drops and bubbles at one instant as a sparse grid of optical density for ray marching: bricks of
//! 8³ voxels where there are any.
//!
//! The optical cross-section of a drop is spread over the nodes around it by a kernel. The weights
//! are normalised on these same nodes, so that the grid's total equals that of the drops wherever
//! they lie between nodes. The result depends only on the drops: the order of summation does not
//! change with the number of threads.

use std::ops::Range;

use glam::DVec3;
use half::f16;
use rayon::prelude::*;
use swell_domain::parallel;

/// Voxels along the edge of a brick.
pub(crate) const EDGE: u32 = 8;
/// Nodes along the edge of a brick; those on its far side belong to the next brick as well.
pub(crate) const NODES: u32 = EDGE + 1;
/// Values of a brick: one per node.
pub(crate) const VALUES: usize = (NODES * NODES * NODES) as usize;
/// Table entry of a brick without drops; occupied bricks are numbered from 1.
pub(crate) const EMPTY: u32 = 0;
/// Flags of a table entry: the brick holds drops, the brick holds bubbles.
pub(crate) const HAS: [u32; 2] = [1 << 30, 1 << 31];

/// Smallest kernel radius, voxels: each drop reaches nodes on all sides.
const LEAST_REACH: f64 = 1.5;
/// Kernel radius over ball radius at which both have the same mean square distance: √(3/5 / (1/3)).
const OF_BALL: f64 = 1.341_640_786_499_874;

/// A cloud of drops or of bubbles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Drop {
    /// Position, metres.
    pub(crate) place: DVec3,
    /// Radius of the ball that the cloud fills, metres.
    pub(crate) radius: f64,
    /// Optical cross-section, m²: extinction times volume.
    pub(crate) area: f64,
    /// Whether this is a bubble in the water rather than a drop in the air.
    pub(crate) is_bubble: bool,
}

/// Optical density of drops and of bubbles over the box that holds them.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Cloud {
    /// Least corner, metres: a multiple of a brick's edge.
    pub(crate) corner: DVec3,
    /// Edge length of a voxel, metres.
    pub(crate) voxel: f64,
    /// Bricks along each axis; a single empty one if there are no drops.
    pub(crate) bricks: [u32; 3],
    /// Entry of each brick, x fastest: [`EMPTY`], or the 1-based index of its block in `values`,
    /// combined with the flags of [`HAS`].
    pub(crate) table: Vec<u32>,
    /// [`VALUES`] for each occupied brick, in 1/m: drops in the lower 16 bits and bubbles in the
    /// upper ones, both in half precision. Node (i, j, k) is element i + 9 j + 81 k.
    pub(crate) values: Vec<u32>,
}

/// The nodes that a drop reaches, counted from the grid's corner, and the factor of its kernel.
struct Spread {
    /// Centre in voxels from the grid's corner.
    at: DVec3,
    /// Kernel radius, voxels.
    reach: f64,
    /// First nodes, and one past the last.
    low: [u32; 3],
    end: [u32; 3],
    factor: f64,
    is_bubble: bool,
}

impl Spread {
    fn new(drop: &Drop, corner: DVec3, voxel: f64) -> Self {
        let at = (drop.place - corner) / voxel;
        let reach = (OF_BALL * drop.radius / voxel).max(LEAST_REACH);
        let low = (at - reach).ceil().max(DVec3::ZERO).to_array();
        let end = ((at + reach).floor() + 1.0).to_array();
        let mut spread = Self {
            at,
            reach,
            low: low.map(|c| c as u32),
            end: end.map(|c| c as u32),
            factor: 1.0,
            is_bubble: drop.is_bubble,
        };
        let mut sum = 0.0;
        let [xs, ys, zs] = spread.nodes();
        for z in zs {
            for y in ys.clone() {
                sum += xs.clone().map(|x| spread.weight([x, y, z])).sum::<f64>();
            }
        }
        spread.factor = drop.area / (sum * voxel.powi(3));
        spread
    }

    fn nodes(&self) -> [Range<u32>; 3] {
        [0, 1, 2].map(|axis| self.low[axis]..self.end[axis])
    }

    /// Kernel weight at a node: (1 − q²)², so that density and slope vanish at the edge.
    fn weight(&self, node: [u32; 3]) -> f64 {
        let from = (DVec3::from_array(node.map(f64::from)) - self.at) / self.reach;
        let s = (1.0 - from.length_squared()).max(0.0);
        self.factor * s * s
    }

    /// Bricks that hold nodes within reach.
    fn bricks(&self) -> [Range<u32>; 3] {
        [0, 1, 2].map(|axis| {
            let first = self.low[axis].saturating_sub(EDGE).div_ceil(EDGE);
            first..(self.end[axis] - 1) / EDGE + 1
        })
    }
}

impl Cloud {
    /// Builds the grid of `drops`, whose positions are in metres from the least corner of a domain
    /// of `size`, with voxels of `voxel` metres. Drops that have flown farther from the domain than
    /// the domain's own size are left out.
    pub(crate) fn new(drops: &[Drop], size: DVec3, voxel: f64) -> Self {
        let is_near = |drop: &&Drop| {
            drop.area > 0.0 && drop.place.cmpgt(-size).all() && drop.place.cmplt(2.0 * size).all()
        };
        let near: Vec<Drop> = drops.iter().filter(is_near).copied().collect();
        let edge = voxel * f64::from(EDGE);
        let reach = |drop: &Drop| DVec3::splat((OF_BALL * drop.radius).max(LEAST_REACH * voxel));
        let low = near
            .iter()
            .fold(DVec3::INFINITY, |low, it| low.min(it.place - reach(it)));
        let high = near.iter().fold(DVec3::NEG_INFINITY, |high, it| {
            high.max(it.place + reach(it))
        });
        if near.is_empty() {
            return Self {
                corner: DVec3::ZERO,
                voxel,
                bricks: [1; 3],
                table: vec![EMPTY],
                values: Vec::new(),
            };
        }
        let corner = (low / edge).floor() * edge;
        let bricks = (high - corner) / edge;
        let bricks = bricks.to_array().map(|n| n.floor() as u32 + 1);
        let spreads: Vec<Spread> =
            parallel::map_slice(&near, |drop| Spread::new(drop, corner, voxel));
        let mut cloud = Self {
            corner,
            voxel,
            bricks,
            table: vec![EMPTY; bricks.iter().map(|&n| n as usize).product()],
            values: Vec::new(),
        };
        cloud.fill(&spreads);
        cloud
    }

    fn fill(&mut self, spreads: &[Spread]) {
        let [nx, ny, nz] = self.bricks;
        let mut pairs: Vec<(u32, u32)> = parallel::flat_map(0..spreads.len(), |k| {
            let (spread, index) = (&spreads[k], k as u32);
            let [xs, ys, zs] = spread.bricks();
            let row = move |y: u32, z: u32| (z.min(nz - 1) * ny + y.min(ny - 1)) * nx;
            zs.flat_map(move |z| {
                let xs = xs.clone();
                ys.clone()
                    .flat_map(move |y| xs.clone().map(move |x| (row(y, z) + x.min(nx - 1), index)))
            })
        });
        pairs.par_sort_unstable();
        pairs.dedup();
        let groups: Vec<&[(u32, u32)]> = pairs.chunk_by(|a, b| a.0 == b.0).collect();
        let filled: Vec<Vec<u32>> =
            parallel::map_slice(&groups, |group| self.brick(group, spreads));
        for (group, values) in groups.iter().zip(filled) {
            self.values.extend(values);
            let slot = (self.values.len() / VALUES) as u32;
            let kinds = group
                .iter()
                .map(|&(_, of)| usize::from(spreads[of as usize].is_bubble));
            let has = kinds.fold(0, |bits, kind| bits | HAS[kind]);
            self.table[group[0].0 as usize] = slot | has;
        }
    }

    /// Values of the brick that a group of pairs names.
    fn brick(&self, group: &[(u32, u32)], spreads: &[Spread]) -> Vec<u32> {
        let [nx, ny, _] = self.bricks;
        let index = group[0].0;
        let first = [index % nx, index / nx % ny, index / nx / ny].map(|c| c * EDGE);
        let mut sums = vec![[0.0f32; 2]; VALUES];
        for &(_, of) in group {
            let spread = &spreads[of as usize];
            let [xs, ys, zs] = [0, 1, 2].map(|axis| {
                let low = spread.low[axis].max(first[axis]);
                low..spread.end[axis].min(first[axis] + NODES)
            });
            for z in zs {
                for y in ys.clone() {
                    let row = ((z - first[2]) * NODES + y - first[1]) * NODES;
                    for x in xs.clone() {
                        let weight = spread.weight([x, y, z]) as f32;
                        sums[(row + x - first[0]) as usize][usize::from(spread.is_bubble)] +=
                            weight;
                    }
                }
            }
        }
        let bits = |x: f32| u32::from(f16::from_f32(x).to_bits());
        sums.iter()
            .map(|[a, b]| bits(*a) | bits(*b) << 16)
            .collect()
    }

    /// Returns the extent of the grid, metres.
    pub(crate) fn size(&self) -> DVec3 {
        DVec3::from_array(self.bricks.map(f64::from)) * (self.voxel * f64::from(EDGE))
    }

    /// Returns the densities of drops and of bubbles at `p`, 1/m: trilinear between nodes, zero
    /// beyond the grid.
    pub(crate) fn densities(&self, p: DVec3) -> [f64; 2] {
        let at = (p - self.corner) / self.voxel;
        let end = DVec3::from_array(self.bricks.map(|n| f64::from(n * EDGE)));
        if !(at.cmpge(DVec3::ZERO).all() && at.cmplt(end).all()) {
            return [0.0; 2];
        }
        let [x, y, z] = (at / f64::from(EDGE)).to_array().map(|c| c as usize);
        let [nx, ny] = [self.bricks[0] as usize, self.bricks[1] as usize];
        let slot = self.table[(z * ny + y) * nx + x] & !(HAS[0] | HAS[1]);
        if slot == EMPTY {
            return [0.0; 2];
        }
        let values = &self.values[(slot - 1) as usize * VALUES..][..VALUES];
        let local = at - DVec3::new(x as f64, y as f64, z as f64) * f64::from(EDGE);
        let low = local.floor();
        let part = local - low;
        let [x, y, z] = low.to_array().map(|c| c as usize);
        let nodes = NODES as usize;
        let mut sums = [0.0; 2];
        for corner in 0..8usize {
            let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
            let weigh = |bit: usize, part: f64| if bit == 1 { part } else { 1.0 - part };
            let weight = weigh(i, part.x) * weigh(j, part.y) * weigh(k, part.z);
            let word = values[(x + i) + nodes * ((y + j) + nodes * (z + k))];
            for (sum, bits) in sums.iter_mut().zip([word as u16, (word >> 16) as u16]) {
                *sum += weight * f64::from(f16::from_bits(bits).to_f32());
            }
        }
        sums
    }
}

#[cfg(test)]
mod tests;
