// Sums max(0, ρ/ρ0 − 1) over the 256 particles of a workgroup, in a fixed order.
#import "shared/thread.wgsl"
#import "shared/pbf_params.wgsl"

@group(0) @binding(10) var<storage, read> density: array<f32>;
@group(0) @binding(11) var<storage, read_write> error_sums: array<f32>;

var<workgroup> partial: array<f32, 256>;

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 256u);
    partial[local] = 0.0;
    if i < params.particle_count {
        partial[local] = max(density[i] - 1.0, 0.0);
    }
    workgroupBarrier();
    for (var half = 128u; half > 0u; half /= 2u) {
        if local < half {
            partial[local] += partial[local + half];
        }
        workgroupBarrier();
    }
    if local == 0u && i < params.particle_count {
        error_sums[i / 256u] = partial[0];
    }
}
