// PCG hash (Jarzynski and Olano 2020).
fn pcg(value: u32) -> u32 {
    let state = value * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// A unit vector for a pair of particles at the same position: opposite for (a, b) and (b, a). It
// points to a hashed point of a cube, with odd coordinates up to 1023, whose squares f32 adds
// exactly. WGSL's sines would err by 2⁻¹¹.
fn pair_direction(a: u32, b: u32) -> vec3f {
    let seed = pcg(min(a, b) ^ pcg(max(a, b)));
    let bits = vec3u(seed, seed >> 10u, seed >> 20u) & vec3u(1023u);
    let direction = vec3f(2u * bits) - 1023.0;
    let sign = select(-1.0, 1.0, a < b);
    return direction * (sign * inverseSqrt(dot(direction, direction)));
}
