// One velocity component at a time. Axes turn so that the component's own comes first (a), then b and c: its faces
// lie at whole cells along a and at half ones along b and c, and a particle's trilinear weights reach the 2 x 3 x 3
// faces about its cell, of which those that it does not touch get (next to) nothing, without a branch.
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

// A face that no particle of its two cells touches would have no velocity where a cell of water asks for one. This
// much of a weight gives it that of the particles nearby, and changes others by their rounding.
const LEAST_WEIGHT = 2.4e-7;

// Hats at the lower and the upper face, for a place `f` of a cell, which rounding may take out of it.
fn face_weights(f: f32) -> vec2f {
    return max(vec2f(1.0 - f, f), vec2f(0.0)) + LEAST_WEIGHT;
}

// Hats at the centres of the cell before, of its own, and of the one after.
fn center_weights(f: f32) -> vec3f {
    return vec3f(max(0.5 - f, 0.0), 1.0 - abs(f - 0.5), max(f - 0.5, 0.0)) + LEAST_WEIGHT;
}

// Columns along c, rows along b.
fn outer(b: vec3f, c: vec3f) -> mat3x3f {
    return mat3x3f(b * c.x, b * c.y, b * c.z);
}
