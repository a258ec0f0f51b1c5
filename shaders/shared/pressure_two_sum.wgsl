// Sums that keep their rounding error (Knuth's two-sum).
//
// A compiler that simplifies `(a + b) - a` to `b`, as Mesa's does, would drop the error; an XOR
// with a 0 that it does not know hides the sum from it.
fn hidden(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ phase.opaque_zero);
}

// The rounded sum and its rounding error.
fn two_sum(a: f32, b: f32) -> vec2f {
    let sum = hidden(a + b);
    let rounded_b = hidden(sum - a);
    let rounded_a = hidden(sum - rounded_b);
    return vec2f(sum, (a - rounded_a) + (b - rounded_b));
}

// The 12 leading bits of the mantissa: the product of two such numbers is exact.
fn leading(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) & 0xfffff000u);
}
