// What an imprecise device computes in place of an operation: the exact result and an error, which
// a hash of the result's bits chooses. `mod.rs` declares the constants ahead of this text,
// `call.rs` writes versions for vectors, and `rewrite.rs` replaces the operations.

fn imprecise_flush(x: f32) -> f32 {
    let is_subnormal = IMPRECISE_FLUSHES && (bitcast<u32>(x) & 0x7f800000u) == 0u;
    return select(x, 0.0, is_subnormal);
}

// A number from −1 to 1.
fn imprecise_part(x: f32) -> f32 {
    var hash = (bitcast<u32>(x) ^ IMPRECISE_SEED) * 0x9e3779b1u;
    hash = (hash ^ (hash >> 15u)) * 0x85ebca77u;
    hash ^= hash >> 13u;
    return f32(hash >> 8u) * 1.1920929e-7 - 1.0;
}

// Half an ulp of the error is the rounding's.
fn imprecise_round(exact: f64, ulps: f32) -> f32 {
    let rounded = f32(exact);
    let exponent = bitcast<u32>(rounded) & 0x7f800000u;
    if exponent == 0u || exponent == 0x7f800000u {
        return imprecise_flush(rounded);
    }
    let ulp = f64(bitcast<f32>(exponent)) * 1.1920928955078125e-7lf;
    let error = f64(imprecise_part(rounded) * max(ulps - 0.5, 0.0)) * ulp;
    return imprecise_flush(f32(exact + error));
}

fn imprecise_add(a: f32, b: f32) -> f32 {
    return imprecise_flush(a + b);
}

fn imprecise_subtract(a: f32, b: f32) -> f32 {
    return imprecise_flush(a - b);
}

fn imprecise_multiply(a: f32, b: f32) -> f32 {
    return imprecise_flush(a * b);
}

// a b + c
fn imprecise_fused(a: f32, b: f32, c: f32) -> f32 {
    return imprecise_flush(f32(f64(a) * f64(b) + f64(c)));
}

// a b − c
fn imprecise_fused_less(a: f32, b: f32, c: f32) -> f32 {
    return imprecise_flush(f32(f64(a) * f64(b) - f64(c)));
}

// c − a b
fn imprecise_less_fused(a: f32, b: f32, c: f32) -> f32 {
    return imprecise_flush(f32(f64(c) - f64(a) * f64(b)));
}

fn imprecise_mix(a: f32, b: f32, c: f32) -> f32 {
    return imprecise_fused(b, c, a * (1.0 - c));
}

// Nothing is promised beyond these divisors: of a (1 / b), 1 / b is then subnormal or infinite.
fn imprecise_divide(a: f32, b: f32) -> f32 {
    if abs(b) > 8.507059e37 {
        return 0.0;
    }
    if abs(b) < 1.1754944e-38 {
        return a / b;
    }
    return imprecise_round(f64(a) / f64(b), IMPRECISE_DIVIDE);
}

fn imprecise_sqrt(x: f32) -> f32 {
    return imprecise_round(sqrt(f64(imprecise_flush(x))), IMPRECISE_SQRT);
}

fn imprecise_inverse_sqrt(x: f32) -> f32 {
    return imprecise_round(1.0lf / sqrt(f64(imprecise_flush(x))), IMPRECISE_INVERSE_SQRT);
}

// The errors of exponentials and of sine and cosine are added to those of the device.
fn imprecise_exp(x: f32) -> f32 {
    return imprecise_round(f64(exp(x)), IMPRECISE_EXP + 2.0 * abs(x));
}

fn imprecise_exp2(x: f32) -> f32 {
    return imprecise_round(f64(exp2(x)), IMPRECISE_EXP + 2.0 * abs(x));
}

fn imprecise_logarithm(x: f32, logarithm: f32) -> f32 {
    if x >= 0.5 && x <= 2.0 {
        return imprecise_flush(logarithm + imprecise_part(logarithm) * 4.7683716e-7);
    }
    return imprecise_round(f64(logarithm), IMPRECISE_EXP);
}

fn imprecise_log(x: f32) -> f32 {
    return imprecise_logarithm(x, log(x));
}

fn imprecise_log2(x: f32) -> f32 {
    return imprecise_logarithm(x, log2(x));
}

fn imprecise_pow(x: f32, y: f32) -> f32 {
    return imprecise_exp2(y * imprecise_log2(x));
}

fn imprecise_sin(x: f32) -> f32 {
    return sin(x) + imprecise_part(x) * IMPRECISE_SIN;
}

fn imprecise_cos(x: f32) -> f32 {
    return cos(x) + imprecise_part(-x) * IMPRECISE_SIN;
}
