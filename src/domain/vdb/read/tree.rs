//! Reads a tree of floats: its topology, then its leaves' values.

use std::{borrow::Cow, io::Read};

use flate2::bufread::ZlibDecoder;
use half::f16;

use super::blosc;
use crate::{
    sparse_grid::{Leaf, VOXELS},
    vdb::{
        LEAF_BITS, LOWER_BITS, UPPER_BITS, compression, cursor::Cursor, inactive, version, volume,
    },
};

/// Values of a node as they are stored.
struct Stored<'a> {
    /// Inactive values where the mask is clear, and where it is set.
    inactive: [f32; 2],
    mask: &'a [u8],
    /// Whether only active values are stored.
    is_sparse: bool,
    /// Number of bytes when unpacked.
    size: usize,
    bytes: &'a [u8],
    is_packed: bool,
}

/// Reads a tree of floats.
pub(super) struct Tree<'a> {
    pub(super) cursor: Cursor<'a>,
    pub(super) version: u32,
    pub(super) compression: u32,
    pub(super) is_half: bool,
    /// Read by [`Self::topology`].
    pub(super) background: f32,
}

impl<'a> Tree<'a> {
    /// Reads all but the leaves' values; returns the leaves' first voxels.
    pub(super) fn topology(&mut self) -> Result<Vec<[i32; 3]>, String> {
        let cursor = &mut self.cursor;
        let buffers = cursor.number()?;
        if buffers != 1 {
            return Err(format!("{buffers} values in a voxel; 1 is read"));
        }
        self.background = cursor.float()?;
        let (tiles, nodes) = (cursor.number()?, cursor.number()?);
        // Index, value, whether it is active.
        cursor.take((tiles as usize).saturating_mul(12 + 4 + 1))?;
        let mut leaves = Vec::new();
        for _ in 0..nodes {
            let origin = self.cursor.ints()?;
            // Then no index of a voxel overflows.
            if origin.iter().any(|x| x % (1 << UPPER_BITS) != 0) {
                return Err(format!("damaged: a node at {origin:?}"));
            }
            for lower in self.node(origin, LOWER_BITS, UPPER_BITS)? {
                let within = self.node(lower, LEAF_BITS, LOWER_BITS)?;
                self.cursor.take(within.len() * VOXELS / 8)?;
                leaves.extend(within);
            }
        }
        Ok(leaves)
    }

    /// Skips the tiles of an internal node; returns the first voxels of its children.
    fn node(&mut self, origin: [i32; 3], below: u32, above: u32) -> Result<Vec<[i32; 3]>, String> {
        let bits = above - below;
        let count = volume(bits);
        let children = self.cursor.take(count / 8)?;
        let active = self.cursor.take(count / 8)?;
        let all = match self.version < version::PER_GRID {
            true => count - ones(children),
            false => count,
        };
        self.stored(active, all)?;
        let within = |child: usize, axis: u32| (child >> (bits * axis)) as i32 & ((1 << bits) - 1);
        let voxel = |child| {
            let [x, y, z] = origin;
            [
                x + (within(child, 2) << below),
                y + (within(child, 1) << below),
                z + (within(child, 0) << below),
            ]
        };
        let is_child = |&child: &usize| is_set(children, child);
        Ok((0..count).filter(is_child).map(voxel).collect())
    }

    pub(super) fn leaf(&mut self, origin: [i32; 3]) -> Result<Leaf<f32>, String> {
        let active = self.cursor.take(VOXELS / 8)?;
        if self.version < version::PER_GRID {
            // The first voxel, which is known, and the number of buffers.
            self.cursor.take(12)?;
            let buffers = self.cursor.byte()?;
            if buffers != 1 {
                return Err(format!("a leaf with {buffers} buffers; allowed is 1"));
            }
        }
        let stored = self.stored(active, VOXELS)?;
        let unpacked = self.unpacked(&stored)?;
        let half = |b: &[u8]| f16::from_le_bytes([b[0], b[1]]).to_f32();
        let single = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
        let mut numbers: Box<dyn Iterator<Item = f32>> = match self.is_half {
            true => Box::new(unpacked.chunks_exact(2).map(half)),
            false => Box::new(unpacked.chunks_exact(4).map(single)),
        };
        let mut value = |element| match stored.is_sparse && !is_set(active, element) {
            true => stored.inactive[usize::from(is_set(stored.mask, element))],
            false => numbers.next().unwrap_or(f32::NAN),
        };
        Ok(Leaf {
            origin,
            active: Cursor::new(active).mask()?,
            values: (0..VOXELS).map(&mut value).collect(),
        })
    }

