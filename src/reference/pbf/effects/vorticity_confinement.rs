//! Vorticity confinement (Macklin and Müller 2013, eqs. 15 and 16).

use glam::DVec3;
use rayon::prelude::*;

use super::{Inputs, fluid_sums, slope};
use crate::Timings;
use swell_scene::effects::vorticity_confinement::Settings;

/// Returns ω_i = Σ_j m/ρ (v_j − v_i) × ∇_j W, 1/s (effects/vorticity_curl).
pub fn vorticity_curl(inputs: Inputs<'_>, velocity: &[DVec3]) -> Vec<DVec3> {
    fluid_sums(inputs, |i, j| {
        (velocity[j] - velocity[i]).cross(slope(inputs, i, j))
    })
    .collect()
}

/// Returns the velocities after a = ε h (N × ω), N = η/|η|, η = ∇|ω| by differences, has acted for
/// the substep, m/s (effects/vorticity_force).
pub fn vorticity_force(
    inputs: Inputs<'_>,
    strength: f64,
    vorticity: &[DVec3],
    velocity: &[DVec3],
) -> Vec<DVec3> {
    let h = inputs.model.calibration.support_radius;
    let length: Vec<f64> = vorticity.iter().map(|w| w.length()).collect();
    fluid_sums(inputs, |i, j| {
        -slope(inputs, i, j) * (length[j] - length[i])
    })
    .enumerate()
    .map(|(i, eta)| {
        let steepness = eta.length();
        // Below the rounding error of |ω| over h in f32 the direction is noise.
        if steepness * h < 1e-5 * length[i] || length[i] == 0.0 {
            return velocity[i];
        }
        let force = (eta / steepness).cross(vorticity[i]);
        velocity[i] + inputs.substep.time_step * strength * h * force
    })
    .collect()
}

pub(super) fn apply(
    settings: &Settings,
    inputs: Inputs<'_>,
    velocity: &[DVec3],
    timings: &mut Timings,
) -> Vec<DVec3> {
    let vorticity = timings.time("effects/vorticity_curl", || {
        vorticity_curl(inputs, velocity)
    });
    timings.time("effects/vorticity_force", || {
        vorticity_force(inputs, settings.strength, &vorticity, velocity)
    })
}
