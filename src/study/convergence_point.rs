//! The convergence point of the paper's Table 1 (Ribas and Pedrini), and the table itself.
//!
//! The paper: the point is reached "when the relative error of the current iteration and the 50
//! before is less than 0.5 % and this condition remains valid for all points to come". It does not
//! say what the error is, nor whether each of the 50 is compared with the current one or is itself
//! below the bound; [`Reading`] lists the interpretations.

/// Number of earlier steps that a step is compared with.
pub const WINDOW: usize = 50;

/// Relative bound of the paper's condition.
pub const TOLERANCE: f64 = 0.005;

/// Interpretations of the paper's sentence. e is the mean of max(0, ρ/ρ0 − 1) at the end of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// The mean density 1 + e differs from each of the 50 before by less than 0.5 % of that one.
    Density,
    /// The error e differs from each of the 50 before by less than 0.5 % of that one.
    Error,
    /// The error e, relative to ρ0, is below 0.5 % now and in each of the 50 before.
    Bound,
}

impl Reading {
    /// In the order of the page; the first is shown beside the paper's figures.
    pub const ALL: [Self; 3] = [Self::Density, Self::Bound, Self::Error];

    /// Describes the reading in words.
    pub fn text(self) -> &'static str {
        match self {
            Self::Density => "mean density against each of the 50 before",
            Self::Error => "density error against each of the 50 before",
            Self::Bound => "density error itself, now and in the 50 before",
        }
    }

    /// Whether step `n` (from 0, [`WINDOW`] or more) meets the condition.
    fn holds(self, errors: &[f64], n: usize) -> bool {
        let now = errors[n];
        errors[n - WINDOW..n].iter().all(|&before| match self {
            Self::Density => (now - before).abs() < TOLERANCE * (1.0 + before),
            Self::Error => (now - before).abs() < TOLERANCE * before,
            Self::Bound => now < TOLERANCE && before < TOLERANCE,
        })
    }
}

/// First step, counted from 1, from which on the condition holds to the end; `None` if the last
/// step does not meet it.
pub fn convergence_point(errors: &[f64], reading: Reading) -> Option<usize> {
    let meets = (WINDOW..errors.len())
        .rev()
        .take_while(|&n| reading.holds(errors, n))
        .count();
    (meets > 0).then(|| errors.len() - meets + 1)
}

/// A row of the paper's Table 1: 500 000 particles, 16 ms, 800 steps, GTX 1650.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PaperRow {
    /// Solver iterations.
    pub iterations: u32,
    /// Milliseconds per frame and convergence point with Jacobi.
    pub jacobi: (f64, u32),
    /// Milliseconds per frame and convergence point with red-black Gauss-Seidel.
    pub red_black: (f64, u32),
}

const fn row(iterations: u32, jacobi: (f64, u32), red_black: (f64, u32)) -> PaperRow {
    PaperRow {
        iterations,
        jacobi,
        red_black,
    }
}

/// The paper's Table 1.
pub const TABLE_1: [PaperRow; 7] = [
    row(2, (23.73, 737), (24.54, 636)),
    row(3, (28.22, 603), (29.35, 449)),
    row(4, (32.80, 439), (34.47, 291)),
    row(5, (37.44, 287), (39.65, 168)),
    row(6, (42.31, 251), (44.68, 165)),
    row(7, (47.13, 165), (49.99, 163)),
    row(8, (51.93, 162), (55.23, 161)),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// e = 0.1 · 0.98ⁿ⁻¹ at step n. By hand: the earliest value x of the window is 0.1 · 0.98ⁿ⁻⁵¹.
    /// The change from it, (1 − 0.98⁵⁰) x = 0.6358 x, falls below 0.005 (1 + x) where x < 0.005 /
    /// 0.6308 = 7.93e-3: n − 51 ≥ 125.5, so from step 177 on. x itself is below 0.005 from n − 51 ≥
    /// 148.3 on: step 200.
    #[test]
    fn a_decay_converges_where_it_is_known_to() {
        let errors: Vec<f64> = (0..400).map(|k| 0.1 * 0.98f64.powi(k)).collect();
        assert_eq!(convergence_point(&errors, Reading::Density), Some(177));
        assert_eq!(convergence_point(&errors, Reading::Bound), Some(200));
        // A decay by a constant factor never settles relative to itself.
        assert_eq!(convergence_point(&errors, Reading::Error), None);
    }

    /// The same decay, so slow that a hundredth of the bound, and one step of the window, are many
    /// steps. Below 0.005 from the first m with 0.006 rᵐ < 0.005 on, r = 0.9999; the window's
    /// earliest value is 50 steps before. With e = rᵐ, r = 0.999, the change from the earliest x =
    /// rᵐ is x (1 − r⁵⁰), which is below 0.005 (1 + x) for x < 0.005 / (1 − r⁵⁰ − 0.005).
    #[test]
    fn a_slow_decay_converges_where_it_is_known_to() {
        let decay =
            |from: f64, rate: f64| -> Vec<f64> { (0..4000).map(|k| from * rate.powi(k)).collect() };
        let first = |part: f64, rate: f64| (part.ln() / rate.ln()).ceil() as usize + 50 + 1;
        let bound = first(0.005 / 0.006, 0.9999);
        let slow = decay(0.006, 0.9999);
        assert_eq!(convergence_point(&slow, Reading::Bound), Some(bound));
        let least = 0.005 / (1.0 - 0.999f64.powi(50) - 0.005);
        let density = first(least, 0.999);
        assert_eq!(
            convergence_point(&decay(1.0, 0.999), Reading::Density),
            Some(density)
        );
        // Relative to itself it falls over 50 steps by 0.499 % at r = 0.9999, and by 0.504 % at
        // 0.999899.
        assert_eq!(convergence_point(&slow, Reading::Error), Some(WINDOW + 1));
        assert_eq!(
            convergence_point(&decay(0.006, 0.999_899), Reading::Error),
            None
        );
    }

    #[test]
    fn what_never_settles_has_no_point() {
        let swing: Vec<f64> = (0..400)
            .map(|k| 0.02 + 0.01 * (0.3 * f64::from(k)).sin())
            .collect();
        for reading in Reading::ALL {
            assert_eq!(convergence_point(&swing, reading), None);
            assert_eq!(convergence_point(&[], reading), None);
            assert_eq!(convergence_point(&[0.001; WINDOW], reading), None);
            assert_eq!(
                convergence_point(&[0.001; WINDOW + 1], reading),
                Some(WINDOW + 1)
            );
        }
    }

    /// The condition must hold to the end: a late splash moves the point behind it.
    #[test]
    fn a_late_disturbance_counts() {
        let mut errors = vec![0.001; 300];
        assert_eq!(convergence_point(&errors, Reading::Density), Some(51));
        errors[200] = 0.1;
        // Step 201 fails, and step 251 still has it among its 50.
        assert_eq!(convergence_point(&errors, Reading::Density), Some(252));
        assert_eq!(convergence_point(&errors, Reading::Bound), Some(252));
    }
}
