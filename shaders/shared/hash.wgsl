// PCG hash (Jarzynski and Olano 2020).
fn pcg(value: u32) -> u32 {
    let state = value * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    return (word >> 22u) ^ word;
}

// A unit vector for a pair of particles at the same position: opposite for (a, b) and (b, a).
fn pair_direction(a: u32, b: u32) -> vec3f {
    let seed = pcg(min(a, b) ^ pcg(max(a, b)));
    let z = f32(seed & 0xffffu) / 32767.5 - 1.0;
    let angle = f32(seed >> 16u) * (6.283185307 / 65536.0);
    let r = sqrt(max(1.0 - z * z, 0.0));
    let sign = select(-1.0, 1.0, a < b);
    return sign * vec3f(r * cos(angle), r * sin(angle), z);
}
