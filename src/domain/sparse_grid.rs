//! Sparse voxel grids with leaves of 8³ voxels: the content of an OpenVDB tree.

use glam::DVec3;
use serde::{Deserialize, Serialize};

/// Voxels along the edge of a leaf.
pub const EDGE: i32 = 8;

/// Voxels in a leaf.
pub const VOXELS: usize = 512;

/// Precision with which the values of a grid are stored on disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Precision {
    /// 16 bits: accurate to 1/1000 of a voxel for a level set, and to 1/2000 relative
    /// for velocities.
    Half,
    /// 32 bits.
    Float,
}

impl Precision {
    /// Both precisions, with their names in scenes.
    pub const NAMED: [(&'static str, Self); 2] = [("half", Self::Half), ("float", Self::Float)];

    /// Returns the name used in scenes.
    pub fn name(self) -> &'static str {
        match self {
            Self::Half => "half",
            Self::Float => "float",
        }
    }
}

/// A sparse grid. Voxel (i, j, k) is the cell whose least corner lies at
/// `origin + voxel_size · (i, j, k)`.
#[derive(Clone, Debug, PartialEq)]
pub struct SparseGrid<T> {
    /// World position of the corner where the indices begin, metres.
    pub origin: DVec3,
    /// Edge length of a voxel, metres.
    pub voxel_size: f64,
    /// Value of all voxels outside of `leaves` and `inside`; inactive.
    pub background: T,
    /// Leaves in the order of their first voxels, x slowest.
    pub leaves: Vec<Leaf<T>>,
    /// First voxels of leaves whose voxels are all inactive and hold the negative background: the
    /// inside of a level set. Same order as `leaves`.
    pub inside: Vec<[i32; 3]>,
}

/// A block of 8³ voxels; its voxel (x, y, z) is element 64 x + 8 y + z.
#[derive(Clone, Debug, PartialEq)]
pub struct Leaf<T> {
    /// First voxel, a multiple of 8 along each axis.
    pub origin: [i32; 3],
    /// Activity mask with one bit per voxel, the lowest first.
    pub active: [u64; 8],
    /// One value per voxel; inactive voxels hold the background or its negative.
    pub values: Vec<T>,
}

impl<T> Leaf<T> {
    /// Returns the number of active voxels.
    pub fn active_count(&self) -> u64 {
        self.active.iter().map(|w| u64::from(w.count_ones())).sum()
    }

    /// Returns whether the voxel of `element` is active.
    pub fn is_active(&self, element: usize) -> bool {
        self.active[element / 64] >> (element % 64) & 1 == 1
    }

    /// Returns the index of the voxel of `element`.
    pub fn voxel(&self, element: usize) -> [i32; 3] {
        let at = [element / 64, element / 8 % 8, element % 8];
        std::array::from_fn(|axis| self.origin[axis] + at[axis] as i32)
    }
}

impl<T> SparseGrid<T> {
    /// Returns the number of active voxels.
    pub fn active_count(&self) -> u64 {
        self.leaves.iter().map(Leaf::active_count).sum()
    }

    /// Returns the least and greatest index of the active voxels; `None` if there are none.
    pub fn active_bounds(&self) -> Option<([i32; 3], [i32; 3])> {
        let active = self.leaves.iter().flat_map(|leaf| {
            (0..VOXELS)
                .filter(|&element| leaf.is_active(element))
                .map(|element| leaf.voxel(element))
        });
        active.fold(None, |bounds, at| {
            let (min, max) = bounds.unwrap_or((at, at));
            Some((
                std::array::from_fn(|axis| min[axis].min(at[axis])),
                std::array::from_fn(|axis| max[axis].max(at[axis])),
            ))
        })
    }
}
