// A step along the direction: solution += α direction, residual −= α product, and each brick's share of the
// residual's square. The solution is a sum of two words: in one, rounding would leave a true residual of
// ε ‖A‖ ‖x‖, 1e-4 ‖b‖ and more for smooth right-hand sides.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_control.wgsl"
#import "shared/pressure_two_sum.wgsl"
#import "shared/pressure_sum.wgsl"

@group(0) @binding(1) var<storage, read> pressure_control: PressureControl;
@group(0) @binding(2) var<storage, read> pressure_direction: array<f32>;
@group(0) @binding(3) var<storage, read> pressure_product: array<f32>;
@group(0) @binding(4) var<storage, read_write> pressure_residual: array<f32>;
@group(0) @binding(5) var<storage, read_write> pressure_solution: array<f32>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[0];
    let alpha = pressure_control.alpha;
    var square = 0.0;
    if i / 64u < range.y {
        let first = 512u * (range.x + i / 64u) + (i & 63u);
        for (var c = 0u; c < 512u; c += 64u) {
            let e = first + c;
            let sum = two_sum(pressure_solution[e], alpha * pressure_direction[e]);
            pressure_solution[e] = sum.x;
            pressure_solution[phase.stride + e] += sum.y;
            let r = pressure_residual[e] - alpha * pressure_product[e];
            pressure_residual[e] = r;
            square += r * r;
        }
    }
    sum_workgroup(square, local, thread_index(workgroup, workgroups, 0u, 1u));
}
