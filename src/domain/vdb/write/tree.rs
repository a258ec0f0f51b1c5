//! Writes a tree: its topology, then its buffers.

use std::collections::BTreeMap;
use std::io::Write;
use std::iter;

use flate2::{Compression, write::ZlibEncoder};

use super::put_u32;
use super::value::{self, VoxelValue};
use crate::{
    parallel,
    sparse_grid::{Leaf, SparseGrid},
    vdb::{LEAF_BITS, LOWER_BITS, UPPER_BITS, inactive, volume},
};

/// A grid's leaves, grouped by the nodes above them; each map is in file order.
pub(super) struct Tree<'a, T> {
    background: T,
    /// Nodes keyed by the first voxel of their 32³ node, then by offset in it.
    upper: BTreeMap<[i32; 3], BTreeMap<usize, Lower<'a, T>>>,
}

/// A 16³ node; leaves and inside tiles by offset.
struct Lower<'a, T> {
    leaves: BTreeMap<usize, &'a Leaf<T>>,
    inside: Vec<usize>,
}

impl<'a, T: VoxelValue> Tree<'a, T> {
    pub(super) fn of(grid: &'a SparseGrid<T>) -> Self {
        let mut tree = Self {
            background: grid.background,
            upper: BTreeMap::new(),
        };
        for leaf in &grid.leaves {
            let offset = offset(leaf.origin, LEAF_BITS, LOWER_BITS);
            tree.lower(leaf.origin).leaves.insert(offset, leaf);
        }
        for &origin in &grid.inside {
            let offset = offset(origin, LEAF_BITS, LOWER_BITS);
            tree.lower(origin).inside.push(offset);
        }
        tree
    }

    /// The 16³ node that holds a voxel.
    fn lower(&mut self, voxel: [i32; 3]) -> &mut Lower<'a, T> {
        let origin = voxel.map(|x| x >> UPPER_BITS << UPPER_BITS);
        let upper = self.upper.entry(origin).or_default();
        upper
            .entry(offset(voxel, LOWER_BITS, UPPER_BITS))
            .or_insert_with(|| Lower {
                leaves: BTreeMap::new(),
                inside: Vec::new(),
            })
    }

    pub(super) fn put_topology(&self, out: &mut Vec<u8>, is_half: bool) {
        // Buffers per voxel.
        put_u32(out, 1);
        value::put_whole(out, self.background, is_half);
        // Number of root tiles.
        put_u32(out, 0);
        put_u32(out, self.upper.len() as u32);
        for (origin, upper) in &self.upper {
            for x in origin {
                out.extend_from_slice(&x.to_le_bytes());
            }
            put_masks(out, 5, upper.keys());
            put_tiles(out, iter::repeat_n(self.background, volume(5)), is_half);
            for lower in upper.values() {
                lower.put_topology(out, self.background, is_half);
            }
        }
    }

    pub(super) fn put_buffers(&self, out: &mut Vec<u8>, is_half: bool) {
        let leaves: Vec<_> = self
            .upper
            .values()
            .flat_map(|upper| upper.values())
            .flat_map(|lower| lower.leaves.values())
            .collect();
        let buffers: Vec<_> =
            parallel::map_slice(&leaves, |leaf| buffer(leaf, self.background, is_half));
        for buffer in buffers {
            out.extend_from_slice(&buffer);
        }
    }
}

impl<T: VoxelValue> Lower<'_, T> {
    fn put_topology(&self, out: &mut Vec<u8>, background: T, is_half: bool) {
        put_masks(out, 4, self.leaves.keys());
        let mut tiles = vec![background; volume(4)];
        for &offset in &self.inside {
            tiles[offset] = background.negative();
        }
        put_tiles(out, tiles.into_iter(), is_half);
        for leaf in self.leaves.values() {
            put_words(out, &leaf.active);
        }
    }
}

/// Offset of a voxel in its node, which has `2^(above - below)` children along an edge; x is
/// slowest.
fn offset(voxel: [i32; 3], below: u32, above: u32) -> usize {
    let edge_bits = above - below;
    voxel.iter().fold(0, |offset, x| {
        let within = (x >> below) & ((1 << edge_bits) - 1);
        (offset << edge_bits) | within as usize
    })
}

/// Child mask of an internal node with `2^bits` children along an edge, and its value mask, which
/// is empty.
fn put_masks<'a>(out: &mut Vec<u8>, bits: u32, children: impl Iterator<Item = &'a usize>) {
    let words = volume(bits) / 64;
    let mut mask = vec![0u64; words];
    for child in children {
        mask[child / 64] |= 1 << (child % 64);
    }
    put_words(out, &mask);
    put_words(out, &vec![0; words]);
}

/// The values of an internal node, all inactive and all written; zip compresses them to almost
/// nothing. OpenVDB omits them where it can, but in half precision it then omits their length too,
/// and vdb-rs 0.6 expects one.
fn put_tiles<T: VoxelValue>(out: &mut Vec<u8>, tiles: impl Iterator<Item = T>, is_half: bool) {
    out.push(inactive::STORED);
    let mut bytes = Vec::new();
    for tile in tiles {
        value::put(&mut bytes, tile, is_half);
    }
    out.extend_from_slice(&zipped(&bytes));
}

/// A leaf's mask again, followed by its active values.
fn buffer<T: VoxelValue>(leaf: &Leaf<T>, background: T, is_half: bool) -> Vec<u8> {
    let mut out = Vec::new();
    put_words(&mut out, &leaf.active);
    let mut is_background = [0u64; 8];
    let mut active = Vec::new();
    for (element, &value) in leaf.values.iter().enumerate() {
        if leaf.is_active(element) {
            value::put(&mut active, value, is_half);
        } else {
            debug_assert!(value == background || value == background.negative());
            is_background[element / 64] |= u64::from(value == background) << (element % 64);
        }
    }
    let all_inactive = leaf.active.map(|word| !word);
    if is_background == all_inactive {
        out.push(inactive::BACKGROUND);
    } else if is_background == [0; 8] {
        out.push(inactive::MINUS_BACKGROUND);
    } else {
        out.push(inactive::EITHER);
        put_words(&mut out, &is_background);
    }
    out.extend_from_slice(&zipped(&active));
    out
}

/// The bytes preceded by their length: zipped, or raw with a negative length if zipping does not
/// shorten them.
fn zipped(bytes: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
    // Writing to a Vec cannot fail; if it did, the bytes would be written raw.
    let zipped = encoder.write_all(bytes).and_then(|()| encoder.finish());
    let (length, content) = match &zipped {
        Ok(zipped) if zipped.len() < bytes.len() => (zipped.len() as i64, zipped.as_slice()),
        _ => (-(bytes.len() as i64), bytes),
    };
    [&length.to_le_bytes(), content].concat()
}

fn put_words(out: &mut Vec<u8>, words: &[u64]) {
    for word in words {
        out.extend_from_slice(&word.to_le_bytes());
    }
}
