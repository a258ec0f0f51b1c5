// Adds the changes by viscosity_gather, after every particle has read the old velocities.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/phase.wgsl"
#import "shared/pbf_params.wgsl"

@group(0) @binding(10) var<storage, read> viscosity_change: array<Vector>;
@group(0) @binding(11) var<storage, read_write> velocity: array<Vector>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= phase.count {
        return;
    }
    let i = phase_particle(thread);
    velocity[i] = packed(three(velocity[i]) + three(viscosity_change[i]));
}
