// Ends the iteration once the mean density error is small enough, by emptying the dispatches to come.
// control: 0 done, 1 iterations, 4–6 groups of a dispatch over all, 8–10 over one colour.
#import "shared/pbf_params.wgsl"

override DENSITY_ERROR: f32;

@group(0) @binding(10) var<storage, read> error_sums: array<f32>;
@group(0) @binding(11) var<storage, read_write> control: array<u32>;
@group(0) @binding(12) var<storage, read_write> counters: array<u32>;

var<workgroup> partial: array<f32, 256>;

@compute @workgroup_size(256)
fn main(@builtin(local_invocation_index) local: u32) {
    let blocks = (params.particle_count + 255u) / 256u;
    var sum = 0.0;
    for (var k = local; k < blocks; k += 256u) {
        sum += error_sums[k];
    }
    partial[local] = sum;
    workgroupBarrier();
    for (var half = 128u; half > 0u; half /= 2u) {
        if local < half {
            partial[local] += partial[local + half];
        }
        workgroupBarrier();
    }
    if local == 0u && control[0] == 0u {
        if partial[0] <= DENSITY_ERROR * f32(params.particle_count) {
            control[0] = 1u;
            for (var k = 4u; k < 12u; k++) {
                control[k] = 0u;
            }
        } else {
            control[1] += 1u;
            counters[2] += 1u;
        }
    }
}
