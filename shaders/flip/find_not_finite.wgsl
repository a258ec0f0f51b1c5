// Counts non-finite values in one of a substep's arrays, which clamps, maxima and comparisons of
// later passes would hide.
#import "shared/thread.wgsl"
#import "shared/counters.wgsl"

@group(0) @binding(0) var<storage, read> values: array<vec4u>;
@group(0) @binding(1) var<storage, read_write> counters: Counters;

// Vectors of four values per thread.
const RUN = 4u;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let first = thread_index(workgroup, workgroups, local, 64u) * RUN;
    let exponent = vec4u(0x7f800000u);
    var bad = vec4u(0u);
    for (var k = first; k < min(first + RUN, arrayLength(&values)); k++) {
        bad += select(vec4u(0u), vec4u(1u), (values[k] & exponent) == exponent);
    }
    let count = bad.x + bad.y + bad.z + bad.w;
    if count > 0u {
        atomicAdd(&counters.not_finite, count);
    }
}
