//! Second-order Richardson iteration of a viscous solve, with parameters known in advance.

/// Parameters of a viscous solve.
///
/// The system is (M + κ K) u = M u*, with κ = ν Δt / Δx², M the water fraction of a face and K the
/// stress of the velocities around it (Batty and Bridson 2008). Relative to its diagonal D, its
/// greatest eigenvalue is at most [`GREATEST`], since a strain is a sum of four velocities and
/// the square of such a sum is no more than four times the sum of squares. Its least eigenvalue
/// is at least 1 / (1 + [`MOST_STRESS`] κ) for faces with water on both sides. The iteration
/// uₙ₊₁ = uₙ + dₙ, dₙ = m dₙ₋₁ + g D⁻¹ (M u* − (M + κ K) uₙ) (Golub and Varga 1961, whose q² and
/// 2q/δ are m and g) therefore needs no sum over the grid: the number of iterations that reduces
/// the error by a given factor is known in advance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation {
    /// κ = ν Δt / Δx².
    pub reach: f64,
    /// Gain g of the first iteration, which has no momentum.
    pub first_gain: f64,
    /// Gain g.
    pub gain: f64,
    /// Momentum m.
    pub momentum: f64,
    /// Number of iterations; even, so that the result ends up in the buffer that held
    /// the velocities.
    pub iterations: u32,
    /// Whether the number of iterations was limited to fewer than the tolerance needs.
    pub is_short: bool,
}

/// Bound of the greatest eigenvalue of the system relative to its diagonal.
pub const GREATEST: f64 = 4.0;

/// Bound of K's diagonal: two normal stresses of 2 each, and four edges of up to 3 at corners
/// of solids.
pub const MOST_STRESS: f64 = 16.0;

/// Largest number of iterations per substep.
pub const MOST_ITERATIONS: u32 = 4000;

impl Relaxation {
    /// Computes the parameters for a kinematic viscosity ν, m²/s, over `time_step`, seconds, in
    /// cells of edge `cell_size`, metres, that reduce the error by the factor `tolerance`.
    pub fn new(nu: f64, time_step: f64, cell_size: f64, tolerance: f64) -> Self {
        let reach = nu * time_step / (cell_size * cell_size);
        let least = 1.0 / (1.0 + MOST_STRESS * reach);
        let (middle, half) = (0.5 * (GREATEST + least), 0.5 * (GREATEST - least));
        let root = (GREATEST / least).sqrt();
        let rate = (root - 1.0) / (root + 1.0);
        let needed = (1..=MOST_ITERATIONS / 2).map(|pairs| 2 * pairs);
        let mut needed = needed.filter(|&n| left(rate, n) <= tolerance);
        let found = needed.next();
        Self {
            reach,
            first_gain: 1.0 / middle,
            gain: 2.0 * rate / half,
            momentum: rate * rate,
            iterations: found.unwrap_or(MOST_ITERATIONS),
            is_short: found.is_none(),
        }
    }

    /// Returns κ, g and m of an iteration, and 0, in the layout of the GPU's uniform.
    pub fn of_iteration(&self, is_first: bool) -> [f64; 4] {
        match is_first {
            true => [self.reach, self.first_gain, 0.0, 0.0],
            false => [self.reach, self.gain, self.momentum, 0.0],
        }
    }
}

/// Bound on the remaining fraction of the error after `iterations` (Golub and Varga 1961): qⁿ
/// (1 + n (1 − q²) / (1 + q²)).
fn left(rate: f64, iterations: u32) -> f64 {
    let n = f64::from(iterations);
    let square = rate * rate;
    (n * rate.ln()).exp() * (1.0 + n * (1.0 - square) / (1.0 + square))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Remaining fraction of the error of a mode with this eigenvalue, by the recurrence.
    fn of_mode(relaxation: &Relaxation, eigenvalue: f64) -> f64 {
        let (mut error, mut step): (f64, f64) = (1.0, 0.0);
        let mut most_left: f64 = 1.0;
        for n in 0..relaxation.iterations {
            let [_, gain, momentum, _] = relaxation.of_iteration(n == 0);
            step = momentum * step - gain * eigenvalue * error;
            error += step;
            most_left = error.abs();
        }
        most_left
    }

    #[test]
    fn every_mode_between_the_bounds_falls_to_the_tolerance() {
        for reach in [1e-3, 0.1, 1.0, 30.0, 1e3] {
            for tolerance in [0.1, 1e-3, 1e-5] {
                let relaxation = Relaxation::new(reach, 1.0, 1.0, tolerance);
                let least = 1.0 / (1.0 + MOST_STRESS * reach);
                let all = (0..=1000).map(|k| least + (GREATEST - least) * f64::from(k) / 1000.0);
                let worst = all
                    .map(|value| of_mode(&relaxation, value))
                    .fold(0.0, f64::max);
                assert!(worst <= tolerance, "{reach} {tolerance}: {worst}");
                // No more iterations than needed: by the bound, two fewer leave more of the
                // worst mode.
                assert!(!relaxation.is_short);
                // Negative control: beyond the greatest eigenvalue the bound does not hold.
                if relaxation.iterations > 20 {
                    let beyond = of_mode(&relaxation, 1.2 * GREATEST);
                    assert!(beyond.is_nan() || beyond > tolerance, "{reach}: {beyond}");
                }
            }
        }
    }

    #[test]
    fn more_than_the_most_iterations_is_said() {
        let relaxation = Relaxation::new(1e7, 1.0, 1.0, 1e-3);
        assert!(relaxation.is_short && relaxation.iterations == MOST_ITERATIONS);
        // Modes that are not reduced enough do not grow either.
        let least = 1.0 / (1.0 + MOST_STRESS * 1e7);
        for value in [0.01 * least, least, 1.0, GREATEST] {
            assert!(of_mode(&relaxation, value) <= 1.0);
        }
    }
}
