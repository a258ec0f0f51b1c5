//! Reference passes of the scene's forces on PBF's particles, where no projection applies them on
//! its grid.

use glam::DVec3;

use super::Substep;
use crate::Timings;
use swell_domain::{
    forces::{ForceField, Medium},
    frame::change_by_turn,
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

/// Turns velocities by Coriolis's acceleration over half a substep, where the domain rotates and no
/// projection does it (effects/turn_particles).
pub(super) fn turn_particles(
    scene: &PbfScene,
    substep: &Substep,
    velocity: &mut [DVec3],
    timings: &mut Timings,
) {
    if let Some(turn) = half_turn(scene, substep).filter(|_| act_on_particles(scene)) {
        timings.time("effects/turn_particles", || {
            for v in velocity {
                *v += change_by_turn(turn, *v);
            }
        });
    }
}

/// Returns the rotation of velocities by Coriolis's acceleration over half a substep: unit axis and
/// angle, radians; `None` in a domain that does not rotate.
pub fn half_turn(scene: &PbfScene, substep: &Substep) -> Option<(DVec3, f64)> {
    scene.half_turn((substep.time - substep.time_step, substep.time_step))
}

/// Returns the work of forces on a particle over its mass, m²/s², from what
/// [`push_particles`] returns for it and its velocity after the substep
/// (effects/work_by_particles).
pub fn work_on_particle((change, before): (DVec3, f64), after: DVec3) -> f64 {
    0.5 * (before + change.dot(after))
}
