// Rays against opaque geometry: triangles in a bounding volume hierarchy, and the ground. The
// importing shader must bind `rays`, `set_nodes` and `set_triangles`.
#import "shared/camera.wgsl"
#import "shared/shutter.wgsl"
#import "shared/ssfr_solid.wgsl"

// Two boxes and their contents. Each axis has one word in steps of `rays.set_step` from
// `rays.set_low`: the lower bound in the low half, the upper bound in the high half, both rounded
// outwards.
struct SetNode {
    left: vec3u,
    // Index of a node, or of the first triangle of a leaf; the bits from LEAF_SHIFT on hold the
    // number of triangles, 0 for a node.
    left_child: u32,
    right: vec3u,
    right_child: u32,
}

const LEAF_SHIFT: u32 = 28u;
const NO_CHILD: u32 = 0xffffffffu;

const SKY: u32 = 0u;
const WATER: u32 = 1u;
const OPAQUE: u32 = 2u;

struct Found {
    kind: u32,
    // Distance of the hit, and distances just before and just after it; FAR in the sky.
    t: f32,
    before: f32,
    after: f32,
    // Points out of the water; of opaque geometry, to either side.
    normal: vec3f,
    // As in ssfr_solid; 2 is the ground.
    material: u32,
    // Mean square slope of waves too short to be resolved by a pixel there.
    variance: f32,
    // Index of the triangle, or NO_TRIANGLE.
    triangle: u32,
}

fn met(kind: u32, t: f32, normal: vec3f, material: u32) -> Found {
    return Found(kind, t, t, t, normal, material, 0.0, NO_TRIANGLE);
}

// Triangle at the ray's instant.
fn triangle_at(index: u32) -> Triangle {
    var triangle = set_triangles[index];
#ifdef SHUTTER
    if rays.ways > 0u {
        let way = set_triangles[index + rays.ways];
        triangle.a += own_part * way.a;
        triangle.b += own_part * way.b;
        triangle.c += own_part * way.c;
    }
#endif
    return triangle;
}

#ifdef SHUTTER
// Where a point of a triangle at the ray's instant is at the sample's, for which `set_triangles`
// has corners and texture mappings.
fn at_sample(index: u32, p: vec3f) -> vec3f {
    if index == NO_TRIANGLE || rays.ways == 0u {
        return p;
    }
    let now = triangle_at(index);
    let ab = now.b - now.a;
    let ac = now.c - now.a;
    let ap = p - now.a;
    let n = cross(ab, ac);
    let b = dot(cross(ap, ac), n) / dot(n, n);
    let c = dot(cross(ab, ap), n) / dot(n, n);
    let way = set_triangles[index + rays.ways];
    return p - own_part * (way.a + b * (way.b - way.a) + c * (way.c - way.a));
}
#endif

// Distance along a ray to a triangle; FAR where it misses (Möller and Trumbore 1997).
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
    // Edges shared by two triangles belong to both.
    if u < -1e-6 || v < -1e-6 || u + v > 1.000001 || t <= 0.0 {
        return FAR;
    }
    return t;
}

// Distance at which a ray enters a box, in steps of the hierarchy; FAR where it does not before
// `nearest`. Flat boxes and touching rays count as hits.
fn box_distance(sides: vec3u, origin: vec3f, inverse: vec3f, nearest: f32) -> f32 {
    let a = (vec3f(sides & vec3u(0xffffu)) - origin) * inverse;
    let b = (vec3f(sides >> vec3u(16u)) - origin) * inverse;
    let low = min(a, b);
    let high = max(a, b);
    let enter = max(max(low.x, max(low.y, low.z)), 0.0);
    let leave = min(high.x, min(high.y, high.z));
    return select(FAR, enter, enter <= leave * 1.00001 + 1e-6 && enter < nearest);
}

// Pops pending children until one has a box nearer than `nearest`. Entries are a child and the
// distance of its box.
fn next_of(
    waiting: ptr<function, array<vec2u, 32>>, held: ptr<function, i32>, nearest: f32,
) -> u32 {
    var at = NO_CHILD;
    while at == NO_CHILD && *held > 0 {
        *held -= 1;
        let next = (*waiting)[*held];
        at = select(NO_CHILD, next.x, bitcast<f32>(next.y) < nearest);
    }
    return at;
}

// First hit of a ray before `reach`: the ground or a triangle. All lanes descend to leaves before
// any lane tests triangles, nearer boxes first (Aila and Laine 2009).
fn opaque_along(origin: vec3f, direction: vec3f, reach: f32) -> Found {
    var nearest = reach;
    var triangle = NO_TRIANGLE;
    var found = met(SKY, FAR, vec3f(0.0), 3u);
    if direction.y < -1e-6 && origin.y > 0.0 && -origin.y / direction.y < reach {
        nearest = -origin.y / direction.y;
        found = met(OPAQUE, nearest, vec3f(0.0, 1.0, 0.0), 2u);
    }
    if rays.triangles == 0u {
        return found;
    }
    let from_low = (origin - rays.set_low) / rays.set_step;
    let inverse = rays.set_step / select(direction, vec3f(1e-9), abs(direction) < vec3f(1e-9));
    // Median splits keep the hierarchy's depth below 32.
    var waiting: array<vec2u, 32>;
    var held = 0;
    var at = 0u;
    while at != NO_CHILD {
        while at >> LEAF_SHIFT == 0u {
            let node = set_nodes[at];
            let left = box_distance(node.left, from_low, inverse, nearest);
            let right = box_distance(node.right, from_low, inverse, nearest);
            let goes_left = left <= right;
            let far = max(left, right);
            if far < FAR {
                waiting[held] = vec2u(
                    select(node.left_child, node.right_child, goes_left), bitcast<u32>(far));
                held += 1;
            }
            at = select(node.right_child, node.left_child, goes_left);
            if min(left, right) >= FAR {
                at = next_of(&waiting, &held, nearest);
            }
        }
        let count = select(at >> LEAF_SHIFT, 0u, at == NO_CHILD);
        let first = at & ((1u << LEAF_SHIFT) - 1u);
        for (var k = first; k < first + count; k++) {
            let t = triangle_distance(triangle_at(k), origin, direction);
            if t < nearest {
                nearest = t;
                triangle = k;
            }
        }
        at = next_of(&waiting, &held, nearest);
    }
    if triangle != NO_TRIANGLE {
        let one = triangle_at(triangle);
        found = met(OPAQUE, nearest, normalize(cross(one.b - one.a, one.c - one.a)), code_of(one));
        found.triangle = triangle;
    }
    return found;
}
