//! Reference passes of an iteration, row by row, and the magnitudes that their rounding errors are
//! relative to.

use swell_domain::poisson::{Coupling, NONE, System};

use super::{Solver, gradients::norm};

/// Inverse iterations for the smallest eigenvalue.
const EIGEN_STEPS: usize = 8;

/// Number of times that the true residual may exceed the tolerance, as in pressure/reduce.
const MOST_RESTARTS: u32 = 16;

/// A value and the sum of the magnitudes of its terms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Sum {
    /// Sum of the terms.
    pub value: f64,
    /// Sum of their magnitudes.
    pub size: f64,
}

/// Computes Σ a b by compensated summation (Ogita, Rump and Oishi 2005, algorithm 4.4): the device
/// may also sum in f64, and in a tree, which rounds less than a sequential sum.
pub fn products(a: &[f64], b: &[f64]) -> Sum {
    let terms = || a.iter().zip(b).map(|(a, b)| a * b);
    let (value, rounded_off) = terms().fold((0.0, 0.0), |(sum, rounded_off), term| {
        let next: f64 = sum + term;
        let taken = next - sum;
        (
            next,
            rounded_off + ((sum - (next - taken)) + (term - taken)),
        )
    });
    Sum {
        value: value + rounded_off,
        size: terms().map(f64::abs).sum(),
    }
}

/// Terms of a sum over a body's cells, for each rounding error that a row has without bodies.
const OF_BODIES: f64 = 8.0;

/// Returns Σ c |x − x'| plus the air term's magnitude for each row, and that of bodies' terms.
pub fn differences(system: &System, x: &[f64]) -> Vec<f64> {
    let mut all = of_water(system, x);
    let sizes: Vec<f64> = x.iter().map(|x| x.abs()).collect();
    for body in &system.bodies {
        let size = Coupling {
            row: body.row.clone(),
            push: body.push.iter().map(|push| push.map(f64::abs)).collect(),
            response: body.response.map(|row| row.map(|r| OF_BODIES * r.abs())),
        };
        size.add_flux(&size.change(&sizes), &mut all);
    }
    all
}

fn of_water(system: &System, x: &[f64]) -> Vec<f64> {
    (0..x.len())
        .map(|i| {
            let shared = system.neighbor[i].iter().zip(&system.coefficient[i]);
            let inner: f64 = shared
                .filter(|(j, _)| **j != NONE)
                .map(|(&j, c)| c * (x[i] - x[j as usize]).abs())
                .sum();
            inner + system.dirichlet[i] * x[i].abs()
        })
        .collect()
}

/// Returns Σ c (x + x') plus the air term for each row: how far rounding errors of up to x move the
/// system's image.
pub fn sums(system: &System, x: &[f64]) -> Vec<f64> {
    (0..x.len())
        .map(|i| {
            let shared = system.neighbor[i].iter().zip(&system.coefficient[i]);
            let inner: f64 = shared
                .filter(|(j, _)| **j != NONE)
                .map(|(&j, c)| c * (x[i] + x[j as usize]))
                .sum();
            inner + system.dirichlet[i] * x[i]
        })
        .collect()
}

/// Returns Σ over the lower (`first` = 0) or the upper (1) neighbours of row `i`: coefficient times
/// `value`.
fn shared(system: &System, i: usize, first: usize, value: impl Fn(usize) -> f64) -> Sum {
    let mut sum = Sum::default();
    for k in (first..6).step_by(2) {
        if system.neighbor[i][k] != NONE {
            let term = system.coefficient[i][k] * value(system.neighbor[i][k] as usize);
            sum.value += term;
            sum.size += f64::abs(term);
        }
    }
    sum
}

/// Reference pass of `pressure/ipp_lower`: y = d (r + L d r), from the inverse diagonal `d` and the
/// residual `r`. The size is that of the sum before it is multiplied by d.
pub fn ipp_lower(system: &System, d: &[f64], r: &[f64]) -> Vec<Sum> {
    let of = |i: usize| {
        let sum = shared(system, i, 0, |j| d[j] * r[j]);
        Sum {
            value: d[i] * (r[i] + sum.value),
            size: r[i].abs() + sum.size,
        }
    };
    (0..r.len()).map(of).collect()
}

