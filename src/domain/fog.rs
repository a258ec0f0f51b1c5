//! Whitewater as fog: a density, and the velocity that smears it while a shutter is open.
//!
//! Both are sums over particles, leaf by leaf: memory follows the voxels with particles, wherever
//! they are. The order of summation depends only on the frame, so that the same frame gives the
//! same bytes on any number of threads.

use std::f64::consts::PI;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    parallel,
    particles::Particles,
    sparse_grid::{EDGE, Leaf, SparseGrid, VOXELS},
    whitewater::RADIUS,
};

/// Voxel grid onto which a frame's whitewater is rasterised.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FogRaster {
    /// World position of the corner where the indices begin, metres.
    pub origin: DVec3,
    /// Edge length of a voxel, metres.
    pub voxel_size: f64,
    /// Time between two frames, seconds.
    pub frame_seconds: f64,
}

/// Grids of one frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Fog {
    /// Volume of the particles' balls per volume, m³/m³. Its sum times a voxel's volume is the
    /// balls' volume.
    pub density: SparseGrid<f32>,
    /// Velocity at the voxels' centres, m/s.
    pub velocity: SparseGrid<[f32; 3]>,
}

/// Largest half-width of a particle, and width of the margin of velocities, voxels.
const MOST: usize = 8;

/// Position up to which voxels are indexed, voxels; particles beyond it are ignored.
const FARTHEST: f64 = 1e9;

impl FogRaster {
    /// Spreads each particle over the voxels whose centres are within its radius along each axis,
    /// or within a voxel where that is more, by tents that are normalised over these voxels: what
    /// the grid holds is what the particles hold. Beyond 8 voxels a radius counts as that.
    ///
    /// A voxel with density has the mean velocity of what is in it, weighted by volume. Around
    /// them velocities continue as far as the fastest particle goes in half a frame, at most
    /// 8 voxels: a renderer that asks where the fog at a point comes from finds it there.
    pub fn fog(&self, white: &Particles) -> Fog {
        let radii = white.attributes.get(RADIUS).map_or(&[][..], Vec::as_slice);
        // Splats are large, so each is computed again where its voxels are.
        let mut pairs: Vec<([i32; 3], u32)> = parallel::flat_map(0..radii.len(), |k| {
            let leaves = self.splat(white, k).map(|splat| splat.leaves());
            leaves
                .into_iter()
                .flatten()
                .map(move |leaf| (leaf, k as u32))
        });
        pairs.par_sort_unstable();
        let runs: Vec<&[([i32; 3], u32)]> = pairs.chunk_by(|a, b| a.0 == b.0).collect();
        let volume = self.voxel_size.powi(3);
        let leaves = parallel::map_slice(&runs, |run| {
            let splats = run
                .iter()
                .filter_map(|pair| self.splat(white, pair.1 as usize));
            sums(run[0].0, splats, volume)
        });
        let mut fog = Fog {
            density: self.empty(0.0),
            velocity: self.empty([0.0; 3]),
        };
        for (density, velocity) in leaves.into_iter().flatten() {
            fog.density.leaves.push(density);
            fog.velocity.leaves.push(velocity);
        }
        let way = 0.5 * self.frame_seconds * white.max_speed() / self.voxel_size;
        for _ in 0..(way.ceil() as usize).clamp(1, MOST) {
            fog.velocity.leaves = grown(&fog.velocity.leaves);
        }
        fog
    }

    fn empty<T>(&self, background: T) -> SparseGrid<T> {
        SparseGrid {
            origin: self.origin,
            voxel_size: self.voxel_size,
            background,
            leaves: Vec::new(),
            inside: Vec::new(),
        }
    }

    /// `None` for a position that is not finite or too far to index.
    fn splat(&self, white: &Particles, k: usize) -> Option<Splat> {
        let radius = f64::from(white.attributes[RADIUS][k]);
        let place = DVec3::from(white.position[k].map(f64::from));
        // In voxels from the centre of the first one.
        let at = (place - self.origin) / self.voxel_size - 0.5;
        if !(at.is_finite() && at.abs().max_element() < FARTHEST) {
            return None;
        }
        let half = (radius / self.voxel_size).clamp(1.0, MOST as f64);
        let first = (at - half).ceil();
        let last = (at + half).floor();
        let mut weights = [[0.0; 2 * MOST + 1]; 3];
        for (axis, weights) in weights.iter_mut().enumerate() {
            for (step, weight) in weights.iter_mut().enumerate() {
                let off = (first[axis] + step as f64 - at[axis]).abs();
                *weight = (1.0 - off / half).max(0.0);
            }
            let sum: f64 = weights.iter().sum();
            weights.iter_mut().for_each(|weight| *weight /= sum);
        }
        Some(Splat {
            first: first.as_ivec3().to_array(),
            last: last.as_ivec3().to_array(),
            weights,
            volume: 4.0 / 3.0 * PI * radius.powi(3),
            velocity: DVec3::from(white.velocity[k].map(f64::from)),
        })
    }
}

/// A particle on its voxels.
struct Splat {
    /// Least and greatest index.
    first: [i32; 3],
    last: [i32; 3],
    /// Weights along each axis, from the least index on; they add up to 1.
    weights: [[f64; 2 * MOST + 1]; 3],
    /// Volume of its ball, m³.
    volume: f64,
    /// m/s.
    velocity: DVec3,
}

