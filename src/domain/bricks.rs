//! Sparse grids: bricks of 8³ cells where there is water (the size of a VDB leaf), and coarser
//! levels above them.
//!
//! This module holds the topology only. Values live in flat arrays of [`CELLS`] per slot: cell
//! `local` of slot `s` is element `512 s + local`, with `local` = x + 8 y + 64 z. Slot 0 is a
//! placeholder for every absent brick; its values stay zero. Cost and memory grow with the slots;
//! only `table`, four bytes per brick, grows with the box.

use crate::parallel;
use bytemuck::{Pod, Zeroable};

/// Cells along the edge of a brick.
pub const EDGE: u32 = 8;

/// Cells in a brick.
pub const CELLS: u32 = EDGE * EDGE * EDGE;

/// Index of a brick itself among its 27 neighbours, (dx+1) + 3 (dy+1) + 9 (dz+1).
pub const SELF: usize = 13;

/// A brick and its neighbours. Same layout as `Brick` in shared/bricks.wgsl.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Brick {
    /// Position in bricks of its own level, from the domain's least corner.
    pub coordinate: [u32; 3],
    /// Level: 0 is the finest, and each level doubles the cell size.
    pub level: u32,
    /// Slots of the 3³ bricks around it on its level, x fastest; 0 where there is none.
    pub neighbors: [u32; 27],
    /// Slot of the parent brick on the next coarser level; 0 if there is none.
    pub parent: u32,
    /// Slots of the 2³ child bricks on the next finer level, x fastest; 0 where there is none.
    pub children: [u32; 8],
}

/// Slots of one level: `start..start + count`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Level {
    /// First slot.
    pub start: u32,
    /// Number of slots.
    pub count: u32,
}

/// Bricks around the water at one instant, and their coarser levels.
///
/// Slots 1..=`laden` may hold particles, those up to `wet` hold water, those up to `active` are
/// within reach of it, and the coarser levels over the wet bricks follow. Within each of these
/// groups bricks are ordered by coordinate, x fastest, so the same wet bricks always get the same
/// slots.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bricks {
    /// Cells of the finest level along each axis.
    pub cells: [u32; 3],
    /// Axes along which the domain wraps: the last brick's upper neighbour is the first. The cell
    /// count along such an axis is a multiple of [`EDGE`].
    pub periodic: [bool; 3],
    /// Bricks of the finest level along each axis.
    pub table_dims: [u32; 3],
    /// Slot of each brick of the finest level, x fastest; 0 where there is none.
    pub table: Vec<u32>,
    /// Number of slots that may hold particles; they come first.
    pub laden: u32,
    /// Number of slots that hold water.
    pub wet: u32,
    /// Number of slots on the finest level, wet ones first.
    pub active: u32,
    /// Slots of each level. `levels[0]` covers only the wet bricks. The last one has a single
    /// brick, unless the depth limit came first.
    pub levels: Vec<Level>,
    /// One record per slot, slot 0 included.
    pub records: Vec<Brick>,
}

/// Returns the number of bricks along each axis that cover `cells`, at least 1.
pub fn table_dims(cells: [u32; 3]) -> [u32; 3] {
    cells.map(|n| n.div_ceil(EDGE).max(1))
}

impl Bricks {
    /// Lays out the bricks that `is_wet` flags (one flag per brick of the finest level, x
    /// fastest) and all bricks within `reach` of one, diagonals included. `depth` bounds the
    /// number of levels.
    ///
    /// # Panics
    /// If the length of `is_wet` differs from that of the table.
    pub fn new(cells: [u32; 3], is_wet: &[bool], reach: u32, depth: usize) -> Self {
        Self::periodic(cells, [false; 3], is_wet, reach, depth)
    }

