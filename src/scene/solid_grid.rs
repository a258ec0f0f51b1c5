//! The grid on which distances to solids are known.

use std::borrow::Cow;

use super::{Method, Scene};
use swell_domain::{
    bounds::Bounds, flip, mesh::TriangleMesh, pbf, signed_distance::fitting_spacing,
};

/// Spacings that the signed distance reaches beyond the solids: more than the contact distance and the cells
/// that a substep crosses.
const MARGIN: f64 = 4.0;

/// Nodes of the grid of solids that do not move: as many values as a binding of 128 MiB holds, which every adapter has. Where that
/// does for less than one a particle spacing, they stand farther apart, whatever the adapter.
pub const MOST_NODES: usize = 1 << 25;

impl Scene {
    /// Metres that a signed distance reaches beyond the solids: where the domain joins its own end, as far as a particle may
    /// come beyond it in a substep as well.
    pub fn solid_margin(&self) -> f64 {
        let way = match self.solver.method {
            Method::Pbf => pbf::CAP * self.solver.pbf().cfl * self.particle_spacing(),
            Method::Flip => {
                let solver = self.solver.flip();
                flip::CAP * solver.cfl * solver.cell_size
            }
        };
        let beyond = if self.is_periodic() { way } else { 0.0 };
        MARGIN * self.particle_spacing() + beyond
    }

    /// Where solids at rest are, with room about them, as far as water can come, and metres between the nodes of their distance's grid: a
    /// particle spacing, or what at most [`MOST_NODES`] allow. `None` where there are none.
    pub fn solid_grid(&self, meshes: &[Cow<'_, TriangleMesh>]) -> Option<(Bounds, f64)> {
        let margin = self.solid_margin();
        let reach = self.domain.grown(margin);
        let bounds = meshes.iter().filter_map(|mesh| mesh.bounds());
        let all = bounds.reduce(|all, other| Bounds {
            min: all.min.min(other.min),
            max: all.max.max(other.max),
        })?;
        let clipped = all.grown(margin).intersection(&reach);
        let spacing = || fitting_spacing(&clipped, self.particle_spacing(), MOST_NODES);
        (clipped.min.cmplt(clipped.max).all()).then(|| (clipped, spacing()))
    }
}
