// The identity or the diagonal preconditioner, and each brick's share of residual · correction.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_sum.wgsl"

alias Terms = real;

@group(0) @binding(1) var<storage, read> pressure_residual: array<real>;
@group(0) @binding(2) var<storage, read_write> pressure_correction: array<real>;
#ifdef DIAGONAL
@group(0) @binding(3) var<storage, read> pressure_inverse_diagonal: array<real>;
#endif

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[0];
    var product = real(0.0);
    if i / 64u < range.y {
        let first = 512u * (range.x + i / 64u) + (i & 63u);
        for (var e = first; e < first + 512u; e += 64u) {
            let r = pressure_residual[e];
#ifdef DIAGONAL
            let z = pressure_inverse_diagonal[e] * r;
#else
            let z = r;
#endif
            pressure_correction[e] = z;
            product += r * z;
        }
    }
    let sum = sum_workgroup(product, local);
    if local == 0u {
        pressure_sums[4u * thread_index(workgroup, workgroups, 0u, 1u) + CORRECTED] = sum;
    }
}
