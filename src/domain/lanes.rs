//! Sums over a particle's neighbours, several at a time in the processor's lanes (pulp).
//!
//! A sum has a fixed number of parts, one for each lane, whatever the processor's width, and no product is fused with it: the same
//! bits on every processor and any number of threads. Lanes are plain arrays in loops that the compiler turns into
//! vectors where pulp compiles them for what the processor has. What runs there is a type with inlined methods: a closure that is handed
//! over would not be compiled for it.

use pulp::{Arch, WithSimd};

/// Neighbours that are handled at once.
pub const LANES: usize = 8;

/// Runs a loop, compiled for what the processor has.
#[inline]
pub fn widely<T: WithSimd>(task: T) -> T::Output {
    Arch::new().dispatch(task)
}

/// The sum of a sum's parts.
#[inline(always)]
pub fn sum(parts: [f64; LANES]) -> f64 {
    let [a, b, c, d, e, f, g, h] = parts;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// `max(x, 0)`; 0 of what is not a number, as `f64::max` has it, in one instruction.
#[inline(always)]
pub fn positive(x: f64) -> f64 {
    if x > 0.0 { x } else { 0.0 }
}
