//! Makes grids in half precision readable for vdb-rs 0.6.
//!
//! A compressed buffer is preceded by its length, and an empty one by a length of 0. OpenVDB's
//! writer of half precision (`io::HalfWriter`, `io/Compression.h`) omits that 0, but vdb-rs expects
//! it: this module inserts it. It knows file format 222 and newer.

use std::borrow::Cow;

/// Bytes of a length.
const LENGTH: usize = 8;
/// `COMPRESS_ZIP` and `COMPRESS_BLOSC`: buffers with a length.
const WITH_LENGTH: u32 = 0x1 | 0x4;
/// `COMPRESS_ACTIVE_MASK`: inactive values are omitted.
const ACTIVE_MASK: u32 = 0x2;
/// Edge lengths of nodes, as powers of two, from the root's children down to the leaves.
const SIDES: [u32; 3] = [5, 4, 3];

/// Returns the file with all lengths present; unchanged if nothing is missing, or if its kind
/// is unknown.
pub(super) fn with_lengths(bytes: &[u8]) -> Cow<'_, [u8]> {
    match Walk::over(bytes) {
        Some(found) if !found.holes.is_empty() => Cow::Owned(found.filled()),
        _ => Cow::Borrowed(bytes),
    }
}

/// A traversal of a file.
struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Positions of missing lengths, ascending.
    holes: Vec<usize>,
    /// Positions of file offsets, each a group of three with 8 bytes each.
    places: Vec<usize>,
}

