//! Fields of the cells around a band.

use glam::DVec3;

use crate::{
    bricks::{Bricks, CELLS, EDGE},
    deep::Deep,
    parallel,
};

/// Depths and velocities by element.
pub(super) struct Cells {
    /// Depth below the free surface when the cell was listed, moved with the water since, cells; 0
    /// where it was not.
    pub(super) depth: Vec<f32>,
    /// Velocities on the least faces, m/s.
    pub(super) velocity: Vec<[f32; 3]>,
}

impl Cells {
    pub(super) fn of(bricks: &Bricks, deep: &Deep) -> Self {
        let all = (bricks.active as usize + 1) * CELLS as usize;
        let mut cells = Self {
            depth: vec![0.0; all],
            velocity: vec![[0.0; 3]; all],
        };
        for (k, cell) in deep.cell.iter().enumerate() {
            let element = bricks.element(cell.map(i64::from)) as usize;
            cells.depth[element] = deep.depth[k];
            cells.velocity[element] = deep.velocity[k];
        }
        cells
    }

    /// Velocity at a position in a cell, trilinear between the faces that are known, m/s.
    pub(super) fn velocity_at(&self, bricks: &Bricks, element: u32, within: DVec3) -> [f32; 3] {
        std::array::from_fn(|axis| {
            let (mut sum, mut all) = (0.0, 0.0);
            for_corners(within, axis, |offset, weight| {
                let near = bricks.near(element, offset.map(|k| k as i32)) as usize;
                // The greatest face of a deep cell may belong to one that is not listed.
                let is_known = self.depth[near] > 0.0;
                let weight = if is_known { weight } else { 0.0 };
                sum += weight * f64::from(self.velocity[near][axis]);
                all += weight;
            });
            if all > 0.0 { (sum / all) as f32 } else { 0.0 }
        })
    }
}

/// Calls `of` with the cells whose least faces across `axis` surround a position, in cells, and
/// their trilinear weights.
pub(super) fn for_corners(at: DVec3, axis: usize, mut of: impl FnMut([i64; 3], f64)) {
    let mut at = at - 0.5;
    at[axis] += 0.5;
    let low = at.floor();
    let part = at - low;
    for corner in 0..8 {
        let is_high = [corner & 1, corner >> 1 & 1, corner >> 2];
        let weight: f64 = (0..3)
            .map(|k| {
                if is_high[k] == 1 {
                    part[k]
                } else {
                    1.0 - part[k]
                }
            })
            .product();
        of(std::array::from_fn(|k| low[k] as i64 + is_high[k]), weight);
    }
}

/// Calls `of` with the values of each line of 24 cells along `axis`, through three bricks, and
/// returns what it makes of those of the middle brick. `beyond` gives the values of cells that no
/// brick has, by their index along the axis.
fn along<T: Copy + Default + Send + Sync>(
    bricks: &Bricks,
    values: &[T],
    axis: usize,
    beyond: impl Fn(i64) -> T + Sync,
    of: impl Fn(&[T; 24], i64) -> [T; 8] + Sync,
) -> Vec<T> {
    let edge = EDGE as usize;
    let stride = edge.pow(axis as u32);
    let step = 3usize.pow(axis as u32);
    let mut found = vec![T::default(); values.len()];
    parallel::for_chunks_mut(&mut found, CELLS as usize, |slot, found| {
        if slot == 0 {
            return;
        }
        let brick = &bricks.records[slot];
        let first = i64::from(EDGE * brick.coordinate[axis]);
        let sides = [13 - step, 13, 13 + step].map(|k| brick.neighbors[k] as usize);
        for line in 0..edge * edge {
            // The line's first cell: `line` without the digit of the axis.
            let begin = line % stride + line / stride * stride * edge;
            let mut read = [T::default(); 24];
            for (k, value) in read.iter_mut().enumerate() {
                let there = sides[k / edge];
                *value = match there {
                    0 => beyond(first + k as i64 - i64::from(EDGE)),
                    _ => values[there * CELLS as usize + begin + k % edge * stride],
                };
            }
            for (k, value) in of(&read, first).into_iter().enumerate() {
                found[begin + k * stride] = value;
            }
        }
    });
    found
}

/// Returns which cells are water: those whose neighbourhood of 3³ cells is at least half full, of
/// those of it that the domain has. A cell may hold no particle for a moment.
pub(super) fn is_water(bricks: &Bricks, dims: [u32; 3], counts: &[u16], full: u16) -> Vec<bool> {
    let mut sums: Vec<u32> = counts.iter().map(|count| u32::from(*count)).collect();
    for axis in 0..3 {
        sums = along(
            bricks,
            &sums,
            axis,
            |_| 0,
            |read, _| std::array::from_fn(|k| read[k + 7] + read[k + 8] + read[k + 9]),
        );
    }
    let room = |cell: [u32; 3]| -> u32 {
        let of = |axis: usize| {
            let is_end = cell[axis] == 0 || cell[axis] + 1 >= dims[axis];
            if is_end && !bricks.periodic[axis] {
                2
            } else {
                3
            }
        };
        of(0) * of(1) * of(2)
    };
    parallel::map(0..sums.len(), |element| {
        if element < CELLS as usize {
            return false;
        }
        let cell = bricks.cell(element as u32);
        let is_inside = (0..3).all(|axis| cell[axis] < dims[axis]);
        is_inside && 2 * sums[element] >= u32::from(full) * room(cell)
    })
}

/// Returns the depth of each cell's centre below the nearest face of a cell of air, at most
/// `reach` less half a cell: the Euclidean distance of their centres less half a cell (Felzenszwalb
/// and Huttenlocher 2012). Beyond the domain there is no air.
pub(super) fn depths(bricks: &Bricks, dims: [u32; 3], is_water: &[bool], reach: u32) -> Vec<f32> {
    // Values along lines come from the bricks on both sides.
    assert!(reach <= EDGE, "a depth within a brick's edge");
    let reach = i64::from(reach);
    let most = (reach * reach) as u16;
    let is_inside =
        |axis: usize, k: i64| bricks.periodic[axis] || (0..i64::from(dims[axis])).contains(&k);
    let mut squares: Vec<u16> = parallel::map(0..is_water.len(), |element| {
        if is_water[element] || element < CELLS as usize {
            return most;
        }
        let cell = bricks.cell(element as u32);
        let is_air = (0..3).all(|axis| is_inside(axis, i64::from(cell[axis])));
        if is_air { 0 } else { most }
    });
    for axis in 0..3 {
        let beyond = |k: i64| if is_inside(axis, k) { 0 } else { most };
        squares = along(bricks, &squares, axis, beyond, |read, _| {
            std::array::from_fn(|k| {
                let of = |step: i64| {
                    let there = read[(k as i64 + 8 + step) as usize];
                    there + (step * step) as u16
                };
                (-reach..=reach).map(of).min().unwrap_or(most).min(most)
            })
        });
    }
    parallel::map_slice(&squares, |square| {
        (f64::from(*square).sqrt() - 0.5).max(0.0) as f32
    })
}
