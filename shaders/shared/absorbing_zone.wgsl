// A bit a wall, of the least faces along x, y and z, then of the greatest.
override ABSORBING: u32;
// At the wall, 1/s.
override RATE: f32;
override INVERSE_LENGTH: f32;
override SIZE_X: f32;
override SIZE_Y: f32;
override SIZE_Z: f32;

// What a step takes of a velocity at x, metres from the domain's least corner: r Δt / (1 + r Δt), where r grows with the
// square of the way into the zone (Israeli and Orszag 1981).
fn absorbed(x: vec3f, time_step: f32) -> f32 {
    let beyond = vec3f(SIZE_X, SIZE_Y, SIZE_Z) - x;
    let least = ((vec3u(ABSORBING) >> vec3u(0u, 1u, 2u)) & vec3u(1u)) == vec3u(1u);
    let greatest = ((vec3u(ABSORBING) >> vec3u(3u, 4u, 5u)) & vec3u(1u)) == vec3u(1u);
    let ways = max(
        select(vec3f(0.0), 1.0 - x * INVERSE_LENGTH, least),
        select(vec3f(0.0), 1.0 - beyond * INVERSE_LENGTH, greatest),
    );
    let way = clamp(max(ways.x, max(ways.y, ways.z)), 0.0, 1.0);
    let lost = RATE * time_step * way * way;
    return lost / (1.0 + lost);
}
