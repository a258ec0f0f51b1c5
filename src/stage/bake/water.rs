//! Warnings at the end of a bake about the water that entered.

use swell_scene::{Scene, four_digits};

/// Fraction of the domain's volume by which water may exceed it. Whole layers around a block ten
/// spacings high amount to as much.
const OVERFULL: f64 = 0.05;

/// Warning for emitted particles that never entered.
pub(super) fn never_entered(blocked: u64) -> Vec<String> {
    let words = match blocked {
        0 => return Vec::new(),
        1 => "1 particle of an emitter".to_owned(),
        many => format!("{many} particles of emitters"),
    };
    vec![format!(
        "{words} did not enter in the frames computed now: solids blocked the whole path through \
         the emitter's volume"
    )]
}

/// Warning for a frame with more water than the domain holds; `most` is the greatest particle
/// count. When pressed together, particles beside walls hide the excess from PBF's densities.
pub(super) fn overfull(scene: &Scene, most: usize) -> Vec<String> {
    let (made, room) = (most as f64 * scene.particle_volume(), scene.domain.volume());
    if made <= (1.0 + OVERFULL) * room {
        return Vec::new();
    }
    vec![format!(
        "the domain is overfull: {most} particles represent {} m³ of water, and it has room for {} \
         m³",
        four_digits(made),
        four_digits(room)
    )]
}