    /// Reads the values of a node, of which it has `all`.
    fn stored(&mut self, active: &[u8], all: usize) -> Result<Stored<'a>, String> {
        let cursor = &mut self.cursor;
        let kind = match self.version < version::PER_GRID {
            true => inactive::STORED,
            false => cursor.byte()?,
        };
        let background = self.background;
        let inactive = match kind {
            inactive::BACKGROUND => [background; 2],
            inactive::MINUS_BACKGROUND | inactive::EITHER | inactive::STORED => {
                [-background, background]
            }
            inactive::ONE | inactive::ONE_OR_BACKGROUND => [cursor.float()?, background],
            inactive::TWO => [cursor.float()?, cursor.float()?],
            _ => return Err(format!("damaged: {kind} as the kind of inactive values")),
        };
        let mask = match kind {
            inactive::EITHER | inactive::ONE_OR_BACKGROUND | inactive::TWO => {
                cursor.take(active.len())?
            }
            _ => &[],
        };
        let is_sparse =
            self.compression & compression::ACTIVE_MASK != 0 && kind != inactive::STORED;
        let count = if is_sparse { ones(active) } else { all };
        let size = count * if self.is_half { 2 } else { 4 };
        let is_compressed = self.compression & (compression::ZIP | compression::BLOSC) != 0;
        // OpenVDB's writer of half precision (`io::HalfWriter`) omits the length of nothing.
        let (length, is_packed) = match is_compressed && !(self.is_half && count == 0) {
            true => {
                let length = cursor.long()?;
                // A negative length is that of uncompressed values.
                let is_packed = length > 0;
                let length = usize::try_from(length.unsigned_abs()).unwrap_or(usize::MAX);
                (length, is_packed)
            }
            false => (size, false),
        };
        if !is_packed && length != size {
            return Err(format!(
                "damaged: {length} bytes of values instead of {size}"
            ));
        }
        Ok(Stored {
            inactive,
            mask,
            is_sparse,
            size,
            bytes: cursor.take(length)?,
            is_packed,
        })
    }

    fn unpacked(&self, stored: &Stored<'a>) -> Result<Cow<'a, [u8]>, String> {
        if !stored.is_packed {
            return Ok(stored.bytes.into());
        }
        if stored.size == 0 {
            return Ok(Cow::Borrowed(&[]));
        }
        if self.compression & compression::BLOSC != 0 {
            return blosc::decompress(stored.bytes, stored.size).map(Cow::Owned);
        }
        let mut unpacked = Vec::with_capacity(stored.size);
        ZlibDecoder::new(stored.bytes)
            .take(stored.size as u64 + 1)
            .read_to_end(&mut unpacked)
            .map_err(|error| format!("damaged: zipped values: {error}"))?;
        match unpacked.len() == stored.size {
            true => Ok(unpacked.into()),
            false => Err(format!(
                "damaged: zipped values of other than {} bytes",
                stored.size
            )),
        }
    }
}

/// Whether a bit of a mask is set; an empty mask has none.
fn is_set(mask: &[u8], bit: usize) -> bool {
    mask.get(bit / 8)
        .is_some_and(|byte| byte >> (bit % 8) & 1 == 1)
}

fn ones(mask: &[u8]) -> usize {
    mask.iter().map(|byte| byte.count_ones() as usize).sum()
}
