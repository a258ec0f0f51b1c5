//! The surface of an OpenVDB level set: where it is 0, in world coordinates of the grid.

use super::{Digits, Raw};
use crate::{
    isosurface::sparse::{Band, around},
    sparse_grid::{Leaf, VOXELS},
    vdb::level_set,
};

/// Most active voxels of a level set: the search for its surface needs 30 bytes for each, and zip
/// makes a hundredth of that.
const MAX_VOXELS: u64 = 1 << 28;

/// Reads vertices in metres, and triangles.
pub(super) fn read(bytes: &[u8]) -> Result<Raw, String> {
    let grid = level_set(bytes)?;
    let count: u64 = grid.leaves.iter().map(Leaf::active_count).sum();
    if count > MAX_VOXELS {
        return Err(format!(
            "the level set has {count} active voxels; allowed are up to {MAX_VOXELS}"
        ));
    }
    // Tiles are entirely inside or outside: no surface passes through them.
    let mut band = Band::new();
    for leaf in &grid.leaves {
        for element in (0..VOXELS).filter(|&element| leaf.is_active(element)) {
            band.insert(leaf.voxel(element), leaf.values[element]);
        }
    }
    if let Some(value) = band.values().find(|value| !value.is_finite()) {
        return Err(format!("a value of the level set is {value}"));
    }
    let mesh = around(&band);
    let places = mesh.vertices.iter();
    let places = places.map(|&v| grid.translation + grid.scale * v);
    let triangles = mesh.triangles.iter().map(|t| t.map(u64::from));
    Ok(Raw::of_triangles(
        Digits::Double,
        places.collect(),
        triangles,
    ))
}