    /// Same as [`Self::new`] for a domain that wraps along the axes of `periodic`. A coarser level
    /// wraps only where it has exactly half as many bricks as the level below; otherwise the bricks
    /// at its ends have no neighbour.
    ///
    /// # Panics
    /// If the length of `is_wet` differs from that of the table, or if the cells along a periodic
    /// axis do not fill whole bricks.
    pub fn periodic(
        cells: [u32; 3],
        periodic: [bool; 3],
        is_wet: &[bool],
        reach: u32,
        depth: usize,
    ) -> Self {
        Self::laden_first(cells, periodic, is_wet, is_wet, reach, depth)
    }

    /// Same as [`Self::periodic`], with the wet bricks that `is_laden` flags before the others.
    /// Each of both groups is ordered by coordinate.
    ///
    /// # Panics
    /// As [`Self::periodic`].
    pub fn laden_first(
        cells: [u32; 3],
        periodic: [bool; 3],
        is_wet: &[bool],
        is_laden: &[bool],
        reach: u32,
        depth: usize,
    ) -> Self {
        let dims = table_dims(cells);
        assert_eq!(is_wet.len(), volume(dims), "one flag a brick");
        assert_eq!(is_laden.len(), is_wet.len(), "one flag a brick");
        let is_whole = |axis: usize| !periodic[axis] || cells[axis].is_multiple_of(EDGE);
        assert!((0..3).all(is_whole), "whole bricks along a period");
        let near = dilate(is_wet, dims, periodic, reach);
        let mut wet: Vec<usize> = (0..near.len()).filter(|&k| is_wet[k]).collect();
        wet.sort_by_key(|&k| !is_laden[k]);
        let laden = wet.iter().filter(|&&k| is_laden[k]).count() as u32;
        let dry = (0..near.len()).filter(|&k| near[k] && !is_wet[k]);
        let mut records = vec![Brick::default()];
        let mut table = vec![0; near.len()];
        for index in wet.iter().copied().chain(dry) {
            table[index] = records.len() as u32;
            records.push(Brick {
                coordinate: coordinate(index, dims),
                ..Brick::default()
            });
        }
        let active = records.len() as u32 - 1;
        let range = 1..active as usize + 1;
        connect(&mut records, range, &table, dims, periodic);
        let mut bricks = Self {
            cells,
            periodic,
            table_dims: dims,
            table,
            laden,
            wet: wet.len() as u32,
            active,
            levels: vec![Level {
                start: 1,
                count: wet.len() as u32,
            }],
            records,
        };
        bricks.add_levels(depth);
        bricks
    }

    /// Returns the number of slots, slot 0 included: the length that per-slot arrays need.
    pub fn slots(&self) -> usize {
        self.records.len()
    }

    /// Returns the coordinates of an element's cell on its level.
    pub fn cell(&self, element: u32) -> [u32; 3] {
        let brick = &self.records[(element / CELLS) as usize];
        let within = place(element);
        std::array::from_fn(|axis| EDGE * brick.coordinate[axis] + within[axis])
    }

    /// Returns the element of a cell of the finest level; it lies in slot 0 where there is
    /// no brick.
    pub fn element(&self, cell: [i64; 3]) -> u32 {
        let edge = i64::from(EDGE);
        let cell = self.wrapped(cell);
        let brick = cell.map(|c| c.div_euclid(edge));
        let dims = self.table_dims.map(i64::from);
        let is_inside = (0..3).all(|axis| (0..dims[axis]).contains(&brick[axis]));
        let slot = if is_inside {
            self.table[((brick[2] * dims[1] + brick[1]) * dims[0] + brick[0]) as usize]
        } else {
            0
        };
        let [x, y, z] = cell.map(|c| c.rem_euclid(edge) as u32);
        CELLS * slot + x + EDGE * (y + EDGE * z)
    }

    /// Maps a cell beyond a periodic end to the cell of the domain that it is an image of.
    pub fn wrapped(&self, cell: [i64; 3]) -> [i64; 3] {
        std::array::from_fn(|axis| {
            if self.periodic[axis] {
                cell[axis].rem_euclid(i64::from(self.cells[axis]))
            } else {
                cell[axis]
            }
        })
    }

