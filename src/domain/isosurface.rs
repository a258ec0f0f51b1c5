//! Extracts a closed mesh around the water of a level set.
//!
//! The method is marching cubes (Lorensen and Cline 1987) with the asymptotic decider. Beyond the
//! sides of the level set's box is air: where water touches a side, the mesh has a flat cap in it.
//! Each vertex has a key derived from its grid position, and triangles refer to keys. Bricks can
//! thus be processed in parallel, and the mesh is the same for any number of threads.

mod cell;
pub mod sparse;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    level_set::{EDGE, EMPTY, FULL, LevelSet},
    mesh::TriangleMesh,
    parallel,
};

use cell::{EDGES, Loops, fan};

/// Smallest distance of a vertex from a corner of its cell, relative to the edge: triangles between
/// coincident vertices have no normal.
const NEAREST: f64 = 1.0 / 128.0;

/// Code in a key's lowest three bits for a vertex at a node; smaller codes are the axis of an edge.
const AT_NODE: u64 = 3;
/// First of the four codes for the centre vertex of a loop in a cell.
const MIDDLE: u64 = 4;

/// A mesh around water, metres from the box's least corner.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Isosurface {
    /// Triangles, counter-clockwise seen from the air.
    pub mesh: TriangleMesh,
    /// For each vertex of a cap, the sum of the outward normals of the box sides that it lies in;
    /// zero for other vertices.
    pub caps: Vec<DVec3>,
}

/// Extracts the mesh where the field of `level` equals `iso`; 0 is the surface of the water.
pub fn extract(level: &LevelSet, iso: f32) -> Isosurface {
    let grid = NodeGrid::over(level, iso);
    let blocks = grid.nodes.map(|n| (n - 1).div_ceil(EDGE));
    let count = blocks.map(|n| n as usize).iter().product::<usize>();
    let faces: Vec<[u64; 3]> = parallel::flat_map(0..count, |index| {
        let [nx, ny] = [blocks[0] as usize, blocks[1] as usize];
        let at = [index % nx, index / nx % ny, index / nx / ny];
        grid.triangles(at.map(|c| c as u32 * EDGE))
    });
    let mut keys: Vec<u64> = faces.iter().flatten().copied().collect();
    keys.par_sort_unstable();
    keys.dedup();
    let index = |key: &u64| keys.partition_point(|other| other < key) as u32;
    let triangles = parallel::map_slice(&faces, |face| face.each_ref().map(index));
    Isosurface {
        mesh: TriangleMesh {
            vertices: parallel::map_slice(&keys, |&key| grid.vertex(key)),
            triangles,
        },
        caps: parallel::map_slice(&keys, |&key| grid.cap(key)),
    }
}

/// The grid of nodes: the level set's own, a last layer in the far side, and one layer of air
/// beyond each side.
struct NodeGrid<'a> {
    level: &'a LevelSet,
    iso: f32,
    /// Nodes along each axis, those of air included.
    nodes: [u32; 3],
    /// For the layer in the far side: the level set's node before it, and the distance from there
    /// in voxels.
    last: [(u32, f32); 3],
}

impl<'a> NodeGrid<'a> {
    fn over(level: &'a LevelSet, iso: f32) -> Self {
        let ends = level.size.to_array().map(|length| {
            let end = length / level.voxel;
            let before = (end + 1e-9).floor();
            (before, (end - before).max(0.0))
        });
        // A layer less than half a voxel before the side is dropped: the layer in the side
        // replaces it.
        let layers = ends.map(|(before, part)| match part < 0.5 {
            true => before as u32 + 1,
            false => before as u32 + 2,
        });
        Self {
            level,
            iso,
            nodes: layers.map(|n| n.max(2) + 2),
            last: ends.map(|(before, part)| (before as u32, part as f32)),
        }
    }

    /// Returns whether a node lies in the layer of air beyond a side along `axis`.
    fn is_beyond(&self, at: u32, axis: usize) -> bool {
        at == 0 || at == self.nodes[axis] - 1
    }

    fn is_outside(&self, at: [u32; 3]) -> bool {
        (0..3).any(|axis| self.is_beyond(at[axis], axis))
    }

    /// Coordinate along an axis, metres from the box's least corner.
    fn place(&self, at: u32, axis: usize) -> f64 {
        match at {
            0 => 0.0,
            at if at >= self.nodes[axis] - 2 => self.level.size[axis],
            at => f64::from(at - 1) * self.level.voxel,
        }
    }

