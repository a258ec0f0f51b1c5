//! The iteration of a solve: preconditioners, direction, step and scalars; bodies of water that no air touches.

use crate::{
    check::{
        engine::{Io, Twin, twin},
        table::{Table, pair},
    },
    domain::{bricks::CELLS, poisson::remove_means},
    reference::poisson::iteration::{
        Decision, Limits, Progress, SolveState, Sum, differences, ipp_lower as twin_ipp_lower,
        ipp_upper as twin_ipp_upper, products, verify as twin_verify,
    },
    scene::flip::Preconditioner,
    solve::{
        SolveError,
        pressure::{
            DONE, ITERATING, PressureControl64, PressurePhase, PressureStats, VERIFYING,
            WANTS_POCKETS, blocked, control_words, widen_control,
        },
    },
};

use super::{FlipState, rows::*};

/// Twins of the passes of an iteration.
pub(super) const TWINS: &[Twin<FlipState>] = &[
    twin("pressure/precondition", &[], precondition),
    twin("pressure/ipp_lower", &[], ipp_lower),
    twin("pressure/ipp_upper", &[], ipp_upper),
    twin("pressure/direction", &["pressure_direction"], direction),
    twin(
        "pressure/advance",
        &["pressure_solution", "pressure_residual"],
        advance,
    ),
    twin("pressure/verify", &[], verify),
    twin("pressure/center", &["values"], center),
    twin("pressure/reduce", &["pressure_control"], reduce),
    twin("pressure/count_pockets", &[], count_pockets),
];

/// Runs of an iteration's pass that are compared: each is as good as any.
pub(super) const PRODUCTS: usize = 3;

/// Steps of `pressure/reduce`, as in the shader.
const BEGIN: u32 = 0;
const DIRECTION: u32 = 1;
const LENGTH: u32 = 2;
const CHECK: u32 = 3;
const VERIFIED: u32 = 4;

// The device's states have the twin's numbers.
const _: () = assert!(
    SolveState::Iterating as u32 == ITERATING
        && SolveState::Verifying as u32 == VERIFYING
        && SolveState::Done as u32 == DONE
        && SolveState::WantsPockets as u32 == WANTS_POCKETS
);

impl FlipState {
    /// Counts a run of a pass on a level; true for the first few.
    pub(super) fn is_due(&mut self, io: &Io<'_>, level: u32) -> bool {
        let runs = self.runs.entry((io.pass(), level)).or_default();
        *runs += 1;
        *runs <= PRODUCTS
    }

    /// Whether the solve is at one of the iterations that are compared.
    pub(super) fn is_early(&self) -> bool {
        let done = self.runs.get(&("pressure/direction", 0));
        done.is_none_or(|&done| done < PRODUCTS)
    }

    /// Whether the dispatch was not empty.
    pub(super) fn is_turn(&self, io: &Io<'_>) -> Result<bool, SolveError> {
        let state = self.control(io)?.state;
        Ok(match io.pass() {
            // A solve among pockets begins with a verification.
            "pressure/verify" => state == VERIFYING || io.last == "pressure/center",
            "pressure/center" => match (io.buffer("values"), io.last) {
                ("pressure_rhs", _) => true,
                ("pressure_residual", "pressure/verify") => state == VERIFYING,
                _ => state == ITERATING,
            },
            _ => state == ITERATING,
        })
    }

    /// What the bricks' sums of products of two arrays come to.
    pub(super) fn note_sum(&mut self, io: &Io<'_>, names: [&str; 2]) -> Result<(), SolveError> {
        let [a, b] = [self.by_row(io, names[0])?, self.by_row(io, names[1])?];
        self.sum = Some(products(&a, &b));
        Ok(())
    }
}

fn precondition(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    if !(state.is_turn(io)? && state.is_due(io, 0)) {
        return Ok(());
    }
    let unit = state.unit();
    let r = state.by_row(io, "pressure_residual")?;
    let z = state.by_row(io, "pressure_correction")?;
    if state.model.settings().pressure.preconditioner == Preconditioner::Jacobi {
        let d = state.by_row(io, "pressure_inverse_diagonal")?;
        state.add_rows(table, &PRECONDITIONED, |i| {
            (z[i], d[i] * r[i], [unit, (d[i] * r[i]).abs()])
        });
    } else {
        state.add_rows(table, &PRECONDITIONED, |i| (z[i], r[i], [unit, 0.0]));
    }
    state.sum = Some(products(&r, &z));
    Ok(())
}

fn ipp_lower(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    if !(state.is_turn(io)? && state.is_due(io, 0)) {
        return Ok(());
    }
    let unit = state.unit();
    let r = state.by_row(io, "pressure_residual")?;
    let d = state.by_row(io, "pressure_inverse_diagonal")?;
    let half = state.by_row(io, "pressure_product")?;
    let twin = twin_ipp_lower(state.system(), &d, &r);
    state.add_rows(table, &IPP_LOWER, |i| {
        (half[i], twin[i].value, [unit, d[i], twin[i].size])
    });
    Ok(())
}

fn ipp_upper(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    if !(state.is_turn(io)? && state.is_due(io, 0)) {
        return Ok(());
    }
    let unit = state.unit();
    let d = state.by_row(io, "pressure_inverse_diagonal")?;
    let half = state.by_row(io, "pressure_product")?;
    let z = state.by_row(io, "pressure_correction")?;
    let twin = twin_ipp_upper(state.system(), &d, &half);
    state.add_rows(table, &IPP_UPPER, |i| {
        (z[i], twin[i].value, [unit, twin[i].size])
    });
    state.note_sum(io, ["pressure_residual", "pressure_correction"])
}

