//! Generation zones: move velocities of particles towards those of the waves and the
//! current.

use glam::DVec3;

use super::{Inputs, led_particles};
use crate::Timings;
use swell_scene::effects::generation_zone::Settings;

pub(super) fn apply(
    settings: &Settings,
    inputs: Inputs<'_>,
    velocity: &[DVec3],
    timings: &mut Timings,
) -> Vec<DVec3> {
    timings.time("effects/generate_particles", || {
        let waves = settings.incoming(inputs.model.scene_gravity);
        let step = (inputs.model.size, inputs.substep.time_step);
        let water = (inputs.points, inputs.is_drop);
        led_particles(settings.zone(), step, water, velocity, |place| {
            inputs.model.current + waves.velocity(place, inputs.substep.time)
        })
    })
}
