// Ends the iteration once the mean density error is small enough, by setting the sizes of the
// remaining dispatches to zero.
#import "shared/pbf_params.wgsl"
#import "shared/counters.wgsl"
#import "shared/iteration_control.wgsl"

override DENSITY_ERROR: f32;

@group(0) @binding(10) var<storage, read> error_sums: array<f32>;
@group(0) @binding(11) var<storage, read_write> control: IterationControl;
@group(0) @binding(12) var<storage, read_write> counters: Counters;

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
    if local == 0u && control.is_done == 0u {
        if partial[0] <= DENSITY_ERROR * f32(params.particle_count) {
            control.is_done = 1u;
            control.all = vec4u(0u);
            control.colour = vec4u(0u);
        } else {
            control.iterations += 1u;
            atomicAdd(&counters.iterations, 1u);
        }
    }
}
