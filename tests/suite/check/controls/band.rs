//! A band of particles over water without any, and faults in what moves it.

use swell::scene::Scene;
use swell::stage::prepare::Start;

use super::{Control, control, variants::stir};
use crate::support::{D, flip_of as flip, lattice};

/// Water of 8 × 14 × 8 cells, whose lower part has no particles, in rapid motion.
pub fn band(scene: &mut Scene, start: &mut Start) {
    flip(scene).band = Some(4);
    start.particles = lattice([0.0; 3], [16, 28, 16], [D; 3]);
    stir(&mut start.particles);
    scene.band().unwrap().enter(&mut start.particles);
    assert!(start.particles.deep.count() > 8 * 8 * 8);
    // Depths beyond where the surface is level, so that they differ within the layers.
    for (k, depth) in start.particles.deep.depth.iter_mut().enumerate() {
        *depth += 0.1 * (k % 7) as f32;
    }
}

pub const BAND: &[Control] = &[
    control(
        "flip/place_deep",
        "velocity + params.velocity_step[component], is_deep",
        "velocity, is_deep",
        "flip/place_deep",
        &["velocity in the depth with gravity"],
    ),
    control(
        "flip/place_deep",
        "face_change[face], velocity, is_deep",
        "face_change[face], 1.001 * velocity, is_deep",
        "flip/place_deep",
        &["velocity in the depth"],
    ),
    control(
        "flip/place_deep",
        "deep_depth[element] = own",
        "deep_depth[element] = own - 0.001",
        "flip/place_deep",
        &["depth below the surface"],
    ),
    control(
        "flip/place_deep",
        "u32(is_deep) <<",
        "u32(!is_deep) <<",
        "flip/place_deep",
        &["whether there is a velocity"],
    ),
    control(
        "flip/gather_centers",
        "deep_depth[element] >= params.band",
        "deep_depth[element] > 2.0 * params.band",
        "flip/gather_centers",
        &["relative density"],
    ),
    control(
        "flip/carry_deep",
        "-t * (1.0 - t) * (2.0 - t) / 6.0",
        "-t * (1.0 - t) * (2.0 - t) / 6.6",
        "flip/carry_deep",
        &["velocity in the depth"],
    ),
    // Velocities one step old: nothing moves.
    control(
        "flip/carry_deep",
        "return within_domain(x - way * params.inverse_cell_size)",
        "return within_domain(x)",
        "flip/carry_deep",
        &["velocity in the depth", "depth below the surface"],
    ),
    control(
        "flip/carry_deep",
        "sum += weight.x * weight.y * weight.z * deep_depth",
        "sum += 1.001 * weight.x * weight.y * weight.z * deep_depth",
        "flip/carry_deep",
        &["depth below the surface"],
    ),
];
