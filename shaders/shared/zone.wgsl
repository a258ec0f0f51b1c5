// Bit mask of walls: the minimum faces along x, y, z, then the maximum faces.
override ZONE_WALLS: u32;
// Relaxation rate at the wall, 1/s.
override ZONE_RATE: f32;
override ZONE_INVERSE_LENGTH: f32;
override ZONE_SIZE_X: f32;
override ZONE_SIZE_Y: f32;
override ZONE_SIZE_Z: f32;
// Velocity of the undisturbed water, m/s.
override CURRENT_X: f32;
override CURRENT_Z: f32;

fn current() -> vec3f {
    return vec3f(CURRENT_X, 0.0, CURRENT_Z);
}

// Fraction by which a step moves the velocity of water at x towards the target velocity; x in
// metres from the domain's minimum corner. It is r Δt / (1 + r Δt), where r grows with the square
// of the depth into the zone (Israeli and Orszag 1981).
fn led(x: vec3f, time_step: f32) -> f32 {
    let beyond = vec3f(ZONE_SIZE_X, ZONE_SIZE_Y, ZONE_SIZE_Z) - x;
    let least = ((vec3u(ZONE_WALLS) >> vec3u(0u, 1u, 2u)) & vec3u(1u)) == vec3u(1u);
    let greatest = ((vec3u(ZONE_WALLS) >> vec3u(3u, 4u, 5u)) & vec3u(1u)) == vec3u(1u);
    let ways = max(
        select(vec3f(0.0), 1.0 - x * ZONE_INVERSE_LENGTH, least),
        select(vec3f(0.0), 1.0 - beyond * ZONE_INVERSE_LENGTH, greatest),
    );
    let way = clamp(max(ways.x, max(ways.y, ways.z)), 0.0, 1.0);
    let part = ZONE_RATE * time_step * way * way;
    return part / (1.0 + part);
}
