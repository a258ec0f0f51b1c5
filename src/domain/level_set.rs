//! The water of a frame as a sparse level set for ray tracing: bricks of 8³ voxels along
//! the surface.
//!
//! The field is Σ V det(G) P(|G (x − x̄)|) over particles with anisotropic kernels ([`kernels`]; Yu
//! and Turk 2013), sampled at the voxels' corners, divided by its value at a calm surface, minus 1:
//! positive in water. Bricks away from the surface take one word. The result depends only on the
//! frame: the order of summation does not change with the number of threads.

pub mod drift;
pub mod edges;
pub mod eigen;
pub mod foam;
mod grid;
pub mod kernels;
mod moments;
pub mod sunlight;
pub mod velocity;

use glam::{DVec3, Vec3};

use crate::parallel;
use kernels::{Ellipsoid, Kernels};

/// Voxels along the edge of a brick.
pub const EDGE: u32 = 8;

/// Nodes (voxel corners) stored along the edge of a brick: its own, and one more on each side, so
/// that the central differences of a gradient need no other brick.
pub const NODES: u32 = EDGE + 3;

/// Values of a brick: one per node.
pub const VALUES: usize = (NODES * NODES * NODES) as usize;

/// Table entry of a brick without water.
pub const EMPTY: u32 = 0;
/// Table entry of a brick that lies entirely in water.
pub const FULL: u32 = 1;
/// Table entry of the first brick that has values; later ones follow.
pub const FIRST: u32 = 2;

/// Default number of voxels per particle spacing.
pub const VOXELS: f64 = 2.0;

/// A sparse level set over a box whose least corner is the origin.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelSet {
    /// Size of the box, metres.
    pub size: DVec3,
    /// Edge length of a voxel, metres.
    pub voxel: f64,
    /// Bricks along each axis.
    pub bricks: [u32; 3],
    /// Entry of each brick, x fastest: [`EMPTY`], [`FULL`], or [`FIRST`] plus the index of its
    /// block in `values`.
    pub table: Vec<u32>,
    /// [`VALUES`] for each brick that the surface passes through or near. Node (i, j, k), counted
    /// from −1, is element (i + 1) + 11 (j + 1) + 121 (k + 1).
    pub values: Vec<f32>,
}

/// Returns the number of bricks along each axis over a box of `size` metres with voxels of
/// `voxel` metres.
pub fn bricks_over(size: DVec3, voxel: f64) -> [u32; 3] {
    let edge = voxel * f64::from(EDGE);
    size.to_array()
        .map(|length| (length / edge).ceil().max(1.0) as u32)
}

impl LevelSet {
    /// Builds the level set of particles at `positions`, metres from the box's least corner, with
    /// `spacing` metres between neighbours at rest. The sides of the box are mirrors: water meets
    /// them at a right angle.
    pub fn new(positions: &[DVec3], size: DVec3, spacing: f64) -> Self {
        let kernels = Kernels::fit(positions, size, spacing);
        Self::of_kernels(&kernels, size, spacing / VOXELS)
    }

    /// Samples the field of kernels that were fitted in this box, with voxels of `voxel` metres.
    pub fn of_kernels(kernels: &Kernels, size: DVec3, voxel: f64) -> Self {
        Self::with_margin(kernels, size, voxel, 0.0)
    }

    /// Same as [`Self::of_kernels`], but keeps the values of all bricks where the field comes
    /// within `margin` (relative, below 1) of the surface's value: isosurfaces of values from
    /// −`margin` to `margin` then lie in bricks with values.
    pub fn with_margin(kernels: &Kernels, size: DVec3, voxel: f64, margin: f32) -> Self {
        let bricks = bricks_over(size, voxel);
        let lists = Lists::new(&kernels.ellipsoids, bricks, voxel);
        let level = kernels.level as f32;
        let filled: Vec<Filled> = parallel::map(0..lists.len(), |brick| {
            lists.fill(kernels, brick, voxel, (level, margin))
        });
        let mut set = Self {
            size,
            voxel,
            bricks,
            table: Vec::with_capacity(filled.len()),
            values: Vec::new(),
        };
        for brick in filled {
            set.table.push(match brick {
                Filled::Empty => EMPTY,
                Filled::Full => FULL,
                Filled::Values(values) => {
                    let slot = set.values.len() / VALUES;
                    set.values.extend_from_slice(&values[..]);
                    FIRST + slot as u32
                }
            });
        }
        set
    }

