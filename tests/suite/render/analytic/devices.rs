//! Arithmetic of shaders on devices that are as inexact as WGSL allows.

use std::f64::consts::{PI, TAU};

use swell::gpu::shader::compose;

use super::support::{context, kernel, kernel_after};

/// A cosine that is right within half a turn, and 0 beyond.
const NARROW: &str = "fn narrow(x: f32) -> f32 {
    return select(0.0, cos(x), abs(x) <= 3.14159275);
}
";

/// Turns that are whole, half and in between, near 0 and far from it.
fn turns() -> Vec<f32> {
    let near = (-64..=64).map(|k| k as f32 / 16.0);
    let far = (-500..=500).map(|k| 20.37 * k as f32);
    near.chain(far).collect()
}

/// The number of turns is exact, and the nearest whole number leaves an exact rest: a product of
/// two numbers that are rounded, 3 u of at most π.
#[test]
fn angles_of_turns_are_within_half_a_turn_and_exact() {
    let turns = turns();
    let input: Vec<[f32; 4]> = turns.iter().map(|&t| [t, 0.0, 0.0, 0.0]).collect();
    let error = |body: &str| {
        let found = kernel(&context(), "shared/angle", body, &input);
        let errors = turns.iter().zip(&found).map(|(&turns, found)| {
            let angle = f64::from(found[0]);
            let gap = (angle / TAU - f64::from(turns)) * TAU;
            let gap = (gap + PI).rem_euclid(TAU) - PI;
            gap.abs().max(angle.abs() - PI)
        });
        errors.fold(0.0, f64::max)
    };
    let tolerance = 3.0 * PI / f64::from(1 << 24);
    let found = error("return vec4f(angle_of(value.x));");
    assert!(found < tolerance, "{found:e} {tolerance:e}");
    // Negative control: the angle as it was, beyond half a turn.
    let control = error("return vec4f(6.2831853 * value.x);");
    assert!(control > 1.0, "{control}");
}

/// Slopes near the origin and 100 m from it, early and late, are the same with a cosine that is
/// right within half a turn only; but for phases of 10⁴, which a compiler may round otherwise.
#[test]
fn ripples_ask_for_no_cosine_beyond_half_a_turn() {
    let input: Vec<[f32; 4]> = (0..600)
        .map(|k| {
            let far = if k % 2 == 0 { 0.0 } else { 100.0 };
            let k = k as f32;
            [far + 0.37 * k, 0.21 * k - far, 0.5 * k, 0.0]
        })
        .collect();
    let body = "let r = ripple_at(value.xy, value.z, 1.0, 0.1, value.w); \
                return vec4f(r.slope, r.lost, 0.0);";
    let shared = compose("shared/ssfr_ripple", &[]).unwrap();
    let gap = |shared: &str| {
        let narrow = NARROW.to_owned() + &shared.replace("cos(angle)", "narrow(angle)");
        let [wide, narrow] =
            [shared, &narrow].map(|text| kernel_after(&context(), text, body, &input));
        let pairs = wide.iter().flatten().zip(narrow.iter().flatten());
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
    };
    let found = gap(&shared);
    assert!(found < 1e-3, "{found:e}");
    let unbounded = shared.replace("angle_of(phase / (2.0 * PI))", "phase");
    assert!(unbounded != shared);
    let control = gap(&unbounded);
    assert!(control > 0.01, "{control}");
}

/// Rows of pixels where the quotient is off by the 2.5 ulp that WGSL allows, either way.
#[test]
fn rows_of_pixels_are_exact_where_quotients_are_not() {
    let boxes: Vec<[u32; 2]> = [1u32, 2, 3, 7, 63, 641, 1920, 4095, 8191]
        .into_iter()
        .flat_map(|width| {
            let rows = ((1 << 23) / width).min(1 << 20) - 1;
            let ends = [0, 1, rows / 3, rows / 2, rows - 1];
            ends.into_iter().flat_map(move |row| {
                let first = row * width;
                [first, first + width / 2, first + width - 1].map(|i| [i, width])
            })
        })
        .collect();
    let input: Vec<[f32; 4]> = boxes
        .iter()
        .map(|&[i, width]| [i as f32, width as f32, 0.0, 0.0])
        .collect();
    let shared =
        compose("shared/camera", &[]).unwrap() + &compose("shared/ssfr_splat", &[]).unwrap();
    let wrong = |text: &str| {
        let body = "return vec4f(f32(row_of(u32(value.x), u32(value.y))), 0.0, 0.0, 0.0);";
        let found = kernel_after(&context(), text, body, &input);
        let rows = boxes.iter().zip(&found);
        rows.filter(|([i, width], row)| row[0] as u32 != i / width)
            .count()
    };
    assert_eq!(wrong(&shared), 0);
    let quotient = "(f32(i) + 0.5) / f32(width)";
    for factor in ["1.0000003", "0.9999997"] {
        let inexact = shared.replace(quotient, &format!("{quotient} * {factor}"));
        assert!(inexact != shared);
        assert_eq!(wrong(&inexact), 0, "{factor}");
        // Negative control: without the correction.
        let plain = inexact.replace("row - 1u, i < low", "row, i < low");
        let plain = plain.replace("select(0u, 1u,", "select(0u, 0u,");
        assert!(wrong(&plain) > 0, "{factor}");
    }
}
