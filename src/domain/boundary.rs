//! Solids as a solver meets them: samples with a weight in the density, and a signed distance.

use super::{sampling::BoundarySample, signed_distance::SignedDistance};

/// All solids of a scene.
#[derive(Clone, Debug, Default)]
pub struct Boundary {
    /// Samples over all surfaces of static solids, world space.
    pub samples: Vec<BoundarySample>,
    /// Distance to the union of the static solids; `None` where the scene has none.
    pub distance: Option<SignedDistance>,
    /// Distance to each moving solid, where it stood at the start.
    pub moving: Vec<SignedDistance>,
    /// Samples over the surface of each moving solid, where it stood at the start; none where the solver takes no samples.
    pub moving_samples: Vec<Vec<BoundarySample>>,
}

impl Boundary {
    /// Samples on all solids.
    pub fn sample_count(&self) -> usize {
        self.samples.len() + self.moving_samples.iter().map(Vec::len).sum::<usize>()
    }

    /// Distances to all solids, the static ones first.
    pub fn grids(&self) -> impl Iterator<Item = &SignedDistance> {
        self.distance.iter().chain(&self.moving)
    }
}
