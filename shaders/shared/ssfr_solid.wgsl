// A triangle of the set, and how its normal and material are packed into a word.

struct Triangle {
    a: vec3f,
    // 0 = solid of the scene, 1 = quay wall of the look; from 4 on solids that are told apart, from 192 on colours of the palette.
    material: u32,
    b: vec3f,
    // Number of its material, from 1 on; 0 = the colour of all of that kind.
    paint: u32,
    c: vec3f,
    // How the material's picture lies on it: behind the last triangle stand such records, whose words materials.wgsl tells.
    place: u32,
}

// What is no triangle: the ground, a side of the box, the sky.
const NO_TRIANGLE: u32 = 0xffffffffu;

// First of the materials whose colours the palette has.
const FIRST_OF_PALETTE: u32 = 192u;

// 2 = ground, 3 = sky.
fn material_of(code: u32) -> u32 {
    return select(code, 0u, code >= 4u && code < FIRST_OF_PALETTE);
}

fn corner(triangle: Triangle, index: u32) -> vec3f {
    return select(select(triangle.a, triangle.b, index == 1u), triangle.c, index == 2u);
}

fn sign_not_zero(v: vec2f) -> vec2f {
    return select(vec2f(-1.0), vec2f(1.0), v >= vec2f(0.0));
}

// Octahedral, 12 bits an axis; the six axis directions come back exactly.
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
