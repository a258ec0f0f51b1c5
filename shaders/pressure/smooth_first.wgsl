// Smooths the finest level from a correction of 0: how a V-cycle begins that does not follow
// pressure/advance (shared/pressure_cycle.wgsl).
#import "shared/pressure_cycle.wgsl"

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let group = thread_index(workgroup, workgroups, 0u, 1u);
    let colour = local >> 5u;
    let slot = brick_slot(group, 0u);
    let s = site_at(slot, coloured_block(local & 31u, colour), last_slot(0u));
    smooth_brick(s, colour, residual_at(s), slot != 0u);
}
