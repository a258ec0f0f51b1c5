// Rays and what is opaque: the set's triangles in a tree of boxes, and the ground. Needs the bindings `rays`, `set_nodes` and
// `set_triangles` of whoever imports it.
#import "shared/camera.wgsl"
#import "shared/ssfr_solid.wgsl"

struct SetNode {
    min: vec3f,
    // First triangle of a leaf, or the right child of an inner node, whose left one follows it.
    first_or_right: u32,
    max: vec3f,
    // Triangles of a leaf; 0 is an inner node.
    count: u32,
}

const SKY: u32 = 0u;
const WATER: u32 = 1u;
const OPAQUE: u32 = 2u;

struct Found {
    kind: u32,
    // Distance, and distances just before and just after it; FAR in the sky.
    t: f32,
    before: f32,
    after: f32,
    // Out of the water; of what is opaque, on either side.
    normal: vec3f,
    // As in ssfr_solid; 2 is the ground.
    material: u32,
    // Mean square slope of waves that a pixel there cannot hold.
    variance: f32,
    // Of the set, or NO_TRIANGLE.
    triangle: u32,
}

fn met(kind: u32, t: f32, normal: vec3f, material: u32) -> Found {
    return Found(kind, t, t, t, normal, material, 0.0, NO_TRIANGLE);
}

// Distance along a ray to a triangle, FAR where it misses (Möller and Trumbore 1997).
fn triangle_distance(triangle: Triangle, origin: vec3f, direction: vec3f) -> f32 {
    let ab = triangle.b - triangle.a;
    let ac = triangle.c - triangle.a;
    let p = cross(direction, ac);
    let volume = dot(ab, p);
    if abs(volume) < 1e-20 {
        return FAR;
    }
    let from_a = origin - triangle.a;
    let u = dot(from_a, p) / volume;
    let q = cross(from_a, ab);
    let v = dot(direction, q) / volume;
    let t = dot(ac, q) / volume;
    // Sides that two triangles share belong to both.
    if u < -1e-6 || v < -1e-6 || u + v > 1.000001 || t <= 0.0 {
        return FAR;
    }
    return t;
}

fn box_distance(node: SetNode, origin: vec3f, inverse: vec3f, nearest: f32) -> f32 {
    let a = (node.min - origin) * inverse;
    let b = (node.max - origin) * inverse;
    let low = min(a, b);
    let high = max(a, b);
    let enter = max(max(low.x, max(low.y, low.z)), 0.0);
    let leave = min(high.x, min(high.y, high.z));
    // Flat boxes, and those that a ray only touches, count.
    return select(FAR, enter, enter <= leave * 1.00001 + 1e-6 && enter < nearest);
}

fn opaque_along(origin: vec3f, direction: vec3f) -> Found {
    var found = met(SKY, FAR, vec3f(0.0), 3u);
    if direction.y < -1e-6 && origin.y > 0.0 {
        found = met(OPAQUE, -origin.y / direction.y, vec3f(0.0, 1.0, 0.0), 2u);
    }
    if rays.triangles == 0u {
        return found;
    }
    let inverse = 1.0 / select(direction, vec3f(1e-9), abs(direction) < vec3f(1e-9));
    // Median splits keep the tree's depth below 32.
    var stack: array<u32, 32>;
    var held = 1;
    stack[0] = 0u;
    while held > 0 {
        held -= 1;
        let at = stack[held];
        let node = set_nodes[at];
        if box_distance(node, origin, inverse, found.t) >= FAR {
            continue;
        }
        if node.count == 0u {
            stack[held] = node.first_or_right;
            stack[held + 1] = at + 1u;
            held += 2;
            continue;
        }
        for (var k = node.first_or_right; k < node.first_or_right + node.count; k++) {
            let triangle = set_triangles[k];
            let t = triangle_distance(triangle, origin, direction);
            if t < found.t {
                let normal = normalize(cross(triangle.b - triangle.a, triangle.c - triangle.a));
                found = met(OPAQUE, t, normal, triangle.material);
                found.triangle = k;
            }
        }
    }
    return found;
}
