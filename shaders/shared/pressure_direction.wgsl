// The next search direction. `pressure/multiply` computes it for a block and those around it, and
// `pressure/advance` once more to store it. In f32 both round it alike, or the residual would drift
// from that of the solution; in f64 such a drift is below what a solve asks for.
fn next_direction(correction: real, direction: real, beta: real) -> real {
#ifdef F64
    let kept = beta * direction;
#else
    // An XOR with a 0 that the compiler does not know keeps it from fusing product and sum.
    let kept = bitcast<f32>(bitcast<u32>(beta * direction) ^ phase.opaque_zero);
#endif
    return select(correction + kept, correction, beta == 0.0);
}
