//! Reference passes of the scene's forces on PBF's particles, where no projection applies them on
//! its grid.

use glam::DVec3;

use super::Substep;
use swell_domain::{
    forces::{ForceField, Medium},
    parallel,
};
use swell_scene::PbfScene;

/// Whether forces act on the particles, and not on a projection's grid.
pub fn act_on_particles(scene: &PbfScene) -> bool {
    !scene.settings().grid_projection && scene.has_forces_on(Medium::Water)
}

/// Returns the forces on the water in a substep.
pub fn forces<'a>(scene: &'a PbfScene, substep: &Substep) -> ForceField<'a> {
    let start = substep.time - substep.time_step;
    scene.force_field(Medium::Water, (start, substep.time_step))
}

/// Returns each particle's change of velocity by forces, m/s, and that times its velocity before
/// (effects/push_particles). Shapes (particles).
pub fn push_particles(
    scene: &PbfScene,
    substep: &Substep,
    position: &[DVec3],
    velocity: &[DVec3],
) -> Vec<(DVec3, f64)> {
    let field = forces(scene, substep);
    parallel::map(0..position.len(), |i| {
        let change = substep.time_step * field.at(scene.domain.min + position[i]);
        (change, change.dot(velocity[i]))
    })
}

/// Returns the work of forces on a particle over its mass, m²/s², from what
/// [`push_particles`] returns for it and its velocity after the substep
/// (effects/work_by_particles).
pub fn work_on_particle((change, before): (DVec3, f64), after: DVec3) -> f64 {
    0.5 * (before + change.dot(after))
}
