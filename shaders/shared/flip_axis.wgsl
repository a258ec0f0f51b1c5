// Transfers of one velocity component at a time. Axes are permuted cyclically so that the
// component's own axis comes first (a), then b and c: its faces lie at integer coordinates along a
// and at half-integer coordinates along b and c. A particle's trilinear weights cover the 2 x 3 x 3
// faces around its cell; faces out of its reach get (almost) no weight, without a branch.
@group(0) @binding(20) var<uniform> axis: vec4u;

fn turned(v: vec3f) -> vec3f {
    return select(select(v.xyz, v.yzx, axis.x == 1u), v.zxy, axis.x == 2u);
}

fn turned_cell(v: vec3u) -> vec3u {
    return select(select(v.xyz, v.yzx, axis.x == 1u), v.zxy, axis.x == 2u);
}

// From (a, b, c) to (x, y, z).
fn turned_back(v: vec3i) -> vec3i {
    return select(select(v.xyz, v.zxy, axis.x == 1u), v.yzx, axis.x == 2u);
}

// A face that no particle in its two cells touches would have no velocity where a cell of water
// needs one. This small weight gives it the velocity of the particles nearby, and changes other
// faces by no more than rounding.
const LEAST_WEIGHT = 2.4e-7;

// Hat functions at the lower and the upper face, for a position `f` within a cell; rounding may put
// f slightly outside.
fn face_weights(f: f32) -> vec2f {
    return max(vec2f(1.0 - f, f), vec2f(0.0)) + LEAST_WEIGHT;
}

// Hat functions at the centres of the previous cell, its own cell, and the next one.
fn center_weights(f: f32) -> vec3f {
    return vec3f(max(0.5 - f, 0.0), 1.0 - abs(f - 0.5), max(f - 0.5, 0.0)) + LEAST_WEIGHT;
}

// Outer product: columns along c, rows along b.
fn outer(b: vec3f, c: vec3f) -> mat3x3f {
    return mat3x3f(b * c.x, b * c.y, b * c.z);
}
