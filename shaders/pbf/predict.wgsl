// Explicit step of the external forces (Macklin and Müller 2013, algorithm 1, lines 1–4) into
// `corrected`; the sort copies it to `predicted`. What walls and solids remove from the
// displacement is also removed from the velocity.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/counters.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/confine.wgsl"
#import "shared/finite.wgsl"
#ifdef WALL_WORK
#import "shared/wall_work.wgsl"
#endif

@group(0) @binding(1) var<storage, read_write> corrected: array<Vector>;
@group(0) @binding(10) var<storage, read> position: array<Vector>;
@group(0) @binding(11) var<storage, read_write> velocity: array<Vector>;
// Counts non-finite values, which clamping would hide.
@group(0) @binding(12) var<storage, read_write> counters: Counters;
#ifdef PROJECTED
@group(0) @binding(14) var<storage, read> is_drop: array<f32>;
#endif

#ifdef PROJECTED
// Removes the part of v against the pushes of walls and solids; call it after confine(free).
fn stopped(v: vec3f, free: vec3f) -> vec3f {
    var left = v;
    var y = free;
#ifdef SOLIDS
#ifdef MOVING_SOLIDS
    let push = solids_push;
    let against = left - pushing_velocity;
#else
    let push = solid_push;
    let against = left;
#endif
    left -= push * (min(dot(against, push), 0.0) / max(dot(push, push), 1e-30));
    y += push;
#endif
    left = select(
        left, max(left, params.wall_velocity_min), y < params.wall_min + params.contact_distance);
    return select(
        left, min(left, params.wall_velocity_max), y > params.wall_max - params.contact_distance);
}

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
    let start = three(position[thread]);
    var v = three(velocity[thread]) + params.velocity_step;
    if !is_finite(v) || !is_finite(start) {
        atomicAdd(&counters.not_finite, 1u);
    }
    v *= min(1.0, params.max_displacement / max(params.time_step * length(v), 1e-30));
    let free = start + params.time_step * v;
    let x = confine(free);
#ifdef WALL_WORK
    wall_work[params.particle_count + thread] = work_of_pushes();
#endif
#ifdef PERIODIC
    corrected[thread] = packed(wrapped_place(x));
#else
    corrected[thread] = packed(x);
#endif
    let taken = (x - free) * params.inverse_time_step;
#ifdef PROJECTED
    // Water was moved here by the grid's flow, not by its own velocity. The velocity therefore only
    // loses its component into walls and solids.
    velocity[thread] = packed(select(stopped(v, free), v + taken, is_drop[thread] > 0.0));
#else
    velocity[thread] = packed(v + taken);
#endif
}
