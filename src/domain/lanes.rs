//! Sums over a particle's neighbours, several at a time in SIMD lanes (pulp).
//!
//! A sum has a fixed number of partial sums, one per lane, whatever the processor's vector width,
//! and products are not fused with it: the bits are the same on every processor and with any number
//! of threads. Lanes are plain arrays in loops that the compiler vectorises where pulp compiles
//! them for the processor's features. A task is a type with inlined methods: a closure passed as an
//! argument would not be compiled for these features.

use pulp::{Arch, WithSimd};

/// Neighbours processed at once.
pub const LANES: usize = 8;

/// Runs a loop, compiled for the SIMD features of the processor.
#[inline]
pub fn widely<T: WithSimd>(task: T) -> T::Output {
    Arch::new().dispatch(task)
}

/// Adds the partial sums of all lanes, pairwise in a fixed order.
#[inline(always)]
pub fn sum(parts: [f64; LANES]) -> f64 {
    let [a, b, c, d, e, f, g, h] = parts;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// Returns `max(x, 0)`, and 0 for NaN as `f64::max` does, in one instruction.
#[inline(always)]
pub fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}
