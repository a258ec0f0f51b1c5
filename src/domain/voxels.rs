//! Particles on the voxels of a sparse grid: which leaves there are, and who lies in each.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    bricks::{Bricks, CELLS, EDGE, SELF, table_dims},
    particles::Particles,
    sparse_grid::{Leaf, VOXELS},
};

/// Bricks about the particles of one frame, and the particles of each.
///
/// Positions and indices are relative to `base`, which lies at the least corner of the first brick.
pub(super) struct Voxels {
    pub(super) bricks: Bricks,
    /// Index of the first voxel of the first brick, in the whole grid.
    pub(super) base: [i32; 3],
    /// By wet slot − 1: where its particles begin in `order`, and at the end their number.
    starts: Vec<usize>,
    /// Particles by brick, and within it as in the frame.
    order: Vec<u32>,
    /// In voxels from `base`, in the order of `order`.
    places: Vec<[f32; 3]>,
}

impl Voxels {
    /// Sorts `particles` into bricks of voxels whose indices begin at `origin`, with all bricks
    /// that `reach` voxels about a particle's brick touch. Positions that are no numbers are passed
    /// over. `None` where nothing is left.
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

        let mut starts = vec![0; bricks.wet as usize + 1];
        for p in sound() {
            starts[bricks.table[brick_of(p)] as usize] += 1;
        }
        for slot in 1..starts.len() {
            starts[slot] += starts[slot - 1];
        }
        let mut next = starts.clone();
        let mut order = vec![0; starts[bricks.wet as usize]];
        let mut places = vec![[0.0; 3]; order.len()];
        for (index, p) in particles.position.iter().map(place).enumerate() {
            if is_sound(&p) {
                let slot = bricks.table[brick_of(p)] as usize - 1;
                order[next[slot]] = index as u32;
                places[next[slot]] = (p - base).to_array().map(|x| x as f32);
                next[slot] += 1;
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

    /// Elements of an array with one value a voxel, slot 0 included.
    pub(super) fn len(&self) -> usize {
        self.bricks.slots() * CELLS as usize
    }

    /// Slots, whether they hold particles or not.
    pub(super) fn slots(&self) -> std::ops::RangeInclusive<usize> {
        1..=self.bricks.active as usize
    }

    /// First voxel of a slot, from `base`.
    pub(super) fn corner(&self, slot: usize) -> [i32; 3] {
        self.bricks.records[slot]
            .coordinate
            .map(|c| (c * EDGE) as i32)
    }

    /// Places (voxels from `base`) and indices of the particles in the 3³ bricks about `slot`,
    /// in an order that depends on the frame alone.
    pub(super) fn near(&self, slot: usize) -> impl Iterator<Item = (&[f32; 3], u32)> {
        let slots = self.bricks.records[slot].neighbors.iter();
        slots
            .filter(|&&s| s != 0 && s <= self.bricks.wet)
            .flat_map(|&s| {
                let range = self.starts[s as usize - 1]..self.starts[s as usize];
                self.places[range.clone()]
                    .iter()
                    .zip(self.order[range].iter().copied())
            })
    }

    /// Element of the neighbour of a voxel along `axis`, a step of ±1; an element of slot 0 where
    /// there is no brick.
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

    /// Fills one value a voxel, brick by brick in parallel; slot 0 is left as it is.
    pub(super) fn for_each_brick<T: Send>(
        &self,
        values: &mut [T],
        fill: impl Fn(usize, &mut [T]) + Sync,
    ) {
        values
            .par_chunks_mut(CELLS as usize)
            .enumerate()
            .skip(1)
            .for_each(|(slot, values)| fill(slot, values));
    }

    /// The slot's leaf, where `value` gives for an element the value and whether it is active;
    /// `None` where none is.
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