/// Reference pass of `pressure/ipp_upper`: z = y + d U y.
pub fn ipp_upper(system: &System, d: &[f64], y: &[f64]) -> Vec<Sum> {
    let of = |i: usize| {
        let sum = shared(system, i, 1, |j| y[j]);
        Sum {
            value: y[i] + d[i] * sum.value,
            size: y[i].abs() + d[i] * sum.size,
        }
    };
    (0..y.len()).map(of).collect()
}

/// Reference pass of `pressure/verify`: b − A x, where x is the sum of `terms`. The size is that of
/// b and of each image.
pub fn verify(system: &System, b: &[f64], terms: &[Vec<f64>]) -> Vec<Sum> {
    let images: Vec<_> = terms.iter().map(|term| system.apply(term)).collect();
    let of = |i: usize| Sum {
        value: images.iter().fold(b[i], |left, image| left - image[i]),
        size: (images.iter()).fold(b[i].abs(), |size, image| size + image[i].abs()),
    };
    (0..b.len()).map(of).collect()
}

/// State of a solve, numbered as on the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SolveState {
    /// It iterates.
    Iterating,
    /// It recomputes its true residual.
    Verifying,
    /// It has ended.
    Done,
    /// It waits until the host has listed the pockets.
    WantsPockets,
}

/// Decision of `pressure/reduce` from a sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Decision {
    /// Starts a solve, from ‖b‖².
    Begin {
        /// Whether there are pockets that the host has not listed yet.
        wants_pockets: bool,
    },
    /// Tests ‖r‖² as the last step left it, and computes β.
    Direction(Limits),
    /// Computes α, and tests the ‖r‖² that this step will leave.
    Length(Limits),
    /// Tests ‖r‖² of the true residual.
    Verified(Limits),
}

/// Stop conditions of an iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// ‖r‖² at which the solve has converged.
    pub target: f64,
    /// Most iterations.
    pub iterations: u32,
}

/// State that the decisions depend on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// State of the solve.
    pub state: SolveState,
    /// Iterations so far.
    pub iterations: u32,
    /// Whether the next direction restarts from the preconditioned residual.
    pub is_first: bool,
    /// Number of verifications.
    pub restarts: u32,
}

impl Progress {
    /// Reference pass of `pressure/reduce`: returns the state after a decision from a sum.
    #[must_use]
    pub fn after(mut self, decision: Decision, sum: f64) -> Self {
        match decision {
            Decision::Begin { wants_pockets } => {
                self = Self {
                    state: match (wants_pockets, sum > 0.0) {
                        (true, _) => SolveState::WantsPockets,
                        (_, true) => SolveState::Iterating,
                        _ => SolveState::Done,
                    },
                    iterations: 0,
                    is_first: true,
                    restarts: 0,
                };
            }
            Decision::Direction(limits) => {
                self.is_first = false;
                if sum <= limits.target {
                    self.state = SolveState::Verifying;
                }
            }
            Decision::Length(limits) => {
                self.iterations += 1;
                if sum <= limits.target || self.iterations >= limits.iterations {
                    self.state = SolveState::Verifying;
                }
            }
            Decision::Verified(limits) => {
                self.restarts += 1;
                self.is_first = true;
                let is_over = self.iterations >= limits.iterations;
                let is_last = sum <= limits.target || is_over || self.restarts > MOST_RESTARTS;
                self.state = if is_last {
                    SolveState::Done
                } else {
                    SolveState::Iterating
                };
            }
        }
        self
    }
}