    /// Returns the field at `p`, metres from the box's least corner, trilinear between nodes: −1 in
    /// bricks without water, 1 in bricks entirely in water.
    pub fn value(&self, p: DVec3) -> f64 {
        let (slot, q) = self.brick_at(p);
        match slot {
            EMPTY => -1.0,
            FULL => 1.0,
            slot => self.within(slot, q),
        }
    }

    /// Returns the gradient of the field, 1/m, by central differences over two voxels; zero in
    /// bricks without values.
    pub fn gradient(&self, p: DVec3) -> DVec3 {
        let (slot, q) = self.brick_at(p);
        if slot < FIRST {
            return DVec3::ZERO;
        }
        let along = |axis: DVec3| self.within(slot, q + axis) - self.within(slot, q - axis);
        DVec3::new(along(DVec3::X), along(DVec3::Y), along(DVec3::Z)) / (2.0 * self.voxel)
    }

    /// Returns the value at node `at`, counted from the box's least corner, from the brick that
    /// begins there: −1 in bricks without water, 1 in bricks entirely in water.
    pub fn node(&self, at: [u32; 3]) -> f32 {
        let brick = [0, 1, 2].map(|axis| (at[axis] / EDGE).min(self.bricks[axis] - 1));
        let [nx, ny] = [self.bricks[0] as usize, self.bricks[1] as usize];
        let [x, y, z] = brick.map(|c| c as usize);
        match self.table[(z * ny + y) * nx + x] {
            EMPTY => -1.0,
            FULL => 1.0,
            slot => {
                let [x, y, z] = [0, 1, 2].map(|axis| (at[axis] - EDGE * brick[axis] + 1) as usize);
                let nodes = NODES as usize;
                self.values[(slot - FIRST) as usize * VALUES + x + nodes * (y + nodes * z)]
            }
        }
    }

    /// Returns the height below which all water lies, metres: the upper side of the highest brick
    /// that holds any, within the box.
    pub fn top(&self) -> f64 {
        let [nx, ny] = [self.bricks[0] as usize, self.bricks[1] as usize];
        let wet = self
            .table
            .iter()
            .enumerate()
            .filter(|(_, slot)| **slot != EMPTY);
        let layers = wet.map(|(brick, _)| brick / nx % ny + 1).max().unwrap_or(0);
        (layers as f64 * self.voxel * f64::from(EDGE)).min(self.size.y)
    }

    /// Returns the table entry of the brick at `p`.
    pub fn slot(&self, p: DVec3) -> u32 {
        self.brick_at(p).0
    }

    /// Table entry of the brick at `p`, and the position within the brick, voxels.
    fn brick_at(&self, p: DVec3) -> (u32, DVec3) {
        let last = DVec3::from_array(self.bricks.map(|n| f64::from(n * EDGE) - 1e-9));
        let at = (p / self.voxel).clamp(DVec3::ZERO, last);
        let brick = (at / f64::from(EDGE)).floor();
        let [x, y, z] = brick.to_array().map(|c| c as usize);
        let [nx, ny] = [self.bricks[0] as usize, self.bricks[1] as usize];
        let slot = self.table[(z * ny + y) * nx + x];
        (slot, at - f64::from(EDGE) * brick)
    }

    fn within(&self, slot: u32, q: DVec3) -> f64 {
        let values = &self.values[(slot - FIRST) as usize * VALUES..][..VALUES];
        let q = q + 1.0;
        let low = q
            .floor()
            .clamp(DVec3::ZERO, DVec3::splat(f64::from(NODES - 2)));
        let part = q - low;
        let [x, y, z] = low.to_array().map(|c| c as usize);
        let nodes = NODES as usize;
        let mut sum = 0.0;
        for corner in 0..8usize {
            let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
            let weigh = |bit: usize, part: f64| if bit == 1 { part } else { 1.0 - part };
            let weight = weigh(i, part.x) * weigh(j, part.y) * weigh(k, part.z);
            let at = (x + i) + nodes * ((y + j) + nodes * (z + k));
            sum += weight * f64::from(values[at]);
        }
        sum
    }
}

/// Content of a brick.
enum Filled {
    Empty,
    Full,
    Values(Box<[f32; VALUES]>),
}

/// Indices of the ellipsoids that reach each brick.
struct Lists {
    bricks: [u32; 3],
    starts: Vec<u32>,
    entries: Vec<u32>,
}

