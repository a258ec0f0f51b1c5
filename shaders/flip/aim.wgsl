// Displaces each particle so that its own velocity takes it to where the grid's velocity would take
// it from its original position. A solver that predicts positions with particle velocities then
// follows the grid's flow, and deviations of single particles do not separate neighbours. Isolated
// droplets keep their own path. The displacement that pushes particles apart is added to all.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/flip_params.wgsl"

@group(0) @binding(1) var<storage, read_write> sorted_position: array<Vector>;
// Velocities, and behind them displacements.
@group(0) @binding(2) var<storage, read> carried: array<Vector>;
@group(0) @binding(5) var<storage, read> is_drop: array<u32>;
@group(0) @binding(3) var<storage, read> velocity: array<Vector>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= params.particle_count {
        return;
    }
    let beside = select(three(carried[i]) - three(velocity[i]), vec3f(0.0), is_drop[i] > 0u);
    let pushed = three(carried[params.particle_count + i]);
    sorted_position[i] = packed(
        three(sorted_position[i]) + params.time_step * beside + pushed);
}
