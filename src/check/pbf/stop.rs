//! The stop at a density error.

use crate::{
    check::{
        engine::Io,
        table::{Table, pair},
    },
    scene::Stop,
    solve::{
        SolveError,
        params::{Counters, IterationControl},
    },
};

use super::{
    PbfState, State,
    rows::{DECISION, ERROR_SUMS, NEAR_TARGET},
};

pub(super) fn sum_error(
    state: &mut PbfState,
    io: &Io<'_>,
    table: &mut Table,
) -> Result<(), SolveError> {
    let n = state.particles();
    let density = io.before::<f32>("density", n)?;
    let sums = io.after::<f32>("error_sums", n.div_ceil(256))?;
    table.each(&ERROR_SUMS, 0..sums.len(), |k| {
        let block = density[256 * k..n.min(256 * k + 256)].iter();
        let exact: f64 = block.map(|&rho| (f64::from(rho) - 1.0).max(0.0)).sum();
        pair(k, sums[k], exact, [exact])
    });
    Ok(())
}

pub(super) fn decide(
    state: &mut PbfState,
    io: &Io<'_>,
    table: &mut Table,
) -> Result<(), SolveError> {
    let Stop::DensityError { density_error, .. } = state.scene.solver.pbf().stop else {
        return Ok(());
    };
    let sums = io.before::<f32>("error_sums", state.particles().div_ceil(256))?;
    let sum: f64 = sums.into_iter().map(f64::from).sum();
    let n = state.particles() as f64;
    if (sum - density_error * n).abs() <= NEAR_TARGET.of([n, sum]) {
        table.leave_out(&DECISION, 1);
        return Ok(());
    }
    let mut expected: IterationControl = io.one_before("control")?;
    let mut iterations = io.one_before::<Counters>("counters")?.iterations;
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
    let counted = io.one::<Counters>("counters")?.iterations;
    let found = words(io.one("control")?, counted);
    table.add_exact(&DECISION, &found, &words(expected, iterations));
    Ok(())
}
