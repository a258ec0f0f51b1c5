//! Grid of the signed distance to static solids.

use std::borrow::Cow;

use super::{Scene, Solver};
use swell_domain::{
    bounds::Bounds, flip, mesh::TriangleMesh, pbf, signed_distance::fitting_spacing,
};

/// Margin of the signed distance around the solids, particle spacings: more than the contact
/// distance and the cells that a substep crosses.
const MARGIN: f64 = 4.0;

/// Largest number of nodes of the distance grid of static solids: a binding of 128 MiB, which every
/// adapter supports. If these do not suffice for one node per particle spacing, the nodes are
/// farther apart on any adapter.
pub const MOST_NODES: usize = 1 << 25;

impl Scene {
    /// Returns the margin of the signed distance around the solids, metres. In a periodic domain it
    /// includes the largest displacement of a particle beyond the domain in a substep.
    pub fn solid_margin(&self) -> f64 {
        let way = match &self.solver {
            Solver::Pbf(pbf) => pbf::CAP * pbf.cfl * pbf.particle_spacing,
            Solver::Flip(flip) => flip::CAP * flip.cfl * flip.cell_size,
        };
        let beyond = if self.is_periodic() { way } else { 0.0 };
        MARGIN * self.particle_spacing() + beyond
    }

    /// Returns the box around the static solids with a margin, clipped to where water can be, and
    /// the distance between the nodes of its grid, metres: a particle spacing, or more if
    /// [`MOST_NODES`] requires it. `None` if there are no solids.
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