    /// Returns the element of the cell `offset` away, at most eight cells along each axis; it lies
    /// in slot 0 where there is no brick.
    pub fn near(&self, element: u32, offset: [i32; 3]) -> u32 {
        let at = place(element);
        let (mut neighbor, mut local) = (0, 0);
        for axis in (0..3).rev() {
            let moved = (at[axis] + EDGE).wrapping_add_signed(offset[axis]);
            neighbor = 3 * neighbor + moved / EDGE;
            local = EDGE * local + moved % EDGE;
        }
        let brick = &self.records[(element / CELLS) as usize];
        CELLS * brick.neighbors[neighbor as usize] + local
    }

    /// Adds coarser levels over the wet bricks until one brick covers all or there are
    /// `depth` levels.
    fn add_levels(&mut self, depth: usize) {
        let (mut dims, mut periodic) = (self.table_dims, self.periodic);
        while self.levels.len() < depth && volume(dims) > 1 {
            let below = self.levels[self.levels.len() - 1];
            let range = below.start as usize..(below.start + below.count) as usize;
            for axis in 0..3 {
                periodic[axis] &= dims[axis].is_multiple_of(2);
                dims[axis] = dims[axis].div_ceil(2);
            }
            let level = self.levels.len() as u32;
            let mut table = vec![0; volume(dims)];
            for brick in &self.records[range.clone()] {
                table[parent_index(brick, dims)] = 1;
            }
            let start = self.records.len() as u32;
            for (index, slot) in table.iter_mut().enumerate().filter(|(_, slot)| **slot != 0) {
                *slot = self.records.len() as u32;
                self.records.push(Brick {
                    coordinate: coordinate(index, dims),
                    level,
                    ..Brick::default()
                });
            }
            for slot in range {
                let parent = table[parent_index(&self.records[slot], dims)];
                self.records[slot].parent = parent;
                let [x, y, z] = self.records[slot].coordinate.map(|c| (c & 1) as usize);
                self.records[parent as usize].children[x + 2 * y + 4 * z] = slot as u32;
            }
            let end = self.records.len();
            connect(
                &mut self.records,
                start as usize..end,
                &table,
                dims,
                periodic,
            );
            self.levels.push(Level {
                start,
                count: end as u32 - start,
            });
        }
    }
}

/// Position of an element's cell within its brick.
fn place(element: u32) -> [u32; 3] {
    let local = element % CELLS;
    [local % EDGE, local / EDGE % EDGE, local / (EDGE * EDGE)]
}

fn volume(dims: [u32; 3]) -> usize {
    dims.iter().map(|&n| n as usize).product()
}

fn coordinate(index: usize, dims: [u32; 3]) -> [u32; 3] {
    let [x, y, _] = dims.map(|n| n as usize);
    [
        (index % x) as u32,
        (index / x % y) as u32,
        (index / (x * y)) as u32,
    ]
}

fn parent_index(brick: &Brick, dims: [u32; 3]) -> usize {
    let [x, y, z] = brick.coordinate.map(|c| (c / 2) as usize);
    (z * dims[1] as usize + y) * dims[0] as usize + x
}

/// Fills in the neighbours of the slots in `range`, which belong to the level that `table` indexes.
fn connect(
    records: &mut [Brick],
    range: std::ops::Range<usize>,
    table: &[u32],
    dims: [u32; 3],
    periodic: [bool; 3],
) {
    parallel::for_each_mut(&mut records[range], |_, brick| {
        for (k, neighbor) in brick.neighbors.iter_mut().enumerate() {
            let step = [k % 3, k / 3 % 3, k / 9];
            // Index −1 wraps round to a value beyond any count.
            let at: [usize; 3] = std::array::from_fn(|axis| {
                let (at, count) = (
                    brick.coordinate[axis] as usize + step[axis],
                    dims[axis] as usize,
                );
                if periodic[axis] {
                    (at + count - 1) % count
                } else {
                    at.wrapping_sub(1)
                }
            });
            if (0..3).all(|axis| at[axis] < dims[axis] as usize) {
                *neighbor = table[(at[2] * dims[1] as usize + at[1]) * dims[0] as usize + at[0]];
            }
        }
    });
}

