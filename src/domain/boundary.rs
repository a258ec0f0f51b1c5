//! Solids as a solver sees them: surface samples that contribute to the density, and a
//! signed distance.

use super::{sampling::BoundarySample, signed_distance::SignedDistance};

/// All solids of a scene.
#[derive(Clone, Debug, Default)]
pub struct Boundary {
    /// Samples of the surfaces of all static solids, world space.
    pub samples: Vec<BoundarySample>,
    /// Signed distance to the union of the static solids; `None` if the scene has none.
    pub distance: Option<SignedDistance>,
    /// Signed distance to each moving solid, in its pose at the start.
    pub moving: Vec<SignedDistance>,
    /// Surface samples of each moving solid, in its pose at the start; empty where the solver takes
    /// no samples.
    pub moving_samples: Vec<Vec<BoundarySample>>,
}

impl Boundary {
    /// Returns the number of samples on all solids.
    pub fn sample_count(&self) -> usize {
        self.samples.len() + self.moving_samples.iter().map(Vec::len).sum::<usize>()
    }

    /// Iterates over the distances to all solids, the static ones first.
    pub fn grids(&self) -> impl Iterator<Item = &SignedDistance> {
        self.distance.iter().chain(&self.moving)
    }
}
