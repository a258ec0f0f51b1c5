// What the conjugate gradients decide among themselves; `PressureControl` of solve/pressure/params.rs.
#import "shared/pressure_real.wgsl"

struct PressureControl {
    state: u32,
    iterations: u32,
    // Whether the next direction starts afresh.
    is_first: u32,
    restarts: u32,
    rhs_square: real,
    residual_square: real,
    // residual · correction.
    product: real,
    alpha: real,
    beta: real,
}

const ITERATING = 0u;
const VERIFYING = 1u;
const DONE = 2u;
const WANTS_POCKETS = 3u;
