// The six walls as half-spaces filled with water at rest (continuum integrals of the kernels): a
// fraction f(z) = 315/256 ∫_q^1 (1 − t²)⁴ dt of the density, and its spiky slope g(z) = 3/2 (1 −
// q)⁴ (1 + 4q) / h, q = z/h. Where walls meet, 1 − Π(1 − f) avoids counting their intersection
// twice; it matches edges and corners of the bulk lattice within 1 %. Without boundary samples
// there is no memory to allocate, nothing to sort when a wave maker moves, and no friction along a
// wall.
struct WallTerm {
    density: f32,
    // Gradient of the density at the particle, 1/m; points towards decreasing density.
    gradient: vec3f,
}

fn wall_fraction(q: f32) -> f32 {
    let q2 = q * q;
    let integral = q * (1.0 + q2 * (-4.0 / 3.0 + q2 * (6.0 / 5.0 + q2 * (-4.0 / 7.0 + q2 / 9.0))));
    return params.wall_density_scale * (0.5 - 315.0 / 256.0 * integral);
}

fn wall_slope(q: f32) -> f32 {
    let s = 1.0 - q;
    let s2 = s * s;
    return params.wall_density_scale * 1.5 * s2 * s2 * (1.0 + 4.0 * q) / params.support_radius;
}

#ifdef WALL_WORK
// Sum over the walls of each wall's density gradient times its velocity, 1/s.
fn wall_rate(x: vec3f) -> f32 {
    let h = params.support_radius;
    let low = clamp((x - params.wall_min) / h, vec3f(0.0), vec3f(1.0));
    let high = clamp((params.wall_max - x) / h, vec3f(0.0), vec3f(1.0));
    let least = min(low, high);
    if min(least.x, min(least.y, least.z)) >= 1.0 {
        return 0.0;
    }
    let free = vec3f(
        (1.0 - wall_fraction(low.x)) * (1.0 - wall_fraction(high.x)),
        (1.0 - wall_fraction(low.y)) * (1.0 - wall_fraction(high.y)),
        (1.0 - wall_fraction(low.z)) * (1.0 - wall_fraction(high.z)),
    );
    let of_low = vec3f(wall_slope(low.x), wall_slope(low.y), wall_slope(low.z));
    let of_high = vec3f(wall_slope(high.x), wall_slope(high.y), wall_slope(high.z));
    let others = vec3f(free.y * free.z, free.x * free.z, free.x * free.y);
    return dot(others, of_high * params.wall_velocity_max - of_low * params.wall_velocity_min);
}

#endif
fn wall_term(x: vec3f) -> WallTerm {
    let h = params.support_radius;
    let low = clamp((x - params.wall_min) / h, vec3f(0.0), vec3f(1.0));
    let high = clamp((params.wall_max - x) / h, vec3f(0.0), vec3f(1.0));
    let least = min(low, high);
    if min(least.x, min(least.y, least.z)) >= 1.0 {
        return WallTerm(0.0, vec3f(0.0));
    }
    let free = vec3f(
        (1.0 - wall_fraction(low.x)) * (1.0 - wall_fraction(high.x)),
        (1.0 - wall_fraction(low.y)) * (1.0 - wall_fraction(high.y)),
        (1.0 - wall_fraction(low.z)) * (1.0 - wall_fraction(high.z)),
    );
    let slope = vec3f(
        wall_slope(high.x) - wall_slope(low.x),
        wall_slope(high.y) - wall_slope(low.y),
        wall_slope(high.z) - wall_slope(low.z),
    );
    let others = vec3f(free.y * free.z, free.x * free.z, free.x * free.y);
    return WallTerm(1.0 - free.x * free.y * free.z, slope * others);
}
