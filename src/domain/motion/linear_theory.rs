//! Linear wave theory: what a piston makes.

/// The wavenumber k in rad/m of a wave of `angular_frequency` (rad/s) on water of `depth` metres:
/// ω² = g k tanh kh.
pub fn wave_number(angular_frequency: f64, depth: f64, gravity: f64) -> f64 {
    let deep = angular_frequency.powi(2) / gravity;
    // Guo 2002, within 0.75 % at any depth; Newton takes it to round-off.
    let y = deep * depth;
    let mut kh = y * (1.0 - (-y.powf(1.25)).exp()).powf(-0.4);
    for _ in 0..20 {
        let tanh = kh.tanh();
        let residual = kh * tanh - y;
        let step = residual / (tanh + kh * (1.0 - tanh * tanh));
        kh -= step;
        if step.abs() <= 1e-15 * kh {
            break;
        }
    }
    kh / depth
}

/// Wave height over piston stroke far from the piston, in linear theory:
/// H/S = 2 (cosh 2kh − 1) / (sinh 2kh + 2kh).
pub fn piston_height_ratio(wave_number: f64, depth: f64) -> f64 {
    let twice = 2.0 * wave_number * depth;
    // Both grow as exp: in deep water the ratio is 2 and cosh overflows.
    if twice > 300.0 {
        return 2.0;
    }
    2.0 * (twice.cosh() - 1.0) / (twice.sinh() + twice)
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn linear_theory_has_its_shallow_and_deep_limits() {
        let gravity = 9.81;
        for (period, depth) in [(2.0, 1.0), (30.0, 0.5), (0.5, 10.0), (3.0, 1.0)] {
            let omega = TAU / period;
            let k = wave_number(omega, depth, gravity);
            let back = (gravity * k * (k * depth).tanh()).sqrt();
            assert!((back - omega).abs() < 1e-12 * omega, "{period} {depth}");
        }
        // Shallow: H/S → kh. Deep: → 2.
        assert!((piston_height_ratio(1e-3, 1.0) - 1e-3).abs() < 1e-8);
        assert!((piston_height_ratio(40.0, 1.0) - 2.0).abs() < 1e-12);
        assert_eq!(piston_height_ratio(1e6, 1.0), 2.0);
    }
}