/// Estimates the smallest eigenvalue of a system of `rows` rows, by inverse iterations from a
/// vector of hashed numbers; the estimate is at most a few percent above it.
pub fn least_eigenvalue(solver: &Solver<'_>, rows: usize) -> f64 {
    let sign = |k: usize| {
        let hash = (k as u32 + 1).wrapping_mul(0x9e37_79b9) >> 31;
        1.0 + f64::from(hash)
    };
    let mut y: Vec<f64> = (0..rows).map(sign).collect();
    let mut eigenvalue = f64::INFINITY;
    for _ in 0..EIGEN_STEPS {
        let size = norm(&y);
        for value in &mut y {
            *value /= size;
        }
        y = solver.solve(&y).x;
        eigenvalue = 1.0 / norm(&y);
    }
    eigenvalue
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::poisson::BUDGET;
    use swell_domain::poisson::cases::{Surface, tank, white_noise};

    /// A large term that appears and cancels between small ones, which a plain sum loses.
    #[test]
    fn a_sum_of_products_keeps_what_its_additions_round_off() {
        let mut terms = vec![1.0];
        for _ in 0..1000 {
            terms.extend([1e16, 0.25, -1e16]);
        }
        let ones = vec![1.0; terms.len()];
        assert_eq!(products(&terms, &ones).value, 251.0);
        // Negative control.
        assert_ne!(terms.iter().sum::<f64>(), 251.0);
    }

    /// Together the two halves are (I + D U)(D + D L D) r: symmetric and positive definite, as a
    /// preconditioner has to be.
    #[test]
    fn the_two_halves_are_a_symmetric_preconditioner() {
        let system = tank(8, Surface::GhostFluid, true).system();
        let d: Vec<f64> = system.diagonal.iter().map(|d| 1.0 / d).collect();
        let values = |sums: Vec<Sum>| sums.iter().map(|sum| sum.value).collect::<Vec<_>>();
        let apply = |r: &[f64]| {
            let half = values(ipp_lower(&system, &d, r));
            values(ipp_upper(&system, &d, &half))
        };
        let a = white_noise(d.len());
        let b: Vec<f64> = a.iter().rev().copied().collect();
        let [ab, ba] = [products(&a, &apply(&b)), products(&b, &apply(&a))];
        assert!(
            (ab.value - ba.value).abs() < 1e-13 * ab.size,
            "{ab:?} {ba:?}"
        );
        assert!(products(&a, &apply(&a)).value > 0.0);
        // Negative control: the lower half by itself is not symmetric.
        let lower = |r: &[f64]| values(ipp_lower(&system, &d, r));
        let [ab, ba] = [products(&a, &lower(&b)), products(&b, &lower(&a))];
        assert!(
            (ab.value - ba.value).abs() > 1e-6 * ab.size,
            "{ab:?} {ba:?}"
        );
    }

    #[test]
    fn a_solve_goes_from_state_to_state() {
        let limits = Limits {
            target: 1.0,
            iterations: 3,
        };
        let idle = Progress {
            state: SolveState::Done,
            iterations: 9,
            is_first: false,
            restarts: 9,
        };
        let begin = |wants_pockets, sum| idle.after(Decision::Begin { wants_pockets }, sum);
        assert_eq!(begin(true, 4.0).state, SolveState::WantsPockets);
        assert_eq!(begin(false, 0.0).state, SolveState::Done);
        let begun = begin(false, 4.0);
        assert_eq!(
            (begun.state, begun.iterations, begun.restarts),
            (SolveState::Iterating, 0, 0)
        );
        let checked = begun
            .after(Decision::Direction(limits), 4.0)
            .after(Decision::Length(limits), 2.0);
        assert_eq!(
            (checked.state, checked.is_first),
            (SolveState::Iterating, false)
        );
        let small = checked.after(Decision::Length(limits), 0.5);
        assert_eq!((small.state, small.iterations), (SolveState::Verifying, 2));
        // The residual fell further than the step foresaw.
        let late = checked.after(Decision::Direction(limits), 0.5);
        assert_eq!((late.state, late.iterations), (SolveState::Verifying, 1));
        // The updated residual was too optimistic.
        let again = small.after(Decision::Verified(limits), 2.0);
        assert_eq!(
            (again.state, again.is_first, again.restarts),
            (SolveState::Iterating, true, 1)
        );
        assert_eq!(
            small.after(Decision::Verified(limits), 1.0).state,
            SolveState::Done
        );
        let last = again.after(Decision::Length(limits), 2.0);
        assert_eq!(
            last.after(Decision::Verified(limits), 2.0).state,
            SolveState::Done
        );
    }

    /// Compares with the Rayleigh quotient of the final vector, which is at least the smallest
    /// eigenvalue.
    #[test]
    fn the_least_eigenvalue_is_no_greater_than_any_quotient() {
        let system = tank(8, Surface::GhostFluid, true).system();
        let solver = Solver::new(&system, BUDGET).unwrap();
        let least = least_eigenvalue(&solver, system.cell.len());
        let smooth = vec![1.0; system.cell.len()];
        let quotient = |x: &[f64]| products(x, &system.apply(x)).value / products(x, x).value;
        let found = solver.solve(&smooth).x;
        assert!(
            least <= 1.001 * quotient(&found) && least > 0.9 * quotient(&solver.solve(&found).x)
        );
        assert!(quotient(&white_noise(smooth.len())) > 10.0 * least);
    }
}
