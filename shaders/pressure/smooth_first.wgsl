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
    let range = phase.levels[0];
    let is_wet = group < range.y;
    let colour = local >> 5u;
    let slot = select(0u, range.x + group, is_wet);
    let s = site_at(slot, coloured_block(local & 31u, colour), last_slot(0u));
    smooth_brick(s, colour, residual_at(s), is_wet);
}
