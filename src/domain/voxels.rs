//! Particles on the voxels of a sparse grid: the bricks, and the particles of each voxel.

use glam::DVec3;

use super::{
    bricks::{Bricks, CELLS, EDGE, SELF, table_dims},
    parallel,
    particles::Particles,
    sparse_grid::{Leaf, VOXELS},
};

/// Bricks around the particles of one frame, and the particles of each voxel.
///
/// Positions and indices are relative to `base`, the least corner of the first brick.
pub(super) struct Voxels {
    pub(super) bricks: Bricks,
    /// Index of the first voxel of the first brick in the whole grid.
    base: [i32; 3],
    /// Start in `order` of each voxel's particles, for the voxels of the wet slots, followed by
    /// the total.
    starts: Vec<u32>,
    /// Particle indices by voxel, and within a voxel in the order of the frame.
    order: Vec<u32>,
    /// Positions in voxels from `base`, in the order of `order`.
    places: Vec<[f32; 3]>,
}

impl Voxels {
    /// Sorts `particles` into voxels whose indices begin at `origin`, with all bricks within
    /// `reach` voxels of one with particles. Positions that are not finite are ignored. `None` if
    /// no particle is left.
    pub(super) fn new(
        particles: &Particles,
        origin: DVec3,
        voxel_size: f64,
        reach: f64,
    ) -> Option<Self> {
        let place = |p: &[f32; 3]| (DVec3::from_array(p.map(f64::from)) - origin) / voxel_size;
        let is_sound = |p: &DVec3| p.is_finite() && p.abs().max_element() < 1e9;
        let sound = || particles.position.iter().map(place).filter(is_sound);
        let min = sound().reduce(DVec3::min)?;
        let max = sound().reduce(DVec3::max)?;
        let edge = f64::from(EDGE);
        let margin = (reach / edge).ceil();
        let first = (min / edge).floor() - margin;
        let last = (max / edge).floor() + margin;
        let cells = (last - first + 1.0).to_array().map(|n| n as u32 * EDGE);
        let base = first * edge;

        let dims = table_dims(cells).map(|n| n as usize);
        let brick_of = |p: DVec3| {
            let [x, y, z] = ((p - base) / edge).to_array().map(|c| c as usize);
            (z * dims[1] + y) * dims[0] + x
        };
        let mut is_wet = vec![false; dims.iter().product()];
        for p in sound() {
            is_wet[brick_of(p)] = true;
        }
        let bricks = Bricks::new(cells, &is_wet, margin as u32, 1);

        let voxel_of = |p: DVec3| {
            let [x, y, z] = (p - base).to_array().map(|c| c as usize % EDGE as usize);
            (bricks.table[brick_of(p)] as usize - 1) * VOXELS + x + 8 * y + 64 * z
        };
        let mut starts = vec![0; bricks.wet as usize * VOXELS + 1];
        for p in sound() {
            starts[voxel_of(p) + 1] += 1;
        }
        for voxel in 1..starts.len() {
            starts[voxel] += starts[voxel - 1];
        }
        let mut next = starts.clone();
        let mut order = vec![0; particles.len()];
        let mut places = vec![[0.0; 3]; particles.len()];
        for (index, p) in particles.position.iter().map(place).enumerate() {
            if is_sound(&p) {
                let at = &mut next[voxel_of(p)];
                order[*at as usize] = index as u32;
                places[*at as usize] = (p - base).to_array().map(|x| x as f32);
                *at += 1;
            }
        }
        Some(Self {
            bricks,
            base: base.to_array().map(|b| b as i32),
            starts,
            order,
            places,
        })
    }

    /// Length of an array with one value per voxel, slot 0 included.
    pub(super) fn len(&self) -> usize {
        self.bricks.slots() * CELLS as usize
    }

    /// All slots, with or without particles.
    pub(super) fn slots(&self) -> std::ops::Range<usize> {
        1..self.bricks.active as usize + 1
    }

