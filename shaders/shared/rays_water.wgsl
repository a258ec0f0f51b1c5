// The water as a sparse level set (`LevelSet` of domain/level_set.rs), and where a ray comes through its surface. Needs the bindings
// `rays`, `level_table` and `level_values` of whoever imports it.
#import "shared/camera.wgsl"
#import "shared/box.wgsl"

struct Rays {
    // Of the box that holds the water, metres.
    size: vec3f,
    // Edge length of a voxel, metres.
    voxel: f32,
    // Along each axis.
    bricks: vec3u,
    // Of the set.
    triangles: u32,
    // Of the lattice of sunlight, along each axis.
    nodes: vec3u,
    // Metres between them.
    pitch: f32,
    // Sides of the box at which a wall stands: bit 2 × axis, plus 1 for the greater end.
    walls: u32,
    // Width of what is taken for water between it and something opaque, metres.
    gap: f32,
    pad0: u32,
    pad1: u32,
    // Of the set's tree: least corner of its lattice, and the lattice's step, metres.
    set_low: vec3f,
    set_step: f32,
}

const EMPTY: u32 = 0u;
const FULL: u32 = 1u;
const FIRST: u32 = 2u;
// Voxels along a brick's edge, and values.
const EDGE: u32 = 8u;
const NODES: u32 = 11u;
const VALUES: u32 = 1331u;
// Steps after which a ray through the box has met nothing.
const MOST_STEPS: i32 = 8192;
// Halvings of the step in which a ray meets the surface.
const HALVINGS: i32 = 10;

struct Place {
    brick: vec3u,
    slot: u32,
    // In voxels from the brick's corner.
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
    let before = vec4f(level_values[i], level_values[i + y], level_values[i + z], level_values[i + y + z]);
    let j = i + 1u;
    let after = vec4f(level_values[j], level_values[j + y], level_values[j + z], level_values[j + y + z]);
    let along_x = mix(before, after, part.x);
    let along_y = mix(along_x.xz, along_x.yw, part.y);
    return mix(along_y.x, along_y.y, part.z);
}

// Positive in water.
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

// Where a ray that is `inside` of the water, or not, at `from_t` first is otherwise, up to `to_t`: a voxel a step, and a brick a
// step where the surface is not.
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

// Distances at which a ray comes into the box and leaves it; the second is less where it misses.
fn box_span(origin: vec3f, direction: vec3f) -> vec2f {
    return span_of(rays.size, origin, direction);
}

// Which side of the box a point on it is on: axis and whether it is the greater end.
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
