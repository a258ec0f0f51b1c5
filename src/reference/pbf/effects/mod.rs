//! Reference passes of shaders/effects on PBF: one file per effect, one function per pass, with the
//! pass's name.

use glam::DVec3;
use rayon::prelude::*;

use super::passes::Inputs;
use crate::Timings;
use swell_domain::parallel;
use swell_scene::effects::{Effects, with_effects, zone::Zone};

macro_rules! twins {
    ($($name:ident),+ $(,)?) => {
        $(pub mod $name;)+

        /// Applies the scene's effects to the velocities of a substep, m/s.
        pub(super) fn apply(
            named: &Effects,
            inputs: Inputs<'_>,
            velocity: &mut Vec<DVec3>,
            timings: &mut Timings,
        ) {
            $(
                if let Some(settings) = &named.$name {
                    *velocity = $name::apply(settings, inputs, velocity, timings);
                }
            )+
        }
    };
}

with_effects!(twins);

/// Returns the velocities of particles at `places` after a zone moved them towards `wanted` in a
/// step of `step` seconds, in a domain of the given size; m/s and metres, shapes (particles).
/// Isolated droplets are left unchanged; `is_drop` is empty if no projection finds them.
pub fn led_particles(
    zone: Zone<'_>,
    (size, step): (DVec3, f64),
    (places, is_drop): (&[DVec3], &[bool]),
    velocity: &[DVec3],
    wanted: impl Fn(DVec3) -> DVec3 + Sync + Send,
) -> Vec<DVec3> {
    parallel::map(0..velocity.len(), |i| {
        let (v, x) = (velocity[i], places[i]);
        match (is_drop.get(i), zone.led(size, x, step)) {
            (Some(true), _) | (_, 0.0) => v,
            (_, part) => v + part * (wanted(x) - v),
        }
    })
}

/// Returns the sum of `term(i, j)` over the fluid neighbours j of every particle i.
fn fluid_sums<'a>(
    inputs: Inputs<'a>,
    term: impl Fn(usize, usize) -> DVec3 + Sync + Send + 'a,
) -> impl IndexedParallelIterator<Item = DVec3> + 'a {
    (0..inputs.particles()).into_par_iter().map(move |i| {
        let neighbors = inputs.neighbors.fluid(i).iter();
        neighbors.map(|&j| term(i, j as usize)).sum()
    })
}

/// Returns the calibrated ∇_j W, 1/m; it points from j to i.
fn slope(inputs: Inputs<'_>, i: usize, j: usize) -> DVec3 {
    let calibration = &inputs.model.calibration;
    let d = inputs.between(i, j);
    let r = d.length();
    let s = (1.0 - r / calibration.support_radius).max(0.0);
    d * (calibration.gradient_scale * s * s / r.max(1e-15))
}
