// Adds to each value the scanned sum of all blocks before its own.
#import "shared/thread.wgsl"

@group(0) @binding(0) var<uniform> length: vec4u;
@group(0) @binding(1) var<storage, read_write> values: array<u32>;
@group(0) @binding(2) var<storage, read> block_sums: array<u32>;

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 256u);
    if i < length.x {
        values[i] += block_sums[i / 1024u];
    }
}
