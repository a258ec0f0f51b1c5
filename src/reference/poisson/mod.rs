//! Solves the pressure's linear system as accurately as f64 allows: by a sparse Cholesky factor if
//! memory suffices, else by conjugate gradients.

mod cholesky;
pub mod gradients;
pub mod iteration;
pub mod multigrid;

use crate::ReferenceError;
use swell_domain::poisson::{System, remove_means};

use cholesky::Factor;
use gradients::{Precondition, Solution, residual};

/// Bytes that a factor may take, including the scratch memory of its computation. That allows for
/// some 280 000 rows of a cubic tank; measured are 30 MiB for 19 000 rows, 87 for 37 000, 408 for
/// 103 000 and 619 for 126 000. The size is known from the ordering, before any of it is allocated.
pub const BUDGET: u64 = 2 << 30;

/// Relative updated residual at which the conjugate gradients stop; the true residual is then
/// limited by rounding, near ε ‖A‖ ‖x‖ / ‖b‖, 1e-14 to 1e-12.
pub const TOLERANCE: f64 = 1e-14;

/// Most iterations of the conjugate gradients. MIC(0) takes about three per cell of the longest
/// path through the water for each factor of 1e-6.
const MOST_ITERATIONS: u32 = 20_000;

/// A system, prepared for right-hand sides.
pub struct Solver<'a> {
    system: &'a System,
    pockets: Vec<Vec<u32>>,
    factor: Option<Factor>,
}

impl<'a> Solver<'a> {
    /// Factorises `system` if that takes at most `budget` bytes; 0 never factorises, and no system
    /// whose pressure moves bodies is: its matrix is not sparse.
    ///
    /// # Errors Returns [`ReferenceError::Factor`] if the system is not positive definite or memory
    /// does not hold the factor.
    pub fn new(system: &'a System, budget: u64) -> Result<Self, ReferenceError> {
        let pockets = system.pockets();
        let factor = match budget {
            0 => None,
            _ if !system.bodies.is_empty() => None,
            _ => Factor::new(system, &pockets, budget)?,
        };
        Ok(Self {
            system,
            pockets,
            factor,
        })
    }

    /// Returns the size of the factor, bytes; `None` if conjugate gradients solve the system.
    pub fn factor_bytes(&self) -> Option<u64> {
        self.factor.as_ref().map(|factor| factor.bytes)
    }

    /// Returns the bodies of water that no air touches, as lists of rows.
    pub fn pockets(&self) -> &[Vec<u32>] {
        &self.pockets
    }

    /// Solves A x = b, one value per row; the means of b and of x over each pocket are removed. The
    /// residual refers to b without its means.
    pub fn solve(&self, b: &[f64]) -> Solution {
        let mut b = b.to_vec();
        remove_means(&mut b, &self.pockets);
        let Some(factor) = &self.factor else {
            return gradients::solve(
                self.system,
                &b,
                Precondition::IncompleteCholesky,
                TOLERANCE,
                MOST_ITERATIONS,
            );
        };
        let mut x = factor.solve(&b);
        remove_means(&mut x, &self.pockets);
        Solution {
            residual: residual(self.system, &b, &x),
            x,
            iterations: 0,
        }
    }
}

/// Solves A x = b once, by a factor of up to [`BUDGET`] bytes or by conjugate gradients; see
/// [`Solver::solve`].
///
/// # Errors Returns the errors of [`Solver::new`].
pub fn solve(system: &System, b: &[f64]) -> Result<Solution, ReferenceError> {
    Ok(Solver::new(system, BUDGET)?.solve(b))
}

#[cfg(test)]
mod tests {
    use super::{gradients::norm, *};
    use swell_domain::poisson::{
        AIR, FLUID, SOLID,
        cases::{Case, Surface, manufactured, tank, tank_rhs, white_noise},
    };

    fn gap(a: &[f64], b: &[f64]) -> f64 {
        let difference: Vec<f64> = a.iter().zip(b).map(|(a, b)| a - b).collect();
        norm(&difference) / norm(b)
    }

    /// Solves by the factor, and by conjugate gradients.
    fn both(system: &System, b: &[f64]) -> [Solution; 2] {
        [BUDGET, 0].map(|budget| {
            let solver = Solver::new(system, budget).unwrap();
            assert_eq!(solver.factor_bytes().is_some(), budget > 0);
            solver.solve(b)
        })
    }

    /// Two cavities in rock, filled completely, above a basin.
    fn pockets() -> Case {
        let is_room = |c: [u32; 3]| {
            (2..=6).contains(&c[1].wrapping_sub(10))
                && (3..=17).contains(&c[0])
                && c[0] != 9
                && (2..=16).contains(&c[2])
        };
        let kind = move |c: [u32; 3]| match c[1] {
            0..=4 => FLUID,
            5..=9 => AIR,
            _ if is_room(c) => FLUID,
            _ => SOLID,
        };
        Case::new([20; 3], 0.05, kind, |_, _| 1.0, |x| x.y - 0.25)
    }

