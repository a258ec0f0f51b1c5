// Solids of which some move, each with a signed-distance grid sampled in its initial pose. All
// static solids, if any, form the first grid. The functions below work on one selected solid at a
// time. Mirrored by `PosedSolid` of solve/params.rs.
struct PosedSolid {
    // Grid in the initial pose, relative to the reference point.
    grid: SolidGrid,
    // Reference point at the substep's start, relative to the domain's minimum corner.
    centre: vec3f,
    // Distance from there to the grid's farthest corner, metres.
    reach: f32,
    // Velocity of the reference point, m/s.
    velocity: vec3f,
    // Largest speed of any point of any solid, m/s.
    fastest: f32,
    // Angular velocity about the reference point, rad/s.
    spin: vec3f,
    // Length of the substep, seconds.
    length: f32,
    // Unit quaternions (x, y, z, w) that rotate back to the initial pose: from the pose at the
    // substep's start, and from that at its end.
    back: vec4f,
    end_back: vec4f,
}
@group(0) @binding(7) var<storage, read> posed_solids: array<PosedSolid>;

var<private> solid_grid: SolidGrid;
var<private> solid_centre: vec3f;
var<private> solid_velocity: vec3f;
var<private> solid_spin: vec3f;
var<private> solid_back: vec4f;

fn solid_count() -> u32 {
    return arrayLength(&posed_solids);
}

// Whether x is within the distance `margin` of solid k's grid, or almost so, after the fraction
// `share` of the substep: a test without the solid's rotation and its distances.
fn may_be_at_solid(k: u32, share: f32, x: vec3f, margin: f32) -> bool {
    let way = share * posed_solids[k].length * posed_solids[k].velocity;
    let reach = posed_solids[k].reach + margin;
    let apart = x - (posed_solids[k].centre + way);
    return dot(apart, apart) <= reach * reach;
}

// Selects solid k in its pose after the fraction `share` of the substep.
fn look_at_solid(k: u32, share: f32) {
    solid_grid = posed_solids[k].grid;
    solid_velocity = posed_solids[k].velocity;
    solid_spin = posed_solids[k].spin;
    solid_centre = posed_solids[k].centre + share * posed_solids[k].length * solid_velocity;
    let back = mix(posed_solids[k].back, posed_solids[k].end_back, share);
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
