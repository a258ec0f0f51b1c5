// Open fractions of each cell and of its lower faces, and the flux of solids through the closed
// parts: face fractions of Batty et al. 2007, exact for walls and for planes in meshes.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_cell.wgsl"
#ifdef SOLIDS
#ifdef MOVING_SOLIDS
#import "shared/all_solids.wgsl"
#endif
#import "shared/flip_faces.wgsl"
#import "shared/flip_hats.wgsl"
#else
#import "shared/flip_walls.wgsl"
#endif

@group(0) @binding(3) var<storage, read_write> cell_kind: array<u32>;
@group(0) @binding(4) var<storage, read_write> face_open: array<f32>;
@group(0) @binding(5) var<storage, read_write> solid_flux: array<f32>;
#ifdef SOLIDS
@group(0) @binding(6) var<storage, read_write> open_volume: array<f32>;
@group(0) @binding(10) var<storage, read_write> open_hats: array<f32>;
// The four layers of the hat, from the lowest up, 16 bits each; of cells that solids cut.
@group(0) @binding(11) var<storage, read_write> open_layers: array<vec2u>;
// Weights of the lower faces in the transfer to particles: open fractions, and `facing_weights`.
@group(0) @binding(12) var<storage, read_write> face_weight: array<f32>;
#endif
#ifdef MOVING_SOLIDS
// Velocities of closed lower faces, m/s.
@group(0) @binding(9) var<storage, read_write> closed_velocity: array<f32>;
#endif

// A later pass finds which open cells are water, from the density at their centres.
const AIR = 0u;
const SOLID = 2u;

#ifdef SOLIDS
// Least weight of a closed face in the transfer to particles: it gives particles between closed
// faces alone the solid's velocity.
const LEAST_FACING = 1e-4;

// A distance that grows by less than this over a cell, in cells, says nothing of a direction, as in
// the middle of a plate: its faces count fully.
const LEAST_RISE = 0.1;

// How much the distance to solids grows over a cell along each axis, metres.
fn rises_over(corners: Corners) -> vec3f {
    let near = corners.near;
    let far = corners.far;
    return vec3f(
        dot(near.yw + far.yw - near.xz - far.xz, vec2f(0.25)),
        dot(near.zw + far.zw - near.xy - far.xy, vec2f(0.25)),
        dot(far - near, vec4f(0.25)),
    );
}

// Distances at the corners of the face one cell before a cell's lower face across `axis`, from the
// solid that is looked at.
fn distances_before(cell: vec3f, axis: u32) -> vec4f {
    let a = vec3f(vec3u(axis) == vec3u(0u, 1u, 2u));
    let b = a.zxy;
    let c = a.yzx;
    let start = cell - a;
    return vec4f(
        corner_distance(start),
        corner_distance(start + b),
        corner_distance(start + c),
        corner_distance(start + b + c),
    );
}

// Sums over the same corners of distances to the nearest of the solids that may cut the cell, for
// the axes that are asked for.
fn sums_before(cell: vec3f, axes: vec3<bool>) -> vec3f {
    var found = array<vec4f, 3>(vec4f(1e15), vec4f(1e15), vec4f(1e15));
#ifdef MOVING_SOLIDS
    for (var about = 0u; about < solids_about(); about++) {
        let is_near = may_cut_by(solid_about(about), cell);
#else
        let is_near = true;
#endif
        for (var axis = 0u; axis < 3u; axis++) {
            for (var once = 0; once < select(0, 1, is_near && axes[axis]); once++) {
                found[axis] = min(found[axis], distances_before(cell, axis));
            }
        }
#ifdef MOVING_SOLIDS
    }
#endif
    return vec3f(dot(found[0], vec4f(1.0)), dot(found[1], vec4f(1.0)), dot(found[2], vec4f(1.0)));
}

