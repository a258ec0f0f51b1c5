// The system times the next search direction, and each brick's shares of direction · product,
// residual · product and ‖product‖².
#import "shared/pressure_links.wgsl"
#import "shared/pressure_control.wgsl"
#import "shared/pressure_direction.wgsl"
#import "shared/pressure_sum.wgsl"

alias Terms = vec3r;

@group(0) @binding(5) var<storage, read> pressure_residual: array<real>;
// The correction, and the product after it.
@group(0) @binding(6) var<storage, read_write> pressure_correction: array<real>;
@group(0) @binding(7) var<storage, read> pressure_control: PressureControl;
// The last direction.
@group(0) @binding(8) var<storage, read> pressure_direction: array<real>;

fn direction_at(e: u32, beta: real) -> real {
    return next_direction(pressure_correction[e], pressure_direction[e], beta);
}

fn directions(first: u32, s: u32, t: u32, beta: real) -> vec4r {
    return vec4r(
        direction_at(first, beta),
        direction_at(first + s, beta),
        direction_at(first + t, beta),
        direction_at(first + s + t, beta),
    );
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let group = thread_index(workgroup, workgroups, 0u, 1u);
    let slot = brick_slot(group, 0u);
    let s = site_at(slot, local, last_slot(0u));
    let own = blocked(s.slot, s.block);
    let lower = blocked_lower(s);
    let upper = blocked_upper(s);
    let beta = pressure_control.beta;
    let p = Pair(directions(own, 64u, 128u, beta), directions(own + 256u, 64u, 128u, beta));
    let about = Sides(
        directions(lower.x + 64u, 128u, 256u, beta),
        directions(upper.x, 128u, 256u, beta),
        directions(lower.y + 128u, 64u, 256u, beta),
        directions(upper.y, 64u, 256u, beta),
        directions(lower.z + 256u, 64u, 128u, beta),
        directions(upper.z, 64u, 128u, beta),
    );
    let product = apply(links_at(s), p, about);
    var overlap = real(0.0);
    // Excess threads leave slot 0 at 0.
    for (var c = select(4u, 0u, slot != 0u); c < 4u; c++) {
        let e = own + 64u * c;
        pressure_correction[phase.stride + e] = product.lo[c];
        pressure_correction[phase.stride + e + 256u] = product.hi[c];
        overlap += pressure_residual[e] * product.lo[c]
            + pressure_residual[e + 256u] * product.hi[c];
    }
    let sum = sum_workgroup(
        vec3r(dot_pair(p, product), overlap, dot_pair(product, product)), local);
    if local == 0u {
        pressure_sums[4u * group + STEEPNESS] = sum.x;
        pressure_sums[4u * group + OVERLAP] = sum.y;
        pressure_sums[4u * group + PRODUCT_SQUARE] = sum.z;
    }
}
