// Sums whose rounding error is kept (Knuth's two-sum).
//
// Compilers that take `(a + b) - a` for `b`, as Mesa's does, would drop the error; a 0 that they do not know hides
// the sum from them.
fn hidden(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ phase.opaque_zero);
}

// The sum and what its rounding lost.
fn two_sum(a: f32, b: f32) -> vec2f {
    let sum = hidden(a + b);
    let rounded_b = hidden(sum - a);
    let rounded_a = hidden(sum - rounded_b);
    return vec2f(sum, (a - rounded_a) + (b - rounded_b));
}
