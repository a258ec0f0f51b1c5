//! Numbers of the FLIP model that the GPU solver and its reference share.

use glam::DVec3;

/// Particles keep this part of their spacing from walls and solids; at rest the lattice stands at 0.5.
pub const CONTACT: f64 = 0.1;

/// Nearer than this to a cell's face, in cells, counts as on it: positions of thousands of cells in f32 round below it.
pub const ON_FACE: f64 = 1e-3;

/// A cell that is open by less has its centre in a wall or a solid; a wall through the centre is beside it.
pub const HALF: f64 = 0.5 - ON_FACE;

/// Open part along each axis of the cell whose least corner is `cell`, of what walls at `low` and `high` leave; all in cells.
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

/// Part of a cell that solids leave of what walls do, from its open `volume`.
pub fn part_of_solids(extent: DVec3, volume: f64) -> f64 {
    volume / extent.element_product().max(1e-6)
}

/// Particles that are nearer to each other than this part of their spacing are pushed apart beside the density correction, and
/// off walls that are nearer than half of it.
pub const APART: f64 = 0.9;

/// The same where iterations on their own densities hold particles apart that are pressed together: only what those do not
/// see is left, particles on one spot at the surface or in the air. At 0.9 a thin sheet that meets a solid throws three times
/// as many drops up (`scenes/quickstart.toml`, frames 20 to 40). Off walls they are pushed as others: the first layer would come
/// nearer than in the lattice, and a stirred tank lose 2 % of its volume.
pub const LEAST_APART: f64 = 0.5;

/// Water in the open ones of the 27 cells about a particle of a plane surface, over what those hold: the layer of cells below has the
/// least that there can be.
pub const PLANE_SHARE: f64 = 1.0 / 3.0;

/// A distance in cells; below half a cell, so that whoever is nearer lies in one of eight.
pub fn apart(wanted: f64) -> f64 {
    wanted.min(0.49)
}

/// κ of the law of the wall.
pub const VON_KARMAN: f64 = 0.41;

/// Displacement cap of a substep over the CFL displacement: what the projection speeds up beyond this is slowed
/// and counted.
pub const CAP: f64 = 2.0;

/// Layers of faces that a velocity is carried outward where particles move by so many cells: √3 times as many
/// along a diagonal, and what trilinear samples at both stages of the midpoint rule add.
pub fn layers(displacement: f64) -> usize {
    (3f64.sqrt() * displacement).ceil() as usize + 3
}

/// Cells stored along each axis: one beyond the domain's own, for its upper faces; none where these are the lower faces
/// of the first cells.
pub fn stored_cells(cells: [u32; 3], periodic: [bool; 3]) -> [u32; 3] {
    std::array::from_fn(|axis| cells[axis] + u32::from(!periodic[axis]))
}
