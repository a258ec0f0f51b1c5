//! The iteration of a solve: preconditioners, direction, step and scalars; bodies of water that no
//! air touches.

use crate::{
    engine::{Comparison, Io, NONE, Outcome, comparison, names},
    table::pair,
};
use swell_domain::{bricks::CELLS, poisson::remove_means};
use swell_gpu::buffer::Buf;
use swell_reference::poisson::iteration::{
    Decision, Limits, Progress, SolveState, Sum, differences, ipp_lower as reference_ipp_lower,
    ipp_upper as reference_ipp_upper, products, verify as reference_verify,
};
use swell_scene::flip::Preconditioner;
use swell_solve::{
    SolveError,
    pressure::{
        DONE, ITERATING, PressureControl64, ReduceStep, VERIFYING, WANTS_POCKETS, blocked,
        buffers::{self as solved, Real},
    },
};

use super::{FlipState, rows::*};

/// Comparisons of the passes of an iteration.
pub(super) const COMPARISONS: &[Comparison<FlipState>] = &[
    early("pressure/precondition", NONE, precondition),
    early("pressure/ipp_lower", NONE, ipp_lower),
    early("pressure/ipp_upper", NONE, ipp_upper),
    early(
        "pressure/direction",
        || names![solved::DIRECTION],
        direction,
    ),
    early(
        "pressure/advance",
        || names![solved::SOLUTION, solved::RESIDUAL],
        advance,
    ),
    early("pressure/verify", NONE, verify),
    early("pressure/center", || names![VALUES], center),
    comparison("pressure/reduce", || names![solved::CONTROL], reduce),
    comparison("pressure/count_pockets", NONE, count_pockets),
];

/// Array whose mean `pressure/center` removes.
const VALUES: Buf<Real> = Buf::new("values");

