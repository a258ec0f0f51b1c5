// A place in a word: modulo 4 of a unit, in steps of 1/256 of it along each axis. Of places less than 2 units apart the words tell how
// far along each axis, to a step: a candidate is one load in place of three.
const STEPS = 256.0;
// What is added to a distance in steps so that whoever is nearer is surely nearer than that by the words: either place is rounded
// down by less than a step along each of three axes, and at 4000 units from the origin its product errs by 1/16 of one.
// √3 (1 + 1/8) < 2.
const UNSURE = 2.0;

// Of a place in units.
fn place_word(x: vec3f) -> u32 {
    let steps = vec3u(vec3i(floor(x * STEPS))) & vec3u(1023u);
    return steps.x | (steps.y << 10u) | (steps.z << 20u);
}

// Squared, in steps.
fn square_between(a: u32, b: u32) -> f32 {
    // Shifted up and down again: other axes drop out, and signs come back.
    let apart = vec3f(vec3i(vec3u(a - b, (a >> 10u) - (b >> 10u), (a >> 20u) - (b >> 20u)) << vec3u(22u)) >> vec3u(22u));
    return dot(apart, apart);
}
