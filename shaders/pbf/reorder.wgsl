// Copies the data that the iteration reads into sorted order (Hoetzlein 2014).
#import "shared/thread.wgsl"
#import "shared/predicted_written.wgsl"
#import "shared/vector.wgsl"
#import "shared/pbf_params.wgsl"
#ifdef PLACES
#import "shared/place.wgsl"
#endif

@group(0) @binding(2) var<storage, read> corrected: array<Vector>;
@group(0) @binding(10) var<storage, read> order: array<u32>;
@group(0) @binding(11) var<storage, read> velocity: array<Vector>;
// In storage order, and behind that in sorted order.
@group(0) @binding(12) var<storage, read_write> id: array<u32>;
@group(0) @binding(13) var<storage, read_write> start_position: array<Vector>;
@group(0) @binding(14) var<storage, read_write> sorted_velocity: array<Vector>;
#ifdef PLACES
@group(0) @binding(3) var<storage, read_write> place: array<u32>;
#endif
#ifdef PROJECTED
// In storage order, and behind that in sorted order.
@group(0) @binding(16) var<storage, read_write> is_drop: array<f32>;
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
    let x = corrected[source];
    set_predicted(thread, vec4f(three(x), 0.0));
    start_position[thread] = x;
    sorted_velocity[thread] = velocity[source];
    id[params.particle_count + thread] = id[source];
#ifdef PLACES
    place[thread] = place_word(three(x) * params.inverse_support_radius);
#endif
#ifdef PROJECTED
    is_drop[params.particle_count + thread] = is_drop[source];
#endif
}
