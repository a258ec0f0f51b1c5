// v += (x* − x*_0) / Δt, where x*_0 is the prediction before any correction. This is v = (x* − x) /
// Δt (Macklin and Müller 2013, algorithm 1, lines 20–23) without its cancellation, which in f32
// costs a free particle at 90 m 0.4 mm/s per step. A particle faster than the cap is slowed and
// counted, and its position follows.
#import "shared/thread.wgsl"
#ifdef NEIGHBOR_EFFECTS
#import "shared/predicted_written.wgsl"
#else
#import "shared/predicted.wgsl"
#endif
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/counters.wgsl"

@group(0) @binding(10) var<storage, read> start_position: array<Vector>;
@group(0) @binding(17) var<storage, read> sorted_velocity: array<Vector>;
@group(0) @binding(12) var<storage, read_write> position: array<Vector>;
@group(0) @binding(13) var<storage, read_write> velocity: array<Vector>;
// In storage order, and behind that in sorted order.
@group(0) @binding(14) var<storage, read_write> id: array<u32>;
@group(0) @binding(15) var<storage, read_write> counters: Counters;
#ifdef PROJECTED
// In storage order, and behind that in sorted order.
@group(0) @binding(18) var<storage, read_write> is_drop: array<f32>;
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
    var x = predicted_at(thread).xyz;
    var v = (x - three(start_position[thread])) * params.inverse_time_step;
#ifdef PROJECTED
    // Water moves with the grid's flow and not with its own velocity: the corrections of each step
    // would accumulate in a velocity that never moves it. Isolated droplets move with their own
    // velocity.
    let own_is_drop = is_drop[params.particle_count + thread];
    v *= own_is_drop;
    is_drop[thread] = own_is_drop;
#endif
    v += three(sorted_velocity[thread]);
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
    position[thread] = packed(x);
#ifdef NEIGHBOR_EFFECTS
    // Effects read neighbours' positions from here.
    set_predicted(thread, vec4f(x, 0.0));
#endif
    velocity[thread] = packed(v);
    id[thread] = id[params.particle_count + thread];
}
