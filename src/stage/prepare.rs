//! From a scene to what a solver starts from: particles, boundary, plan.

use crate::{
    domain::{
        bounds::Bounds,
        particles::Particles,
        sampling::{boundary_samples, fill_water},
        signed_distance::{SignedDistance, SignedDistanceError},
    },
    scene::{
        Scene,
        plan::{Counts, DeviceLimits, Plan},
    },
    solve::boundary::Boundary,
};

/// Spacings that the signed distance reaches beyond the solids: more than the contact distance and the cells
/// that a substep crosses.
const MARGIN: f64 = 4.0;

/// A scene's start.
#[derive(Clone, Debug)]
pub struct Start {
    /// State before the first frame.
    pub particles: Particles,
    /// Lattice points left out because a solid is there.
    pub removed: usize,
    /// Solids as the solver meets them.
    pub boundary: Boundary,
}

impl Start {
    /// Samples solids and fills water.
    ///
    /// # Errors
    /// A mesh without an inside, or too large a distance grid.
    pub fn of(scene: &Scene) -> Result<Self, SignedDistanceError> {
        let spacing = scene.particle_spacing();
        let meshes = || scene.solids.iter().map(|solid| &solid.mesh);
        let distance = match solid_bounds(scene) {
            Some(bounds) => SignedDistance::from_meshes(meshes(), &bounds, spacing)?,
            None => None,
        };
        let samples = meshes()
            .flat_map(|mesh| boundary_samples(mesh, &scene.domain, spacing))
            .collect();
        let water = scene.water.meshes.iter().map(|placed| &placed.mesh);
        let fill = fill_water(
            &scene.water.blocks,
            water,
            distance.as_ref(),
            &scene.domain,
            spacing,
        )?;
        Ok(Self {
            particles: fill.particles,
            removed: fill.removed,
            boundary: Boundary { samples, distance },
        })
    }

    /// What the scene needs on a device with these limits.
    pub fn plan(&self, scene: &Scene, limits: DeviceLimits) -> Plan {
        let counts = Counts {
            particles: self.particles.len(),
            ..self.boundary.counts()
        };
        Plan::new(scene, counts, limits)
    }
}

/// Where the solids are, with room about them, as far as water can come.
fn solid_bounds(scene: &Scene) -> Option<Bounds> {
    let margin = MARGIN * scene.particle_spacing();
    let reach = scene.domain.grown(margin);
    let mut all: Option<Bounds> = None;
    for bounds in scene.solids.iter().filter_map(|solid| solid.mesh.bounds()) {
        all = Some(match all {
            None => bounds,
            Some(other) => Bounds {
                min: other.min.min(bounds.min),
                max: other.max.max(bounds.max),
            },
        });
    }
    let grown = all?.grown(margin);
    let clipped = Bounds {
        min: grown.min.max(reach.min),
        max: grown.max.min(reach.max),
    };
    clipped.min.cmplt(clipped.max).all().then_some(clipped)
}
