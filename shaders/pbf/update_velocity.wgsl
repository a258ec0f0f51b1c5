// v = (x* − x) / Δt (Macklin and Müller 2013, algorithm 1, lines 20–23). A particle faster than the cap is
// slowed and counted, and its position follows, so that position and velocity agree.
#import "shared/thread.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"

@group(0) @binding(1) var<storage, read> predicted: array<vec4f>;
@group(0) @binding(10) var<storage, read> start_position: array<vec4f>;
@group(0) @binding(11) var<storage, read> sorted_id: array<u32>;
@group(0) @binding(12) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(13) var<storage, read_write> velocity: array<vec4f>;
@group(0) @binding(14) var<storage, read_write> id: array<u32>;
@group(0) @binding(15) var<storage, read_write> counters: array<atomic<u32>>;
#ifdef ADAPTIVE
@group(0) @binding(16) var<storage, read> control: array<u32>;
#endif

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.particle_count {
        return;
    }
#ifdef ADAPTIVE
    let source = thread + select(0u, params.particle_count, (control[1] & 1u) == 1u);
#else
    let source = thread + phase.read_even;
#endif
    let x0 = start_position[thread].xyz;
    var moved = predicted[source].xyz - x0;
    let distance = length(moved);
    if distance > params.max_displacement {
        moved *= params.max_displacement / distance;
        atomicAdd(&counters[0], 1u);
    }
    position[thread] = vec4f(x0 + moved, 1.0);
    velocity[thread] = vec4f(moved * params.inverse_time_step, 0.0);
    id[thread] = sorted_id[thread];
}
