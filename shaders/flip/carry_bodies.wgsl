// After a projection: adds to closed faces the change of velocity of the body that closes them.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_cell.wgsl"
#import "shared/flip_faces.wgsl"
#import "shared/bodies.wgsl"
#import "shared/brick_solids.wgsl"
#import "shared/pressure_real.wgsl"

// Change of each body's six velocities by the pressure, m/s and rad/s, and behind those of all
// bodies that by what flip/couple_bodies found.
@group(0) @binding(4) var<storage, read> body_change: array<real>;
@group(0) @binding(5) var<storage, read> face_open: array<f32>;
@group(0) @binding(6) var<storage, read_write> face_velocity: array<f32>;

fn change(first: u32) -> vec3f {
    let other = first + arrayLength(&body_change) / 2u;
    return vec3f(
        f32(body_change[first] + body_change[other]),
        f32(body_change[first + 1u] + body_change[other + 1u]),
        f32(body_change[first + 2u] + body_change[other + 2u]),
    );
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let pair = thread_index(workgroup, workgroups, 0u, 1u);
    if pair >= pair_count() {
        return;
    }
    let body = body_pairs[pair].body;
    look_about(pair);
    let solid = body_states[body].solid;
    let centre = body_states[body].centre;
    let velocity = change(6u * body);
    let spin = change(6u * body + 3u);
    for (var inner = local; inner < CELLS; inner += 64u) {
        let element = CELLS * body_pairs[pair].slot + inner;
        let cell = vec3f(own_cell(element));
        let extent = open_extent(cell);
        let cut = cut_faces(cell, extent.yzx * extent.zxy);
        let is_cut = cut.solids != 0u;
        let arm = (cell + 0.5) * params.cell_size - centre;
        let added = velocity + cross(spin, arm);
        for (var axis = 0u; axis < 3u; axis++) {
            let face = axis * params.stride + element;
            let is_inside = cut.lower_of_walls[axis] > 0.0;
            let is_own = is_cut && is_inside && cut.lower_solid[axis] == solid;
            if is_own && face_open[face] == 0.0 {
                face_velocity[face] += added[axis];
            }
        }
    }
}
