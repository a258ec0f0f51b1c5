// Turns the velocities of PBF's particles by Coriolis's acceleration, before their prediction and
// after their update.
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#import "shared/velocity_turn.wgsl"

@group(0) @binding(11) var<storage, read_write> velocity: array<Vector>;

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
    let v = three(velocity[i]);
    velocity[i] = packed(v + change_by_turn(v));
}
