//! Grids in half precision for vdb-rs 0.6.
//!
//! A buffer that is compressed has its length before it, and one without values a length of 0. OpenVDB's writer of half precision
//! (`io::HalfWriter`, `io/Compression.h`) leaves that 0 out, and vdb-rs expects it: here it is put in. Formats 222 and newer.

use std::borrow::Cow;

/// Bytes of a length.
const LENGTH: usize = 8;
/// `COMPRESS_ZIP`, `COMPRESS_BLOSC`: buffers with a length.
const WITH_LENGTH: u32 = 0x1 | 0x4;
/// `COMPRESS_ACTIVE_MASK`: inactive values are left out.
const ACTIVE_MASK: u32 = 0x2;
/// Sides of nodes, in powers of two, from the root's children on down to the leaves.
const SIDES: [u32; 3] = [5, 4, 3];

/// The file with each length in its place; as it is where nothing is missing, and where it is not of a kind that is known.
pub(super) fn with_lengths(bytes: &[u8]) -> Cow<'_, [u8]> {
    match Walk::over(bytes) {
        Some(found) if !found.holes.is_empty() => Cow::Owned(found.filled()),
        _ => Cow::Borrowed(bytes),
    }
}

/// A way through a file.
struct Walk<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Where a length is missing, ascending.
    holes: Vec<usize>,
    /// Where the file tells of a place in itself, as a length of 8 bytes.
    places: Vec<usize>,
}

impl<'a> Walk<'a> {
    /// Through all of it; `None` of what it does not know.
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
        // Library, whether grids have places, identifier.
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

    /// Whether it says of half precision.
    fn metadata(&mut self) -> Option<bool> {
        let mut is_half = false;
        for _ in 0..self.number()? {
            let (name, _kind, value) = (self.text()?, self.text()?, self.text()?);
            is_half |= name == b"is_saved_as_half_float" && value == [1];
        }
        Some(is_half)
    }

    /// From its descriptor to its end.
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
        // Else it would be gone over again and again.
        if end < self.at {
            return None;
        }
        self.at = end;
        Some(())
    }

    /// Past the map and the tree's nodes; how many leaves they have.
    fn topology(&mut self, is_sparse: bool) -> Option<usize> {
        // Five triples of doubles, or six with a translation, as vdb-rs has them.
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

    /// Past a node; how many children it has.
    fn node(&mut self, side: u32, is_sparse: bool) -> Option<usize> {
        let (children, active) = (self.take(mask_bytes(side))?, self.take(mask_bytes(side))?);
        self.values(side, active, is_sparse)?;
        Some(ones(children))
    }

    /// Past a node's values, of which `active` says which count; of a sparse grid the others are left out.
    fn values(&mut self, side: u32, active: &[u8], is_sparse: bool) -> Option<()> {
        let all = 8 * mask_bytes(side);
        let kind = *self.take(1)?.first()?;
        // `io::NodeMetaData`: inactive values, and a mask of which of two it is.
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
        // Below 0 it is that of what is not compressed.
        let length = usize::try_from(self.long()?.unsigned_abs()).ok()?;
        self.take(length)?;
        Some(())
    }

    /// The file with a length of 0 in each hole, and its places moved by those before them.
    fn filled(&self) -> Vec<u8> {
        let mut filled = Vec::with_capacity(self.bytes.len() + LENGTH * self.holes.len());
        let mut from = 0;
        for &hole in &self.holes {
            filled.extend_from_slice(&self.bytes[from..hole]);
            filled.extend_from_slice(&[0; LENGTH]);
            from = hole;
        }
        filled.extend_from_slice(&self.bytes[from..]);
        // A grid that was not walked through may tell of any place.
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

    /// Each byte spoiled in turn, and the file cut anywhere: it comes to an end, and puts in no more than the file has room for.
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