impl Splat {
    /// First voxels of the leaves that it touches.
    fn leaves(&self) -> impl Iterator<Item = [i32; 3]> + use<> {
        let range =
            |axis: usize| self.first[axis].div_euclid(EDGE)..=self.last[axis].div_euclid(EDGE);
        let [xs, ys, zs] = [range(0), range(1), range(2)];
        xs.flat_map(move |x| {
            let zs = zs.clone();
            ys.clone()
                .flat_map(move |y| zs.clone().map(move |z| [x, y, z].map(|c| c * EDGE)))
        })
    }

    /// Passes each voxel of a leaf that it touches, as the element, and the volume there, m³.
    fn for_each_in(&self, leaf: [i32; 3], mut visit: impl FnMut(usize, f64)) {
        let range = |axis: usize| {
            let low = self.first[axis].max(leaf[axis]);
            low..=self.last[axis].min(leaf[axis] + EDGE - 1)
        };
        let weight = |axis: usize, at: i32| self.weights[axis][(at - self.first[axis]) as usize];
        for x in range(0) {
            for y in range(1) {
                let row = self.volume * weight(0, x) * weight(1, y);
                let element = ((x - leaf[0]) * 64 + (y - leaf[1]) * 8) as usize;
                for z in range(2) {
                    visit(element + (z - leaf[2]) as usize, row * weight(2, z));
                }
            }
        }
    }
}

/// Density and velocity of a leaf; `None` where nothing has a volume.
fn sums(
    origin: [i32; 3],
    splats: impl Iterator<Item = Splat>,
    voxel_volume: f64,
) -> Option<(Leaf<f32>, Leaf<[f32; 3]>)> {
    let mut volumes = vec![0.0; VOXELS];
    let mut momenta = vec![DVec3::ZERO; VOXELS];
    for splat in splats {
        splat.for_each_in(origin, |element, volume| {
            volumes[element] += volume;
            momenta[element] += volume * splat.velocity;
        });
    }
    let density = |element: usize| (volumes[element] / voxel_volume) as f32;
    let velocity = |element: usize| (momenta[element] / volumes[element]).as_vec3().to_array();
    let density = leaf(origin, |element| {
        Some(density(element)).filter(|it| *it > 0.0)
    })?;
    let velocity = leaf(origin, |element| {
        density.is_active(element).then(|| velocity(element))
    })?;
    Some((density, velocity))
}

/// A leaf of the values that there are; `None` if there are none.
fn leaf<T: Default>(origin: [i32; 3], value: impl Fn(usize) -> Option<T>) -> Option<Leaf<T>> {
    let mut active = [0u64; 8];
    let values = (0..VOXELS).map(|element| {
        let found = value(element);
        active[element / 64] |= u64::from(found.is_some()) << (element % 64);
        found.unwrap_or_default()
    });
    let values = values.collect();
    (active != [0; 8]).then_some(Leaf {
        origin,
        active,
        values,
    })
}

/// The leaves, sorted as before, with the voxels that have an active one behind a side of theirs:
/// these have the mean of those neighbours.
fn grown(leaves: &[Leaf<[f32; 3]>]) -> Vec<Leaf<[f32; 3]>> {
    let sides = (0..3).flat_map(|axis| [-1, 1].map(|step| (axis, step)));
    let beside = |origin: [i32; 3], axis: usize, step: i32| {
        let mut at = origin;
        at[axis] += step * EDGE;
        at
    };
    let mut origins: Vec<[i32; 3]> = leaves.iter().map(|leaf| leaf.origin).collect();
    let around = (leaves.iter()).flat_map(|leaf| {
        sides
            .clone()
            .map(|(axis, step)| beside(leaf.origin, axis, step))
    });
    origins.extend(around);
    origins.par_sort_unstable();
    origins.dedup();
    let find = |origin: [i32; 3]| {
        let found = leaves.binary_search_by_key(&origin, |leaf| leaf.origin);
        found.ok().map(|index| &leaves[index])
    };
    let value = |leaf: Option<&Leaf<[f32; 3]>>, element: usize| {
        leaf.filter(|leaf| leaf.is_active(element))
            .map(|leaf| leaf.values[element])
    };
    parallel::flat_map(0..origins.len(), |index| {
        let origin = origins[index];
        let own = find(origin);
        let near: Vec<_> = sides
            .clone()
            .map(|(axis, step)| (axis, step, find(beside(origin, axis, step))))
            .collect();
        leaf(origin, |element| {
            value(own, element).or_else(|| {
                let known = near.iter().filter_map(|&(axis, step, other)| {
                    let stride = [64, 8, 1][axis];
                    let at = (element / stride % EDGE as usize) as i32 + step;
                    match (0..EDGE).contains(&at) {
                        true => value(
                            own,
                            element.wrapping_add_signed(step as isize * stride as isize),
                        ),
                        false => value(
                            other,
                            element.wrapping_add_signed(-7 * step as isize * stride as isize),
                        ),
                    }
                });
                let (sum, count) = known.fold((DVec3::ZERO, 0.0), |(sum, count), v| {
                    (sum + DVec3::from(v.map(f64::from)), count + 1.0)
                });
                (count > 0.0).then(|| (sum / count).as_vec3().to_array())
            })
        })
    })
}

#[cfg(test)]
#[path = "fog/tests.rs"]
mod tests;
