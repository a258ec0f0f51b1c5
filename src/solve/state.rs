//! Transfer of a particle state to and from the device, and checks on it.

use glam::Vec3;

use swell_domain::{
    budget::{Breach, Watched},
    particles::Particles,
};
use swell_gpu::program::Program;
use swell_scene::Scene;

use super::{
    SolveError,
    buffers::{ID, POSITION, VELOCITY},
};

/// Returns whether the particle count of `state` differs from the planned one.
///
/// # Errors Returns [`SolveError::Count`] if it differs although no water enters or leaves the
/// scene.
pub(super) fn is_other_count(
    scene: &Scene,
    planned: usize,
    state: &Particles,
) -> Result<bool, SolveError> {
    let given = state.len();
    match given == planned {
        false if !scene.has_sources() => Err(SolveError::Count { planned, given }),
        is_same => Ok(!is_same),
    }
}

/// Uploads positions relative to the domain's minimum corner, velocities and ids.
pub(super) fn upload(program: &Program, scene: &Scene, state: &Particles) {
    let origin = scene.domain.min;
    let local = |p: &[f32; 3]| {
        let x = (Vec3::from_array(*p).as_dvec3() - origin).as_vec3();
        x.to_array()
    };
    let position: Vec<[f32; 3]> = state.position.iter().map(local).collect();
    program.upload(POSITION, 0, &position);
    program.upload(VELOCITY, 0, &state.velocity);
    program.upload(ID, 0, &state.id);
}

/// Writes downloaded positions and velocities, which come in any order, into the slots given by
/// their ids.
pub(super) fn take_over(
    state: &mut Particles,
    scene: &Scene,
    slot_of: &impl Fn(u32) -> usize,
    id: &[u32],
    position: &[[f32; 3]],
    velocity: &[[f32; 3]],
) {
    let origin = scene.domain.min;
    for (k, &id) in id.iter().enumerate() {
        let slot = slot_of(id);
        let world = origin + Vec3::from_array(position[k]).as_dvec3();
        state.position[slot] = world.as_vec3().to_array();
        state.velocity[slot] = velocity[k];
    }
}

/// Downloads current positions and velocities, in the order of `state` and in world coordinates.
/// `state` is the frame's initial state; its attributes are not copied.
pub(super) fn look(
    program: &Program,
    scene: &Scene,
    state: &Particles,
    frame: u32,
) -> Result<Particles, SolveError> {
    let n = state.len();
    let wanted = (POSITION.first(n), VELOCITY.first(n), ID.first(n));
    let (position, velocity, id) = program.download(wanted)?;
    check_ids(frame, &state.id, &id)?;
    let mut now = Particles {
        position: vec![[0.0; 3]; n],
        velocity: vec![[0.0; 3]; n],
        id: state.id.clone(),
        ..Particles::default()
    };
    let slot_of = slots_by_id(&state.id);
    take_over(&mut now, scene, &slot_of, &id, &position, &velocity);
    Ok(now)
}

/// Returns a map from id to index in the state.
pub(super) fn slots_by_id(ids: &[u32]) -> impl Fn(u32) -> usize + use<> {
    let top = ids.iter().max().map_or(0, |&id| id as usize + 1);
    let mut slots = vec![0; top];
    for (slot, &id) in ids.iter().enumerate() {
        slots[id as usize] = slot;
    }
    move |id| slots[id as usize]
}

/// Checks that the downloaded ids are a permutation of the uploaded ones, before they are used as
/// indices.
pub(super) fn check_ids(frame: u32, sent: &[u32], found: &[u32]) -> Result<(), Breach> {
    let top = sent.iter().max().map_or(0, |&id| id as usize + 1);
    let mut is_missing = vec![false; top];
    for &id in sent {
        is_missing[id as usize] = true;
    }
    let is_wrong = |&&id: &&u32| match is_missing.get_mut(id as usize) {
        Some(missing) => !std::mem::replace(missing, false),
        None => true,
    };
    match found.iter().filter(is_wrong).count() {
        0 => Ok(()),
        wrong => Err(Breach::new(frame, Watched::Particles, wrong as f64, 0.0)),
    }
}

/// Checks that a state is finite. `density` holds one relative density per particle, in the state's
/// order, if the solver has it.
pub(super) fn check_finite(
    frame: u32,
    state: &Particles,
    density: Option<&[f64]>,
) -> Result<(), Breach> {
    match state.first_not_finite(density) {
        None => Ok(()),
        Some((count, first)) => Err(Breach::not_finite(frame, count, Some(first))),
    }
}
