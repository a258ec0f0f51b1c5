// What the conjugate gradients decide among themselves; `Control` of solve/pressure/params.rs.
struct PressureControl {
    rhs_square: f32,
    residual_square: f32,
    // residual · correction.
    product: f32,
    alpha: f32,
    beta: f32,
    state: u32,
    iterations: u32,
    // Whether the next direction starts afresh.
    is_first: u32,
    restarts: u32,
    padding_0: u32,
    padding_1: u32,
    padding_2: u32,
}

const ITERATING = 0u;
const VERIFYING = 1u;
const DONE = 2u;
const WANTS_POCKETS = 3u;
