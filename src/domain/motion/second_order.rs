//! The wave maker problem to second order for regular waves: the motion that a piston needs at
//! twice its frequency so that it generates no free wave of that frequency (Schäffer 1996; in
//! shallow water Madsen 1971).

use std::f64::consts::PI;

use super::wave_number;

/// Number of evanescent modes of first order that are summed: a base for shallow water, and more
/// per kh. The truncation error falls as one over their number; extrapolation from half as many
/// leaves 1e-3 of the sum.
const MODES: f64 = 100.0;
const MODES_PER_KH: f64 = 20.0;
const MOST_MODES: f64 = 1000.0;

/// Returns the wall's second-order motion in addition to A sin φ, divided by A²: the factors of sin
/// 2φ and cos 2φ, 1/m, for a wave of `frequency` (rad/s).
///
/// To first order the wall's potential is
/// i A ω Σ (Dⱼ / kⱼ) cosh kⱼ(z + h) / cosh kⱼh · exp(i(ωt − kⱼx)) with ω² = g kⱼ tanh kⱼh, k₀ real
/// and the others −iκⱼ, and Dⱼ = 2 sinh 2kⱼh / (2kⱼh + sinh 2kⱼh). Its squares force the surface,
/// and the wall is at its displacement, not at the mean position. Projection onto the free wave of
/// 2ω, whose wavenumber is K, shows that this wave vanishes if
/// ξ₂ = (K A)² / 8 · (Re Q sin 2φ + Im Q cos 2φ) with ν = ω²/g and Q =
/// Σⱼₗ DⱼDₗ (1 + (kⱼ² + kₗ² − 6ν²) / 4kⱼkₗ) (kⱼ + kₗ) / (K² − (kⱼ + kₗ)²)
/// − 3/2 Σⱼ kⱼDⱼ / (K² − kⱼ²).
pub(super) fn second_harmonic(frequency: f64, depth: f64, gravity: f64) -> [f64; 2] {
    let k = wave_number(frequency, depth, gravity);
    let twice = wave_number(2.0 * frequency, depth, gravity);
    let count = (MODES + MODES_PER_KH * k * depth).min(MOST_MODES) as u32;
    let sums = Sums {
        k,
        d: 2.0 / (1.0 + 2.0 * k * depth / (2.0 * k * depth).sinh()),
        squared: twice * twice,
        deep: frequency.powi(2) / gravity,
        modes: (1..=count)
            .map(|j| evanescent(j, frequency.powi(2) / gravity, depth))
            .collect(),
    };
    let scale = 0.125 * twice * twice;
    let [all, half] = [count, count / 2].map(|n| sums.evanescent(n as usize));
    [
        scale * (sums.progressive() + 2.0 * all[0] - half[0]),
        scale * (2.0 * all[1] - half[1]),
    ]
}

/// κⱼ, 1/m, and Dⱼ of an evanescent mode: κh tan κh = −νh with κh slightly below jπ.
pub(super) fn evanescent(index: u32, deep: f64, depth: f64) -> [f64; 2] {
    let whole = PI * f64::from(index);
    let mut less = 0.0f64;
    // Each iteration reduces the error to a third or less.
    for _ in 0..40 {
        less = (deep * depth / (whole - less)).atan();
    }
    let (twice, sin) = (2.0 * (whole - less), (2.0 * less).sin());
    [(whole - less) / depth, -2.0 * sin / (twice - sin)]
}

/// Quantities that Q is summed from.
struct Sums {
    /// k₀, rad/m.
    k: f64,
    /// D₀.
    d: f64,
    /// K².
    squared: f64,
    /// ν.
    deep: f64,
    /// [κⱼ, Dⱼ].
    modes: Vec<[f64; 2]>,
}

impl Sums {
    /// Terms of the progressive wave with itself and at the wall's displacement.
    fn progressive(&self) -> f64 {
        let (k, d) = (self.k, self.d);
        let tanh = self.deep / k;
        3.0 * k * d * d * (1.0 - tanh * tanh) / (self.squared - 4.0 * k * k)
            - 1.5 * k * d / (self.squared - k * k)
    }

    /// All terms with one or two of the first `count` evanescent modes: real and imaginary part.
    fn evanescent(&self, count: usize) -> [f64; 2] {
        let modes = &self.modes[..count];
        let mut sum = [0.0, 0.0];
        for (j, &[kappa, d]) in modes.iter().enumerate() {
            let [re, im] = self.with_progressive(kappa);
            sum[0] += 2.0 * self.d * d * re;
            sum[1] += 2.0 * self.d * d * im + 1.5 * kappa * d / (self.squared + kappa * kappa);
            let earlier = modes[..j].iter();
            let pairs: f64 = earlier.map(|other| self.pair([kappa, d], *other)).sum();
            sum[1] -= 2.0 * pairs + self.pair([kappa, d], [kappa, d]);
        }
        sum
    }

