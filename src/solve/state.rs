//! A particle state on its way to the device and back, and what is reported of it.

use glam::{DVec3, Vec3};

use crate::{
    domain::{particles::Particles, solver::StepReport},
    gpu::program::Program,
    scene::Scene,
};

use super::SolveError;

/// Positions go up relative to the domain's least corner.
pub(super) fn upload(program: &Program, scene: &Scene, state: &Particles) {
    let origin = scene.domain.min;
    let local = |p: &[f32; 3]| {
        let x = (Vec3::from_array(*p).as_dvec3() - origin).as_vec3();
        [x.x, x.y, x.z, 1.0]
    };
    let position: Vec<[f32; 4]> = state.position.iter().map(local).collect();
    let velocity: Vec<[f32; 4]> = state
        .velocity
        .iter()
        .map(|v| [v[0], v[1], v[2], 0.0])
        .collect();
    program.upload("position", 0, &position);
    program.upload("velocity", 0, &velocity);
    program.upload("id", 0, &state.id);
}

/// What came back from the device, in any order, into the order of the ids.
pub(super) fn take_over(
    state: &mut Particles,
    scene: &Scene,
    slot_of: &impl Fn(u32) -> usize,
    id: &[u32],
    position: &[[f32; 4]],
    velocity: &[[f32; 4]],
) {
    let origin = scene.domain.min;
    for (k, &id) in id.iter().enumerate() {
        let slot = slot_of(id);
        let [x, y, z, _] = position[k];
        let world = origin + DVec3::new(f64::from(x), f64::from(y), f64::from(z));
        state.position[slot] = world.as_vec3().to_array();
        let [x, y, z, _] = velocity[k];
        state.velocity[slot] = [x, y, z];
    }
}

/// Where a particle stands in a state, by id.
pub(super) fn slots_by_id(ids: &[u32]) -> impl Fn(u32) -> usize + use<> {
    let top = ids.iter().max().map_or(0, |&id| id as usize + 1);
    let mut slots = vec![0; top];
    for (slot, &id) in ids.iter().enumerate() {
        slots[id as usize] = slot;
    }
    move |id| slots[id as usize]
}

pub(super) fn max_speed(state: &Particles) -> f64 {
    state
        .velocity
        .iter()
        .map(|v| Vec3::from_array(*v).as_dvec3().length())
        .fold(0.0, f64::max)
}

/// `density` is one value a particle, in the state's order, where the solver has it.
pub(super) fn check_finite(
    frame: u32,
    state: &Particles,
    density: Option<&[f32]>,
) -> Result<(), SolveError> {
    let is_bad = |v: &[f32; 3]| !v.iter().all(|x| x.is_finite());
    let density = |k: usize| density.map_or(1.0, |density| density[k]);
    let place = (0..state.len()).find(|&k| {
        is_bad(&state.position[k]) || is_bad(&state.velocity[k]) || !density(k).is_finite()
    });
    match place {
        None => Ok(()),
        Some(k) => Err(SolveError::Numbers {
            frame,
            what: format!(
                "particle {} is not finite: position {:?}, velocity {:?}, relative density {}",
                state.id[k],
                state.position[k],
                state.velocity[k],
                density(k)
            ),
        }),
    }
}

/// Energies of a state, and the errors of relative densities; sums run in order.
pub(super) fn report(scene: &Scene, state: &Particles, density: &[f32]) -> StepReport {
    let mass = scene.water.rest_density * scene.particle_spacing().powi(3);
    let (mut kinetic, mut potential) = (0.0, 0.0);
    for (x, v) in state.position.iter().zip(&state.velocity) {
        kinetic += 0.5 * mass * Vec3::from_array(*v).as_dvec3().length_squared();
        potential -= mass
            * scene
                .water
                .gravity
                .dot(Vec3::from_array(*x).as_dvec3() - scene.domain.min);
    }
    let mut errors: Vec<f64> = density
        .iter()
        .map(|&rho| (f64::from(rho) - 1.0).max(0.0))
        .collect();
    // From 0: an empty sum is -0.
    let mean = errors.iter().fold(0.0, |sum, error| sum + error) / errors.len().max(1) as f64;
    errors.sort_unstable_by(f64::total_cmp);
    let percentile = |p: f64| {
        errors
            .get(((errors.len() as f64 * p).ceil() as usize).saturating_sub(1))
            .copied()
    };
    StepReport {
        substeps: 0,
        iterations: 0,
        density_error_mean: mean,
        density_error_p99: percentile(0.99).unwrap_or(0.0),
        density_error_max: percentile(1.0).unwrap_or(0.0),
        kinetic_energy: kinetic,
        potential_energy: potential,
        max_speed: max_speed(state),
        capped: 0,
        searched: 0,
        projection: None,
    }
}
