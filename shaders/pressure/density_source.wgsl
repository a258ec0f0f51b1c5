// Right-hand side of the density correction: the excess that displacements have to carry out of
// each cell (Kugelstadt et al. 2019), metres.
#import "shared/pressure_site.wgsl"
#import "shared/pressure_sum.wgsl"

alias Terms = real;

@group(0) @binding(2) var<storage, read> pressure_block: array<u32>;
@group(0) @binding(3) var<storage, read> density_excess: array<f32>;
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
    let block = i & 63u;
    let rows = pressure_block[64u * slot + block] >> 8u;
    let own = natural(slot, block);
    var square = real(0.0);
    for (var c = 0u; c < 8u; c++) {
        let excess = density_excess[own + (c & 1u) + 8u * ((c >> 1u) & 1u) + 64u * (c >> 2u)];
        let b = select(0.0, real(excess) * real(phase.cell_size), ((rows >> c) & 1u) == 1u);
        let e = blocked(slot, block) + 64u * c;
        pressure_rhs[e] = b;
        pressure_residual[e] = b;
        pressure_solution[e] = 0.0;
#ifdef TWO_WORDS
        pressure_solution[phase.stride + e] = 0.0;
#endif
        square += b * b;
    }
    let sum = sum_workgroup(square, local);
    if local == 0u {
        pressure_sums[4u * thread_index(workgroup, workgroups, 0u, 1u) + SQUARE] = sum;
    }
}
