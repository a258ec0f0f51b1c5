// Right-hand side −(Σ ± f u + solid flux − contraction's) of the rows, the initial solution and
// residual of the iteration, and the largest |∇·u| in a cell with a row.
#import "shared/pressure_divergence.wgsl"
#import "shared/pressure_sum.wgsl"

alias Terms = real;

@group(0) @binding(6) var<storage, read_write> pressure_rhs: array<real>;
@group(0) @binding(7) var<storage, read_write> pressure_residual: array<real>;
@group(0) @binding(8) var<storage, read_write> pressure_solution: array<real>;

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let slot = brick_slot(i / 64u, 0u);
    let s = site_at(slot, i & 63u, phase.levels[0].z);
    let b = outflow(s);
    let most = largest_divergence(b, local);
    if local == 0u {
        atomicMax(&pressure_stats.divergence_before, most);
    }
    let own = blocked(s.slot, s.block);
    for (var c = 0u; c < 4u; c++) {
        pressure_rhs[own + 64u * c] = -b.lo[c];
        pressure_rhs[own + 64u * c + 256u] = -b.hi[c];
        pressure_residual[own + 64u * c] = -b.lo[c];
        pressure_residual[own + 64u * c + 256u] = -b.hi[c];
    }
    for (var e = own; e < own + 512u; e += 64u) {
        pressure_solution[e] = 0.0;
#ifdef TWO_WORDS
        pressure_solution[phase.stride + e] = 0.0;
#endif
    }
    let squares = b.lo * b.lo + b.hi * b.hi;
    let square = sum_workgroup((squares.x + squares.y) + (squares.z + squares.w), local);
    if local == 0u {
        pressure_sums[4u * thread_index(workgroup, workgroups, 0u, 1u) + SQUARE] = square;
    }
}
