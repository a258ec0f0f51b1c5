// Only multiplications and additions, in three independent vectors: measures the device's peak
// arithmetic rate.
#import "shared/thread.wgsl"

@group(0) @binding(0) var<storage, read_write> escaped: array<vec4f>;

const THREADS = 256u;
const ROUNDS = 512u;
const FACTOR = vec4f(0.999);
const TERM = vec4f(0.001);
/// Each number converges to TERM / (1 - FACTOR) = 1, so none is ever this large; but no compiler
/// knows that.
const NEVER = 1e30;

@compute @workgroup_size(256)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, THREADS);
    var a = vec4f(f32(i));
    var b = vec4f(f32(local));
    var c = vec4f(f32(workgroup.x));
    for (var round = 0u; round < ROUNDS; round++) {
        a = a * FACTOR + TERM;
        b = b * FACTOR + TERM;
        c = c * FACTOR + TERM;
    }
    let all = a + b + c;
    if all.x + all.y + all.z + all.w > NEVER {
        escaped[0] = all;
    }
}
