// An opaque triangle, and the packing of its normal and material into a word.

struct Triangle {
    a: vec3f,
    // Material code in the low byte: 0 = solid of the scene, 1 = quay wall of the look; from 4 on
    // individual solids, from 192 on colours of the palette. Then a byte each for the wetness of
    // the corners, 255 for 1.
    material: u32,
    b: vec3f,
    // Number of its material, from 1; 0 = the common colour of its kind.
    paint: u32,
    c: vec3f,
    // Index of its texture mapping, which is stored after the last triangle; materials.wgsl
    // describes the record.
    place: u32,
}

// Marks hits without a triangle: the ground, a side of the box, the sky.
const NO_TRIANGLE: u32 = 0xffffffffu;

// First material code of the palette.
const FIRST_OF_PALETTE: u32 = 192u;

// 2 = ground, 3 = sky.
fn material_of(code: u32) -> u32 {
    return select(code, 0u, code >= 4u && code < FIRST_OF_PALETTE);
}

fn code_of(triangle: Triangle) -> u32 {
    return triangle.material & 255u;
}

fn corner(triangle: Triangle, index: u32) -> vec3f {
    return select(select(triangle.a, triangle.b, index == 1u), triangle.c, index == 2u);
}

fn sign_not_zero(v: vec2f) -> vec2f {
    return select(vec2f(-1.0), vec2f(1.0), v >= vec2f(0.0));
}

// Octahedral encoding with 12 bits per axis; the six axis directions are exact.
fn pack_normal(n: vec3f, material: u32) -> u32 {
    let p = n.xy / (abs(n.x) + abs(n.y) + abs(n.z));
    let folded = select((1.0 - abs(p.yx)) * sign_not_zero(p), p, n.z >= 0.0);
    let q = vec2u(vec2i(round(folded * 2047.0)) + 2048);
    return q.x | (q.y << 12u) | (material << 24u);
}

fn unpack_normal(word: u32) -> vec3f {
    let q = vec2f(vec2i(vec2u(word & 4095u, (word >> 12u) & 4095u)) - 2048) / 2047.0;
    let z = 1.0 - abs(q.x) - abs(q.y);
    let xy = select((1.0 - abs(q.yx)) * sign_not_zero(q), q, z >= 0.0);
    return normalize(vec3f(xy, z));
}
