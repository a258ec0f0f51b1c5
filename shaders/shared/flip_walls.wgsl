// The six walls as half-spaces that cut cells, in closed form; lengths in cells. A wall closer to a
// cell's face than this counts as on the face: f32 positions thousands of cells from the origin
// round by less.
const ON_FACE = 1e-3;

// Open part of a cell's extent along each axis.
fn open_extent(cell: vec3f) -> vec3f {
    let length = min(cell + 1.0, params.cut_max) - max(cell, params.cut_min);
    let inner = select(length, vec3f(0.0), length < vec3f(ON_FACE));
    return select(inner, vec3f(1.0), length > vec3f(1.0 - ON_FACE));
}

// Whether the planes of a cell's lower faces lie inside the box.
fn is_plane_open(cell: vec3f) -> vec3<bool> {
    return (cell > params.cut_min + ON_FACE) & (cell < params.cut_max - ON_FACE);
}

// Velocity of the wall that closes each lower face's plane, along its own axis, m/s.
fn wall_velocity(cell: vec3f) -> vec3f {
    let high = select(vec3f(0.0), params.wall_velocity_max, cell >= params.cut_max - ON_FACE);
    return select(high, params.wall_velocity_min, cell <= params.cut_min + ON_FACE);
}
