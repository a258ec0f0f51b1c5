// A conjugate-gradient step: solution += α direction, residual −= α product, and each brick's share
// of the squared residual. With TWO_WORDS the solution is the sum of two words; the first
// accumulates the part of the step that is free of rounding. With one word of f32, or with a
// rounded step, the true residual stops falling at ε ‖A‖ ‖x‖, 1e-5 to 6e-4 ‖b‖ for smooth
// right-hand sides.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_control.wgsl"
#import "shared/pressure_sum.wgsl"
#ifdef TWO_WORDS
#import "shared/pressure_two_sum.wgsl"
#endif

@group(0) @binding(1) var<storage, read> pressure_control: PressureControl;
@group(0) @binding(2) var<storage, read> pressure_direction: array<real>;
@group(0) @binding(3) var<storage, read> pressure_product: array<real>;
@group(0) @binding(4) var<storage, read_write> pressure_residual: array<real>;
@group(0) @binding(5) var<storage, read_write> pressure_solution: array<real>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[0];
    let alpha = pressure_control.alpha;
#ifdef TWO_WORDS
    let alpha_large = leading(alpha);
    let alpha_small = alpha - alpha_large;
#endif
    var square = real(0.0);
    if i / 64u < range.y {
        let first = 512u * (range.x + i / 64u) + (i & 63u);
        for (var c = 0u; c < 512u; c += 64u) {
            let e = first + c;
            let p = pressure_direction[e];
#ifdef TWO_WORDS
            let p_large = leading(p);
            let sum = two_sum(pressure_solution[e], alpha_large * p_large);
            pressure_solution[e] = sum.x;
            pressure_solution[phase.stride + e] += sum.y
                + (alpha_large * (p - p_large) + alpha_small * p);
#else
            pressure_solution[e] += alpha * p;
#endif
            let r = pressure_residual[e] - alpha * pressure_product[e];
            pressure_residual[e] = r;
            square += r * r;
        }
    }
    sum_workgroup(square, local, thread_index(workgroup, workgroups, 0u, 1u));
}
