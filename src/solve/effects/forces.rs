//! The scene's forces on the GPU. On FLIP's grid, which PBF's projection shares, they accelerate
//! faces before the projection, and isolated droplets after it; without a projection, PBF's
//! particles before their prediction.

use glam::DVec3;

use swell_domain::{
    bounds::{Bounds, FAR},
    bricks::CELLS,
    forces::{Force, ForceKind, Law, Medium},
};
use swell_gpu::{
    buffer::{Buf, BufferSpec},
    program::{PassSpec, Program},
};
use swell_scene::Scene;

use super::Addition;
use crate::params::{DeviceForce, DeviceTurn};

/// The forces on a medium, in the order of the scene.
pub const FORCES: Buf<DeviceForce> = Buf::new("forces");
/// Distances to the meshes of their rooms, metres.
pub const FORCE_DISTANCE: Buf<f32> = Buf::new("force_distance");
/// Work in the last substep (FLIP) or in the frame so far (PBF) over a particle's mass, m²/s²; a
/// value for each 64 cells or particles.
pub const FORCE_WORK: Buf<f32> = Buf::new("force_work");
/// Change of a PBF particle's velocity by forces, m/s, and that times its velocity before.
pub const FORCE_IMPULSE: Buf<[f32; 4]> = Buf::new("force_impulse");

/// Owner of passes and buffers in plans.
pub(crate) const OWNER: &str = "forces";

/// The condition under which rooms have meshes.
pub(crate) const MESHES: &str = "FORCE_MESHES";

/// Rotation of velocities by Coriolis's acceleration over half a substep.
pub const VELOCITY_TURN: Buf<DeviceTurn> = Buf::new("velocity_turn");

/// Returns the pass that turns velocities where the domain rotates.
fn turn(scene: &Scene, name: &'static str) -> Option<PassSpec> {
    scene.turns_velocities().then(|| PassSpec {
        name,
        defines: Vec::new(),
        constants: Vec::new(),
    })
}

/// Returns the buffer of that pass.
fn turn_buffer(scene: &Scene) -> Option<BufferSpec> {
    scene.turns_velocities().then(|| VELOCITY_TURN.sized(1))
}

/// Returns the pass `name` with the constant of shared/forces.wgsl.
fn pass(name: &'static str, scene: &Scene) -> PassSpec {
    PassSpec {
        name,
        defines: Vec::new(),
        constants: constants(scene, Medium::Water),
    }
}

/// Returns the constants of shared/forces.wgsl.
pub(crate) fn constants(scene: &Scene, medium: Medium) -> Vec<(&'static str, f64)> {
    vec![("FORCE_COUNT", scene.forces_on(medium).count() as f64)]
}

/// Returns the number of nodes of the rooms' meshes.
fn nodes(scene: &Scene, medium: Medium) -> usize {
    let rooms = scene.forces_on(medium).filter_map(|it| it.room.as_ref());
    let meshes = rooms.filter_map(|room| Some(room.mesh()?.values.len()));
    meshes.sum()
}

/// Returns whether a room of a force on a medium is a mesh.
pub(crate) fn has_meshes(scene: &Scene, medium: Medium) -> bool {
    nodes(scene, medium) > 0
}

/// Returns the buffers of shared/forces.wgsl; none without a force on the medium.
pub(crate) fn buffers(scene: &Scene, medium: Medium) -> Vec<BufferSpec> {
    let (count, nodes) = (scene.forces_on(medium).count(), nodes(scene, medium));
    let forces = (count > 0).then(|| FORCES.sized(count));
    let meshes = (nodes > 0).then(|| FORCE_DISTANCE.sized(nodes));
    forces.into_iter().chain(meshes).collect()
}

/// Whether forces act on PBF's particles, and not on the grid of a projection.
fn act_on_particles(scene: &Scene) -> bool {
    let is_projected = scene.solver.pbf().is_some_and(|pbf| pbf.grid_projection);
    !is_projected && scene.has_forces_on(Medium::Water)
}

/// Returns what forces add to PBF with `particles` particles: nothing where a projection applies
/// them on its grid.
pub(super) fn pbf(scene: &Scene, particles: usize) -> Option<Addition> {
    if !act_on_particles(scene) {
        return None;
    }
    let mut buffers = buffers(scene, Medium::Water);
    buffers.push(FORCE_IMPULSE.sized(particles));
    buffers.push(FORCE_WORK.sized(particles.div_ceil(64)));
    buffers.extend(turn_buffer(scene));
    let turn = turn(scene, "effects/turn_particles");
    let work = PassSpec {
        constants: Vec::new(),
        ..pass("effects/work_by_particles", scene)
    };
    let push = pass("effects/push_particles", scene);
    Some(Addition {
        before_prediction: turn.iter().cloned().chain([push]).collect(),
        after_update: [work].into_iter().chain(turn).collect(),
        buffers,
        ..Addition::default()
    })
}

