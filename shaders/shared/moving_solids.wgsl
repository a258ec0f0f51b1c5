// Moving solids, each with a signed-distance grid sampled in its initial pose. All static solids,
// if any, form the first grid. The functions below work on one selected solid at a time. Mirrored
// by `SolidGrids` of solve/params.rs.
struct SolidGrids {
    // Grids in their initial pose, relative to each solid's reference point.
    grids: array<SolidGrid, 8>,
    // Reference points at the substep's start, relative to the domain's minimum corner.
    centres: array<vec4f, 8>,
    // Velocities of the reference points, m/s.
    velocities: array<vec4f, 8>,
    // Angular velocities about the reference points, rad/s.
    spins: array<vec4f, 8>,
    // Unit quaternions (x, y, z, w) that rotate back to the initial pose: from the pose at the
    // substep's start, and from that at its end.
    backs: array<vec4f, 8>,
    end_backs: array<vec4f, 8>,
    count: u32,
    // Largest speed of any point of a solid, m/s.
    fastest: f32,
    // Length of the substep, seconds.
    length: f32,
    // Number of nodes of all grids.
    nodes: u32,
}
@group(0) @binding(7) var<uniform> solid_grids: SolidGrids;

var<private> solid_grid: SolidGrid;
var<private> solid_centre: vec3f;
var<private> solid_velocity: vec3f;
var<private> solid_spin: vec3f;
var<private> solid_back: vec4f;

// Selects solid k in its pose after the fraction `share` of the substep.
fn look_at_solid(k: u32, share: f32) {
    solid_grid = solid_grids.grids[k];
    solid_velocity = solid_grids.velocities[k].xyz;
    solid_spin = solid_grids.spins[k].xyz;
    solid_centre = solid_grids.centres[k].xyz + share * solid_grids.length * solid_velocity;
    let back = mix(solid_grids.backs[k], solid_grids.end_backs[k], share);
    solid_back = back * inverseSqrt(dot(back, back));
}

// v rotated by the unit quaternion q.
fn turned(q: vec4f, v: vec3f) -> vec3f {
    let across = 2.0 * cross(q.xyz, v);
    return v + q.w * across + cross(q.xyz, across);
}

// Velocity of the solid's material point at x, m/s.
fn solid_velocity_at(x: vec3f) -> vec3f {
    return solid_velocity + cross(solid_spin, x - solid_centre);
}

// x relative to the grid's first node, in the grid's frame.
fn from_first_node(x: vec3f) -> vec3f {
    return turned(solid_back, x - solid_centre) - solid_grid.origin;
}

// Rotates a vector from the grid's frame to the world.
fn to_world(way: vec3f) -> vec3f {
    return turned(vec4f(-solid_back.xyz, solid_back.w), way);
}
