// Adds up the partial sums and decides the next state of the solve. Dispatches of other states get
// zero workgroups. This pass itself always runs, because it must not take its size from a buffer
// that it writes; out of turn it does nothing.
#import "shared/pressure_phase.wgsl"
#import "shared/pressure_control.wgsl"
#import "shared/pressure_stats.wgsl"

alias note = u32;

@group(0) @binding(1) var<storage, read_write> pressure_control: PressureControl;
// Four sums per workgroup (shared/pressure_sum.wgsl).
@group(0) @binding(2) var<storage, read> pressure_sums: array<real>;
// Holds the number of pockets that pressure/count_pockets found.
@group(0) @binding(3) var<storage, read> pressure_stats: PressureStats;
@group(0) @binding(4) var<storage, read> pressure_sizes: array<vec4u>;
// Four copies of the sizes: for iterations, the verification, what follows it, and the step of an
// iteration; copies that are not due are 0.
@group(0) @binding(5) var<storage, read_write> pressure_groups: array<vec4u>;

const BEGIN = 0u;
const DIRECTION = 1u;
const LENGTH = 2u;
const VERIFIED = 3u;

// The copy of the sizes for the step of an iteration.
const STEP = 3u;

const MOST_RESTARTS = 16u;

var<workgroup> terms: array<vec4r, 256>;

// Tests the bits: a compiler may assume that a comparison never sees a NaN.
fn is_positive(x: real) -> bool {
#ifdef F64
    // The root of every positive f64 that a sum reaches is representable in f32; the root of a
    // negative number is NaN.
    let bits = bitcast<u32>(f32(sqrt(x)));
#else
    let bits = bitcast<u32>(x);
#endif
    return bits > 0u && bits < 0x7f800000u;
}

// Whether the iteration takes its step; set in the first thread.
var<workgroup> is_step: bool;

fn begin(sum: real) {
    pressure_control = PressureControl(ITERATING, 0u, 1u, 0u, sum, sum, 0.0, 0.0, 0.0);
    if phase.pocket_parts == 0u && pressure_stats.pockets > 0u {
        pressure_control.state = WANTS_POCKETS;
    } else if !is_positive(sum) {
        pressure_control.state = DONE;
    }
}

fn decide(sums: vec4r) {
    let target_square = real(phase.tolerance_square) * pressure_control.rhs_square;
    switch phase.step {
        case DIRECTION: {
            let product = sums.y;
            pressure_control.residual_square = sums.x;
            pressure_control.beta = select(
                product / pressure_control.product, 0.0, pressure_control.is_first == 1u);
            pressure_control.product = product;
            pressure_control.is_first = 0u;
            // The residual is small enough, which the last step did not foresee; it is zero; or
            // rounding has made the preconditioner indefinite.
            if !(sums.x > target_square) || !is_positive(product) {
                pressure_control.state = VERIFYING;
            }
        }
        case LENGTH: {
            let alpha = pressure_control.product / sums.y;
            pressure_control.alpha = alpha;
            if !is_positive(sums.y) {
                pressure_control.state = VERIFYING;
                return;
            }
            is_step = true;
            pressure_control.iterations += 1u;
            // ‖residual − α product‖².
            let square = pressure_control.residual_square - 2.0 * alpha * sums.z
                + alpha * alpha * sums.w;
            pressure_control.residual_square = square;
            let is_last = pressure_control.iterations >= phase.max_iterations;
            if !(square > target_square) || is_last {
                pressure_control.state = VERIFYING;
            }
        }
        default: {
            pressure_control.residual_square = sums.x;
            pressure_control.restarts += 1u;
            pressure_control.is_first = 1u;
            let is_reached = sums.x <= target_square;
            let is_over = pressure_control.iterations >= phase.max_iterations;
            if is_reached || is_over || pressure_control.restarts > MOST_RESTARTS {
                pressure_control.state = DONE;
            } else {
                pressure_control.state = ITERATING;
            }
        }
    }
}

@compute @workgroup_size(256)
fn main(@builtin(local_invocation_index) local: u32) {
    let wanted = select(ITERATING, VERIFYING, phase.step == VERIFIED);
    let is_turn = phase.step == BEGIN || pressure_control.state == wanted;
    let count = select(0u, phase.sum_count, is_turn);
    var sum = vec4r(0.0);
    for (var k = local; k < count; k += 256u) {
        let first = 4u * k;
        sum += vec4r(
            pressure_sums[first],
            pressure_sums[first + 1u],
            pressure_sums[first + 2u],
            pressure_sums[first + 3u],
        );
    }
    terms[local] = sum;
    workgroupBarrier();
    if local < 16u {
        sum = vec4r(0.0);
        for (var k = local; k < 256u; k += 16u) {
            sum += terms[k];
        }
        terms[local] = sum;
    }
    workgroupBarrier();
    if local == 0u {
        sum = vec4r(0.0);
        for (var k = 0u; k < 16u; k++) {
            sum += terms[k];
        }
        is_step = false;
        if phase.step == BEGIN {
            begin(sum.x);
        } else if is_turn {
            decide(sum);
        }
    }
    storageBarrier();
    workgroupBarrier();
    let state = pressure_control.state;
    let sizes = arrayLength(&pressure_sizes);
    for (var k = local; k < 4u * sizes; k += 256u) {
        let copy = k / sizes;
        let is_due = select(copy == state, is_step, copy == STEP);
        pressure_groups[k] = select(vec4u(0u), pressure_sizes[k % sizes], is_due);
    }
}
