// Smooths one colour of a level, and on the finest level sums its share of residual · correction
// (shared/pressure_cycle.wgsl).
#import "shared/pressure_cycle.wgsl"
#import "shared/pressure_sum.wgsl"

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[phase.level];
    let slot = select(0u, range.x + i / 32u, i / 32u < range.y);
    let product = smooth_at(
        site_at(slot, coloured_block(i & 31u, phase.colour), last_slot(phase.level)));
    if phase.level == 0u {
        let groups = (range.y + 1u) / 2u;
        let group = workgroup.y * workgroups.x + workgroup.x;
        // A two-dimensional dispatch may have excess workgroups: their 0 is stored after the sums.
        let place = select(2u * groups, phase.colour * groups + group, group < groups);
        sum_workgroup(product, local, place);
    }
}
