// Re-lays what the iteration reads in sorted order (Hoetzlein 2014).
#import "shared/thread.wgsl"
#import "shared/pbf_params.wgsl"
#ifdef PLACES
#import "shared/place.wgsl"
#endif

@group(0) @binding(1) var<storage, read_write> predicted: array<vec4f>;
@group(0) @binding(10) var<storage, read> order: array<u32>;
@group(0) @binding(11) var<storage, read> velocity: array<vec4f>;
@group(0) @binding(12) var<storage, read> id: array<u32>;
@group(0) @binding(13) var<storage, read_write> start_position: array<vec4f>;
@group(0) @binding(14) var<storage, read_write> sorted_velocity: array<vec4f>;
@group(0) @binding(15) var<storage, read_write> sorted_id: array<u32>;
#ifdef PLACES
@group(0) @binding(3) var<storage, read_write> place: array<u32>;
#endif

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
    let x = predicted[params.particle_count + source];
    predicted[thread] = x;
    start_position[thread] = x;
    sorted_velocity[thread] = velocity[source];
    sorted_id[thread] = id[source];
#ifdef PLACES
    place[thread] = place_word(x.xyz * params.inverse_support_radius);
#endif
}
