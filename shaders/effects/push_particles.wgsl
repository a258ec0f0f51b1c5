// Accelerates particles by the scene's forces, before the prediction applies gravity. Keeps each
// particle's change of velocity, and that times its velocity before, for the work.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/forces.wgsl"

@group(0) @binding(10) var<storage, read> position: array<Vector>;
@group(0) @binding(11) var<storage, read_write> velocity: array<Vector>;
@group(0) @binding(12) var<storage, read_write> force_impulse: array<vec4f>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= params.particle_count {
        return;
    }
    let before = three(velocity[i]);
    let change = params.time_step * force_at(three(position[i]));
    velocity[i] = packed(before + change);
    force_impulse[i] = vec4f(change, dot(change, before));
}