impl<'a> Walk<'a> {
    /// Traverses the whole file; `None` for a kind that it does not know.
    fn over(bytes: &'a [u8]) -> Option<Self> {
        let mut walk = Self {
            bytes,
            at: 8,
            holes: Vec::new(),
            places: Vec::new(),
        };
        if walk.number()? < 222 {
            return None;
        }
        // Library version, whether grids have offsets, identifier.
        walk.take(4 + 4 + 1 + 36)?;
        walk.metadata()?;
        for _ in 0..walk.number()? {
            walk.grid()?;
        }
        Some(walk)
    }

    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let part = self.bytes.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(part)
    }

    fn number(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(self.take(4)?.try_into().ok()?))
    }

    fn long(&mut self) -> Option<i64> {
        Some(i64::from_le_bytes(self.take(LENGTH)?.try_into().ok()?))
    }

    fn text(&mut self) -> Option<&'a [u8]> {
        let length = self.number()?;
        self.take(length as usize)
    }

    /// Reads metadata; returns whether it declares half precision.
    fn metadata(&mut self) -> Option<bool> {
        let mut is_half = false;
        for _ in 0..self.number()? {
            let (name, _kind, value) = (self.text()?, self.text()?, self.text()?);
            is_half |= name == b"is_saved_as_half_float" && value == [1];
        }
        Some(is_half)
    }

    /// Traverses a grid, from its descriptor to its end.
    fn grid(&mut self) -> Option<()> {
        let (_name, kind, _parent) = (self.text()?, self.text()?, self.text()?);
        self.places.push(self.at);
        let (start, blocks, end) = (self.long()?, self.long()?, self.long()?);
        self.at = usize::try_from(start).ok()?;
        let compression = self.number()?;
        let is_half = self.metadata()?;
        if is_half && kind.starts_with(b"Tree_float_5_4_3") && compression & WITH_LENGTH != 0 {
            let is_sparse = compression & ACTIVE_MASK != 0;
            let leaves = self.topology(is_sparse)?;
            self.at = usize::try_from(blocks).ok()?;
            for _ in 0..leaves {
                let mask = self.take(mask_bytes(SIDES[2]))?;
                self.values(SIDES[2], mask, is_sparse)?;
            }
        }
        let end = usize::try_from(end).ok()?;
        // Otherwise the same bytes would be traversed again and again.
        if end < self.at {
            return None;
        }
        self.at = end;
        Some(())
    }

    /// Skips the map and the nodes of the tree; returns the number of leaves.
    fn topology(&mut self, is_sparse: bool) -> Option<usize> {
        // Five triples of doubles, or six with a translation, as vdb-rs reads them.
        let map = match self.text()? {
            b"UniformScaleMap" => 5 * 24,
            b"UniformScaleTranslateMap" | b"ScaleTranslateMap" => 6 * 24,
            _ => return None,
        };
        self.take(map)?;
        // Number of buffers, background.
        self.take(4 + 4)?;
        let (tiles, children) = (self.number()?, self.number()?);
        self.take((tiles as usize).checked_mul(12 + 4 + 1)?)?;
        let mut leaves = 0;
        for _ in 0..children {
            self.take(12)?;
            for _ in 0..self.node(SIDES[0], is_sparse)? {
                let within = self.node(SIDES[1], is_sparse)?;
                self.take(within.checked_mul(mask_bytes(SIDES[2]))?)?;
                leaves += within;
            }
        }
        Some(leaves)
    }

    /// Skips a node; returns the number of its children.
    fn node(&mut self, side: u32, is_sparse: bool) -> Option<usize> {
        let (children, active) = (self.take(mask_bytes(side))?, self.take(mask_bytes(side))?);
        self.values(side, active, is_sparse)?;
        Some(ones(children))
    }

    /// Skips the values of a node. `active` is the mask of active values; a sparse grid omits
    /// the others.
    fn values(&mut self, side: u32, active: &[u8], is_sparse: bool) -> Option<()> {
        let all = 8 * mask_bytes(side);
        let kind = *self.take(1)?.first()?;
        // `io::NodeMetaData`: number of inactive values, and whether a mask selects between two.
        let (inactive, has_mask) = match kind {
            0 | 1 | 6 => (0, false),
            2 => (1, false),
            3 => (0, true),
            4 => (1, true),
            5 => (2, true),
            _ => return None,
        };
        self.take(4 * inactive + if has_mask { mask_bytes(side) } else { 0 })?;
        let count = match is_sparse && kind != 6 {
            true => ones(active),
            false => all,
        };
        if count == 0 {
            self.holes.push(self.at);
            return Some(());
        }
        // A negative length is that of uncompressed data.
        let length = usize::try_from(self.long()?.unsigned_abs()).ok()?;
        self.take(length)?;
        Some(())
    }

    /// Copies the file, inserts a length of 0 at each hole, and moves the offsets accordingly.
    fn filled(&self) -> Vec<u8> {
        let mut filled = Vec::with_capacity(self.bytes.len() + LENGTH * self.holes.len());
        let mut from = 0;
        for &hole in &self.holes {
            filled.extend_from_slice(&self.bytes[from..hole]);
            filled.extend_from_slice(&[0; LENGTH]);
            from = hole;
        }
        filled.extend_from_slice(&self.bytes[from..]);
        // Grids that were not traversed may hold any offset.
        let moved = |place: usize| {
            place.saturating_add(LENGTH * self.holes.partition_point(|&it| it <= place))
        };
        for place in self
            .places
            .iter()
            .flat_map(|&first| (0..3).map(move |k| first + k * LENGTH))
        {
            let at = moved(place);
            if let Some(told) = filled.get_mut(at..at + LENGTH)
                && let Ok(of) = <[u8; LENGTH]>::try_from(&*told)
            {
                let of = moved(i64::from_le_bytes(of) as usize);
                told.copy_from_slice(&(of as i64).to_le_bytes());
            }
        }
        filled
    }
}

fn mask_bytes(side: u32) -> usize {
    (1 << (3 * side)) / 8
}

fn ones(mask: &[u8]) -> usize {
    mask.iter().map(|byte| byte.count_ones() as usize).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const HALF: &[u8] = include_bytes!("../../../../tests/suite/domain/files/half.vdb");

    /// Each byte damaged in turn, and the file cut anywhere: the traversal ends, and inserts no
    /// more lengths than the file has space for.
    #[test]
    fn no_damage_makes_the_walk_panic() {
        assert_eq!(with_lengths(HALF).len(), HALF.len() + 6 * LENGTH);
        let head = 1500;
        let mut spoiled = HALF.to_vec();
        for at in (0..head).chain((head..HALF.len()).step_by(53)) {
            for value in [0x00, 0x7f, 0xff] {
                let whole = spoiled[at];
                spoiled[at] = value;
                assert!(with_lengths(&spoiled).len() < 9 * HALF.len());
                spoiled[at] = whole;
            }
        }
        for end in (0..HALF.len()).step_by(97) {
            assert!(with_lengths(&HALF[..end]).len() < 9 * HALF.len());
        }
    }
}
