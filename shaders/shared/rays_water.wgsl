// The water as a sparse level set (`LevelSet` of domain/level_set.rs), and intersection of rays
// with its surface. The importing shader must bind `rays`, `level_table` and `level_values`.
#import "shared/camera.wgsl"
#import "shared/box.wgsl"

struct Rays {
    // Size of the box that contains the water, metres.
    size: vec3f,
    // Edge length of a voxel, metres.
    voxel: f32,
    // Number of bricks along each axis.
    bricks: vec3u,
    // Number of opaque triangles.
    triangles: u32,
    // Number of nodes along each axis of the lattice of sunlight.
    nodes: vec3u,
    // Distance between the nodes, metres.
    pitch: f32,
    // Sides of the box with a wall: bit 2 × axis, plus 1 for the upper end.
    walls: u32,
    // Width of the gap between water and opaque geometry that counts as water, metres.
    gap: f32,
    pad0: u32,
    pad1: u32,
    // Quantisation lattice of the hierarchy over opaque geometry: least corner and step, metres.
    set_low: vec3f,
    set_step: f32,
}

const EMPTY: u32 = 0u;
const FULL: u32 = 1u;
const FIRST: u32 = 2u;
// Voxels and nodes along a brick's edge, and values per brick.
const EDGE: u32 = 8u;
const NODES: u32 = 11u;
const VALUES: u32 = 1331u;
// Number of steps after which a ray through the box counts as a miss.
const MOST_STEPS: i32 = 8192;
// Number of bisections of the step in which a ray meets the surface.
const HALVINGS: i32 = 10;

struct Place {
    brick: vec3u,
    slot: u32,
    // Position in voxels from the brick's corner.
    q: vec3f,
}

fn place_at(p: vec3f) -> Place {
    let at = clamp(p / rays.voxel, vec3f(0.0), vec3f(rays.bricks * EDGE) - 1e-3);
    let brick = vec3u(at) / EDGE;
    let slot = level_table[(brick.z * rays.bricks.y + brick.y) * rays.bricks.x + brick.x];
    return Place(brick, slot, at - vec3f(brick * EDGE));
}

fn within(slot: u32, q: vec3f) -> f32 {
    let at = q + 1.0;
    let low = clamp(floor(at), vec3f(0.0), vec3f(f32(NODES - 2u)));
    let part = at - low;
    let c = vec3u(low);
    let y = NODES;
    let z = NODES * NODES;
    let i = (slot - FIRST) * VALUES + c.x + y * c.y + z * c.z;
    let before = vec4f(
        level_values[i], level_values[i + y], level_values[i + z], level_values[i + y + z]);
    let j = i + 1u;
    let after = vec4f(
        level_values[j], level_values[j + y], level_values[j + z], level_values[j + y + z]);
    let along_x = mix(before, after, part.x);
    let along_y = mix(along_x.xz, along_x.yw, part.y);
    return mix(along_y.x, along_y.y, part.z);
}

// Level-set value, positive in water.
fn field(p: vec3f) -> f32 {
    let at = place_at(p);
    if at.slot < FIRST {
        return select(-1.0, 1.0, at.slot == FULL);
    }
    return within(at.slot, at.q);
}

// Unit normal out of the water.
fn field_normal(p: vec3f, otherwise: vec3f) -> vec3f {
    let at = place_at(p);
    if at.slot < FIRST {
        return otherwise;
    }
    let x = vec3f(1.0, 0.0, 0.0);
    let y = vec3f(0.0, 1.0, 0.0);
    let z = vec3f(0.0, 0.0, 1.0);
    let gradient = vec3f(
        within(at.slot, at.q + x) - within(at.slot, at.q - x),
        within(at.slot, at.q + y) - within(at.slot, at.q - y),
        within(at.slot, at.q + z) - within(at.slot, at.q - z),
    );
    let steep = length(gradient);
    if steep < 1e-6 {
        return otherwise;
    }
    return -gradient / steep;
}

struct Crossing {
    // Distances just before and just after the surface; FAR where there is none.
    before: f32,
    after: f32,
}

fn refine(origin: vec3f, direction: vec3f, from_t: f32, to_t: f32, inside: bool) -> Crossing {
    var low = from_t;
    var high = to_t;
    for (var i = 0; i < HALVINGS; i++) {
        let middle = 0.5 * (low + high);
        if (field(origin + direction * middle) > 0.0) == inside {
            low = middle;
        } else {
            high = middle;
        }
    }
    return Crossing(low, high);
}

// First distance up to `to_t` at which a ray crosses the surface; `inside` states whether it is in
// water at `from_t`. Steps one voxel at a time, or a whole brick where that has no surface.
fn crossing(origin: vec3f, direction: vec3f, from_t: f32, to_t: f32, inside: bool) -> Crossing {
    let inverse = safe_inverse(direction);
    let edge = f32(EDGE) * rays.voxel;
    var last = from_t;
    var t = from_t;
    for (var i = 0; i < MOST_STEPS; i++) {
        let at = place_at(origin + direction * t);
        var next = t + rays.voxel;
        var wet = at.slot == FULL;
        if at.slot < FIRST {
            let corner = vec3f(at.brick) + select(vec3f(0.0), vec3f(1.0), direction > vec3f(0.0));
            let out = (corner * edge - origin) * inverse;
            next = max(min(out.x, min(out.y, out.z)), t) + 0.01 * rays.voxel;
        } else {
            wet = within(at.slot, at.q) > 0.0;
        }
        if wet != inside {
            return refine(origin, direction, last, t, inside);
        }
        if t >= to_t {
            break;
        }
        last = t;
        t = min(next, to_t);
    }
    return Crossing(FAR, FAR);
}

// Distances at which a ray enters and leaves the box; the second is less where it misses.
fn box_span(origin: vec3f, direction: vec3f) -> vec2f {
    return span_of(rays.size, origin, direction);
}

// Side of the box on which a point is: the axis, and 1 for the upper end.
fn side_of(p: vec3f) -> vec2u {
    let low = abs(p);
    let high = abs(p - rays.size);
    var side = vec2u(0u, 0u);
    var least = low.x;
    let distances = array<f32, 6>(low.x, high.x, low.y, high.y, low.z, high.z);
    for (var i = 1u; i < 6u; i++) {
        if distances[i] < least {
            least = distances[i];
            side = vec2u(i / 2u, i % 2u);
        }
    }
    return side;
}

fn side_normal(side: vec2u) -> vec3f {
    let way = select(-1.0, 1.0, side.y == 1u);
    return way * vec3f(vec3u(0u, 1u, 2u) == vec3u(side.x));
}
