//! The stop at a density error.

use crate::{
    compare::rounding::U,
    scene::Stop,
    solve::{SolveError, params::IterationControl, trace::Traced},
};

use super::{Checker, fields::*, pair_of};

impl Checker<'_> {
    pub(super) fn sum_error(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let sums = traced.read::<f32>("error_sums", self.n().div_ceil(256))?;
        let pairs: Vec<_> = (self.floats.chunks(256).zip(&sums).enumerate())
            .map(|(k, (block, &sum))| {
                let exact: f64 = block
                    .iter()
                    .map(|&rho| (f64::from(rho) - 1.0).max(0.0))
                    .sum();
                pair_of(k, f64::from(sum), exact, 9.0 * U * exact)
            })
            .collect();
        self.table.add(&ERROR_SUMS, &pairs, 0);
        Ok(())
    }

    pub(super) fn decide(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let Stop::DensityError { density_error, .. } = self.scene.solver.pbf().stop else {
            return Ok(());
        };
        let n = self.n() as f64;
        let after = traced.iteration_control()?;
        let counted = traced.counters()?.iterations;
        let sum: f64 = self.floats.iter().map(|&value| f64::from(value)).sum();
        let (mut expected, mut iterations) = (self.control, self.counters.iterations);
        let is_tie = (sum - density_error * n).abs() <= (n / 65536.0 + 10.0) * U * sum;
        if expected.is_done == 0 && sum <= density_error * n {
            expected = IterationControl {
                is_done: 1,
                iterations: expected.iterations,
                ..IterationControl::default()
            };
        } else if expected.is_done == 0 {
            expected.iterations += 1;
            iterations += 1;
        }
        let words = |control: IterationControl, counted: u32| {
            let mut words: Vec<u32> = bytemuck::cast_slice(&[control]).to_vec();
            words.push(counted);
            words
        };
        if is_tie {
            self.table.add::<f64>(&DECISION, &[], 1);
        } else {
            let expected = words(expected, iterations);
            (self.table).add_exact(&DECISION, &words(after, counted), &expected);
        }
        Ok(())
    }
}
