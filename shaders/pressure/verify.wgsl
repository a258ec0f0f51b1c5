// The true residual, right-hand side − system × solution, and each brick's share of its square.
#import "shared/pressure_links.wgsl"
#import "shared/pressure_sum.wgsl"

alias Terms = real;

@group(0) @binding(5) var<storage, read> pressure_solution: array<real>;
@group(0) @binding(6) var<storage, read> pressure_rhs: array<real>;
@group(0) @binding(7) var<storage, read_write> pressure_residual: array<real>;

fn values(first: u32, s: u32, t: u32) -> vec4r {
    return vec4r(
        pressure_solution[first],
        pressure_solution[first + s],
        pressure_solution[first + t],
        pressure_solution[first + s + t],
    );
}

// The system times one word of the solution. With two words, the differences within each are exact,
// or nearly so.
fn product(s: Site, l: Links, word: u32) -> Pair {
    let own = word + blocked(s.slot, s.block);
    let lower = word + blocked_lower(s);
    let upper = word + blocked_upper(s);
    let x = Pair(values(own, 64u, 128u), values(own + 256u, 64u, 128u));
    return apply(l, x, Sides(
        values(lower.x + 64u, 128u, 256u),
        values(upper.x, 128u, 256u),
        values(lower.y + 128u, 64u, 256u),
        values(upper.y, 64u, 256u),
        values(lower.z + 256u, 64u, 128u),
        values(upper.z, 64u, 128u),
    ));
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let i = thread_index(workgroup, workgroups, local, 64u);
    let s = site_at(brick_slot(i / 64u, 0u), i & 63u, last_slot(0u));
    let l = links_at(s);
    let main_part = product(s, l, 0u);
#ifdef TWO_WORDS
    let small_part = product(s, l, phase.stride);
#endif
    let own = blocked(s.slot, s.block);
    var r: Pair;
    for (var c = 0u; c < 4u; c++) {
        r.lo[c] = pressure_rhs[own + 64u * c] - main_part.lo[c];
        r.hi[c] = pressure_rhs[own + 64u * c + 256u] - main_part.hi[c];
#ifdef TWO_WORDS
        r.lo[c] -= small_part.lo[c];
        r.hi[c] -= small_part.hi[c];
#endif
        pressure_residual[own + 64u * c] = r.lo[c];
        pressure_residual[own + 64u * c + 256u] = r.hi[c];
    }
    let square = sum_workgroup(dot_pair(r, r), local);
    if local == 0u {
        pressure_sums[4u * thread_index(workgroup, workgroups, 0u, 1u) + SQUARE] = square;
    }
}
