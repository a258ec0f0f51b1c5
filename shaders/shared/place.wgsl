// A position packed into one word: 10 bits per axis, in steps of 1/256 unit, modulo 4 units. For
// positions less than 2 units apart, two words give the distance along each axis to within a step:
// testing a candidate takes one load instead of three.
const STEPS = 256.0;
// Added to a distance in steps, it bounds the distance between two words from above. Each position
// is rounded down by less than a step along each of three axes, and at 4000 units from the origin
// its product has an error of 1/16 step. √3 (1 + 1/8) < 2.
const UNSURE = 2.0;

// Packs a position given in units.
fn place_word(x: vec3f) -> u32 {
    let steps = vec3u(vec3i(floor(x * STEPS))) & vec3u(1023u);
    return steps.x | (steps.y << 10u) | (steps.z << 20u);
}

// Squared distance, in steps.
fn square_between(a: u32, b: u32) -> f32 {
    // Shifting up and down drops the other axes and restores the sign.
    let apart = vec3f(vec3i(
        vec3u(a - b, (a >> 10u) - (b >> 10u), (a >> 20u) - (b >> 20u))
            << vec3u(22u)) >> vec3u(22u));
    return dot(apart, apart);
}
