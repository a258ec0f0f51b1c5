// Scalars and state of the conjugate-gradient iteration; mirrored by `PressureControl` of
// solve/pressure/params.rs.
#import "shared/pressure_real.wgsl"

struct PressureControl {
    state: u32,
    iterations: u32,
    // 1 if the next direction restarts from the preconditioned residual.
    is_first: u32,
    restarts: u32,
    rhs_square: real,
    residual_square: real,
    // Residual · correction.
    product: real,
    alpha: real,
    beta: real,
}

const ITERATING = 0u;
const VERIFYING = 1u;
const DONE = 2u;
const WANTS_POCKETS = 3u;