    fn point(&self, at: [u32; 3]) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| self.place(at[axis], axis)))
    }

    /// Field at a node, minus `iso`.
    fn value(&self, at: [u32; 3]) -> f32 {
        if self.is_outside(at) {
            return -1.0;
        }
        let mut sum = 0.0;
        for corner in 0..8 {
            let (mut weight, mut node) = (1.0, [0; 3]);
            for axis in 0..3 {
                let (before, part) = match at[axis] == self.nodes[axis] - 2 {
                    true => self.last[axis],
                    false => (at[axis] - 1, 0.0),
                };
                let step = corner >> axis & 1;
                weight *= if step == 1 { part } else { 1.0 - part };
                node[axis] = before + step;
            }
            if weight > 0.0 {
                sum += weight * self.level.node(node);
            }
        }
        sum - self.iso
    }

    /// Returns whether the bricks alone show that the block of cells that starts at `first` holds
    /// no surface.
    fn is_plain(&self, first: [u32; 3]) -> bool {
        let mut is_inner = true;
        let ranges = [0, 1, 2].map(|axis| {
            let last = (first[axis] + EDGE).min(self.nodes[axis] - 1);
            is_inner &= first[axis] > 0 && last < self.nodes[axis] - 1;
            let brick = |node: u32| (node / EDGE).min(self.level.bricks[axis] - 1);
            brick(first[axis].saturating_sub(1))..=brick(last)
        });
        let [xs, ys, zs] = ranges;
        let [nx, ny, _] = self.level.bricks;
        let all = |what: u32| {
            zs.clone().all(|z| {
                ys.clone().all(|y| {
                    let row = (z * ny + y) as usize * nx as usize;
                    xs.clone()
                        .all(|x| self.level.table[row + x as usize] == what)
                })
            })
        };
        all(EMPTY) || is_inner && all(FULL)
    }

    /// Triangles in the block of cells that starts at `first`, as vertex keys.
    fn triangles(&self, first: [u32; 3]) -> Vec<[u64; 3]> {
        let mut found = Vec::new();
        if self.is_plain(first) {
            return found;
        }
        let end = [0, 1, 2].map(|axis| (first[axis] + EDGE).min(self.nodes[axis] - 1));
        let side = EDGE as usize + 1;
        let mut values = vec![0.0; side.pow(3)];
        let place = |at: [u32; 3]| {
            let [x, y, z] = [0, 1, 2].map(|axis| (at[axis] - first[axis]) as usize);
            x + side * (y + side * z)
        };
        for z in first[2]..=end[2] {
            for y in first[1]..=end[1] {
                for x in first[0]..=end[0] {
                    values[place([x, y, z])] = self.value([x, y, z]);
                }
            }
        }
        for z in first[2]..end[2] {
            for y in first[1]..end[1] {
                for x in first[0]..end[0] {
                    let cell = [x, y, z];
                    let corners = std::array::from_fn(|c| values[place(corner(cell, c))]);
                    self.add_cell(cell, &corners, &mut found);
                }
            }
        }
        found
    }

    fn add_cell(&self, cell: [u32; 3], values: &[f32; 8], found: &mut Vec<[u64; 3]>) {
        let water = values.iter().filter(|&&value| value > 0.0).count();
        if water == 0 || water == 8 {
            return;
        }
        let mut add = |keys: [u64; 3]| {
            let [a, b, c] = keys;
            // At the sides, several edges end in the same vertex.
            if a != b && b != c && c != a {
                found.push(keys);
            }
        };
        for (number, edges) in Loops::of(values).iter().enumerate() {
            let key = |k: usize| self.key(cell, edges[k % edges.len()]);
            match fan(edges) {
                Some(apex) => (1..edges.len() - 1)
                    .for_each(|k| add([key(apex), key(apex + k), key(apex + k + 1)])),
                None => {
                    let middle = 8 * self.node_number(cell) + MIDDLE + number as u64;
                    (0..edges.len()).for_each(|k| add([middle, key(k), key(k + 1)]));
                }
            }
        }
    }

    fn node_number(&self, at: [u32; 3]) -> u64 {
        let [x, y, z] = at.map(u64::from);
        let [nx, ny, _] = self.nodes.map(u64::from);
        x + nx * (y + ny * z)
    }

    fn node_of(&self, key: u64) -> [u32; 3] {
        let number = key / 8;
        let [nx, ny, _] = self.nodes.map(u64::from);
        [number % nx, number / nx % ny, number / nx / ny].map(|c| c as u32)
    }

    /// Key of the vertex on an edge of a cell.
    fn key(&self, cell: [u32; 3], edge: u8) -> u64 {
        let (from, axis) = EDGES[usize::from(edge)];
        let ends = [from, from | 1 << axis].map(|c| corner(cell, c));
        match ends.map(|at| self.is_beyond(at[axis], axis)) {
            [true, _] => 8 * self.node_number(ends[1]) + AT_NODE,
            [_, true] => 8 * self.node_number(ends[0]) + AT_NODE,
            _ => 8 * self.node_number(ends[0]) + axis as u64,
        }
    }

    fn vertex(&self, key: u64) -> DVec3 {
        let at = self.node_of(key);
        match key % 8 {
            AT_NODE => self.point(at),
            code if code < AT_NODE => {
                let axis = code as usize;
                let mut other = at;
                other[axis] += 1;
                let [a, b] = [at, other].map(|at| f64::from(self.value(at)));
                let t = (a / (a - b)).clamp(NEAREST, 1.0 - NEAREST);
                self.point(at).lerp(self.point(other), t)
            }
            code => {
                let values = std::array::from_fn(|c| self.value(corner(at, c)));
                let loops = Loops::of(&values);
                let edges = loops.iter().nth((code - MIDDLE) as usize).unwrap_or(&[]);
                let ends = edges.iter().map(|&edge| self.vertex(self.key(at, edge)));
                ends.sum::<DVec3>() / edges.len().max(1) as f64
            }
        }
    }

    /// Sum of the outward normals of the sides that a cap's vertex lies in.
    fn cap(&self, key: u64) -> DVec3 {
        let at = self.node_of(key);
        if key % 8 != AT_NODE {
            return DVec3::ZERO;
        }
        DVec3::from_array([0, 1, 2].map(|axis| match at[axis] {
            1 => -1.0,
            at if at == self.nodes[axis] - 2 => 1.0,
            _ => 0.0,
        }))
    }
}

/// Corner of a cell, by its number.
fn corner(cell: [u32; 3], c: usize) -> [u32; 3] {
    [0, 1, 2].map(|axis| cell[axis] + (c >> axis & 1) as u32)
}

#[cfg(test)]
#[path = "isosurface/tests.rs"]
mod tests;
