// Re-lays what the iteration reads in sorted order (Hoetzlein 2014).
#import "shared/thread.wgsl"
#import "shared/pbf_params.wgsl"

@group(0) @binding(1) var<storage, read_write> predicted: array<vec4f>;
@group(0) @binding(10) var<storage, read> order: array<u32>;
@group(0) @binding(11) var<storage, read> position: array<vec4f>;
@group(0) @binding(12) var<storage, read> id: array<u32>;
@group(0) @binding(13) var<storage, read_write> start_position: array<vec4f>;
@group(0) @binding(14) var<storage, read_write> sorted_id: array<u32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.particle_count {
        return;
    }
    let source = order[thread];
    predicted[thread] = predicted[params.particle_count + source];
    start_position[thread] = position[source];
    sorted_id[thread] = id[source];
}
