// Adds the coarser level's correction to that of a level and smooths it: the way back up of a
// V-cycle. On the finest level, each brick's share of residual · correction
// (shared/pressure_cycle.wgsl).
#import "shared/pressure_cycle.wgsl"
#import "shared/pressure_sum.wgsl"

alias Terms = real;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let group = thread_index(workgroup, workgroups, 0u, 1u);
    let slot = brick_slot(group, phase.level);
    let colour = local >> 5u;
    let s = site_at(slot, coloured_block(local & 31u, colour), last_slot(phase.level));
    var product = real(0.0);
    if slot != 0u && colour == 1u {
        product = prolong_at(s, false);
    }
    storageBarrier();
    if slot != 0u && colour == 0u {
        product = prolong_at(s, true);
    }
    let sum = sum_workgroup(product, local);
    if local == 0u && phase.level == 0u {
        pressure_sums[4u * group + CORRECTED] = sum;
    }
}
