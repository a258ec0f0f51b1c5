//! A grid file in OpenVDB's format: sparse, buffers zipped, inactive values omitted.
//!
//! OpenVDB has no specification besides its source. This writer follows `io/Archive.cc`,
//! `io/GridDescriptor.cc`, `io/Compression.h` and `tree/*.h` of OpenVDB 10, format version 224. The
//! library writes a random identifier into each file; ours is derived from the content, so that the
//! same frame gives the same bytes.

mod tree;
mod value;

use std::io::{self, Write};

use glam::DVec3;

use super::frame::{Stamp, Written};
use swell_domain::sparse_grid::{Precision, SparseGrid};
use value::Value;

/// "VDB " and four zero bytes.
const MAGIC: i64 = 0x5644_4220;
/// The newest version of the file format.
const FORMAT_VERSION: u32 = 224;
/// OpenVDB version that the files claim to be written by.
const LIBRARY_VERSION: [u32; 2] = [10, 0];
/// `COMPRESS_ZIP | COMPRESS_ACTIVE_MASK`, which every build of OpenVDB reads; Blosc is optional.
const COMPRESSION: u32 = 0x1 | 0x2;

/// Grids of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grids {
    /// Level set `surface`, metres.
    pub surface: Option<SparseGrid<f32>>,
    /// Staggered velocity grid `vel`, m/s.
    pub velocity: Option<SparseGrid<[f32; 3]>>,
}

impl Grids {
    /// The grids translated by `way`, metres.
    #[must_use]
    pub fn moved(mut self, way: DVec3) -> Self {
        if let Some(grid) = &mut self.surface {
            grid.origin += way;
        }
        if let Some(grid) = &mut self.velocity {
            grid.origin += way;
        }
        self
    }
}

/// Writes one file.
///
/// # Errors
/// Those of `out`.
pub fn encode(
    out: &mut impl Write,
    stamp: &Stamp<'_>,
    grids: &Grids,
    precision: Precision,
) -> io::Result<Written> {
    let mut body = Vec::new();
    let program = format!("{} {}", stamp.program, stamp.program_version);
    put_metadata(
        &mut body,
        &[
            ("creator", Metadata::Text(&program)),
            ("frame", Metadata::Int(stamp.frame as i32)),
            ("shot", Metadata::Text(stamp.shot)),
            ("time", Metadata::Double(stamp.time)),
        ],
    );
    let count = u32::from(grids.surface.is_some()) + u32::from(grids.velocity.is_some());
    put_u32(&mut body, count);
    if let Some(grid) = &grids.surface {
        put_grid(&mut body, "surface", "level set", grid, precision);
    }
    if let Some(grid) = &grids.velocity {
        put_grid(&mut body, "vel", "staggered", grid, precision);
    }
    let bytes = [header(&body), body].concat();
    out.write_all(&bytes)?;
    Ok(Written {
        bytes: bytes.len() as u64,
        hash: blake3::hash(&bytes),
    })
}

/// Hash of the values at this precision, independent of frame, shot and program.
pub fn content_hash(grids: &Grids, precision: Precision) -> io::Result<blake3::Hash> {
    let stamp = Stamp {
        program: "",
        program_version: "",
        shot: "",
        frame: 0,
        time: 0.0,
        origin: DVec3::ZERO,
    };
    encode(&mut io::sink(), &stamp, grids, precision).map(|written| written.hash)
}

/// Length in bytes of what [`header`] returns.
const HEADER: usize = 8 + 4 + 2 * 4 + 1 + 36;

/// Bytes before the file's metadata.
fn header(body: &[u8]) -> Vec<u8> {
    let mut header = MAGIC.to_le_bytes().to_vec();
    put_u32(&mut header, FORMAT_VERSION);
    for part in LIBRARY_VERSION {
        put_u32(&mut header, part);
    }
    // A file with offsets can be read grid by grid.
    header.push(1);
    header.extend_from_slice(identifier(body).as_bytes());
    debug_assert_eq!(header.len(), HEADER);
    header
}

/// A UUID of version 8 (RFC 9562), which leaves all other bits to the application.
fn identifier(body: &[u8]) -> String {
    let hash = blake3::hash(body).to_hex();
    let hex = hash.as_str();
    format!(
        "{}-{}-8{}-8{}-{}",
        &hex[..8],
        &hex[8..12],
        &hex[12..15],
        &hex[15..18],
        &hex[18..30]
    )
}