/// Returns a comparison of the first few non-empty runs.
const fn early(
    pass: &'static str,
    keeps: fn() -> Vec<String>,
    compare: fn(&mut FlipState, &mut Io<'_>) -> Outcome,
) -> Comparison<FlipState> {
    Comparison {
        is_due: |state, io| Ok(state.is_turn(io)? && state.is_due(io, 0)),
        ..comparison(pass, keeps, compare)
    }
}

/// Number of compared runs per pass of an iteration; the runs are equivalent.
pub(super) const PRODUCTS: usize = 3;

/// Steps of `pressure/reduce`, by number.
const STEPS: [ReduceStep; 5] = [
    ReduceStep::Begin,
    ReduceStep::Direction,
    ReduceStep::Length,
    ReduceStep::Check,
    ReduceStep::Verified,
];

// The device's states have the same numbers as the reference's.
const _: () = assert!(
    SolveState::Iterating as u32 == ITERATING
        && SolveState::Verifying as u32 == VERIFYING
        && SolveState::Done as u32 == DONE
        && SolveState::WantsPockets as u32 == WANTS_POCKETS
);

impl FlipState {
    /// Counts a run of a pass on a level; returns whether it is one of the first few.
    pub(crate) fn is_due(&mut self, io: &Io<'_>, level: u32) -> bool {
        let runs = self.runs.entry((io.pass, level)).or_default();
        *runs += 1;
        *runs <= PRODUCTS
    }

    /// Returns whether the solve is at one of the iterations that are compared.
    pub(super) fn is_early(&self) -> bool {
        let done = self.runs.get(&("pressure/direction", 0));
        done.is_none_or(|&done| done < PRODUCTS)
    }

    /// Returns whether the dispatch was not empty.
    pub(super) fn is_turn(&self, io: &Io<'_>) -> Result<bool, SolveError> {
        let state = io.before.control(self.precision())?.state;
        Ok(match io.pass {
            // A solve with pockets begins with a verification.
            "pressure/verify" => state == VERIFYING || io.last == "pressure/center",
            "pressure/center" => {
                let values = VALUES;
                let buffer = io.before.buffer(values.name());
                let is_verified = io.last == "pressure/verify" && buffer == solved::RESIDUAL.name();
                let wanted = if is_verified { VERIFYING } else { ITERATING };
                buffer == solved::RHS.name() || state == wanted
            }
            _ => state == ITERATING,
        })
    }

    /// Computes the sum of products of two arrays, which the bricks' partial sums should add up to.
    pub(super) fn note_sum(&mut self, io: &Io<'_>, a: Buf<Real>, b: Buf<Real>) -> Outcome {
        let [a, b] = [self.by_row(&io.after, a)?, self.by_row(&io.after, b)?];
        self.sum = Some(products(&a, &b));
        Ok(())
    }
}

fn precondition(state: &mut FlipState, io: &mut Io<'_>) -> Outcome {
    let unit = state.unit();
    let r = state.by_row(&io.after, solved::RESIDUAL)?;
    let z = state.by_row(&io.after, solved::CORRECTION)?;
    if state.model.settings().pressure.preconditioner == Preconditioner::Jacobi {
        let d = state.by_row(&io.after, solved::INVERSE_DIAGONAL)?;
        state.add_rows(io.table, &PRECONDITIONED, |i| {
            (z[i], d[i] * r[i], [unit, (d[i] * r[i]).abs()])
        });
    } else {
        state.add_rows(io.table, &PRECONDITIONED, |i| (z[i], r[i], [unit, 0.0]));
    }
    state.sum = Some(products(&r, &z));
    Ok(())
}

fn ipp_lower(state: &mut FlipState, io: &mut Io<'_>) -> Outcome {
    let unit = state.unit();
    let r = state.by_row(&io.after, solved::RESIDUAL)?;
    let d = state.by_row(&io.after, solved::INVERSE_DIAGONAL)?;
    let half = state.by_row(&io.after, solved::PRODUCT)?;
    let reference = reference_ipp_lower(state.system(), &d, &r);
    state.add_rows(io.table, &IPP_LOWER, |i| {
        (half[i], reference[i].value, [unit, d[i], reference[i].size])
    });
    Ok(())
}

fn ipp_upper(state: &mut FlipState, io: &mut Io<'_>) -> Outcome {
    let unit = state.unit();
    let d = state.by_row(&io.after, solved::INVERSE_DIAGONAL)?;
    let half = state.by_row(&io.after, solved::PRODUCT)?;
    let z = state.by_row(&io.after, solved::CORRECTION)?;
    let reference = reference_ipp_upper(state.system(), &d, &half);
    state.add_rows(io.table, &IPP_UPPER, |i| {
        (z[i], reference[i].value, [unit, reference[i].size])
    });
    state.note_sum(io, solved::RESIDUAL, solved::CORRECTION)
}

fn direction(state: &mut FlipState, io: &mut Io<'_>) -> Outcome {
    let (unit, beta) = (state.unit(), io.before.control(state.precision())?.beta);
    let before = state.by_row(&io.before, solved::DIRECTION)?;
    let z = state.by_row(&io.after, solved::CORRECTION)?;
    let p = state.by_row(&io.after, solved::DIRECTION)?;
    state.add_rows(io.table, &DIRECTED, |i| {
        let kept = beta * before[i];
        (p[i], z[i] + kept, [unit, z[i].abs() + kept.abs()])
    });
    Ok(())
}

fn advance(state: &mut FlipState, io: &mut Io<'_>) -> Outcome {
    let (unit, alpha) = (state.unit(), io.before.control(state.precision())?.alpha);
    let p = state.by_row(&io.after, solved::DIRECTION)?;
    let q = state.by_row(&io.after, solved::PRODUCT)?;
    let [before, terms] = [state.terms(&io.before)?, state.terms(&io.after)?];
    let at = |terms: &[Vec<f64>], i: usize| terms.iter().map(|term| term[i]).sum::<f64>();
    state.add_rows(io.table, &ADVANCED_SOLUTION, |i| {
        let way = alpha * p[i];
        let magnitudes = match &terms[..] {
            [large, small, ..] => {
                let lost = LOST.of([unit, large[i].abs(), way.abs()]);
                [0.0, TWO_WORDS.of([unit, small[i].abs(), lost])]
            }
            _ => [ONE_WORD.of([unit, way.abs(), at(&terms, i).abs()]), 0.0],
        };
        (at(&terms, i), at(&before, i) + way, magnitudes)
    });
    let old = state.by_row(&io.before, solved::RESIDUAL)?;
    let r = state.by_row(&io.after, solved::RESIDUAL)?;
    state.add_rows(io.table, &ADVANCED_RESIDUAL, |i| {
        let way = alpha * q[i];
        (r[i], old[i] - way, [unit, old[i].abs() + way.abs()])
    });
    state.sum = Some(products(&r, &r));
    Ok(())
}

fn verify(state: &mut FlipState, io: &mut Io<'_>) -> Outcome {
    let (terms, unit) = (state.terms(&io.after)?, state.unit());
    let b = state.by_row(&io.after, solved::RHS)?;
    let r = state.by_row(&io.after, solved::RESIDUAL)?;
    let system = state.system();
    let reference = reference_verify(system, &b, &terms);
    let errors: Vec<_> = terms.iter().map(|term| differences(system, term)).collect();
    state.add_rows(io.table, &VERIFIED_RESIDUAL, |i| {
        let error = errors.iter().map(|error| error[i]).sum();
        (r[i], reference[i].value, [unit, error, reference[i].size])
    });
    state.sum = Some(products(&r, &r));
    Ok(())
}

fn center(state: &mut FlipState, io: &mut Io<'_>) -> Outcome {
    let unit = state.unit();
    let before = state.by_row(&io.before, VALUES)?;
    let found = state.by_row(&io.after, VALUES)?;
    let pockets = state.system().pockets();
    let mut exact = before.clone();
    remove_means(&mut exact, &pockets);
    let mut means = vec![[1.0, 0.0]; before.len()];
    for pocket in &pockets {
        let size = pocket.iter().map(|&i| before[i as usize].abs()).sum();
        for &i in pocket {
            means[i as usize] = [pocket.len() as f64, size];
        }
    }
    state.add_rows(io.table, &CENTERED, |i| {
        let [n, size] = means[i];
        // Outside pockets the pass does nothing.
        let value = if size > 0.0 { before[i].abs() } else { 0.0 };
        (found[i], exact[i], [unit, n, size, value])
    });
    Ok(())
}

/// Checks that the cells of each pocket have its smallest element as label, and all others 0.
fn count_pockets(state: &mut FlipState, io: &mut Io<'_>) -> Outcome {
    let wet = state.elements().wet();
    let labels = io.after.get(solved::LABEL, wet.end)?;
    let counted = io.after.one(solved::STATS)?.pockets;
    let system = state.system();
    let pockets = system.pockets();
    let mut expected = vec![0; wet.end];
    for pocket in &pockets {
        let places = || pocket.iter().map(|&row| blocked(system.cell[row as usize]));
        let least = places().min().unwrap_or(0) as u32;
        for place in places() {
            expected[place] = least;
        }
    }
    let first = CELLS as usize;
    io.table
        .add_exact(&LABELS, &labels[first..], &expected[first..]);
    io.table
        .add_exact(&POCKETS, &[counted], &[pockets.len() as u32]);
    Ok(())
}

/// Compares the sums of the partial sums and the decisions based on them.
fn reduce(state: &mut FlipState, io: &mut Io<'_>) -> Outcome {
    let phase = io.before.window(&solved::PHASES)?;
    let before = io.before.control(state.precision())?;
    let step = STEPS[phase.step as usize];
    let wanted = match step {
        ReduceStep::Verified => VERIFYING,
        _ => ITERATING,
    };
    let is_turn = matches!(step, ReduceStep::Begin) || before.state == wanted;
    let Some(Sum { value, size }) = state.sum.take().filter(|_| is_turn) else {
        return Ok(());
    };
    let after = io.after.control(state.precision())?;
    let found = io.after.one(solved::STATS)?.pockets;
    let unit = state.unit();
    let slack = OF_SUM.of([unit, f64::from(phase.sum_count), size]);
    let target = f64::from(phase.tolerance_square) * before.rhs_square;
    let limits = Limits {
        target,
        iterations: phase.max_iterations,
    };
    let sum = |found: f64| (found, value, [slack, 0.0, 0.0]);
    let (decision, scalars, near) = match step {
        ReduceStep::Begin => {
            let wants_pockets = phase.has_pockets == 0 && found > 0;
            let scalars = vec![sum(after.rhs_square), sum(after.residual_square)];
            (Decision::Begin { wants_pockets }, scalars, None)
        }
        ReduceStep::Direction => {
            let [beta, error] = match before.is_first {
                1 => [0.0; 2],
                _ => {
                    let magnitudes = [slack, unit, value.abs(), before.product];
                    [value / before.product, OF_BETA.of(magnitudes)]
                }
            };
            let scalars = vec![sum(after.product), (after.beta, beta, [0.0, 0.0, error])];
            (Decision::Direction, scalars, Some(0.0))
        }
        ReduceStep::Length => {
            let alpha = before.product / value;
            let error = OF_ALPHA.of([alpha.abs(), QUOTIENT.of([slack, value, unit])]);
            let scalars = vec![(after.alpha, alpha, [0.0, error, 0.0])];
            (Decision::Length, scalars, Some(0.0))
        }
        ReduceStep::Check => {
            let scalars = vec![sum(after.residual_square)];
            (Decision::Check(limits), scalars, Some(target))
        }
        ReduceStep::Verified => {
            let scalars = vec![sum(after.residual_square)];
            (Decision::Verified(limits), scalars, Some(target))
        }
    };
    let pairs = scalars.into_iter().enumerate();
    io.table.add(
        &SCALARS,
        pairs.map(|(k, (found, exact, magnitudes))| pair(k, found, exact, magnitudes)),
    );
    let is_near = |target: f64| {
        let room = NEAR_TARGET.of([slack, unit, target]);
        value - target <= room && (target == 0.0 || target - value <= room)
    };
    if near.is_some_and(is_near) {
        io.table.leave_out(&DECIDED, 1);
        return Ok(());
    }
    let expected = progress(&before).after(decision, value);
    let expected = [
        expected.state as u32,
        expected.iterations,
        u32::from(expected.is_first),
        expected.restarts,
    ];
    let decided = [
        after.state,
        after.iterations,
        after.is_first,
        after.restarts,
    ];
    io.table.add_exact(&DECIDED, &decided, &expected);
    Ok(())
}

fn progress(control: &PressureControl64) -> Progress {
    let states = [
        SolveState::Iterating,
        SolveState::Verifying,
        SolveState::Done,
    ];
    Progress {
        state: *(states.get(control.state as usize)).unwrap_or(&SolveState::WantsPockets),
        iterations: control.iterations,
        is_first: control.is_first == 1,
        restarts: control.restarts,
    }
}
