//! OpenVDB files: writes sparse grids, and reads level sets of other programs.
//!
//! OpenVDB has no specification besides its source. Both directions follow `io/Archive.cc`,
//! `io/GridDescriptor.cc`, `io/Compression.h` and `tree/*.h` of OpenVDB 10, format version 224. A
//! file has metadata, then grid after grid: a descriptor with offsets, metadata, a transform, the
//! topology of the tree (32³ nodes of 16³ nodes of leaves of 8³ voxels), and the leaves' values.

mod cursor;
mod read;
mod write;

use cursor::Cursor;

pub use read::{GridFile, LevelSet, grids, level_set};
pub use write::{VdbGrid, encode};

/// First bytes of a file: the number 0x56444220 in 64 bits.
const MAGIC: [u8; 8] = *b" BDV\0\0\0\0";

/// Length of the text that identifies a file, a UUID.
const IDENTIFIER: usize = 36;

/// Type of a tree of 32-bit floats; a suffix says whether they are stored in half precision.
const FLOAT_TREE: &str = "Tree_float_5_4_3";

/// Versions of the file format.
mod version {
    /// The newest, which is written.
    pub(super) const NEWEST: u32 = 224;
    /// The oldest that is read: the first with today's transforms.
    pub(super) const OLDEST: u32 = 219;
    /// From here to [`PER_GRID`], a byte of the file says whether its grids are zipped.
    pub(super) const SELECTIVE: u32 = 220;
    /// Each grid says how it is compressed, and each buffer how inactive values are encoded.
    pub(super) const PER_GRID: u32 = 222;
}

/// Flags of a grid's compression.
mod compression {
    pub(super) const ZIP: u32 = 0x1;
    /// Inactive values are omitted.
    pub(super) const ACTIVE_MASK: u32 = 0x2;
    pub(super) const BLOSC: u32 = 0x4;
}

/// `io/Compression.h`: how the inactive values of a buffer are encoded.
mod inactive {
    /// All are the background.
    pub(super) const BACKGROUND: u8 = 0;
    /// All are minus the background.
    pub(super) const MINUS_BACKGROUND: u8 = 1;
    /// All are the value that follows.
    pub(super) const ONE: u8 = 2;
    /// A mask follows: set for the background, clear for minus the background.
    pub(super) const EITHER: u8 = 3;
    /// A value and a mask follow: set for the background, clear for that value.
    pub(super) const ONE_OR_BACKGROUND: u8 = 4;
    /// Two values and a mask follow: clear for the first.
    pub(super) const TWO: u8 = 5;
    /// They are stored like active values.
    pub(super) const STORED: u8 = 6;
}

/// Bits of a coordinate below a leaf, and below each kind of internal node.
const LEAF_BITS: u32 = 3;
const LOWER_BITS: u32 = LEAF_BITS + 4;
const UPPER_BITS: u32 = LOWER_BITS + 5;

/// Number of children, or of voxels, of a node with `2^bits` along an edge.
const fn volume(bits: u32) -> usize {
    1 << (3 * bits)
}

/// A value in the metadata of a file or grid.
#[derive(Clone, Debug, PartialEq)]
pub enum Metadata {
    /// Text.
    Text(String),
    /// Yes or no.
    Flag(bool),
    /// 32-bit integer.
    Int(i32),
    /// 64-bit integer.
    Long(i64),
    /// 64-bit float.
    Double(f64),
    /// Three 32-bit integers, such as a voxel's index.
    Ints([i32; 3]),
}

impl Metadata {
    /// OpenVDB's name of the type.
    fn kind(&self) -> &'static str {
        match self {
            Self::Text(_) => "string",
            Self::Flag(_) => "bool",
            Self::Int(_) => "int32",
            Self::Long(_) => "int64",
            Self::Double(_) => "double",
            Self::Ints(_) => "vec3i",
        }
    }

    fn bytes(&self) -> Vec<u8> {
        match self {
            Self::Text(text) => text.as_bytes().to_vec(),
            Self::Flag(flag) => vec![u8::from(*flag)],
            Self::Int(n) => n.to_le_bytes().to_vec(),
            Self::Long(n) => n.to_le_bytes().to_vec(),
            Self::Double(x) => x.to_le_bytes().to_vec(),
            Self::Ints(v) => v.iter().flat_map(|n| n.to_le_bytes()).collect(),
        }
    }

    /// The value of this kind with these bytes; `None` for an unknown kind or another length.
    fn of(kind: &str, bytes: &[u8]) -> Option<Self> {
        Some(match kind {
            "string" => Self::Text(String::from_utf8_lossy(bytes).into_owned()),
            "bool" => Self::Flag(<[u8; 1]>::try_from(bytes).ok()? != [0]),
            "int32" => Self::Int(i32::from_le_bytes(bytes.try_into().ok()?)),
            "int64" => Self::Long(i64::from_le_bytes(bytes.try_into().ok()?)),
            "double" => Self::Double(f64::from_le_bytes(bytes.try_into().ok()?)),
            "vec3i" if bytes.len() == 12 => Self::Ints(Cursor::new(bytes).ints().ok()?),
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests;
