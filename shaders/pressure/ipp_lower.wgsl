// First half of the incomplete Poisson preconditioner Kᵀ D⁻¹ K, K = I − L D⁻¹: D⁻¹ K residual.
// Ament et al. 2010 derive it for a system scaled to a unit diagonal; as published it is worse than
// the diagonal preconditioner if the diagonal varies.
#import "shared/pressure_ipp.wgsl"

@group(0) @binding(6) var<storage, read> pressure_residual: array<real>;
// Its second half takes the result.
@group(0) @binding(7) var<storage, read_write> pressure_correction: array<real>;

fn scaled(first: u32, s: u32, t: u32) -> vec4r {
    return inverse_diagonals(first, s, t) * residuals(first, s, t);
}

fn residuals(first: u32, s: u32, t: u32) -> vec4r {
    return vec4r(
        pressure_residual[first],
        pressure_residual[first + s],
        pressure_residual[first + t],
        pressure_residual[first + s + t],
    );
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let range = phase.levels[0];
    if i / 64u >= range.y {
        return;
    }
    let s = site_at(range.x + i / 64u, i & 63u, range.x + range.y - 1u);
    let own = blocked(s.slot, s.block);
    let lower = blocked_lower(s);
    let l = links_at(s);
    let d = Pair(inverse_diagonals(own, 64u, 128u), inverse_diagonals(own + 256u, 64u, 128u));
    let r = Pair(residuals(own, 64u, 128u), residuals(own + 256u, 64u, 128u));
    let within = sides_of(Pair(d.lo * r.lo, d.hi * r.hi));
    let flow = sum_sides(Sides(
        l.out.xl * scaled(lower.x + 64u, 128u, 256u),
        l.ix * within.xl,
        l.out.yl * scaled(lower.y + 128u, 64u, 256u),
        l.iy * within.yl,
        l.out.zl * scaled(lower.z + 256u, 64u, 128u),
        l.iz * within.zl,
    ));
    for (var c = 0u; c < 4u; c++) {
        let e = phase.stride + own + 64u * c;
        pressure_correction[e] = d.lo[c] * (r.lo[c] + flow.lo[c]);
        pressure_correction[e + 256u] = d.hi[c] * (r.hi[c] + flow.hi[c]);
    }
}
