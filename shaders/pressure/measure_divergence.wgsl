// Largest |∇·u| that the projection leaves.
#import "shared/pressure_divergence.wgsl"

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let slot = brick_slot(i / 64u, 0u);
    let most = largest_divergence(outflow(site_at(slot, i & 63u, phase.levels[0].z)), local);
    if local == 0u {
        atomicMax(&pressure_stats.divergence_after, most);
    }
}