fn put_grid<T: Value>(
    body: &mut Vec<u8>,
    name: &str,
    class: &str,
    grid: &SparseGrid<T>,
    precision: Precision,
) {
    let is_half = precision == Precision::Half;
    put_text(body, name);
    let suffix = if is_half { "_HalfFloat" } else { "" };
    put_text(body, &format!("Tree_{}_5_4_3{suffix}", T::NAME));
    // Not an instance of another grid.
    put_text(body, "");
    let offsets = body.len();
    body.extend_from_slice(&[0; 24]);

    let start = body.len();
    put_u32(body, COMPRESSION);
    put_grid_metadata(body, name, class, grid, is_half);
    put_transform(body, grid);
    let tree = tree::Tree::of(grid);
    tree.put_topology(body, is_half);
    let blocks = body.len();
    tree.put_buffers(body, is_half);
    for (k, at) in [start, blocks, body.len()].into_iter().enumerate() {
        let at = (HEADER + at) as i64;
        body[offsets + 8 * k..][..8].copy_from_slice(&at.to_le_bytes());
    }
}

fn put_grid_metadata<T: Value>(
    body: &mut Vec<u8>,
    name: &str,
    class: &str,
    grid: &SparseGrid<T>,
    is_half: bool,
) {
    // OpenVDB's own value for a grid without active voxels.
    let nothing = ([i32::MAX; 3], [i32::MIN; 3]);
    let (min, max) = grid.active_bounds().unwrap_or(nothing);
    let count = grid.active_count() as i64;
    let mut entries = vec![
        ("class", Metadata::Text(class)),
        ("file_bbox_max", Metadata::Ints(max)),
        ("file_bbox_min", Metadata::Ints(min)),
        ("file_voxel_count", Metadata::Long(count)),
        ("is_saved_as_half_float", Metadata::Flag(is_half)),
        ("name", Metadata::Text(name)),
    ];
    if let Some(kind) = T::VECTOR_TYPE {
        entries.push(("vector_type", Metadata::Text(kind)));
    }
    put_metadata(body, &entries);
}

/// Index (i, j, k) maps to the centre of voxel (i, j, k); a staggered component i then lies half a
/// voxel before it along i, which is where [`SparseGrid`]'s faces are.
fn put_transform<T>(body: &mut Vec<u8>, grid: &SparseGrid<T>) {
    put_text(body, "UniformScaleTranslateMap");
    let size = grid.voxel_size;
    let translation = (grid.origin + 0.5 * size).to_array();
    let scales = [
        size,
        size,
        1.0 / size,
        1.0 / (size * size),
        1.0 / (2.0 * size),
    ];
    for value in translation
        .into_iter()
        .chain(scales.into_iter().flat_map(|s| [s; 3]))
    {
        body.extend_from_slice(&value.to_le_bytes());
    }
}

enum Metadata<'a> {
    Text(&'a str),
    Flag(bool),
    Int(i32),
    Long(i64),
    Double(f64),
    Ints([i32; 3]),
}

/// Entries sorted by name, as in OpenVDB's map.
fn put_metadata(body: &mut Vec<u8>, entries: &[(&str, Metadata<'_>)]) {
    debug_assert!(entries.is_sorted_by_key(|(name, _)| *name));
    put_u32(body, entries.len() as u32);
    for (name, value) in entries {
        put_text(body, name);
        let (kind, bytes) = match value {
            Metadata::Text(text) => ("string", text.as_bytes().to_vec()),
            Metadata::Flag(flag) => ("bool", vec![u8::from(*flag)]),
            Metadata::Int(n) => ("int32", n.to_le_bytes().to_vec()),
            Metadata::Long(n) => ("int64", n.to_le_bytes().to_vec()),
            Metadata::Double(x) => ("double", x.to_le_bytes().to_vec()),
            Metadata::Ints(v) => ("vec3i", v.iter().flat_map(|n| n.to_le_bytes()).collect()),
        };
        put_text(body, kind);
        put_u32(body, bytes.len() as u32);
        body.extend_from_slice(&bytes);
    }
}

fn put_text(out: &mut Vec<u8>, text: &str) {
    put_u32(out, text.len() as u32);
    out.extend_from_slice(text.as_bytes());
}

fn put_u32(out: &mut Vec<u8>, value: u32) {
    out.extend_from_slice(&value.to_le_bytes());
}
