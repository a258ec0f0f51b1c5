//! XSPH viscosity (Schechter and Bridson 2012; Macklin and Müller 2013, eq. 17).

use glam::DVec3;
use rayon::prelude::*;

use super::{Inputs, fluid_sums};
use crate::Timings;
use swell_scene::effects::viscosity::Settings;

/// Returns c Σ_j m/ρ (v_j − v_i) W of each particle, m/s (effects/viscosity_gather).
pub fn viscosity_gather(inputs: Inputs<'_>, xsph: f64, velocity: &[DVec3]) -> Vec<DVec3> {
    let calibration = &inputs.model.calibration;
    let inverse_h = 1.0 / calibration.support_radius;
    fluid_sums(inputs, |i, j| {
        let q2 = inputs.between(i, j).length_squared() * inverse_h * inverse_h;
        (velocity[j] - velocity[i]) * (1.0 - q2).max(0.0).powi(3)
    })
    .map(|sum| xsph * calibration.density_scale * sum)
    .collect()
}

/// Adds the changes to the velocities, m/s (effects/viscosity_apply).
pub fn viscosity_apply(change: &[DVec3], velocity: &[DVec3]) -> Vec<DVec3> {
    velocity.iter().zip(change).map(|(v, dv)| v + dv).collect()
}

pub(super) fn apply(
    settings: &Settings,
    inputs: Inputs<'_>,
    velocity: &[DVec3],
    timings: &mut Timings,
) -> Vec<DVec3> {
    let Some(xsph) = settings.xsph else {
        // The projection's grid handles a viscosity coefficient.
        return velocity.to_vec();
    };
    let change = timings.time("effects/viscosity_gather", || {
        viscosity_gather(inputs, xsph, velocity)
    });
    timings.time("effects/viscosity_apply", || {
        viscosity_apply(&change, velocity)
    })
}
