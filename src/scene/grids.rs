//! `[grids]`: grids written with each frame beside its particles.

use swell_domain::sparse_grid::Precision;

/// Grids written with each frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grids {
    /// Whether to write a level set of the water's surface.
    pub surface: bool,
    /// Whether to write the water's velocity on cell faces.
    pub velocity: bool,
    /// Edge of a voxel, metres. The default is FLIP's cell size, or two particle spacings with PBF,
    /// which is the same for eight particles per cell.
    pub voxel_size: f64,
    /// Storage precision of the values.
    pub precision: Precision,
}
