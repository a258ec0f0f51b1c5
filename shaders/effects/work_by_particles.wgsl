// Adds each workgroup's share of the work of the scene's forces in a substep, over a particle's
// mass, to the sum over earlier substeps: impulse times the mean of the velocities before and after
// the substep.
#import "shared/thread.wgsl"
#import "shared/sum_of_group.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"

// Of the particle that each sorted particle was before the sort.
@group(0) @binding(1) var<storage, read> order: array<u32>;
@group(0) @binding(11) var<storage, read> velocity: array<Vector>;
@group(0) @binding(12) var<storage, read> force_impulse: array<vec4f>;
@group(0) @binding(13) var<storage, read_write> force_work: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    let is_inside = thread < params.particle_count;
    let i = select(0u, thread, is_inside);
    let impulse = force_impulse[order[i]];
    let work = 0.5 * (impulse.w + dot(impulse.xyz, three(velocity[i])));
    let sum = sum_of_group(local, select(0.0, work, is_inside));
    if local == 0u && is_inside {
        force_work[thread / 64u] += sum;
    }
}