// Weights that a cell's lower faces have in the transfer to particles where a solid closes them. A
// face that faces the solid counts fully, with the solid's velocity, which stops the water. One
// that the water slides along would drag it, and does not count. The solid's normal follows from
// the growth of the distance from the face towards its open side and along it.
fn facing_weights(cell: vec3f, corners: Corners, by_solid: vec3<bool>) -> vec3f {
    let near = corners.near;
    let far = corners.far;
    let own = rises_over(corners);
    let before = 0.25 * (lower_sums(corners) - sums_before(cell, by_solid));
    let across = max(max(own, -before), vec3f(0.0));
    // Growth along each face, from its four corners.
    let along_x = vec2f(near.z + far.z - near.x - far.x, far.x + far.z - near.x - near.z);
    let along_y = vec2f(near.y + far.y - near.x - far.x, far.x + far.y - near.x - near.y);
    let along_z = vec2f(near.y + near.w - near.x - near.z, near.z + near.w - near.x - near.y);
    let along = 0.25 * vec3f(dot(along_x, along_x), dot(along_y, along_y), dot(along_z, along_z));
    let least = LEAST_RISE * params.cell_size;
    let facing = (across * across + least * least) / (across * across + along + least * least);
    let part = max(2.0 * facing - 1.0, vec3f(0.0));
    return max(part * part, vec3f(LEAST_FACING));
}

#endif
@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.active_cells {
        return;
    }
    let element = thread + CELLS;
    let cell = vec3f(own_cell(element));
    let extent = open_extent(cell);
    let across = extent.yzx * extent.zxy;
    var volume = extent.x * across.x;
#ifdef SOLIDS
    let cut = cut_faces(cell, across);
    let lower = cut.lower;
    let upper = cut.upper;
    var hats = 1.0;
    var closed = vec3f(1.0);
    for (var once = 0; once < select(0, 1, cut.solids != 0u); once++) {
        let near = cut.corners.near;
        let far = cut.corners.far;
        let rises = abs(rises_over(cut.corners));
        let center = dot(near + far, vec4f(0.125));
        let rise = rises.x + rises.y + rises.z;
        let by_solid = (lower == vec3f(0.0)) & (cut.lower_of_walls > vec3f(0.0));
        for (var some = 0; some < select(0, 1, any(by_solid)); some++) {
            closed = select(closed, facing_weights(cell, cut.corners, by_solid), by_solid);
        }
        volume *= clamp(0.5 + center / max(rise, 1e-20), 0.0, 1.0);
        let hat = open_hat(cell, rise, cut.solids);
        hats = hat.part;
        open_layers[element] =
            vec2u(pack2x16unorm(hat.layers.xy), pack2x16unorm(hat.layers.zw));
    }
    open_volume[element] = volume;
    open_hats[element] = hats;
    let weight = select(lower, closed, lower == vec3f(0.0));
    face_weight[element] = weight.x;
    face_weight[params.stride + element] = weight.y;
    face_weight[2u * params.stride + element] = weight.z;
#else
    let lower = select(vec3f(0.0), across, is_plane_open(cell));
    let upper = select(vec3f(0.0), across, is_plane_open(cell + 1.0));
#endif
    let is_open = volume >= ON_FACE * ON_FACE || any(lower + upper > vec3f(0.0));
    cell_kind[element] = select(SOLID, AIR, is_open);
    face_open[element] = lower.x;
    face_open[params.stride + element] = lower.y;
    face_open[2u * params.stride + element] = lower.z;
    // The part of a face beyond a wall perpendicular to it counts for nothing.
#ifdef MOVING_SOLIDS
    let pushed_high = (across - cut.upper_of_walls) * wall_velocity(cell + 1.0)
        + (cut.upper_of_walls - upper) * cut.upper_velocity;
    let pushed_low = (across - cut.lower_of_walls) * wall_velocity(cell)
        + (cut.lower_of_walls - lower) * cut.lower_velocity;
    let pushed = pushed_high - pushed_low;
    let closing = select(wall_velocity(cell), cut.lower_velocity, is_plane_open(cell));
    closed_velocity[element] = closing.x;
    closed_velocity[params.stride + element] = closing.y;
    closed_velocity[2u * params.stride + element] = closing.z;
#else
    let pushed = (across - upper) * wall_velocity(cell + 1.0)
        - (across - lower) * wall_velocity(cell);
#endif
    solid_flux[element] = pushed.x + pushed.y + pushed.z;
}
