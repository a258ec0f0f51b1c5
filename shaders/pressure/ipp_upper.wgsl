// Second half of the incomplete Poisson preconditioner (pressure/ipp_lower): Kᵀ times the result of
// the first half, and each brick's share of residual · correction.
#import "shared/pressure_ipp.wgsl"
#import "shared/pressure_sum.wgsl"

alias Terms = real;

@group(0) @binding(6) var<storage, read> pressure_residual: array<real>;
// The correction, and the result of the first half after it.
@group(0) @binding(8) var<storage, read_write> pressure_correction: array<real>;

fn halves(at: u32, s: u32, t: u32) -> vec4r {
    let first = phase.stride + at;
    return vec4r(
        pressure_correction[first],
        pressure_correction[first + s],
        pressure_correction[first + t],
        pressure_correction[first + s + t],
    );
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let s = site_at(brick_slot(i / 64u, 0u), i & 63u, last_slot(0u));
    let own = blocked(s.slot, s.block);
    let upper = blocked_upper(s);
    let l = links_at(s);
    let d = Pair(inverse_diagonals(own, 64u, 128u), inverse_diagonals(own + 256u, 64u, 128u));
    let y = Pair(halves(own, 64u, 128u), halves(own + 256u, 64u, 128u));
    let within = sides_of(y);
    let flow = sum_sides(Sides(
        l.ix * within.xu,
        l.out.xu * halves(upper.x, 128u, 256u),
        l.iy * within.yu,
        l.out.yu * halves(upper.y, 64u, 256u),
        l.iz * within.zu,
        l.out.zu * halves(upper.z, 64u, 128u),
    ));
    var product = real(0.0);
    for (var c = 0u; c < 4u; c++) {
        let e = own + 64u * c;
        let z = vec2<real>(y.lo[c] + d.lo[c] * flow.lo[c], y.hi[c] + d.hi[c] * flow.hi[c]);
        pressure_correction[e] = z.x;
        pressure_correction[e + 256u] = z.y;
        product += pressure_residual[e] * z.x + pressure_residual[e + 256u] * z.y;
    }
    let sum = sum_workgroup(product, local);
    if local == 0u {
        pressure_sums[4u * thread_index(workgroup, workgroups, 0u, 1u) + CORRECTED] = sum;
    }
}
