// Sums the residuals of a level into the next coarser level (shared/pressure_cycle.wgsl).
#import "shared/pressure_cycle.wgsl"

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[phase.level];
    let slot = select(0u, range.x + i / 32u, i / 32u < range.y);
    restrict_at(site_at(slot, coloured_block(i & 31u, phase.colour), last_slot(phase.level)));
}
