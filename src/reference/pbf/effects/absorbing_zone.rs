//! Absorbing zones: particles in one lose a part of their velocity.

use glam::DVec3;
use rayon::prelude::*;

use super::Inputs;
use crate::{reference::Timings, scene::effects::absorbing_zone::Settings};

/// The velocities after the zone's absorption, m/s (effects/absorb_particles).
pub fn absorb_particles(settings: &Settings, inputs: Inputs<'_>, velocity: &[DVec3]) -> Vec<DVec3> {
    let (size, step) = (inputs.model.size, inputs.substep.time_step);
    (velocity.par_iter().zip(inputs.points))
        .map(|(&v, &x)| v * (1.0 - settings.absorbed(size, x, step)))
        .collect()
}

pub(super) fn apply(
    settings: &Settings,
    inputs: Inputs<'_>,
    velocity: &[DVec3],
    timings: &mut Timings,
) -> Vec<DVec3> {
    timings.time("effects/absorb_particles", || {
        absorb_particles(settings, inputs, velocity)
    })
}
