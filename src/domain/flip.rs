//! Constants and formulas of the FLIP model that the GPU solver and its reference share.

use glam::DVec3;

/// Smallest distance of particles from walls and solids, in particle spacings; in the resting
/// lattice it is 0.5.
pub const CONTACT: f64 = 0.1;

/// A position nearer than this to a cell's face, in cells, counts as on it: in f32, positions
/// thousands of cells from the origin round to below the face.
pub const ON_FACE: f64 = 1e-3;

/// Open fraction below which a cell's centre lies in a wall or a solid; a cell with a wall through
/// its centre is still beside it.
pub const HALF: f64 = 0.5 - ON_FACE;

/// Returns the open length, along each axis, of the cell whose least corner is `cell`, between
/// walls at `low` and `high`; all in cells. Lengths within [`ON_FACE`] of 0 or 1 are rounded to it.
pub fn open_extent(cell: DVec3, [low, high]: [DVec3; 2]) -> DVec3 {
    let length = (cell + 1.0).min(high) - cell.max(low);
    DVec3::from_array(length.to_array().map(|length| {
        if length > 1.0 - ON_FACE {
            1.0
        } else if length < ON_FACE {
            0.0
        } else {
            length
        }
    }))
}

/// Returns the fraction of a cell that solids leave open of what walls do, from the cell's
/// open `volume`.
pub fn part_of_solids(extent: DVec3, volume: f64) -> f64 {
    volume / extent.element_product().max(1e-6)
}

/// Particles nearer to each other than this fraction of their spacing are pushed apart, in addition
/// to the density correction; so are particles nearer than half of it to a wall.
pub const APART: f64 = 0.9;

/// Replaces [`APART`] where the density iterations of the projection separate compressed
/// particles. Only coincident particles at the surface or in the air remain, which these
/// iterations do not see. At 0.9, a thin sheet that hits a solid throws up three times as many
/// drops (`scenes/quickstart.toml`, frames 20 to 40). The push off walls stays at [`APART`]:
/// otherwise the first layer would come nearer than in the lattice, and a stirred tank would lose
/// 2 % of its volume.
pub const LEAST_APART: f64 = 0.5;

/// Water in the open cells among the 27 around a particle at a plane surface, relative to their
/// capacity: the layer of cells below is the least that there can be.
pub const PLANE_SHARE: f64 = 1.0 / 3.0;

/// Limits a separation, in cells, to less than half a cell, so that every closer particle lies in
/// one of eight cells.
pub fn apart(wanted: f64) -> f64 {
    wanted.min(0.49)
}

/// Von Kármán constant κ of the law of the wall.
pub const VON_KARMAN: f64 = 0.41;

/// Displacement cap of a substep relative to the CFL displacement. Particles that the projection
/// accelerates beyond it are slowed and counted.
pub const CAP: f64 = 2.0;

/// Returns how many layers of faces a velocity is extrapolated outward for particles that move by
/// `displacement` cells: √3 times as many along a diagonal, plus those that trilinear samples at
/// both stages of the midpoint rule read.
pub fn layers(displacement: f64) -> usize {
    (3f64.sqrt() * displacement).ceil() as usize + 3
}

/// Returns the cells stored along each axis: one beyond the domain's own, for its upper faces; none
/// along periodic axes, where these are the lower faces of the first cells.
pub fn stored_cells(cells: [u32; 3], periodic: [bool; 3]) -> [u32; 3] {
    std::array::from_fn(|axis| cells[axis] + u32::from(!periodic[axis]))
}
