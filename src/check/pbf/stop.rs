//! The stop at a density error.

use crate::{
    comparison::{Io, PassResult},
    table::pair,
};
use swell_scene::Stop;
use swell_solve::{params::IterationControl, pbf::buffers};

use super::{
    PbfState, State,
    rows::{DECISION, ERROR_SUMS, NEAR_TARGET},
};

pub(super) fn sum_error(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let n = state.particles();
    let density = io.before.get(buffers::DENSITY, n)?;
    let sums = io.after.get(buffers::ERROR_SUMS, n.div_ceil(256))?;
    io.table.each(&ERROR_SUMS, 0..sums.len(), |k| {
        let block = density[256 * k..n.min(256 * k + 256)].iter();
        let exact: f64 = block.map(|&rho| (f64::from(rho) - 1.0).max(0.0)).sum();
        pair(k, sums[k], exact, [exact])
    });
    Ok(())
}

pub(super) fn decide(state: &mut PbfState, io: &mut Io<'_>) -> PassResult {
    let Stop::DensityError { density_error, .. } = state.scene.settings().stop else {
        return Ok(());
    };
    let sums = io
        .before
        .get(buffers::ERROR_SUMS, state.particles().div_ceil(256))?;
    let sum: f64 = sums.into_iter().map(f64::from).sum();
    let n = state.particles() as f64;
    if (sum - density_error * n).abs() <= NEAR_TARGET.of([n, sum]) {
        io.table.leave_out(&DECISION, 1);
        return Ok(());
    }
    let mut expected: IterationControl = io.before.one(buffers::CONTROL)?;
    let mut iterations = io.before.one(buffers::COUNTERS)?.iterations;
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
    let counted = io.after.one(buffers::COUNTERS)?.iterations;
    let found = words(io.after.one(buffers::CONTROL)?, counted);
    io.table
        .add_exact(&DECISION, &found, &words(expected, iterations));
    Ok(())
}
