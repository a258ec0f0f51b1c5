// The operations from which every tolerance of a check is derived, on numbers that no compiler
// knows: x and y become a sum, a product, a quotient and an inverse square root.
#import "shared/thread.wgsl"

@group(0) @binding(0) var<storage, read> numbers: array<vec2f>;
@group(0) @binding(1) var<storage, read_write> results: array<vec4f>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= arrayLength(&numbers) {
        return;
    }
    let x = numbers[i].x;
    let y = numbers[i].y;
    results[i] = vec4f(x + y, x * y, x / y, inverseSqrt(x));
}