impl Lists {
    fn new(ellipsoids: &[Ellipsoid], bricks: [u32; 3], voxel: f64) -> Self {
        let edge = voxel * f64::from(EDGE);
        // Bricks whose nodes, including the extra layer on each side, an ellipsoid's box overlaps;
        // empty if the first is past the last.
        let range = |ellipsoid: &Ellipsoid| {
            let low = (ellipsoid.centre - ellipsoid.reach - voxel) / edge;
            let high = (ellipsoid.centre + ellipsoid.reach + voxel) / edge;
            [0, 1, 2].map(|axis| {
                let last = f64::from(bricks[axis]);
                let first = low[axis].floor().clamp(0.0, last) as u32;
                first..(high[axis].floor() + 1.0).clamp(0.0, last) as u32
            })
        };
        let count = bricks.iter().map(|&n| n as usize).product::<usize>();
        let each = |visit: &mut dyn FnMut(usize, u32)| {
            for (index, ellipsoid) in ellipsoids.iter().enumerate() {
                let [xs, ys, zs] = range(ellipsoid);
                for z in zs {
                    for y in ys.clone() {
                        for x in xs.clone() {
                            let row = (z * bricks[1] + y) as usize * bricks[0] as usize;
                            visit(row + x as usize, index as u32);
                        }
                    }
                }
            }
        };
        let mut starts = vec![0u32; count + 1];
        each(&mut |brick, _| starts[brick + 1] += 1);
        for brick in 0..count {
            starts[brick + 1] += starts[brick];
        }
        let mut next = starts.clone();
        let mut entries = vec![0; starts[count] as usize];
        each(&mut |brick, index| {
            entries[next[brick] as usize] = index;
            next[brick] += 1;
        });
        Self {
            bricks,
            starts,
            entries,
        }
    }

    fn len(&self) -> usize {
        self.starts.len() - 1
    }

    fn fill(
        &self,
        kernels: &Kernels,
        brick: usize,
        voxel: f64,
        (level, margin): (f32, f32),
    ) -> Filled {
        let entries = &self.entries[self.starts[brick] as usize..self.starts[brick + 1] as usize];
        if entries.is_empty() {
            return Filled::Empty;
        }
        let [nx, ny] = [self.bricks[0] as usize, self.bricks[1] as usize];
        let place = [brick % nx, brick / nx % ny, brick / nx / ny];
        // Position of node −1, so that nodes count from 0.
        let edge = f64::from(EDGE);
        let corner = DVec3::from_array(place.map(|c| (c as f64 * edge - 1.0) * voxel));
        let mut values = Box::new([0.0f32; VALUES]);
        for &index in entries {
            add(
                &mut values,
                &kernels.ellipsoids[index as usize],
                corner,
                voxel,
            );
        }
        let is_beyond = |part: f32| move |value: &f32| *value > level * part;
        match () {
            () if !values.iter().any(is_beyond(1.0 - margin)) => Filled::Empty,
            () if values.iter().all(is_beyond(1.0 + margin)) => Filled::Full,
            () => {
                for value in values.iter_mut() {
                    *value = *value / level - 1.0;
                }
                Filled::Values(values)
            }
        }
    }
}

/// Adds an ellipsoid to the nodes of a brick whose first node lies at `corner`.
fn add(values: &mut [f32; VALUES], ellipsoid: &Ellipsoid, corner: DVec3, voxel: f64) {
    let nodes = NODES as usize;
    let from = (ellipsoid.centre - corner) / voxel;
    let reach = ellipsoid.reach / voxel;
    let low = (from - reach).ceil().max(DVec3::ZERO).to_array();
    let end = (from + reach).floor() + 1.0;
    let end = end.clamp(DVec3::ZERO, DVec3::splat(nodes as f64));
    let [x0, y0, z0] = low.map(|c| c as usize);
    let [x1, y1, z1] = end.to_array().map(|c| c as usize);
    let by = (ellipsoid.inverse * voxel).as_mat3();
    let from = from.as_vec3();
    let peak = ellipsoid.peak as f32;
    for z in z0..z1 {
        for y in y0..y1 {
            let start = by * (Vec3::new(0.0, y as f32, z as f32) - from);
            let row = nodes * (y + nodes * z);
            for x in x0..x1 {
                let q = start + by.x_axis * x as f32;
                let s = (1.0 - q.length_squared()).max(0.0);
                values[row + x] += peak * s * s * s;
            }
        }
    }
}

#[cfg(test)]
#[path = "level_set/tests.rs"]
mod tests;
