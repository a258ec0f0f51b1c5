// The water as a sparse level set (`LevelSet` of domain/level_set.rs), and intersection of rays
// with its surface. The importing shader must bind `rays`, `level_table` and `level_values`.
#import "shared/camera.wgsl"
#import "shared/shutter.wgsl"
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
    // Entries of `set_triangles` between a triangle and the way of its corners; 0 where none moves.
    ways: u32,
    pad0: u32,
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
#ifdef SHUTTER
// With an open shutter the table has the water's velocities behind its entries, a word a node
// (`Drift` of domain/level_set/drift.rs), also for bricks without values into which the surface
// moves. Flags of such bricks, in air and in water, and the rest of an entry.
const HALO: u32 = 0x40000000u;
const HALO_FULL: u32 = 0x80000000u;
const NUMBER: u32 = 0x3fffffffu;
// Nodes along a brick's edge, words of a brick, and voxels between two nodes.
const DRIFT_NODES: u32 = 5u;
const DRIFT_WORDS: u32 = 125u;
const PITCH: f32 = 2.0;
// Word of a component at rest, and steps to the largest velocity.
const AT_REST: f32 = 512.0;
const STEPS: f32 = 511.0;
#endif
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

#ifdef SHUTTER
fn drift_node(at: u32) -> vec3f {
    let word = level_table[at];
    return vec3f(vec3u(word, word >> 10u, word >> 20u) & vec3u(1023u));
}

// Voxels by which the water at a place has moved since the level set's instant: linear in each of
// six tetrahedra of a cell, which takes half of the nodes of a trilinear one.
fn drift(at: Place) -> vec3f {
    let half = at.q / PITCH;
    let low = clamp(floor(half), vec3f(0.0), vec3f(f32(DRIFT_NODES - 2u)));
    let part = half - low;
    let c = vec3u(low);
    let y = DRIFT_NODES;
    let z = DRIFT_NODES * DRIFT_NODES;
    let bricks = rays.bricks.x * rays.bricks.y * rays.bricks.z;
    let i = bricks + ((at.slot & NUMBER) - FIRST) * DRIFT_WORDS + c.x + y * c.y + z * c.z;
    let most = max(part.x, max(part.y, part.z));
    let least = min(part.x, min(part.y, part.z));
    let middle = part.x + part.y + part.z - most - least;
    // From the low corner along the axis of the greatest part, then along that of the next one.
    let first = select(select(z, y, part.y == most), 1u, part.x == most);
    let last = select(select(z, y, part.y == least), 1u, part.x == least);
    let far = 1u + y + z;
    let steps = (1.0 - most) * drift_node(i) + (most - middle) * drift_node(i + first)
        + (middle - least) * drift_node(i + far - last) + least * drift_node(i + far);
    return (steps - AT_REST) * (own_speed * own_since / (STEPS * rays.voxel));
}

// Level-set value in a brick with velocities, at the ray's instant: that where the water was, there
// at the level set's. One look-up whatever brick that is in: software adapters run both branches.
fn field_within(at: Place) -> f32 {
    var q = at.q - drift(at);
    var slot = at.slot;
    if slot >= HALO || any(q < vec3f(-1.0)) || any(q > vec3f(f32(EDGE + 1u))) {
        let there = place_at((vec3f(at.brick * EDGE) + q) * rays.voxel);
        slot = there.slot;
        q = there.q;
    }
    let has_values = slot >= FIRST && slot < HALO;
    let value = within(select(FIRST, slot, has_values), q);
    return select(select(-1.0, 1.0, slot == FULL || slot >= HALO_FULL), value, has_values);
}
#else

fn field_within(at: Place) -> f32 {
    return within(at.slot, at.q);
}
#endif

// Level-set value, positive in water.
fn field(p: vec3f) -> f32 {
    let at = place_at(p);
    if at.slot < FIRST {
        return select(-1.0, 1.0, at.slot == FULL);
    }
    return field_within(at);
}

fn field_beside(at: Place, step: vec3f) -> f32 {
    return field_within(Place(at.brick, at.slot, at.q + step));
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
        field_beside(at, x) - field_beside(at, -x),
        field_beside(at, y) - field_beside(at, -y),
        field_beside(at, z) - field_beside(at, -z),
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
            wet = field_within(at) > 0.0;
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
