// First colour of a level, from nothing (shared/pressure_cycle.wgsl).
#import "shared/pressure_cycle.wgsl"

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[phase.level];
    // Past the end it is slot 0, where all is 0 and stays so.
    let slot = select(0u, range.x + i / 32u, i / 32u < range.y);
    smooth_first_at(site_at(slot, coloured_block(i & 31u, phase.colour), last_slot(phase.level)));
}
