// Solids that move, each with the distances that were sampled where it stood at the start; those that do not, if there
// are any, come first as one. One is looked at, at a time.
struct SolidGrids {
    // As they lie at the start, their origins from each solid's point of rest.
    grids: array<SolidGrid, 8>,
    // Points of rest at the substep's start, relative to the domain's least corner.
    centres: array<vec4f, 8>,
    // Of the points of rest, m/s.
    velocities: array<vec4f, 8>,
    // Angular velocities about them, rad/s.
    spins: array<vec4f, 8>,
    // Unit quaternions that turn what is seen from a point of rest back to where it was at the start: at the substep's start,
    // and at its end.
    backs: array<vec4f, 8>,
    end_backs: array<vec4f, 8>,
    count: u32,
    // The greatest speed of any point.
    fastest: f32,
    // Of the substep, s.
    length: f32,
    padding: u32,
}
@group(0) @binding(7) var<uniform> solid_grids: SolidGrids;

var<private> solid_grid: SolidGrid;
var<private> solid_centre: vec3f;
var<private> solid_velocity: vec3f;
var<private> solid_spin: vec3f;
var<private> solid_back: vec4f;

// Turns to solid k as it stands when `share` of the substep is over.
fn look_at_solid(k: u32, share: f32) {
    solid_grid = solid_grids.grids[k];
    solid_velocity = solid_grids.velocities[k].xyz;
    solid_spin = solid_grids.spins[k].xyz;
    solid_centre = solid_grids.centres[k].xyz + share * solid_grids.length * solid_velocity;
    let back = mix(solid_grids.backs[k], solid_grids.end_backs[k], share);
    solid_back = back * inverseSqrt(dot(back, back));
}

// v turned by the unit quaternion q.
fn turned(q: vec4f, v: vec3f) -> vec3f {
    let across = 2.0 * cross(q.xyz, v);
    return v + q.w * across + cross(q.xyz, across);
}

// Of the solid's point at x, m/s.
fn solid_velocity_at(x: vec3f) -> vec3f {
    return solid_velocity + cross(solid_spin, x - solid_centre);
}

// x from the first node of the solid's grid, as the grid lies.
fn from_first_node(x: vec3f) -> vec3f {
    return turned(solid_back, x - solid_centre) - solid_grid.origin;
}

// A way that is seen as the grid lies, in the world.
fn to_world(way: vec3f) -> vec3f {
    return turned(vec4f(-solid_back.xyz, solid_back.w), way);
}