    /// Term of an evanescent mode with the progressive wave, divided by D₀Dⱼ.
    fn with_progressive(&self, kappa: f64) -> [f64; 2] {
        let k = self.k;
        let (re, im) = (self.squared - k * k + kappa * kappa, 2.0 * k * kappa);
        let size = re * re + im * im;
        // (k − iκ) / (re + i im) = a − ib, times 1 + ic.
        let a = (k * re - kappa * im) / size;
        let b = (kappa * re + k * im) / size;
        let c = (k * k - kappa * kappa - 6.0 * self.deep.powi(2)) / (4.0 * k * kappa);
        [a + c * b, c * a - b]
    }

    /// Term of two evanescent modes.
    fn pair(&self, [kappa, d]: [f64; 2], [other, e]: [f64; 2]) -> f64 {
        let squares = kappa * kappa + other * other + 6.0 * self.deep.powi(2);
        let sum = kappa + other;
        d * e * (1.0 + squares / (4.0 * kappa * other)) * sum / (self.squared + sum * sum)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    /// B / A² and C / A² for a depth of one metre, as a function of kh.
    fn of(kh: f64) -> [f64; 2] {
        second_harmonic((9.81 * kh * kh.tanh()).sqrt(), 1.0, 9.81)
    }

    /// Madsen's B / A² for a depth of one metre: A = H/2n,
    /// B = H²/32 · (3 cosh kh / sinh³ kh − 2/n), with the 2 given by `two`.
    fn madsen(kh: f64, two: f64) -> f64 {
        let n = 2.0 * ((2.0 * kh).cosh() - 1.0) / ((2.0 * kh).sinh() + 2.0 * kh);
        (2.0 * n).powi(2) / 32.0 * (3.0 * kh.cosh() / kh.sinh().powi(3) - two / n)
    }

    /// Madsen's formula neglects terms of fourth order in kh.
    #[test]
    fn in_shallow_water_the_second_harmonic_is_madsens() {
        for kh in [0.05, 0.1, 0.2, 0.3] {
            let [sin, cos] = of(kh);
            let off = (sin / madsen(kh, 2.0) - 1.0) / kh.powi(4);
            assert!(off > 0.5 && off < 0.7, "{kh}: {off}");
            assert!(cos.abs() < 2.0 * kh.powi(7), "{kh}: {cos}");
        }
        // Negative control: his last term multiplied by 1.5.
        let off = (of(0.1)[0] / madsen(0.1, 3.0) - 1.0) / 1e-4;
        assert!(off > 20.0, "{off}");
    }

    /// From a separate program: the surface's forcing and the wall's condition term by term in
    /// complex numbers, with integrals over the depth instead of Green's identity, and 200 and
    /// 400 modes.
    #[test]
    fn at_any_depth_the_second_harmonic_is_that_of_the_sum_of_modes() {
        for (kh, sin, cos) in [
            (0.5, 0.650_479, 0.000_409_57),
            (1.0, 0.350_629, 0.034_150_8),
            (3.0, 0.789_874, 0.907_903),
        ] {
            let found = of(kh);
            let size = f64::hypot(sin, cos);
            let off = f64::hypot(found[0] - sin, found[1] - cos) / size;
            assert!(off < 3e-4, "{kh}: {found:?}, off by {off}");
            // Negative control: Madsen's formula differs.
            let off = f64::hypot(madsen(kh, 2.0) - sin, cos) / size;
            assert!(off > 0.04, "{kh}: {off}");
        }
    }

    /// For a long wave, the water that the wall pushes is what a wave of permanent form carries, c
    /// η: ξ' (h + η) = c η at x = ξ, with Stokes' η and this module's ξ, has no component of twice
    /// the frequency.
    #[test]
    fn the_wall_pushes_what_the_wave_carries() {
        let kh: f64 = 0.05;
        let ratio = super::super::piston_height_ratio(kh, 1.0);
        // a₂ = 3 a² / 4k²h³ is small, so that the fourth order is negligible.
        let amplitude = 1e-6;
        let second =
            0.25 * kh * amplitude * amplitude * (3.0 - kh.tanh().powi(2)) / kh.tanh().powi(3);
        let first = amplitude / ratio;
        let twice = |b: f64| {
            let [mut re, mut im] = [0.0, 0.0];
            for i in 0..64 {
                let phase = TAU * f64::from(i) / 64.0;
                let way = first * phase.sin() + b * (2.0 * phase).sin();
                let speed = first * phase.cos() + 2.0 * b * (2.0 * phase).cos();
                let at = phase - kh * way;
                let level = amplitude * at.cos() + second * (2.0 * at).cos();
                // Divided by ω: c = ω/k.
                let off = speed * (1.0 + level) - level / kh;
                re += off * (2.0 * phase).cos() / 32.0;
                im += off * (2.0 * phase).sin() / 32.0;
            }
            f64::hypot(re, im) / (second / kh)
        };
        let b = of(kh)[0] * first * first;
        assert!(twice(b) < 1e-5, "{}", twice(b));
        // Negative control: the second harmonic of the water only, without the effect of the
        // wall's displacement.
        let spoiled = twice(second / (2.0 * kh));
        assert!(spoiled > 1e-3, "{spoiled}");
    }
}
