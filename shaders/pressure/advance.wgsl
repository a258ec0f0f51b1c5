// A conjugate-gradient step: the next direction, solution += α direction, residual −= α product,
// and each brick's share of the squared residual. With TWO_WORDS the solution is the sum of two
// words; the first accumulates the part of the step that is free of rounding. With one word of f32,
// or with a rounded step, the true residual stops falling at ε ‖A‖ ‖x‖, 1e-5 to 6e-4 ‖b‖ for smooth
// right-hand sides. With MULTIGRID the V-cycle of the next iteration begins here
// (shared/pressure_cycle.wgsl).
#ifdef MULTIGRID
#import "shared/pressure_cycle.wgsl"
#else
#import "shared/pressure_site.wgsl"
#endif
#import "shared/pressure_control.wgsl"
#import "shared/pressure_direction.wgsl"
#import "shared/pressure_sum.wgsl"
#ifdef TWO_WORDS
#import "shared/pressure_two_sum.wgsl"
#endif

alias Terms = real;

#ifndef MULTIGRID
@group(0) @binding(5) var<storage, read_write> pressure_residual: array<real>;
// The correction, and the product after it.
@group(0) @binding(6) var<storage, read_write> pressure_correction: array<real>;
#endif
@group(0) @binding(7) var<storage, read> pressure_control: PressureControl;
@group(0) @binding(8) var<storage, read_write> pressure_direction: array<real>;
@group(0) @binding(10) var<storage, read_write> pressure_solution: array<real>;

// Advances one cell; returns its residual.
fn advance_at(e: u32) -> real {
    let alpha = pressure_control.alpha;
    let p = next_direction(pressure_correction[e], pressure_direction[e], pressure_control.beta);
    pressure_direction[e] = p;
#ifdef TWO_WORDS
    let alpha_large = leading(alpha);
    let alpha_small = alpha - alpha_large;
    let p_large = leading(p);
    let sum = two_sum(pressure_solution[e], alpha_large * p_large);
    pressure_solution[e] = sum.x;
    pressure_solution[phase.stride + e] += sum.y
        + (alpha_large * (p - p_large) + alpha_small * p);
#else
    pressure_solution[e] += alpha * p;
#endif
    let r = pressure_residual[e] - alpha * pressure_correction[phase.stride + e];
    pressure_residual[e] = r;
    return r;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) workgroup: vec3u,
    @builtin(num_workgroups) workgroups: vec3u,
    @builtin(local_invocation_index) local: u32,
) {
    let group = thread_index(workgroup, workgroups, 0u, 1u);
    let slot = brick_slot(group, 0u);
    let colour = local >> 5u;
    let block = coloured_block(local & 31u, colour);
    var r = Pair(vec4r(0.0), vec4r(0.0));
    for (var once = u32(slot != 0u); once > 0u; once -= 1u) {
        let own = blocked(slot, block);
        for (var c = 0u; c < 4u; c++) {
            r.lo[c] = advance_at(own + 64u * c);
            r.hi[c] = advance_at(own + 64u * c + 256u);
        }
    }
    let squares = r.lo * r.lo + r.hi * r.hi;
    let square = sum_workgroup((squares.x + squares.y) + (squares.z + squares.w), local);
    if local == 0u {
        pressure_sums[4u * group + SQUARE] = square;
    }
#ifdef MULTIGRID
    let s = site_at(slot, block, last_slot(0u));
    smooth_brick(s, colour, r, slot != 0u && pressure_control.state == ITERATING);
#endif
}
