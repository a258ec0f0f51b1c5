//! The convergence point of the paper's Table 1 (Ribas and Pedrini), and the table itself.
//!
//! The paper: the point is reached "when the relative error of the current iteration and the 50 before is less than
//! 0.5 % and this condition remains valid for all points to come". It leaves open what the error is, and whether each of
//! the 50 is compared with the current one or is itself below the bound: [`Reading`] has the readings.

/// Steps before a step that it is compared with.
pub const WINDOW: usize = 50;

/// The bound.
pub const TOLERANCE: f64 = 0.005;

/// What the paper's sentence may mean. e is the mean of max(0, ρ/ρ0 − 1) at a step's end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Reading {
    /// The mean density 1 + e differs from each of the 50 before by less than 0.5 %.
    Density,
    /// The error e differs from each of the 50 before by less than 0.5 % of it.
    Error,
    /// The error e, relative to ρ0, is below 0.5 % now and in each of the 50 before.
    Bound,
}

impl Reading {
    /// In the order of the page; the first is the one that stands beside the paper's figures.
    pub const ALL: [Self; 3] = [Self::Density, Self::Bound, Self::Error];

    /// In words.
    pub fn text(self) -> &'static str {
        match self {
            Self::Density => "mean density against each of the 50 before",
            Self::Error => "density error against each of the 50 before",
            Self::Bound => "density error itself, now and in the 50 before",
        }
    }

    /// Whether step `n` (from 0, [`WINDOW`] or more) meets the bound.
    fn holds(self, errors: &[f64], n: usize) -> bool {
        let now = errors[n];
        errors[n - WINDOW..n].iter().all(|&before| match self {
            Self::Density => (now - before).abs() < TOLERANCE * (1.0 + before),
            Self::Error => (now - before).abs() < TOLERANCE * before,
            Self::Bound => now < TOLERANCE && before < TOLERANCE,
        })
    }
}

/// The step, from 1, from which on the bound holds to the end; `None` where the last step does not meet it.
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
    /// Of the solver.
    pub iterations: u32,
    /// Milliseconds a frame and convergence point with Jacobi.
    pub jacobi: (f64, u32),
    /// The same with red/black.
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

    /// e = 0.1 · 0.98ⁿ⁻¹ at step n. By hand: the earliest of the window is 0.1 · 0.98ⁿ⁻⁵¹, and the change from it,
    /// (1 − 0.98⁵⁰) of it = 0.6358, falls below 0.005 (1 + it) where it < 0.005 / 0.6308 = 7.93e-3: n − 51 ≥ 125.5,
    /// so from step 177 on. It is itself below 0.005 from n − 51 ≥ 148.3: step 200.
    #[test]
    fn a_decay_converges_where_it_is_known_to() {
        let errors: Vec<f64> = (0..400).map(|k| 0.1 * 0.98f64.powi(k)).collect();
        assert_eq!(convergence_point(&errors, Reading::Density), Some(177));
        assert_eq!(convergence_point(&errors, Reading::Bound), Some(200));
        // By a constant factor it never settles against itself.
        assert_eq!(convergence_point(&errors, Reading::Error), None);
    }

    /// The same so slowly that a hundredth of the bound, and one step of the window, are many steps. Below 0.005 from
    /// the first m with 0.006 rᵐ < 0.005 on, r = 0.9999; the window's earliest is 50 before. With e = rᵐ, r = 0.999, the
    /// change from the earliest x = rᵐ is x (1 − r⁵⁰), below 0.005 (1 + x) for x < 0.005 / (1 − r⁵⁰ − 0.005).
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
        // Against itself over 50 steps it falls by 0.499 % at r = 0.9999, and by 0.504 % at 0.999899.
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

    /// The condition must hold for good: a late splash moves the point behind it.
    #[test]
    fn a_late_disturbance_counts() {
        let mut errors = vec![0.001; 300];
        assert_eq!(convergence_point(&errors, Reading::Density), Some(51));
        errors[200] = 0.1;
        // Step 201 is out, and 250 still has it among its 50.
        assert_eq!(convergence_point(&errors, Reading::Density), Some(252));
        assert_eq!(convergence_point(&errors, Reading::Bound), Some(252));
    }
}
