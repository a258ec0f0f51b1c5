// Hashes and smooth noise of positions on the ground, constant over frames.

fn hash2(p: vec2i) -> f32 {
    var h = bitcast<u32>(p.x) * 0x9E3779B1u ^ bitcast<u32>(p.y) * 0x85EBCA77u;
    h = (h ^ (h >> 15u)) * 0x2C1B3C6Du;
    h = (h ^ (h >> 12u)) * 0x297A2D39u;
    return f32((h ^ (h >> 15u)) >> 8u) / 16777216.0;
}

fn value_noise(p: vec2f) -> f32 {
    let i = vec2i(floor(p));
    let f = fract(p);
    let s = f * f * (3.0 - 2.0 * f);
    return mix(
        mix(hash2(i), hash2(i + vec2i(1, 0)), s.x),
        mix(hash2(i + vec2i(0, 1)), hash2(i + vec2i(1, 1)), s.x),
        s.y,
    );
}
