// Curvature of the surface near each cell, and the gradient of the smoothed water fraction there.
//
// κ = −∇·n, n = ∇s / |∇s| at the corners of the cell. Level sets away from the surface have a
// different curvature: κ is extrapolated along the normal to the surface, with κ' = |∇n|² per cell.
// Without that, water whose bulge is below the filter's resolution gets a smaller κ and less
// pressure, and bulges more: ripples of a few cells grew twofold in a fifth of a drop's period. The
// surface itself lies off the level 1/2 of the smoothed fraction by κ s² / 2, where s² is the
// filter's variance along an axis.
#import "shared/tension.wgsl"

@group(0) @binding(3) var<storage, read> tension_share: array<f32>;
// κ Δx and |∇s| Δx.
@group(0) @binding(4) var<storage, read_write> tension_curvature: array<vec2f>;

// Smaller gradients have no reliable direction.
const LEAST_SLOPE = 1e-3;
// Largest distance over which κ is extrapolated, cells.
const FARTHEST = 2.0;
// Half the variance of three binomial filters and of the hat function, 3 × 1/2 + 1/6 cells².
const SHIFT = 0.8333333;
// Curvature of a drop with a radius of two cells: the grid does not resolve smaller ones.
const MOST = 1.0;

var<private> shares: array<f32, 27>;

// Gradient of the water fraction at a corner, from the eight cells that meet there; `k` is the
// first of them, among 27.
fn slope_at(k: u32) -> vec3f {
    let low = vec4f(shares[k], shares[k + 1u], shares[k + 3u], shares[k + 4u]);
    let high = vec4f(shares[k + 9u], shares[k + 10u], shares[k + 12u], shares[k + 13u]);
    let along = high - low;
    return 0.25 * vec3f(
        ((low.y - low.x) + (low.w - low.z)) + ((high.y - high.x) + (high.w - high.z)),
        ((low.z - low.x) + (low.w - low.y)) + ((high.z - high.x) + (high.w - high.y)),
        (along.x + along.y) + (along.z + along.w),
    );
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let thread = thread_index(workgroup, workgroups, local, 64u);
    if thread >= params.active_cells {
        return;
    }
    let element = thread + CELLS;
    var found = vec2f(0.0);
    // Far from water there is no surface.
    for (var once = 0; once < select(0, 1, tension_share[element] > 0.0); once++) {
        open_mirrored(element);
        for (var k = 0; k < 27; k++) {
            shares[k] = tension_share[mirrored_element(vec3i(k % 3, k / 3 % 3, k / 9) - 1)];
        }
        var turns = mat3x3f();
        var mean = vec3f(0.0);
        for (var corner = 0u; corner < 8u; corner++) {
            let at = vec3u(corner & 1u, (corner >> 1u) & 1u, corner >> 2u);
            let slope = slope_at(at.x + 3u * at.y + 9u * at.z);
            let normal = slope / max(length(slope), LEAST_SLOPE);
            let side = 0.5 * vec3f(at) - 0.25;
            turns += mat3x3f(side.x * normal, side.y * normal, side.z * normal);
            mean += 0.125 * slope;
        }
        let bend = -(turns[0].x + turns[1].y + turns[2].z);
        let squares = dot(turns[0], turns[0]) + dot(turns[1], turns[1]) + dot(turns[2], turns[2]);
        let steep = length(mean);
        let off = clamp((0.5 - shares[13]) / max(steep, LEAST_SLOPE), -FARTHEST, FARTHEST);
        found = vec2f(clamp(bend + (off - SHIFT * bend) * squares, -MOST, MOST), steep);
    }
    tension_curvature[element] = found;
}
