//! Absorbing zones: move velocities of particles towards that of the undisturbed water.

use glam::DVec3;

use super::{Inputs, led_particles};
use crate::Timings;
use swell_scene::effects::absorbing_zone::Settings;

pub(super) fn apply(
    settings: &Settings,
    inputs: Inputs<'_>,
    velocity: &[DVec3],
    timings: &mut Timings,
) -> Vec<DVec3> {
    timings.time("effects/absorb_particles", || {
        let step = (inputs.model.size, inputs.substep.time_step);
        let water = (inputs.points, inputs.is_drop);
        let current = inputs.model.current;
        led_particles(settings.zone(), step, water, velocity, |_| current)
    })
}
