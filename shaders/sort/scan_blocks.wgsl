// Exclusive scan of 1024 values per workgroup, in place, and each block's sum (Blelloch 1990).
#import "shared/thread.wgsl"

@group(0) @binding(0) var<uniform> length: vec4u;
@group(0) @binding(1) var<storage, read_write> values: array<u32>;
@group(0) @binding(2) var<storage, read_write> block_sums: array<u32>;

const THREADS = 256u;
var<workgroup> partial: array<u32, THREADS>;

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let block = workgroup.y * workgroups.x + workgroup.x;
    let first = (block * THREADS + local) * 4u;
    var own: array<u32, 4>;
    var sum = 0u;
    for (var k = 0u; k < 4u; k++) {
        own[k] = sum;
        if first + k < length.x {
            sum += values[first + k];
        }
    }
    partial[local] = sum;
    workgroupBarrier();
    for (var stride = 1u; stride < THREADS; stride *= 2u) {
        var before = 0u;
        if local >= stride {
            before = partial[local - stride];
        }
        workgroupBarrier();
        partial[local] += before;
        workgroupBarrier();
    }
    let base = partial[local] - sum;
    for (var k = 0u; k < 4u; k++) {
        if first + k < length.x {
            values[first + k] = base + own[k];
        }
    }
    if local == THREADS - 1u && block * 1024u < length.x {
        block_sums[block] = partial[local];
    }
}
