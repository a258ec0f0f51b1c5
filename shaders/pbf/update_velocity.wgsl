// v += (x* − x*_0) / Δt, x*_0 the prediction before any correction: v = (x* − x) / Δt (Macklin and Müller 2013,
// algorithm 1, lines 20–23) without its cancellation, which costs a free particle at 90 m 0.4 mm/s a step in
// f32. A particle faster than the cap is slowed and counted, and its position follows.
#import "shared/thread.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/phase.wgsl"
#import "shared/counters.wgsl"
#import "shared/iteration_control.wgsl"

@group(0) @binding(1) var<storage, read> predicted: array<vec4f>;
@group(0) @binding(10) var<storage, read> start_position: array<vec4f>;
@group(0) @binding(11) var<storage, read> sorted_id: array<u32>;
@group(0) @binding(17) var<storage, read> sorted_velocity: array<vec4f>;
@group(0) @binding(12) var<storage, read_write> position: array<vec4f>;
@group(0) @binding(13) var<storage, read_write> velocity: array<vec4f>;
@group(0) @binding(14) var<storage, read_write> id: array<u32>;
@group(0) @binding(15) var<storage, read_write> counters: Counters;
#ifdef ADAPTIVE
@group(0) @binding(16) var<storage, read> control: IterationControl;
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
    let source = thread + select(0u, params.particle_count, (control.iterations & 1u) == 1u);
#else
    let source = thread + phase.read_even;
#endif
    var x = predicted[source].xyz;
    let came = sorted_velocity[thread];
    var v = (x - start_position[thread].xyz) * params.inverse_time_step;
#ifdef PROJECTED
    // Water goes with the grid's flow and not with its own velocity: what it is corrected by in each step would add up
    // in a velocity that never moves it. Drops fly with theirs.
    v *= came.w;
#endif
    v += came.xyz;
    let distance = length(v) * params.time_step;
    if distance > params.max_displacement {
        let excess = v * (1.0 - params.max_displacement / distance);
        v -= excess;
        x -= excess * params.time_step;
        atomicAdd(&counters.capped, 1u);
    }
#ifdef PERIODIC
    x = wrapped_place(x);
#endif
    position[thread] = vec4f(x, 1.0);
    velocity[thread] = vec4f(v, came.w);
    id[thread] = sorted_id[thread];
}