    #[test]
    fn factor_and_gradients_agree() {
        let surfaces = [Surface::Voxel, Surface::GhostFluid];
        let tanks = surfaces.map(|surface| tank(24, surface, true));
        for case in tanks.into_iter().chain([pockets()]) {
            let system = case.system();
            let b = tank_rhs(&case, &system);
            let [direct, iterated] = both(&system, &b);
            assert!(direct.iterations == 0 && iterated.iterations > 20);
            // ε κ of these systems is about 1e-13.
            assert!(direct.residual < 1e-12, "{:e}", direct.residual);
            assert!(iterated.residual < 1e-11, "{:e}", iterated.residual);
            let apart = gap(&iterated.x, &direct.x);
            assert!(apart < 1e-10, "{apart:e}");

            // Negative control: the residual shows one coefficient of the wrong sign.
            let mut spoiled = system.clone();
            let row = spoiled.cell.len() / 2;
            let k = (0..6).find(|&k| spoiled.coefficient[row][k] > 0.0).unwrap();
            spoiled.coefficient[row][k] *= -1.0;
            assert!(residual(&spoiled, &b, &direct.x) > 1e-6);
        }
    }

    /// Faces with a tiny open fraction next to a solid, and cells with only such faces: rows of
    /// 1e-6 beside rows of 6. Hard case 12.
    #[test]
    fn slivers_are_solved_as_by_the_factor() {
        let mut case = tank(24, Surface::GhostFluid, true);
        let cut = |open: &&mut f32| **open > 0.0 && **open < 1.0;
        let mut slivers = 0;
        for open in case.open.iter_mut().filter(cut) {
            *open *= 1e-5;
            slivers += 1;
        }
        let wet = case.system().cell;
        for &element in wet.iter().step_by(97) {
            for k in 0..6 {
                let face = case.cells().face(element, k);
                case.open[face] *= 1e-6;
            }
        }
        assert!(slivers > 300, "{slivers}");
        let system = case.system();
        let least = system.diagonal.iter().copied().fold(f64::MAX, f64::min);
        assert!(least < 1e-5, "{least:e}");
        let known = white_noise(system.cell.len());
        let b = system.apply(&known);
        let [direct, iterated] = both(&system, &b);
        let apart = gap(&iterated.x, &direct.x);
        println!("{slivers} slivers, least diagonal {least:.1e}, apart by {apart:.1e}");
        assert!(apart < 1e-8, "{apart:e}");
        assert!(gap(&direct.x, &known) < 1e-8);
        // Negative control: conjugate gradients that stop at 1e-6 have not resolved the tiny faces
        // yet.
        let kind = Precondition::IncompleteCholesky;
        let early = gradients::solve(&system, &b, kind, 1e-6, MOST_ITERATIONS);
        assert!(gap(&early.x, &direct.x) > 1e-8);
    }

    #[test]
    fn pockets_have_no_mean_and_take_none() {
        let system = pockets().system();
        let known = system.pockets();
        assert_eq!(known.len(), 2);
        let b = white_noise(system.cell.len());
        let mut shifted = b.clone();
        for &row in &known[0] {
            shifted[row as usize] += 0.25;
        }
        let [direct, iterated] = both(&system, &b);
        for solution in [&direct, &iterated] {
            for pocket in &known {
                let sum: f64 = pocket.iter().map(|&row| solution.x[row as usize]).sum();
                assert!(sum.abs() < 1e-12 * pocket.len() as f64 * norm(&solution.x));
            }
        }
        let again = both(&system, &shifted);
        assert!(gap(&again[0].x, &direct.x) < 1e-10);
        assert!(gap(&again[1].x, &direct.x) < 1e-10);
    }

    /// Second order in p, like the GPU in tests/suite/solve/pressure.rs.
    #[test]
    fn manufactured_pressure_converges_with_second_order() {
        let error = |n: u32, surface: Surface| {
            let (case, b, q) = manufactured(n);
            let case = Case { surface, ..case };
            gap(&solve(&case.system(), &b).unwrap().x, &q)
        };
        let errors = [16, 32].map(|n| error(n, Surface::GhostFluid));
        let order = (errors[0] / errors[1]).log2();
        assert!(order >= 1.8, "{order} {errors:?}");
        // Negative control: a surface displaced by up to half a cell has a first-order error.
        assert!(error(32, Surface::Voxel) > 5.0 * errors[1]);
    }

    #[test]
    fn nothing_flows_without_a_source() {
        let system = tank(8, Surface::GhostFluid, false).system();
        let none = vec![0.0; system.cell.len()];
        for solution in both(&system, &none) {
            assert_eq!((solution.iterations, solution.residual), (0, 0.0));
            assert!(solution.x.iter().all(|&x| x == 0.0));
        }
        assert!(solve(&System::default(), &[]).unwrap().x.is_empty());
    }
}
