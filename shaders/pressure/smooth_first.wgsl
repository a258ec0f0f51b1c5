// Smooths the first colour of a level from a correction of 0 (shared/pressure_cycle.wgsl).
#import "shared/pressure_cycle.wgsl"

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[phase.level];
    // Excess threads work on slot 0, where all values are and stay 0.
    let slot = select(0u, range.x + i / 32u, i / 32u < range.y);
    smooth_first_at(site_at(slot, coloured_block(i & 31u, phase.colour), last_slot(phase.level)));
}
