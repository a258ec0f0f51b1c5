// Open fractions of each cell and of its lower faces, and the flux of solids through the closed
// parts: face fractions of Batty et al. 2007, exact for walls and for planes in meshes.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_cell.wgsl"
#import "shared/flip_walls.wgsl"
#ifdef SOLIDS
#import "shared/flip_cut.wgsl"
#import "shared/flip_hats.wgsl"
#endif

@group(0) @binding(3) var<storage, read_write> cell_kind: array<u32>;
@group(0) @binding(4) var<storage, read_write> face_open: array<f32>;
@group(0) @binding(5) var<storage, read_write> solid_flux: array<f32>;
#ifdef SOLIDS
@group(0) @binding(6) var<storage, read_write> open_volume: array<f32>;
@group(0) @binding(10) var<storage, read_write> open_hats: array<f32>;
#endif
#ifdef MOVING_SOLIDS
// Velocities of closed lower faces, m/s.
@group(0) @binding(9) var<storage, read_write> closed_velocity: array<f32>;
#endif

// A later pass finds which open cells are water, from the density at their centres.
const AIR = 0u;
const SOLID = 2u;

#ifdef SOLIDS
// A face with a smaller open fraction is closed: such faces drive jets at edges and corners in
// water at rest. A larger threshold blocks the flow along a wall: with 0.05, the deviation from
// Lamb's solution for water in a turning elliptic drum is 50 % larger.
const LEAST_OPEN = 0.02;
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
    var lower = select(vec3f(0.0), across, is_plane_open(cell));
    var upper = select(vec3f(0.0), across, is_plane_open(cell + 1.0));
    var volume = extent.x * across.x;
#ifdef SOLIDS
    var corners = Corners(vec4f(1e15), vec4f(1e15));
    // One bit for each solid that may cut the cell.
    var solids = 0u;
    var hats = 1.0;
#ifdef MOVING_SOLIDS
    let lower_of_walls = lower;
    let upper_of_walls = upper;
    // Velocity of the solid nearest to each face, along that face's axis.
    var lower_velocity = vec3f(0.0);
    var upper_velocity = vec3f(0.0);
    for (var k = 0u; k < solid_grids.count; k++) {
        look_at_solid(k, 0.0);
        for (var once = 0; once < select(0, 1, may_cut(cell)); once++) {
            let found = corner_distances(cell);
            let is_nearer_low = lower_sums(found) < lower_sums(corners);
            let is_nearer_high = upper_sums(found) < upper_sums(corners);
            // A velocity component of a rigid body does not change along its own axis: the value at
            // the centre is that at both faces.
            let pushing = solid_velocity_at((cell + 0.5) * params.cell_size);
            lower_velocity = select(lower_velocity, pushing, is_nearer_low);
            upper_velocity = select(upper_velocity, pushing, is_nearer_high);
            corners = Corners(min(corners.near, found.near), min(corners.far, found.far));
            solids |= 1u << k;
        }
    }
#else
    // Only cells that a solid may cut enter the loop.
    for (var once = 0; once < select(0, 1, may_cut(cell)); once++) {
        corners = corner_distances(cell);
        solids = 1u;
    }
#endif
    for (var once = 0; once < select(0, 1, solids != 0u); once++) {
        let near = corners.near;
        let far = corners.far;
        lower *= vec3f(
            open_part(vec4f(near.xz, far.xz)),
            open_part(vec4f(near.xy, far.xy)),
            open_part(near),
        );
        upper *= vec3f(
            open_part(vec4f(near.yw, far.yw)),
            open_part(vec4f(near.zw, far.zw)),
            open_part(far),
        );
        let slopes = abs(vec3f(
            dot(near.yw + far.yw - near.xz - far.xz, vec2f(0.25)),
            dot(near.zw + far.zw - near.xy - far.xy, vec2f(0.25)),
            dot(far - near, vec4f(0.25)),
        ));
        let center = dot(near + far, vec4f(0.125));
        let rise = slopes.x + slopes.y + slopes.z;
        volume *= clamp(0.5 + center / max(rise, 1e-20), 0.0, 1.0);
        hats = open_part_of_hat(cell, rise, solids);
        lower = select(lower, vec3f(0.0), lower < LEAST_OPEN * across);
        upper = select(upper, vec3f(0.0), upper < LEAST_OPEN * across);
    }
    lower = select(lower, vec3f(0.0), lower < vec3f(ON_FACE));
    upper = select(upper, vec3f(0.0), upper < vec3f(ON_FACE));
    open_volume[element] = volume;
    open_hats[element] = hats;
#endif
    let is_open = volume >= ON_FACE * ON_FACE || any(lower + upper > vec3f(0.0));
    cell_kind[element] = select(SOLID, AIR, is_open);
    face_open[element] = lower.x;
    face_open[params.stride + element] = lower.y;
    face_open[2u * params.stride + element] = lower.z;
    // The part of a face beyond a wall perpendicular to it counts for nothing.
#ifdef MOVING_SOLIDS
    let pushed_high = (across - upper_of_walls) * wall_velocity(cell + 1.0)
        + (upper_of_walls - upper) * upper_velocity;
    let pushed_low = (across - lower_of_walls) * wall_velocity(cell)
        + (lower_of_walls - lower) * lower_velocity;
    let pushed = pushed_high - pushed_low;
    let closing = select(wall_velocity(cell), lower_velocity, is_plane_open(cell));
    closed_velocity[element] = closing.x;
    closed_velocity[params.stride + element] = closing.y;
    closed_velocity[2u * params.stride + element] = closing.z;
#else
    let pushed = (across - upper) * wall_velocity(cell + 1.0)
        - (across - lower) * wall_velocity(cell);
#endif
    solid_flux[element] = pushed.x + pushed.y + pushed.z;
}
