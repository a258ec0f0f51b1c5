// What arithmetic a device has: quotients, roots, what sums and products lose, subnormal numbers.
// The host compares the results with its own in f64.
#import "shared/thread.wgsl"

// What shared/pressure_two_sum.wgsl needs of a pressure phase.
struct Opaque {
    opaque_zero: u32,
}

var<private> phase: Opaque;

@group(0) @binding(0) var<storage, read> rounding_zero: array<u32>;
// a, b, minus the rounded product a b, and an angle.
@group(0) @binding(1) var<storage, read> rounding_operands: array<vec4f>;
// A subnormal number, and the least normal one.
@group(0) @binding(2) var<storage, read> rounding_small: array<vec2f>;
// Four vectors each.
@group(0) @binding(3) var<storage, read_write> rounding_results: array<vec4f>;

#import "shared/pressure_two_sum.wgsl"

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    if i >= arrayLength(&rounding_operands) {
        return;
    }
    phase.opaque_zero = rounding_zero[0];
    let operands = rounding_operands[i];
    let a = operands.x;
    let b = operands.y;
    let a_large = leading(a);
    let b_large = leading(b);
    let small = a_large * (b - b_large) + (a - a_large) * b;
    let sum = two_sum(a, b);
    let small_number = rounding_small[i];
    rounding_results[4u * i] = vec4f(a / b, sqrt(a), inverseSqrt(a), length(operands.xy));
    rounding_results[4u * i + 1u] = vec4f(sum, a_large * b_large, small);
    rounding_results[4u * i + 2u] = vec4f(
        a * b + operands.z,
        select(0.0, 1.0, bitcast<u32>(small_number.x) == 0u),
        select(0.0, 1.0, bitcast<u32>(small_number.y * 0.25) == 0u),
        sin(operands.w),
    );
    rounding_results[4u * i + 3u] = vec4f(exp(operands.w), log(a), pow(a, 0.3), cos(operands.w));
}
