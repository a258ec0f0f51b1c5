//! Twin of shared/place.wgsl: places told by words, and who is near by them.

/// Steps of h along an axis, and how many of them come round.
const STEPS: f32 = 256.0;
const ROUND: u32 = 1024;
/// Steps within which a list made from words has everyone, and no one else.
const REACH: i64 = 258;

/// How far beyond h, over h, whoever is listed can be: within [`REACH`], and a step of each place along three axes with what
/// their products err by.
pub(super) const SKIN: f64 = (REACH as f64 + 1.949) / STEPS as f64 - 1.0;

/// The word of a place, metres; `inverse` is 1/h as the device has it. Products are rounded as there, so that words are equal.
pub(super) fn word(place: [f32; 3], inverse: f32) -> u32 {
    let step = |axis: usize| (place[axis] * inverse * STEPS).floor() as i32 as u32 % ROUND;
    step(0) | step(1) << 10 | step(2) << 20
}

/// Whether two are listed with each other by their words: along each axis the way that comes round sooner.
pub(super) fn are_near(a: u32, b: u32) -> bool {
    let way = |axis: u32| {
        let apart = (a >> (10 * axis)).wrapping_sub(b >> (10 * axis)) % ROUND;
        i64::from(apart.min(ROUND - apart))
    };
    (0..3).map(|axis| way(axis).pow(2)).sum::<i64>() < REACH * REACH
}
