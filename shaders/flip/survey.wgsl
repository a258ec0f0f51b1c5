// What the host needs to choose a step and lay out bricks: which bricks hold water, the largest speed, and whether
// anything is not finite. Bits of floats that are not negative order as the floats do.
#import "shared/thread.wgsl"
#import "shared/finite.wgsl"
#import "shared/flip_params.wgsl"

@group(0) @binding(1) var<storage, read> position: array<vec4f>;
@group(0) @binding(2) var<storage, read> velocity: array<vec4f>;
// Bits of the largest speed squared, values that are not finite, two unused words; then a flag a brick.
@group(0) @binding(3) var<storage, read_write> survey: array<atomic<u32>>;

var<workgroup> fastest: atomic<u32>;

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 256u);
    if local == 0u {
        atomicStore(&fastest, 0u);
    }
    workgroupBarrier();
    if i < params.particle_count {
        let x = position[i].xyz;
        let v = velocity[i].xyz;
        if !is_finite(x) || !is_finite(v) {
            atomicAdd(&survey[1], 1u);
        }
        let index = table_index(cell_of_place(x * params.inverse_cell_size));
        atomicStore(&survey[4u + index], 1u);
        atomicMax(&fastest, bitcast<u32>(dot(v, v)));
    }
    workgroupBarrier();
    if local == 0u {
        atomicMax(&survey[0], atomicLoad(&fastest));
    }
}
