// Copies one buffer to another, 16 bytes per thread, the access pattern of passes over particles:
// measures the device's memory bandwidth (McCalpin 1995, copy).
#import "shared/thread.wgsl"

@group(0) @binding(0) var<storage, read> copied: array<vec4f>;
@group(0) @binding(1) var<storage, read_write> copy: array<vec4f>;

const THREADS = 256u;

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, THREADS);
    if i < arrayLength(&copy) {
        copy[i] = copied[i];
    }
}
