//! Elliptic integrals and functions by the arithmetic-geometric mean (Abramowitz and Stegun 1964,
//! §16.4 and §17.6).

use std::f64::consts::PI;

/// Elliptic integrals and functions for one parameter m between 0 and 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Elliptic {
    /// Parameter m.
    pub(super) parameter: f64,
    /// Quarter period K(m): a quarter of sn's period and half of cn²'s.
    pub(super) quarter: f64,
    /// Σ 2ⁿ⁻¹ cₙ² from n = 1 on. It equals 1 − m/2 − E/K, without the cancellation of that
    /// difference for small m.
    rest: f64,
    /// [aₙ, cₙ] of the arithmetic-geometric mean from n = 1 on.
    steps: Vec<[f64; 2]>,
}

impl Elliptic {
    /// Takes m and 1 − m separately, so that each is accurate.
    pub(super) fn new(parameter: f64, complement: f64) -> Self {
        let (mut a, mut b, mut c_squared) = (1.0, complement.sqrt(), parameter);
        let (mut rest, mut weight) = (0.0, 1.0);
        let mut steps = Vec::new();
        loop {
            let next = 0.5 * (a + b);
            // cₙ = (aₙ₋₁ − bₙ₋₁) / 2, without cancellation.
            let c = c_squared / (4.0 * next);
            b = (a * b).sqrt();
            a = next;
            c_squared = c * c;
            rest += weight * c_squared;
            weight *= 2.0;
            steps.push([a, c]);
            if c <= 1e-17 * a {
                break;
            }
        }
        Self {
            parameter,
            quarter: 0.5 * PI / a,
            rest,
            steps,
        }
    }

    /// Returns the mean of cn² over its period, (E/K − (1 − m)) / m.
    pub(super) fn mean_of_squared_cn(&self) -> f64 {
        0.5 - self.rest / self.parameter
    }

    /// Returns (2 − m − 3 E/K) / m: the excess of a cnoidal wave's c²/gh over 1, in units of H/h
    /// (see [`super::Cnoidal`]).
    pub(super) fn speed_up(&self) -> f64 {
        0.5 + (3.0 * self.rest - 1.0) / self.parameter
    }

    /// Returns cn(u | m) and Jacobi's zeta function Z(u | m) = E(u | m) − u E/K, for |u| up to a
    /// few K.
    pub(super) fn cn_and_zeta(&self, u: f64) -> (f64, f64) {
        let levels = self.steps.len();
        let mut phase = 2f64.powi(levels as i32) * self.steps[levels - 1][0] * u;
        let mut zeta = 0.0;
        for [a, c] in self.steps.iter().rev() {
            let sin = phase.sin();
            zeta += c * sin;
            phase = 0.5 * (phase + (c / a * sin).asin());
        }
        (phase.cos(), zeta)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(m: f64) -> Elliptic {
        Elliptic::new(m, 1.0 - m)
    }

    /// E(m), from 1 − m/2 − Σ.
    fn second_kind(functions: &Elliptic) -> f64 {
        functions.quarter * (1.0 - 0.5 * functions.parameter - functions.rest)
    }

    /// Abramowitz and Stegun 1964, table 17.1: m, K and E.
    const COMPLETE: [[f64; 3]; 6] = [
        [0.01, 1.574_745_561_517_356, 1.566_861_942],
        [0.1, 1.612_441_348_720_219, 1.530_757_637],
        [0.2, 1.659_623_598_610_528, 1.489_035_058],
        [0.5, 1.854_074_677_301_372, 1.350_643_881],
        [0.9, 2.578_092_113_348_173, 1.104_774_733],
        [0.99, 3.695_637_362_989_875, 1.015_993_545],
    ];

    #[test]
    fn complete_integrals_are_those_of_the_table() {
        let off = |m: f64, [_, first, second]: [f64; 3]| {
            let functions = of(m);
            let off = second_kind(&functions) - second;
            ((functions.quarter - first).abs(), off.abs())
        };
        for row in COMPLETE {
            let (first, second) = off(row[0], row);
            assert!(first < 3e-15 && second < 6e-10, "{row:?} {first} {second}");
            let functions = of(row[0]);
            let mean = (row[2] / row[1] - 1.0 + row[0]) / row[0];
            assert!((functions.mean_of_squared_cn() - mean).abs() < 1e-7);
            let speed_up = (2.0 - row[0] - 3.0 * row[2] / row[1]) / row[0];
            assert!((functions.speed_up() - speed_up).abs() < 2e-7);
            // Negative control: the modulus k instead of the parameter m = k².
            let (first, second) = off(row[0].sqrt(), row);
            assert!(first > 1e-3 && second > 1e-3);
        }
    }

    /// Tabulated values of cn(0.2 | 0.81) and cn(u | 0.5); cn² and Z at half of K in closed form
    /// (Abramowitz and Stegun 1964, §16.5; Z(K/2) = (1 − k')/2).
    #[test]
    fn cn_and_zeta_have_the_values_that_are_known() {
        for (m, u, cn) in [
            (0.81, 0.2, 0.980_278_536_973),
            (0.5, 0.1, 0.995_012_462_609_058),
            (0.5, 0.5, 0.882_266_394_890_440),
            (0.5, 1.0, 0.595_976_567_672_141),
            (0.5, 2.0, -0.103_183_615_527_762),
        ] {
            let off = |m: f64| (of(m).cn_and_zeta(u).0 - cn).abs();
            assert!(off(m) < 1e-12, "{m} {u}: {}", off(m));
            assert!(off(1.01 * m) > 1e-8, "{m} {u}");
        }
        for m in [1e-6, 0.1, 0.5, 0.9, 0.999_999] {
            let functions = of(m);
            let (cn, zeta) = functions.cn_and_zeta(0.5 * functions.quarter);
            let k = (1.0 - m).sqrt();
            assert!((cn * cn - k / (1.0 + k)).abs() < 1e-15, "{m}: {cn}");
            assert!((zeta - 0.5 * m / (1.0 + k)).abs() < 1e-15, "{m}: {zeta}");
            let (_, spoiled) = functions.cn_and_zeta(0.51 * functions.quarter);
            let off = (spoiled - 0.5 * m / (1.0 + k)).abs();
            assert!(off > 1e-5 * m, "{m}: {off}");
        }
    }

    #[test]
    fn near_0_they_are_a_cosine_and_near_1_the_hyperbolic_functions() {
        let (low, high) = (Elliptic::new(1e-9, 1.0 - 1e-9), Elliptic::new(1.0, 1e-300));
        for i in -20..=20 {
            let u = 0.07 * f64::from(i);
            let (cn, zeta) = low.cn_and_zeta(u);
            assert!((cn - u.cos()).abs() < 1e-9);
            // m/4 sin 2u to first order in m, with m = 1e-9.
            assert!((zeta * 4e9 - (2.0 * u).sin()).abs() < 1e-8, "{u}: {zeta}");
            let (cn, zeta) = high.cn_and_zeta(u);
            assert!((cn - 1.0 / u.cosh()).abs() < 1e-14);
            let expected = u.tanh() - u / high.quarter;
            assert!((zeta - expected).abs() < 1e-14, "{u}: {zeta}");
        }
        // K → ln 4 / k'.
        let quarter = 4f64.ln() + 150.0 * 10f64.ln();
        assert!((high.quarter / quarter - 1.0).abs() < 1e-14);
        // Negative control: the two limits differ.
        assert!((low.cn_and_zeta(0.7).0 - high.cn_and_zeta(0.7).0).abs() > 0.01);
    }
}
