//! Linear wave theory of a piston.

use std::f64::consts::PI;

/// Returns the wavenumber k in rad/m of a wave of `angular_frequency` (rad/s) on water of `depth`
/// metres, from ω² = g k tanh kh. `gravity` in m/s².
pub fn wave_number(angular_frequency: f64, depth: f64, gravity: f64) -> f64 {
    let deep = angular_frequency.powi(2) / gravity;
    // Initial guess of Guo 2002, within 0.75 % at any depth; Newton refines it to round-off.
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

/// Returns the ratio of wave height to piston stroke far from the piston, by linear theory: H/S = 2
/// (cosh 2kh − 1) / (sinh 2kh + 2kh).
pub fn piston_height_ratio(wave_number: f64, depth: f64) -> f64 {
    let twice = 2.0 * wave_number * depth;
    // Both terms grow as exp: in deep water the ratio tends to 2 and cosh overflows.
    if twice > 300.0 {
        return 2.0;
    }
    2.0 * (twice.cosh() - 1.0) / (twice.sinh() + twice)
}

/// Number of local waves of a piston that are summed: the remainder of their sum falls as 1/count².
const LOCAL_WAVES: u32 = 400;

/// Evanescent (local) waves beside a piston (Biésel 1951; Dean and Dalrymple 1991, 6.2): kⱼh with
/// ω² = −g kⱼ tan kⱼh, and the amplitude of their elevation at the piston per displacement, cⱼ = 4
/// sin² kⱼh / (2kⱼh + sin 2kⱼh). The elevation is in phase with the displacement, as for water that
/// is pushed.
fn local_waves(
    angular_frequency: f64,
    depth: f64,
    gravity: f64,
) -> impl Iterator<Item = (f64, f64)> {
    let deep = angular_frequency.powi(2) * depth / gravity;
    (1..=LOCAL_WAVES).map(move |j| {
        // x sin x + y cos x changes its sign once between (j − ½)π and jπ.
        let (mut low, mut high) = ((f64::from(j) - 0.5) * PI, f64::from(j) * PI);
        let of = |x: f64| x * x.sin() + deep * x.cos();
        let at_low = of(low) < 0.0;
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            match (of(middle) < 0.0) == at_low {
                true => low = middle,
                false => high = middle,
            }
        }
        let x = 0.5 * (low + high);
        (x, 4.0 * x.sin().powi(2) / (2.0 * x + (2.0 * x).sin()))
    })
}

/// Returns the elevation at a piston per displacement, by linear theory: the part in phase with the
/// velocity, and the part in phase with the displacement (that of the local waves). In complex
/// amplitudes, η = (i a + b) ξ for a motion as e^iωt.
pub fn piston_elevation(angular_frequency: f64, depth: f64, gravity: f64) -> [f64; 2] {
    let number = wave_number(angular_frequency, depth, gravity);
    let local = local_waves(angular_frequency, depth, gravity);
    [
        piston_height_ratio(number, depth),
        local.map(|(_, amplitude)| amplitude).sum(),
    ]
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

    /// A piston pushes equally at every depth: the modes are complete, and their profiles add up to
    /// one at the surface. Those of an elevation c have c coth kh and cⱼ cot kⱼh there.
    #[test]
    fn all_waves_of_a_piston_together_are_its_own_profile() {
        for (frequency, depth) in [(2.0, 0.3), (3.0, 1.0), (5.0, 1.0), (9.0, 0.5)] {
            let number = wave_number(frequency, depth, 9.81);
            let progressive = piston_height_ratio(number, depth) / (number * depth).tanh();
            let sum = |scale: f64| {
                let local = local_waves(frequency, depth, 9.81);
                progressive + scale * local.map(|(x, c)| c / x.tan()).sum::<f64>()
            };
            // The truncation error falls as 2 y / (π² count).
            let left = 2.0 * frequency.powi(2) * depth / 9.81 / (PI * PI * f64::from(LOCAL_WAVES));
            assert!((sum(1.0) - 1.0).abs() < 1.2 * left, "{}", sum(1.0) - 1.0);
            assert!((sum(1.1) - 1.0).abs() > 1.5 * left, "{}", sum(1.1) - 1.0);
        }
    }
}