    /// First voxel of a slot, relative to `base`.
    pub(super) fn corner(&self, slot: usize) -> [i32; 3] {
        self.bricks.records[slot]
            .coordinate
            .map(|c| (c * EDGE) as i32)
    }

    /// Visits the particles in the slot's voxels and in `margin` (at most 8) voxels around them, in
    /// an order that depends only on the frame: passes the position, in voxels from the slot's
    /// corner, and the index.
    pub(super) fn for_each_near(
        &self,
        slot: usize,
        margin: usize,
        mut visit: impl FnMut([f32; 3], usize),
    ) {
        let corner = self.corner(slot).map(|c| c as f32);
        let neighbors = &self.bricks.records[slot].neighbors;
        // Bricks before, at and behind the slot along an axis, and the range of voxels in each.
        let parts = [(0, 8 - margin..8), (1, 0..8), (2, 0..margin)];
        for (bz, zs) in &parts {
            for (by, ys) in &parts {
                for (bx, xs) in &parts {
                    let slot = neighbors[bx + 3 * by + 9 * bz];
                    if slot == 0 || slot > self.bricks.wet {
                        continue;
                    }
                    for z in zs.clone() {
                        for y in ys.clone() {
                            let row = (slot as usize - 1) * VOXELS + 8 * y + 64 * z;
                            let first = self.starts[row + xs.start] as usize;
                            let last = self.starts[row + xs.end] as usize;
                            for k in first..last {
                                let p = self.places[k];
                                let from_corner =
                                    std::array::from_fn(|axis| p[axis] - corner[axis]);
                                visit(from_corner, self.order[k] as usize);
                            }
                        }
                    }
                }
            }
        }
    }

    /// Element of a voxel's neighbour along `axis`, at a step of ±1; an element of slot 0 if there
    /// is no brick.
    pub(super) fn neighbor(&self, slot: usize, local: usize, axis: usize, step: i32) -> usize {
        let stride = 1 << (3 * axis);
        let at = (local / stride % 8) as i32 + step;
        if (0..8).contains(&at) {
            return slot * CELLS as usize
                + local.wrapping_add_signed(step as isize * stride as isize);
        }
        let brick = SELF.wrapping_add_signed(step as isize * [1, 3, 9][axis]);
        let wrapped = local.wrapping_add_signed(-7 * step as isize * stride as isize);
        self.bricks.records[slot].neighbors[brick] as usize * CELLS as usize + wrapped
    }

    /// Fills one value per voxel, brick by brick in parallel; slot 0 is left unchanged.
    pub(super) fn for_each_brick<T: Send>(
        &self,
        values: &mut [T],
        fill: impl Fn(usize, &mut [T]) + Sync,
    ) {
        parallel::for_chunks_mut(values, CELLS as usize, |slot, values| {
            if slot > 0 {
                fill(slot, values);
            }
        });
    }

    /// Builds the slot's leaf. `value` returns an element's value and whether it is active; `None`
    /// if no element is.
    pub(super) fn leaf<T>(
        &self,
        slot: usize,
        value: impl Fn(usize) -> (T, bool),
    ) -> Option<Leaf<T>> {
        let mut active = [0u64; 8];
        let values = (0..VOXELS)
            .map(|element| {
                let [x, y, z] = [element / 64, element / 8 % 8, element % 8];
                let (value, is_active) = value(slot * VOXELS + x + 8 * y + 64 * z);
                active[element / 64] |= u64::from(is_active) << (element % 64);
                value
            })
            .collect();
        (active != [0; 8]).then_some(Leaf {
            origin: self.origin(slot),
            active,
            values,
        })
    }

    /// First voxel of a slot in the whole grid.
    pub(super) fn origin(&self, slot: usize) -> [i32; 3] {
        let corner = self.corner(slot);
        std::array::from_fn(|axis| self.base[axis] + corner[axis])
    }
}
