// Adds each workgroup's share of the work by moving walls in a substep to the sum over earlier
// substeps.
#import "shared/thread.wgsl"
#import "shared/sum_of_group.wgsl"
#import "shared/pbf_params.wgsl"

@group(0) @binding(1) var<storage, read> wall_work: array<f32>;
@group(0) @binding(2) var<storage, read_write> boundary_work: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    let is_inside = thread < params.particle_count;
    let i = select(0u, thread, is_inside);
    // Work by corrections, in sorted order, plus work by the prediction, in storage order.
    let work = select(0.0, wall_work[i] + wall_work[params.particle_count + i], is_inside);
    let sum = sum_of_group(local, work);
    if local == 0u && is_inside {
        boundary_work[thread / 64u] += sum;
    }
}