fn direction(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    if !(state.is_turn(io)? && state.is_due(io, 0)) {
        return Ok(());
    }
    let (unit, beta) = (state.unit(), state.control(io)?.beta);
    let before = state.by_row_before(io, "pressure_direction")?;
    let z = state.by_row(io, "pressure_correction")?;
    let p = state.by_row(io, "pressure_direction")?;
    state.add_rows(table, &DIRECTED, |i| {
        let kept = beta * before[i];
        (p[i], z[i] + kept, [unit, z[i].abs() + kept.abs()])
    });
    Ok(())
}

fn advance(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    if !(state.is_turn(io)? && state.is_due(io, 0)) {
        return Ok(());
    }
    let (unit, alpha) = (state.unit(), state.control(io)?.alpha);
    let p = state.by_row(io, "pressure_direction")?;
    let q = state.by_row(io, "pressure_product")?;
    let [before, terms] = [state.terms(io, true)?, state.terms(io, false)?];
    let at = |terms: &[Vec<f64>], i: usize| terms.iter().map(|term| term[i]).sum::<f64>();
    state.add_rows(table, &ADVANCED_SOLUTION, |i| {
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
    let old = state.by_row_before(io, "pressure_residual")?;
    let r = state.by_row(io, "pressure_residual")?;
    state.add_rows(table, &ADVANCED_RESIDUAL, |i| {
        let way = alpha * q[i];
        (r[i], old[i] - way, [unit, old[i].abs() + way.abs()])
    });
    state.sum = Some(products(&r, &r));
    Ok(())
}

fn verify(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    if !(state.is_turn(io)? && state.is_due(io, 0)) {
        return Ok(());
    }
    let (terms, unit) = (state.terms(io, false)?, state.unit());
    let b = state.by_row(io, "pressure_rhs")?;
    let r = state.by_row(io, "pressure_residual")?;
    let system = state.system();
    let twin = twin_verify(system, &b, &terms);
    let errors: Vec<_> = terms.iter().map(|term| differences(system, term)).collect();
    state.add_rows(table, &VERIFIED_RESIDUAL, |i| {
        let error = errors.iter().map(|error| error[i]).sum();
        (r[i], twin[i].value, [unit, error, twin[i].size])
    });
    state.sum = Some(products(&r, &r));
    Ok(())
}

fn center(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    if !(state.is_turn(io)? && state.is_due(io, 0)) {
        return Ok(());
    }
    let unit = state.unit();
    let before = state.by_row_before(io, "values")?;
    let found = state.by_row(io, "values")?;
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
    state.add_rows(table, &CENTERED, |i| {
        let [n, size] = means[i];
        // Outside of pockets nothing is done.
        let value = if size > 0.0 { before[i].abs() } else { 0.0 };
        (found[i], exact[i], [unit, n, size, value])
    });
    Ok(())
}

/// A pocket's cells have its least element for a label, all else 0.
fn count_pockets(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    let wet = state.elements().wet();
    let labels = io.after::<u32>("pressure_label", wet.end)?;
    let counted = io.one::<PressureStats>("pressure_stats")?.pockets;
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
    table.add_exact(&LABELS, &labels[first..], &expected[first..]);
    table.add_exact(&POCKETS, &[counted], &[pockets.len() as u32]);
    Ok(())
}

/// The bricks' sums and what follows from them.
fn reduce(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    let phase = io.uniform::<PressurePhase>("phase")?;
    let before = state.control(io)?;
    let wanted = match phase.step {
        VERIFIED => VERIFYING,
        _ => ITERATING,
    };
    let is_turn = phase.step == BEGIN || before.state == wanted;
    let Some(Sum { value, size }) = state.sum.take().filter(|_| is_turn) else {
        return Ok(());
    };
    let words = io.after::<u32>("pressure_control", control_words(state.precision()))?;
    let after = widen_control(&words, state.precision());
    let found = io.one::<PressureStats>("pressure_stats")?.pockets;
    let unit = state.unit();
    let slack = OF_SUM.of([unit, f64::from(phase.sum_count), size]);
    let target = f64::from(phase.tolerance_square) * before.rhs_square;
    let limits = Limits {
        target,
        iterations: phase.max_iterations,
    };
    let sum = |found: f64| (found, value, [slack, 0.0, 0.0]);
    let (decision, scalars, near) = match phase.step {
        BEGIN => {
            let wants_pockets = phase.has_pockets == 0 && found > 0;
            let scalars = vec![sum(after.rhs_square), sum(after.residual_square)];
            (Decision::Begin { wants_pockets }, scalars, None)
        }
        DIRECTION => {
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
        LENGTH => {
            let alpha = before.product / value;
            let error = OF_ALPHA.of([alpha.abs(), QUOTIENT.of([slack, value, unit])]);
            let scalars = vec![(after.alpha, alpha, [0.0, error, 0.0])];
            (Decision::Length, scalars, Some(0.0))
        }
        CHECK => {
            let scalars = vec![sum(after.residual_square)];
            (Decision::Check(limits), scalars, Some(target))
        }
        _ => {
            let scalars = vec![sum(after.residual_square)];
            (Decision::Verified(limits), scalars, Some(target))
        }
    };
    let pairs = scalars.into_iter().enumerate();
    table.add(
        &SCALARS,
        pairs.map(|(k, (found, exact, magnitudes))| pair(k, found, exact, magnitudes)),
    );
    let is_near = |target: f64| {
        let room = NEAR_TARGET.of([slack, unit, target]);
        value - target <= room && (target == 0.0 || target - value <= room)
    };
    if near.is_some_and(is_near) {
        table.leave_out(&DECIDED, 1);
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
    table.add_exact(&DECIDED, &decided, &expected);
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
