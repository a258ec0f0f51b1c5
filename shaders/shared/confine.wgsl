// Keeps a position inside the box, away from the walls and outside the solids.
#ifdef SOLIDS
struct SolidGrid {
    // First node of the signed-distance grid, relative to the domain's minimum corner, or to a
    // moving solid's reference point.
    origin: vec3f,
    spacing: f32,
    dims: vec3u,
    // Index of the grid's first node in `solid_distance`.
    first: u32,
}
#ifdef MOVING_SOLIDS
#import "shared/moving_solids.wgsl"
#else
@group(0) @binding(7) var<uniform> solid_grid: SolidGrid;

fn from_first_node(x: vec3f) -> vec3f {
    return x - solid_grid.origin;
}

fn to_world(way: vec3f) -> vec3f {
    return way;
}
#endif
// With PBF and moving solids, the velocities of boundary samples follow, three floats each.
@group(0) @binding(8) var<storage, read> solid_distance: array<f32>;

fn solid_node(node: vec3u) -> f32 {
    let within = (node.z * solid_grid.dims.y + node.y) * solid_grid.dims.x + node.x;
#ifdef MOVING_SOLIDS
    let place = solid_grid.first + within;
#ifdef SHAPES
    if solid_changes {
        let start = solid_distance[place];
        let nodes = solid_grid.dims.x * solid_grid.dims.y * solid_grid.dims.z;
        return start + solid_share * (solid_distance[place + nodes] - start);
    }
#endif
    return solid_distance[place];
#else
    return solid_distance[within];
#endif
}

// Displacement applied by the last call of leave_solids. A difference of positions would carry
// their rounding error: far from the origin that can rotate a small push by an angle of order 1.
var<private> solid_push: vec3f;

// Pushes x out along the gradient of the trilinear signed distance if it is closer than the contact
// distance. Outside the grid no solid is near.
fn leave_solids(x: vec3f) -> vec3f {
    solid_push = vec3f(0.0);
    let p = from_first_node(x) / solid_grid.spacing;
    let last = vec3f(solid_grid.dims - 1u);
    if any(p < vec3f(0.0)) || any(p >= last) {
        return x;
    }
    let node = vec3u(p);
    // Twice the spacing exceeds a cell's diagonal: with a node this far away, no contact can occur
    // within the cell.
    if solid_node(node) > params.contact_distance + 2.0 * solid_grid.spacing {
        return x;
    }
    let t = p - vec3f(node);
    let a = mix(
        vec4f(solid_node(node), solid_node(node + vec3u(0, 1, 0)),
            solid_node(node + vec3u(0, 0, 1)), solid_node(node + vec3u(0, 1, 1))),
        vec4f(solid_node(node + vec3u(1, 0, 0)), solid_node(node + vec3u(1, 1, 0)),
            solid_node(node + vec3u(1, 0, 1)), solid_node(node + vec3u(1, 1, 1))),
        t.x,
    );
    let distance = mix(mix(a.x, a.y, t.y), mix(a.z, a.w, t.y), t.z);
    if distance >= params.contact_distance {
        return x;
    }
    let b = vec4f(
        solid_node(node + vec3u(1, 0, 0)) - solid_node(node),
        solid_node(node + vec3u(1, 1, 0)) - solid_node(node + vec3u(0, 1, 0)),
        solid_node(node + vec3u(1, 0, 1)) - solid_node(node + vec3u(0, 0, 1)),
        solid_node(node + vec3u(1, 1, 1)) - solid_node(node + vec3u(0, 1, 1)),
    );
    let gradient = vec3f(
        mix(mix(b.x, b.y, t.y), mix(b.z, b.w, t.y), t.z),
        mix(a.y - a.x, a.w - a.z, t.z),
        mix(a.z - a.x, a.w - a.y, t.y),
    );
    let steepness = length(gradient);
    if steepness < 1e-6 * solid_grid.spacing {
        return x;
    }
    solid_push = to_world(gradient / steepness) * (params.contact_distance - distance);
    return x + solid_push;
}
#endif

#ifdef WALL_WORK
// Displacement by the walls in the last call of confine.
var<private> wall_push: vec3f;

#endif
#ifdef MOVING_SOLIDS
// Total displacement by solids in the last call, the velocity of the last solid that pushed, and
// the sum of each solid's displacement times its velocity.
var<private> solids_push: vec3f;
var<private> pushing_velocity: vec3f;
var<private> solids_work: f32;

// Pushes x out of each solid, one after another, in their poses at the substep's end.
fn leave_all_solids(x: vec3f) -> vec3f {
    var y = x;
    solids_push = vec3f(0.0);
    pushing_velocity = vec3f(0.0);
    solids_work = 0.0;
    for (var k = 0u; k < solid_count(); k++) {
        for (var once = 0; once < select(0, 1, may_be_at_solid(k, 1.0, y, 0.0)); once++) {
            look_at_solid(k, 1.0);
            y = leave_solids(y);
            let velocity = solid_velocity_at(y);
            solids_push += solid_push;
            solids_work += dot(solid_push, velocity);
            pushing_velocity = select(pushing_velocity, velocity, any(solid_push != vec3f(0.0)));
        }
    }
    return y;
}

#endif
fn confine(x: vec3f) -> vec3f {
    var y = x;
#ifdef SOLIDS
#ifdef MOVING_SOLIDS
    y = leave_all_solids(y);
#else
    y = leave_solids(y);
#endif
#endif
    let kept = clamp(
        y, params.wall_min + params.contact_distance, params.wall_max - params.contact_distance);
#ifdef WALL_WORK
    wall_push = kept - y;
#endif
    return kept;
}