/// Sets all flags within `reach` of a set flag in the maximum norm, one axis after the other.
fn dilate(flags: &[bool], dims: [u32; 3], periodic: [bool; 3], reach: u32) -> Vec<bool> {
    let [nx, ny, nz] = dims.map(|n| n as usize);
    let (mut flags, reach) = (flags.to_vec(), reach as usize);
    for (axis, (stride, length)) in [(1, nx), (nx, ny), (nx * ny, nz)].into_iter().enumerate() {
        let before = flags.clone();
        for (index, flag) in flags.iter_mut().enumerate() {
            let at = index / stride % length;
            let is_set = |other: usize| before[index + other * stride - at * stride];
            *flag = if periodic[axis] {
                let first = at + length * reach - reach;
                (first..=first + 2 * reach).any(|other| is_set(other % length))
            } else {
                let (first, last) = (at.saturating_sub(reach), (at + reach).min(length - 1));
                (first..=last).any(is_set)
            };
        }
    }
    flags
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudo-random flags, so that wet bricks are scattered.
    fn scattered(count: usize) -> Vec<bool> {
        (0..count as u64)
            .map(|k| (k + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 59 == 0)
            .collect()
    }

    fn at(bricks: &Bricks, level: u32, coordinate: [u32; 3]) -> u32 {
        let level0 = |slot: usize| level > 0 || slot <= bricks.active as usize;
        (1..bricks.slots())
            .find(|&slot| {
                let brick = &bricks.records[slot];
                brick.level == level && brick.coordinate == coordinate && level0(slot)
            })
            .unwrap_or(0) as u32
    }

    #[test]
    fn every_link_leads_where_its_coordinates_say() {
        let cells = [70, 33, 41];
        let is_wet = scattered(9 * 5 * 6);
        let bricks = Bricks::new(cells, &is_wet, 1, 8);
        assert_eq!(bricks.table_dims, [9, 5, 6]);
        assert_eq!(bricks.levels.len(), 5);
        assert_eq!(bricks.levels[4].count, 1);
        for (slot, brick) in bricks.records.iter().enumerate().skip(1) {
            assert_eq!(brick.neighbors[SELF], slot as u32);
            for (k, &neighbor) in brick.neighbors.iter().enumerate() {
                let step = [k % 3, k / 3 % 3, k / 9].map(|s| s as i64 - 1);
                let there: [i64; 3] =
                    std::array::from_fn(|axis| i64::from(brick.coordinate[axis]) + step[axis]);
                let expected = if there.iter().any(|&c| c < 0) {
                    0
                } else {
                    at(&bricks, brick.level, there.map(|c| c as u32))
                };
                assert_eq!(neighbor, expected, "slot {slot}, neighbour {k}");
            }
            let is_dry = slot > bricks.wet as usize && slot <= bricks.active as usize;
            let is_top = brick.level as usize + 1 == bricks.levels.len();
            assert_eq!(brick.parent == 0, is_dry || is_top);
            if brick.parent != 0 {
                let parent = &bricks.records[brick.parent as usize];
                assert_eq!(parent.coordinate, brick.coordinate.map(|c| c / 2));
                assert!(parent.children.contains(&(slot as u32)));
            }
        }
    }

    #[test]
    fn active_bricks_are_those_within_reach() {
        let is_wet = scattered(9 * 5 * 6);
        for reach in 0..3 {
            let bricks = Bricks::new([72, 40, 48], &is_wet, reach, 8);
            let position = |k: usize| coordinate(k, bricks.table_dims);
            let is_near = |k: usize| {
                (0..is_wet.len()).any(|w| {
                    let (a, b) = (position(k), position(w));
                    is_wet[w] && (0..3).all(|axis| a[axis].abs_diff(b[axis]) <= reach)
                })
            };
            for (k, &slot) in bricks.table.iter().enumerate() {
                assert_eq!(slot != 0, is_near(k));
                assert_eq!((1..=bricks.wet).contains(&slot), is_wet[k]);
            }
        }
    }

    #[test]
    fn neighbours_are_where_their_cells_say() {
        let bricks = Bricks::new([72, 40, 48], &scattered(9 * 5 * 6), 1, 8);
        let mut found = 0;
        for element in (CELLS..CELLS * (bricks.active + 1)).step_by(37) {
            let cell = bricks.cell(element).map(i64::from);
            assert_eq!(bricks.element(cell), element);
            for offset in [[-1, 0, 0], [1, -1, 1], [8, 0, -8], [0, 1, 0]] {
                let there: [i64; 3] = std::array::from_fn(|k| cell[k] + i64::from(offset[k]));
                assert_eq!(bricks.near(element, offset), bricks.element(there));
                found += u32::from(bricks.element(there) >= CELLS);
            }
        }
        assert!(found > 100);
    }

    /// Three bricks, two and one; every cell exists, and so does each of its neighbours.
    #[test]
    fn periodic_bricks_join_their_own_ends() {
        let (cells, dims) = ([24, 16, 8], [3, 2, 1]);
        let periodic = [true, true, true];
        let bricks = Bricks::periodic(cells, periodic, &[true; 6], 1, 8);
        let image = |cell: [i64; 3]| -> [u32; 3] {
            std::array::from_fn(|k| cell[k].rem_euclid(i64::from(cells[k])) as u32)
        };
        for element in (CELLS..CELLS * (bricks.active + 1)).step_by(7) {
            let cell = bricks.cell(element).map(i64::from);
            for offset in [[-1, 0, 0], [1, -1, 1], [8, 0, -8], [0, 1, 0], [-1, -1, -1]] {
                let there: [i64; 3] = std::array::from_fn(|k| cell[k] + i64::from(offset[k]));
                let near = bricks.near(element, offset);
                assert_eq!(near, bricks.element(there));
                assert_eq!(bricks.cell(near), image(there));
            }
        }
        // Above three bricks are two, one of them half empty: that level does not wrap. Above two
        // is one, and above one is one.
        let faces = |slot: u32| bricks.records[slot as usize].neighbors;
        let above = bricks.levels[1].start;
        assert_eq!(bricks.levels[1].count, 2);
        assert_eq!((faces(above)[12], faces(above)[14]), (0, above + 1));
        assert_eq!((faces(above)[10], faces(above)[16]), (above, above));
        assert_eq!((faces(above)[4], faces(above)[22]), (0, 0));
        // Bricks are within reach across the periodic boundary, and not without it.
        let only = [true, false, false, false, false, false];
        let reached = |periodic| Bricks::periodic(cells, periodic, &only, 1, 1).active;
        assert_eq!(reached([true, false, false]), 6);
        assert_eq!(reached([false; 3]), 4);
        assert_eq!(volume(dims), 6);
    }

    #[test]
    fn empty_height_adds_no_slot() {
        let low = Bricks::new([16, 8, 16], &[true, false, true, true], 1, 8);
        let mut flags = vec![false; 2 * 4 * 2];
        (flags[0], flags[8], flags[9]) = (true, true, true);
        let high = Bricks::new([16, 32, 16], &flags, 1, 2);
        assert_eq!(high.wet, low.wet);
        // The layer above the water is within reach.
        assert_eq!(high.active, 2 * low.active);
    }

    #[test]
    fn no_water_has_no_bricks() {
        let bricks = Bricks::new([20, 20, 20], &[false; 27], 2, 8);
        assert_eq!((bricks.wet, bricks.active), (0, 0));
        assert!(bricks.levels.iter().all(|level| level.count == 0));
        assert_eq!(bricks.slots(), 1);
    }
}
