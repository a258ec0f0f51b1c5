//! Absorbing zones: particles in one lose a part of their velocity.

use glam::DVec3;
use rayon::prelude::*;

use super::Inputs;
use crate::{reference::Timings, scene::effects::absorbing_zone::Settings};

/// The velocities of particles at `places` after the zone's absorption in a step of so many seconds, in a domain of `size`; m/s
/// and metres, shapes (particles). Drops lose nothing; `is_drop` is empty where nobody tells them (effects/absorb_particles).
pub fn absorb_particles(
    settings: &Settings,
    (size, step): (DVec3, f64),
    places: &[DVec3],
    is_drop: &[bool],
    velocity: &[DVec3],
) -> Vec<DVec3> {
    (velocity.par_iter().zip(places).enumerate())
        .map(|(i, (&v, &x))| match is_drop.get(i) {
            Some(true) => v,
            _ => v * (1.0 - settings.absorbed(size, x, step)),
        })
        .collect()
}

pub(super) fn apply(
    settings: &Settings,
    inputs: Inputs<'_>,
    velocity: &[DVec3],
    timings: &mut Timings,
) -> Vec<DVec3> {
    timings.time("effects/absorb_particles", || {
        let step = inputs.substep.time_step;
        absorb_particles(
            settings,
            (inputs.model.size, step),
            inputs.points,
            inputs.is_drop,
            velocity,
        )
    })
}
