// Moves each particle to where its own velocity has to start from so as to take it to where the grid's velocity takes it
// from its own place: whoever predicts with the particle's velocity alone then goes with the flow, and what single
// particles do beside it parts no neighbours. Drops fly as they are. All are displaced by what pushes them apart.
#import "shared/thread.wgsl"
#import "shared/flip_params.wgsl"
#import "shared/flip_carried.wgsl"

@group(0) @binding(1) var<storage, read_write> sorted_position: array<vec4f>;
@group(0) @binding(2) var<storage, read> carried: array<f32>;
// The fourth is 1 where it is a drop.
@group(0) @binding(3) var<storage, read> velocity: array<vec4f>;

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
    let first = CARRIED * i;
    let flow = vec3f(carried[first], carried[first + 1u], carried[first + 2u]);
    let beside = select(flow - velocity[i].xyz, vec3f(0.0), velocity[i].w > 0.0);
    let pushed = vec3f(carried[first + 3u], carried[first + 4u], carried[first + 5u]);
    sorted_position[i] = vec4f(sorted_position[i].xyz + params.time_step * beside + pushed, 1.0);
}
