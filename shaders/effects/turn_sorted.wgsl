// Turns the velocities of FLIP's particles by Coriolis's acceleration, before their transfer to the
// grid and after that from it.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/bricks.wgsl"
#import "shared/velocity_turn.wgsl"

@group(0) @binding(2) var<storage, read> cell_start: array<u32>;
// Three floats per particle, and behind those of all particles, 1 for each isolated droplet.
@group(0) @binding(4) var<storage, read_write> sorted_velocity: array<f32>;
// A droplet moves with its own velocity. Before the transfer this has no meaning yet.
@group(0) @binding(5) var<storage, read_write> carried: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.wet_cells {
        return;
    }
    let element = thread + CELLS;
    for (var i = cell_start[element]; i < cell_start[element + 1u]; i++) {
        let v = vec3f(
            sorted_velocity[3u * i], sorted_velocity[3u * i + 1u], sorted_velocity[3u * i + 2u]);
        let turned = v + change_by_turn(v);
        let is_drop = sorted_velocity[3u * params.particle_count + i] > 0.0;
        for (var axis = 0u; axis < 3u; axis++) {
            let k = 3u * i + axis;
            sorted_velocity[k] = turned[axis];
            carried[k] = select(carried[k], turned[axis], is_drop);
        }
    }
}
