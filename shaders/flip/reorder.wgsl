// Copies particles into the order of their cells (Hoetzlein 2014).
#import "shared/thread.wgsl"
#import "shared/vector.wgsl"
#import "shared/flip_params.wgsl"

@group(0) @binding(1) var<storage, read> order: array<u32>;
@group(0) @binding(2) var<storage, read> position: array<Vector>;
@group(0) @binding(3) var<storage, read> velocity: array<Vector>;
// In storage order, and behind that in sorted order.
@group(0) @binding(4) var<storage, read_write> id: array<u32>;
@group(0) @binding(5) var<storage, read_write> sorted_position: array<Vector>;
@group(0) @binding(6) var<storage, read_write> sorted_velocity: array<Vector>;
#ifdef PLACES
#import "shared/place.wgsl"
@group(0) @binding(12) var<storage, read_write> place: array<u32>;
#endif
#ifdef APIC
@group(0) @binding(10) var<storage, read> affine: array<f32>;
@group(0) @binding(11) var<storage, read_write> sorted_affine: array<f32>;
#endif

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
    let source = order[i];
    let x = position[source];
    sorted_position[i] = x;
#ifdef PLACES
    place[i] = place_word(three(x) * params.inverse_cell_size);
#endif
    sorted_velocity[i] = velocity[source];
    id[params.particle_count + i] = id[source];
#ifdef APIC
    for (var k = 0u; k < 9u; k++) {
        sorted_affine[9u * i + k] = affine[9u * source + k];
    }
#endif
}
