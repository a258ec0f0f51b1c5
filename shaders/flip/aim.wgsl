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
// Three floats per particle, and behind those of all particles, 1 for each isolated droplet.
@group(0) @binding(3) var<storage, read> sorted_velocity: array<f32>;

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
    let velocity = vec3f(
        sorted_velocity[3u * i], sorted_velocity[3u * i + 1u], sorted_velocity[3u * i + 2u]);
    let is_drop = sorted_velocity[3u * params.particle_count + i] > 0.0;
    let beside = select(three(carried[i]) - velocity, vec3f(0.0), is_drop);
    let pushed = three(carried[params.particle_count + i]);
    sorted_position[i] = packed(
        three(sorted_position[i]) + params.time_step * beside + pushed);
}
