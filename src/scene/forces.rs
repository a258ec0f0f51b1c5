//! Force fields of a scene.

use std::sync::Arc;

use glam::DVec3;

use super::{PlacedMesh, Scene, sources::Region};
use swell_domain::{
    forces::{Force, ForceField, Medium},
    signed_distance::SignedDistanceError,
    sources::Shape,
};

/// Share of a time in which a force is taken to act. Times that end where another begins overlap
/// by rounding.
const LEAST_SHARE: f64 = 1e-9;

/// A force field, with its room as the scene names it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedForce {
    /// Room; `None` is everywhere.
    pub region: Option<Region>,
    /// The force, whose room has the shape of `region`.
    pub force: Force,
}

impl Region {
    /// Returns the shape that forces act in: a mesh by distances that are sampled one particle
    /// spacing apart, metres.
    ///
    /// # Errors
    /// If the signed distance of the mesh cannot be computed.
    pub fn force_room(&self, spacing: f64) -> Result<Arc<Shape>, SignedDistanceError> {
        Ok(Arc::new(match self {
            Self::Block(block) => Shape::from(*block),
            Self::Mesh(placed) => Shape::sampled(&placed.mesh, spacing, spacing)?,
        }))
    }
}

impl Scene {
    /// Returns the forces on a medium in the `length` seconds from `start`.
    pub fn force_field(&self, medium: Medium, span: (f64, f64)) -> ForceField<'_> {
        ForceField::new(self.forces.iter().map(|it| &it.force), medium, span)
    }

    /// Returns the forces on a medium, whenever they act.
    pub fn forces_on(&self, medium: Medium) -> impl Iterator<Item = &Force> {
        let all = self.forces.iter().map(|it| &it.force);
        all.filter(move |force| force.on.contains(&medium))
    }

    /// Whether a force acts on a medium at some time.
    pub fn has_forces_on(&self, medium: Medium) -> bool {
        self.forces_on(medium).next().is_some()
    }

    /// Bounds the acceleration of water by gravity and by the forces that act between `start` and
    /// `end`, seconds; m/s².
    pub fn most_acceleration(&self, start: f64, end: f64) -> f64 {
        let acting = self.forces_on(Medium::Water);
        let acting = acting.filter(|force| force.window.share(start, end - start) > LEAST_SHARE);
        let forces: f64 = acting.map(|force| force.kind.most()).sum();
        self.water.gravity.length() + forces
    }

    /// Moves forces by `way`, metres.
    pub(super) fn carry_forces(&mut self, way: DVec3, carry: &dyn Fn(&mut PlacedMesh, DVec3)) {
        for PlacedForce { region, force } in &mut self.forces {
            force.kind.carry(way);
            force.room =
                (force.room.take()).map(|room| Arc::new(Arc::unwrap_or_clone(room).moved(way)));
            match region {
                Some(Region::Block(block)) => *block = block.moved(way),
                Some(Region::Mesh(placed)) => carry(placed, way),
                None => {}
            }
        }
    }
}
