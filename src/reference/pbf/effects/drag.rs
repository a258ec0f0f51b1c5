//! Air drag on particles, by the density around them.

use glam::DVec3;

use super::{super::passes::measure_density, Inputs};
use crate::Timings;
use swell_domain::{
    air::{blown, exposure},
    pbf::PLANE_SHARE,
};
use swell_scene::effects::drag::Settings;

/// Returns the water fraction around each particle: 0 for a lone particle, 1 deep in water. Shape
/// (particles).
pub fn shares(inputs: Inputs<'_>) -> Vec<f64> {
    let own = inputs.model.calibration.density_scale;
    let density = measure_density(inputs).into_iter();
    density
        .map(|density| (density - own) / (1.0 - own))
        .collect()
}

/// Returns the velocities after drag, m/s (effects/drag_by_density).
pub fn drag_by_density(settings: &Settings, inputs: Inputs<'_>, velocity: &[DVec3]) -> Vec<DVec3> {
    let blow = |(share, &v): (f64, &DVec3)| match exposure(share, PLANE_SHARE) {
        0.0 => v,
        part => {
            let seconds = part * inputs.substep.time_step;
            let fall = inputs.substep.time_step * inputs.model.scene_gravity;
            blown(
                [v - fall, fall],
                settings.wind(),
                settings.drop_radius,
                seconds,
            )
        }
    };
    shares(inputs).into_iter().zip(velocity).map(blow).collect()
}

pub(super) fn apply(
    settings: &Settings,
    inputs: Inputs<'_>,
    velocity: &[DVec3],
    timings: &mut Timings,
) -> Vec<DVec3> {
    timings.time("effects/drag_by_density", || {
        drag_by_density(settings, inputs, velocity)
    })
}
