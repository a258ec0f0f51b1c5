// The system times the direction, and each brick's share of their dot product.
#import "shared/pressure_links.wgsl"
#import "shared/pressure_sum.wgsl"

@group(0) @binding(5) var<storage, read> pressure_direction: array<real>;
@group(0) @binding(6) var<storage, read_write> pressure_product: array<real>;

fn values(first: u32, s: u32, t: u32) -> vec4r {
    return vec4r(
        pressure_direction[first],
        pressure_direction[first + s],
        pressure_direction[first + t],
        pressure_direction[first + s + t],
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
    let slot = select(0u, range.x + i / 64u, i / 64u < range.y);
    let s = site_at(slot, i & 63u, range.x + range.y - 1u);
    let own = blocked(s.slot, s.block);
    let lower = blocked_lower(s);
    let upper = blocked_upper(s);
    let p = Pair(values(own, 64u, 128u), values(own + 256u, 64u, 128u));
    let about = Sides(
        values(lower.x + 64u, 128u, 256u),
        values(upper.x, 128u, 256u),
        values(lower.y + 128u, 64u, 256u),
        values(upper.y, 64u, 256u),
        values(lower.z + 256u, 64u, 128u),
        values(upper.z, 64u, 128u),
    );
    let product = apply(links_at(s), p, about);
    for (var c = 0u; c < 4u; c++) {
        pressure_product[own + 64u * c] = product.lo[c];
        pressure_product[own + 64u * c + 256u] = product.hi[c];
    }
    sum_workgroup(dot_pair(p, product), local, thread_index(workgroup, workgroups, 0u, 1u));
}