/// Returns what forces add to FLIP, with bricks for `wet` cells of water.
pub(super) fn flip(scene: &Scene, wet: usize) -> Option<Addition> {
    if !scene.has_forces_on(Medium::Water) {
        return None;
    }
    let mut buffers = buffers(scene, Medium::Water);
    buffers.push(FORCE_WORK.sized(wet / 64));
    buffers.extend(turn_buffer(scene));
    let turn = turn(scene, "effects/turn_sorted");
    let after = ["effects/push_drops", "effects/work_by_cells"].map(|name| pass(name, scene));
    Some(Addition {
        on_particles: turn.iter().cloned().collect(),
        passes: vec![pass("effects/push_faces", scene)],
        after_transfer: after.into_iter().chain(turn).collect(),
        buffers,
        ..Addition::default()
    })
}

/// Returns the number of partial sums in [`FORCE_WORK`] that FLIP writes with this number of wet
/// bricks.
pub(crate) fn flip_sums(scene: &Scene, wet_bricks: u32) -> usize {
    match scene.has_forces_on(Medium::Water) {
        true => wet_bricks as usize * (CELLS / 64) as usize,
        false => 0,
    }
}

/// Returns the number of partial sums in [`FORCE_WORK`] that PBF writes.
pub(crate) fn pbf_sums(scene: &Scene, particles: usize) -> usize {
    match act_on_particles(scene) {
        true => particles.div_ceil(64),
        false => 0,
    }
}

/// Uploads the forces on PBF's particles as they act in the given (start, length), seconds.
pub(crate) fn upload_for_pbf(program: &Program, scene: &Scene, span: (f64, f64)) {
    if act_on_particles(scene) {
        upload(program, scene, Medium::Water, span);
    }
}

/// Uploads the distances to the meshes of rooms of forces on PBF's particles.
pub(crate) fn upload_meshes_for_pbf(program: &Program, scene: &Scene) {
    if act_on_particles(scene) {
        upload_meshes(program, scene, Medium::Water);
    }
}

/// Uploads the distances to the meshes of rooms.
pub(crate) fn upload_meshes(program: &Program, scene: &Scene, medium: Medium) {
    let mut first = 0;
    for force in scene.forces_on(medium) {
        if let Some(mesh) = force.room.as_ref().and_then(|room| room.mesh()) {
            program.upload(FORCE_DISTANCE, first, &mesh.values);
            first += mesh.values.len();
        }
    }
}

/// Uploads the forces on a medium as they act in the given (start, length), seconds.
pub(crate) fn upload(program: &Program, scene: &Scene, medium: Medium, span: (f64, f64)) {
    let mut first = 0;
    let rows = scene.forces_on(medium).map(|force| {
        let share = force.window.share(span.0, span.1);
        let row = device_force(force, (span, share), scene.domain.min, first);
        let mesh = force.room.as_ref().and_then(|room| room.mesh());
        first += mesh.map_or(0, |mesh| mesh.values.len());
        row
    });
    let rows: Vec<DeviceForce> = rows.collect();
    if !rows.is_empty() {
        program.upload(FORCES, 0, &rows);
    }
    if let (Medium::Water, Some((axis, angle))) = (medium, scene.half_turn(span)) {
        let half = (0.5 * angle).sin();
        let row = DeviceTurn {
            axis: axis.as_vec3().to_array(),
            sine: angle.sin() as f32,
            rest: (2.0 * half * half) as f32,
            ..DeviceTurn::default()
        };
        program.upload(VELOCITY_TURN, 0, &[row]);
    }
}

/// Returns a force as the device has it over a (start, length), seconds: relative to `corner`, with
/// its strength times `share`.
fn device_force(
    force: &Force,
    (span, share): ((f64, f64), f64),
    corner: DVec3,
    first: usize,
) -> DeviceForce {
    let kind = &*force.kind.over(span);
    let everywhere = Bounds {
        min: DVec3::splat(-FAR),
        max: DVec3::splat(FAR),
    };
    let room = force.room.as_ref();
    let Bounds { min, max } = room.map_or(everywhere, |room| room.bounds().moved(-corner));
    let (at, axis, law) = match *kind {
        ForceKind::Acceleration(acceleration) => {
            let law = Law {
                strength: 1.0,
                core: 1.0,
                falloff: 0,
            };
            (acceleration, DVec3::ZERO, law)
        }
        ForceKind::Vortex { at, axis, law } => (at - corner, axis, law),
        ForceKind::Attract { at, law } => (at - corner, DVec3::ZERO, law),
        ForceKind::Frame(_, inertia) => {
            let law = Law {
                strength: inertia.square,
                core: inertia.angular,
                falloff: 0,
            };
            (inertia.pivot - corner, inertia.axis, law)
        }
    };
    let three = |v: DVec3| v.as_vec3().to_array();
    let mut row = DeviceForce {
        low: three(min),
        fade_rate: if force.fade > 0.0 {
            (1.0 / force.fade) as f32
        } else {
            0.0
        },
        high: three(max),
        kind: kind.number() as u32,
        at: three(at),
        strength: (share * law.strength) as f32,
        axis: three(axis),
        core: law.core as f32,
        falloff: law.falloff,
        ..DeviceForce::default()
    };
    if let ForceKind::Frame(_, inertia) = kind {
        row.origin = three(inertia.at_pivot);
    }
    if let Some(mesh) = room.and_then(|room| room.mesh()) {
        row.origin = three(mesh.origin - corner);
        row.spacing = mesh.spacing as f32;
        row.dims = mesh.dims.map(|n| n as u32);
        row.first = first as u32;
    }
    row
}
