// Solids of which some move, each with a signed-distance grid sampled in its initial pose. All
// static solids, if any, form the first grid. The functions below work on one selected solid at a
// time. Mirrored by `PosedSolid` and `PosedSolids` of solve/params.rs.
struct PosedSolid {
    // Grid in the initial pose, relative to the reference point.
    grid: SolidGrid,
    // Reference point at the substep's start, relative to the domain's minimum corner.
    centre: vec3f,
    // Distance from there to the grid's farthest corner, metres.
    reach: f32,
    // Velocity of the reference point, m/s.
    velocity: vec3f,
    // Of a body: distance by which its surface is moved outward where its volume is cut by cells,
    // metres.
    offset: f32,
    // Angular velocity about the reference point, rad/s.
    spin: vec3f,
    padding: f32,
    // Unit quaternions (x, y, z, w) that rotate back to the initial pose: from the pose at the
    // substep's start, and from that at its end.
    back: vec4f,
    end_back: vec4f,
}

// A uniform: the passes that need it bind as many storage buffers as some drivers allow.
struct PosedSolids {
    count: u32,
    // Largest speed of any point of any solid, m/s.
    fastest: f32,
    // Length of the substep, seconds.
    length: f32,
    padding: u32,
    solids: array<PosedSolid, 512>,
}
@group(0) @binding(7) var<uniform> posed_solids: PosedSolids;

var<private> solid_grid: SolidGrid;
var<private> solid_centre: vec3f;
var<private> solid_velocity: vec3f;
var<private> solid_spin: vec3f;
var<private> solid_back: vec4f;
#ifdef SHAPES
// Marks a solid whose shape changes, in the index of its first node. Behind its distances at the
// substep's start are those at its end, and then velocities of the surface, three floats a node.
const SHAPE = 0x80000000u;
var<private> solid_changes: bool;
// Fraction of the substep that has passed.
var<private> solid_share: f32;
#endif

fn solid_count() -> u32 {
    return posed_solids.count;
}

// Whether x is within the distance `margin` of solid k's grid, or almost so, after the fraction
// `share` of the substep: a test without the solid's rotation and its distances.
fn may_be_at_solid(k: u32, share: f32, x: vec3f, margin: f32) -> bool {
    let way = share * posed_solids.length * posed_solids.solids[k].velocity;
    let reach = posed_solids.solids[k].reach + margin;
    let apart = x - (posed_solids.solids[k].centre + way);
    return dot(apart, apart) <= reach * reach;
}

// Selects solid k in its pose after the fraction `share` of the substep.
fn look_at_solid(k: u32, share: f32) {
    solid_grid = posed_solids.solids[k].grid;
    solid_velocity = posed_solids.solids[k].velocity;
    solid_spin = posed_solids.solids[k].spin;
    solid_centre = posed_solids.solids[k].centre + share * posed_solids.length * solid_velocity;
    let back = mix(posed_solids.solids[k].back, posed_solids.solids[k].end_back, share);
    solid_back = back * inverseSqrt(dot(back, back));
#ifdef SHAPES
    solid_changes = solid_grid.first >= SHAPE;
    solid_grid.first = solid_grid.first & (SHAPE - 1u);
    solid_share = share;
#endif
}

// Index behind the last float of all solids in `solid_distance`.
fn solids_end() -> u32 {
    let last = posed_solids.solids[solid_count() - 1u].grid;
    let nodes = last.dims.x * last.dims.y * last.dims.z;
#ifdef SHAPES
    return (last.first & (SHAPE - 1u)) + select(nodes, 5u * nodes, last.first >= SHAPE);
#else
    return last.first + nodes;
#endif
}

// v rotated by the unit quaternion q.
fn turned(q: vec4f, v: vec3f) -> vec3f {
    let across = 2.0 * cross(q.xyz, v);
    return v + q.w * across + cross(q.xyz, across);
}

#ifdef SHAPES
// Velocity of the surface near x, m/s: interpolated between nodes, each with that of the point of
// the surface nearest to it.
fn shape_velocity_at(x: vec3f) -> vec3f {
    let last = vec3f(solid_grid.dims - 1u);
    let p = clamp(from_first_node(x) / solid_grid.spacing, vec3f(0.0), last);
    let node = min(vec3u(p), solid_grid.dims - 2u);
    let t = p - vec3f(node);
    let nodes = solid_grid.dims.x * solid_grid.dims.y * solid_grid.dims.z;
    let first = solid_grid.first + 2u * nodes;
    var sum = vec3f(0.0);
    for (var k = 0u; k < 8u; k++) {
        let step = vec3u(k & 1u, (k >> 1u) & 1u, k >> 2u);
        let weights = select(1.0 - t, t, step == vec3u(1u));
        let at = node + step;
        let within = (at.z * solid_grid.dims.y + at.y) * solid_grid.dims.x + at.x;
        let velocity = vec3f(
            solid_distance[first + 3u * within],
            solid_distance[first + 3u * within + 1u],
            solid_distance[first + 3u * within + 2u],
        );
        sum += weights.x * weights.y * weights.z * velocity;
    }
    return sum;
}
#endif

// Velocity of the solid's material point at x, m/s; where the shape changes, of the surface near x.
fn solid_velocity_at(x: vec3f) -> vec3f {
    let rigid = solid_velocity + cross(solid_spin, x - solid_centre);
#ifdef SHAPES
    if solid_changes {
        return rigid + shape_velocity_at(x);
    }
#endif
    return rigid;
}

// x relative to the grid's first node, in the grid's frame.
fn from_first_node(x: vec3f) -> vec3f {
    return turned(solid_back, x - solid_centre) - solid_grid.origin;
}

// Rotates a vector from the grid's frame to the world.
fn to_world(way: vec3f) -> vec3f {
    return turned(vec4f(-solid_back.xyz, solid_back.w), way);
}
