//! Writes grids: sparse, buffers zipped, inactive values omitted.
//!
//! The library writes a random identifier into each file; ours is derived from the content, so that
//! the same grids give the same bytes.

mod tree;
mod value;

use super::{IDENTIFIER, MAGIC, Metadata, compression, version};
use crate::sparse_grid::{Precision, SparseGrid};
use tree::Tree;
use value::VoxelValue;

/// OpenVDB version that the files claim to be written by.
const LIBRARY_VERSION: [u32; 2] = [10, 0];
/// What every build of OpenVDB reads; Blosc is optional.
const COMPRESSION: u32 = compression::ZIP | compression::ACTIVE_MASK;

/// A grid to write, with its name.
#[derive(Clone, Copy, Debug)]
pub enum VdbGrid<'a> {
    /// Signed distances, negative inside.
    LevelSet(&'a str, &'a SparseGrid<f32>),
    /// Vectors whose components lie on the faces of voxels.
    Staggered(&'a str, &'a SparseGrid<[f32; 3]>),
    /// Densities at the centres of voxels.
    Fog(&'a str, &'a SparseGrid<f32>),
    /// Vectors at the centres of voxels.
    Vectors(&'a str, &'a SparseGrid<[f32; 3]>),
}

/// Returns a file with these metadata, sorted by name, and grids.
pub fn encode(
    metadata: &[(&str, Metadata)],
    grids: &[VdbGrid<'_>],
    precision: Precision,
) -> Vec<u8> {
    let mut body = Vec::new();
    put_metadata(&mut body, metadata);
    put_u32(&mut body, grids.len() as u32);
    for grid in grids {
        match *grid {
            VdbGrid::LevelSet(name, grid) => {
                put_grid(&mut body, name, "level set", grid, precision)
            }
            VdbGrid::Staggered(name, grid) => {
                put_grid(&mut body, name, "staggered", grid, precision)
            }
            VdbGrid::Fog(name, grid) => put_grid(&mut body, name, "fog volume", grid, precision),
            // OpenVDB's name of no class.
            VdbGrid::Vectors(name, grid) => put_grid(&mut body, name, "unknown", grid, precision),
        }
    }
    [header(&body), body].concat()
}

/// Length in bytes of what [`header`] returns.
const HEADER: usize = MAGIC.len() + 4 + 2 * 4 + 1 + IDENTIFIER;

/// Bytes before the file's metadata.
fn header(body: &[u8]) -> Vec<u8> {
    let mut header = MAGIC.to_vec();
    put_u32(&mut header, version::NEWEST);
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

fn put_grid<T: VoxelValue>(
    body: &mut Vec<u8>,
    name: &str,
    class: &str,
    grid: &SparseGrid<T>,
    precision: Precision,
) {
    let is_half = precision == Precision::Half;
    put_text(body, name);
    let suffix = if is_half { "_HalfFloat" } else { "" };
    put_text(body, &format!("{}{suffix}", T::TREE));
    // Not an instance of another grid.
    put_text(body, "");
    let offsets = body.len();
    body.extend_from_slice(&[0; 24]);

    let start = body.len();
    put_u32(body, COMPRESSION);
    put_grid_metadata(body, name, class, grid, is_half);
    put_transform(body, grid);
    let tree = Tree::of(grid);
    tree.put_topology(body, is_half);
    let blocks = body.len();
    tree.put_buffers(body, is_half);
    for (k, at) in [start, blocks, body.len()].into_iter().enumerate() {
        let at = (HEADER + at) as i64;
        body[offsets + 8 * k..][..8].copy_from_slice(&at.to_le_bytes());
    }
}

fn put_grid_metadata<T: VoxelValue>(
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
        ("class", Metadata::Text(class.to_owned())),
        ("file_bbox_max", Metadata::Ints(max)),
        ("file_bbox_min", Metadata::Ints(min)),
        ("file_voxel_count", Metadata::Long(count)),
        ("is_saved_as_half_float", Metadata::Flag(is_half)),
        ("name", Metadata::Text(name.to_owned())),
    ];
    if let Some(kind) = T::VECTOR_TYPE {
        entries.push(("vector_type", Metadata::Text(kind.to_owned())));
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

/// Entries sorted by name, as in OpenVDB's map.
fn put_metadata(body: &mut Vec<u8>, entries: &[(&str, Metadata)]) {
    debug_assert!(entries.is_sorted_by_key(|(name, _)| *name));
    put_u32(body, entries.len() as u32);
    for (name, value) in entries {
        let bytes = value.bytes();
        put_text(body, name);
        put_text(body, value.kind());
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
