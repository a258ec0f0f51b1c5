//! Second-order Richardson iteration of a viscous solve, with what is known of its system beforehand.

/// How a viscous solve goes.
///
/// The system is (M + κ K) u = M u*, with κ = ν Δt / Δx², M the part of a face's water and K the stress of the velocities about it
/// (Batty and Bridson 2008). Over its diagonal D, its greatest eigenvalue is [`GREATEST`] at most, since a strain is a sum of four
/// velocities and the square of such a sum no more than four times the sum of squares; its least is 1 / (1 + [`MOST_STRESS`] κ) or
/// more for faces with water on both sides. So the iteration uₙ₊₁ = uₙ + dₙ, dₙ = m dₙ₋₁ + g D⁻¹ (M u* − (M + κ K) uₙ) (Golub and
/// Varga 1961, whose q² and 2q/δ are m and g) needs no sum over the grid: how many iterations bring the error to a part of what it was
/// is known before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation {
    /// κ.
    pub reach: f64,
    /// g of the first iteration, which has no momentum.
    pub first_gain: f64,
    /// g.
    pub gain: f64,
    /// m.
    pub momentum: f64,
    /// Even, so that the result stands where the velocities stood.
    pub iterations: u32,
    /// Whether those were not as many as the tolerance asks for.
    pub is_short: bool,
}

/// Bound of the greatest eigenvalue of the system over its diagonal.
pub const GREATEST: f64 = 4.0;

/// Bound of K's diagonal: two normal stresses of 2 each, and four edges of up to 3 at corners of solids.
pub const MOST_STRESS: f64 = 16.0;

/// Iterations of a substep at most.
pub const MOST_ITERATIONS: u32 = 4000;

impl Relaxation {
    /// Of a kinematic ν, m²/s, over `time_step`, seconds, in cells of edge `cell_size`, metres, so that the error falls to a part
    /// `tolerance` of what it was.
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

    /// κ, g and m of an iteration, and 0: as the device has them.
    pub fn of_iteration(&self, is_first: bool) -> [f64; 4] {
        match is_first {
            true => [self.reach, self.first_gain, 0.0, 0.0],
            false => [self.reach, self.gain, self.momentum, 0.0],
        }
    }
}

/// Part of the error that is left at most after so many iterations (Golub and Varga 1961): qⁿ (1 + n (1 − q²) / (1 + q²)).
fn left(rate: f64, iterations: u32) -> f64 {
    let n = f64::from(iterations);
    let square = rate * rate;
    (n * rate.ln()).exp() * (1.0 + n * (1.0 - square) / (1.0 + square))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Part of the error that is left of a mode with an eigenvalue, as the recurrence has it.
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
                // No more iterations than that asks for: two fewer leave more of the worst mode, by the bound.
                assert!(!relaxation.is_short);
                // Negative control: beyond the greatest eigenvalue it does not hold.
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
        // What is not brought down is not blown up either.
        let least = 1.0 / (1.0 + MOST_STRESS * 1e7);
        for value in [0.01 * least, least, 1.0, GREATEST] {
            assert!(of_mode(&relaxation, value) <= 1.0);
        }
    }
}
