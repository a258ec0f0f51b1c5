//! The iteration of a solve: preconditioners, direction, step and scalars; bodies of water that no
//! air touches.

use crate::{
    comparison::{Comparison, Io, NONE, PassResult, comparison, names},
    table::pair,
};
use swell_domain::{bricks::CELLS, poisson::remove_means};
use swell_gpu::buffer::Buf;
use swell_reference::poisson::iteration::{
    Decision, Limits, Progress, SolveState, Sum, differences, ipp_lower as reference_ipp_lower,
    ipp_upper as reference_ipp_upper, products, sums, verify as reference_verify,
};
use swell_scene::flip::Preconditioner;
use swell_solve::{
    SolveError,
    flip::buffers,
    pressure::{
        DONE, ITERATING, PressureControl64, ReduceStep, STEP_OF_FINEST, VERIFYING, WANTS_POCKETS,
        blocked,
        buffers::{self as solved, Real},
    },
};

use super::{
    FlipState,
    cycle::{Cycle, smoothed},
    rows::*,
};

/// Comparisons of the passes of an iteration.
pub(super) const COMPARISONS: &[Comparison<FlipState>] = &[
    early("pressure/precondition", NONE, precondition),
    early("pressure/ipp_lower", NONE, ipp_lower),
    early("pressure/ipp_upper", NONE, ipp_upper),
    early("pressure/multiply", NONE, multiply),
    early(
        "pressure/advance",
        || {
            names![
                solved::DIRECTION,
                solved::SOLUTION,
                solved::RESIDUAL,
                solved::CORRECTION
            ]
        },
        advance,
    ),
    early("pressure/verify", NONE, verify),
    Comparison {
        is_due: |state, io| {
            state.follows_verify = io.last == "pressure/verify";
            Ok(state.is_turn(io)? && state.is_due(io, 0))
        },
        ..comparison("pressure/sum_pockets", NONE, sum_pockets)
    },
    early(
        "pressure/center",
        || names![VALUES, buffers::SOLID_FLUX],
        center,
    ),
    comparison("pressure/reduce", || names![solved::CONTROL], reduce),
    comparison("pressure/count_pockets", NONE, count_pockets),
];

/// Array whose mean `pressure/center` removes.
const VALUES: Buf<Real> = Buf::new("values");

/// Returns a comparison of the first few non-empty runs.
const fn early(
    pass: &'static str,
    keeps: fn() -> Vec<String>,
    compare: fn(&mut FlipState, &mut Io<'_>) -> PassResult,
) -> Comparison<FlipState> {
    Comparison {
        is_due: |state, io| {
            let is_turn = state.is_turn(io)?;
            let is_due = is_turn && state.is_due(io, 0);
            if is_turn && !is_due {
                // A sum of an earlier run does not describe what this one wrote.
                state.sums = [None; 4];
            }
            Ok(is_due)
        },
        ..comparison(pass, keeps, compare)
    }
}

/// Number of compared runs per pass of an iteration; the runs are equivalent.
const RUNS: usize = 3;

/// Partial sums of a workgroup, by number: ‖residual‖²; residual · correction, replaced by
/// direction · product; residual · product; ‖product‖².
pub(super) const SQUARE: usize = 0;
pub(super) const CORRECTED: usize = 1;
const STEEPNESS: usize = 1;
const OVERLAP: usize = 2;
const PRODUCT_SQUARE: usize = 3;

/// Steps of `pressure/reduce`, by number.
const STEPS: [ReduceStep; 4] = [
    ReduceStep::Begin,
    ReduceStep::Direction,
    ReduceStep::Length,
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
        *runs <= RUNS
    }

    /// Returns whether the dispatch was not empty.
    pub(super) fn is_turn(&self, io: &Io<'_>) -> Result<bool, SolveError> {
        let state = io.before.control(self.precision())?.state;
        Ok(match io.pass {
            // A solve with pockets begins with a verification.
            "pressure/verify" => {
                state == VERIFYING || (state != ITERATING && io.last == "pressure/center")
            }
            "pressure/sum_pockets" | "pressure/center" => {
                let values = VALUES;
                let buffer = io.before.buffer(values.name());
                let is_verified = self.follows_verify && buffer == solved::RESIDUAL.name();
                let wanted = if is_verified { VERIFYING } else { ITERATING };
                buffer == solved::RHS.name() || state == wanted
            }
            // The size of its dispatch says whether the iteration takes its step.
            "pressure/advance" => {
                io.before.get(solved::GROUPS, STEP_OF_FINEST + 1)?[STEP_OF_FINEST].count[0] > 0
            }
            _ => state == ITERATING,
        })
    }

    /// Computes the sum of products of two arrays, which the bricks' partial sums of a kind should
    /// add up to.
    pub(super) fn note_sum(
        &mut self,
        io: &Io<'_>,
        kind: usize,
        [a, b]: [Buf<Real>; 2],
    ) -> PassResult {
        let [a, b] = [self.by_row(&io.after, a)?, self.by_row(&io.after, b)?];
        self.sums[kind] = Some(products(&a, &b));
        Ok(())
    }

    /// Notes the sums of products of the direction `p`, whose terms have these sizes, and of the
    /// residual `r` with the system times the direction, `q`.
    pub(super) fn note_products(&mut self, [p, sizes]: [&[f64]; 2], r: &[f64], q: &[f64]) {
        let magnitudes: Vec<f64> = q.iter().map(|q| q.abs()).collect();
        self.sums[STEEPNESS] = Some(Sum {
            size: products(sizes, &magnitudes).value,
            ..products(p, q)
        });
        self.sums[OVERLAP] = Some(products(r, q));
        self.sums[PRODUCT_SQUARE] = Some(products(q, q));
    }

    /// Returns the system times the direction, by row, as the device has it.
    fn product(&self, io: &Io<'_>) -> Result<Vec<f64>, SolveError> {
        self.by_row_of(&io.after, solved::CORRECTION, 1)
    }

    /// Computes the next direction and the magnitudes of its terms, from the last one.
    pub(super) fn direction(&self, io: &Io<'_>, last: &[f64]) -> Result<[Vec<f64>; 2], SolveError> {
        let beta = io.before.control(self.precision())?.beta;
        let z = self.by_row(&io.after, solved::CORRECTION)?;
        let terms = || z.iter().zip(last).map(|(&z, &p)| (z, beta * p));
        Ok([
            terms().map(|(z, kept)| z + kept).collect(),
            terms().map(|(z, kept)| z.abs() + kept.abs()).collect(),
        ])
    }
}

fn precondition(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
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
    state.sums[CORRECTED] = Some(products(&r, &z));
    Ok(())
}

fn ipp_lower(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let unit = state.unit();
    let r = state.by_row(&io.after, solved::RESIDUAL)?;
    let d = state.by_row(&io.after, solved::INVERSE_DIAGONAL)?;
    let half = state.product(io)?;
    let reference = reference_ipp_lower(state.system(), &d, &r);
    state.add_rows(io.table, &IPP_LOWER, |i| {
        (half[i], reference[i].value, [unit, d[i], reference[i].size])
    });
    Ok(())
}

fn ipp_upper(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let unit = state.unit();
    let d = state.by_row(&io.after, solved::INVERSE_DIAGONAL)?;
    let half = state.product(io)?;
    let z = state.by_row(&io.after, solved::CORRECTION)?;
    let reference = reference_ipp_upper(state.system(), &d, &half);
    state.add_rows(io.table, &IPP_UPPER, |i| {
        (z[i], reference[i].value, [unit, reference[i].size])
    });
    state.note_sum(io, CORRECTED, [solved::RESIDUAL, solved::CORRECTION])
}

fn multiply(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let unit = state.unit();
    let last = state.by_row(&io.after, solved::DIRECTION)?;
    let [p, sizes] = state.direction(io, &last)?;
    let r = state.by_row(&io.after, solved::RESIDUAL)?;
    let q = state.product(io)?;
    let system = state.system();
    let (reference, errors) = (system.apply(&p), differences(system, &p));
    let rounded = sums(system, &sizes);
    state.add_rows(io.table, &PRODUCT, |row| {
        (q[row], reference[row], [unit, errors[row], rounded[row]])
    });
    state.note_products([&p, &sizes], &r, &q);
    Ok(())
}

fn advance(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let control = io.before.control(state.precision())?;
    let (unit, alpha) = (state.unit(), control.alpha);
    let last = state.by_row(&io.before, solved::DIRECTION)?;
    let [directed, sizes] = state.direction(io, &last)?;
    let p = state.by_row(&io.after, solved::DIRECTION)?;
    state.add_rows(io.table, &DIRECTED, |i| {
        (p[i], directed[i], [unit, sizes[i]])
    });
    let is_multigrid = state.model.settings().pressure.preconditioner == Preconditioner::Multigrid;
    // The smoothing takes the product's place, unless the solve is to be verified.
    if is_multigrid && control.state == ITERATING {
        smoothed(&Cycle::of(state, io)?, io, &SMOOTHED_NEXT);
    }
    let q = state.by_row_of(&io.before, solved::CORRECTION, 1)?;
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
    state.sums[SQUARE] = Some(products(&r, &r));
    Ok(())
}

fn verify(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
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
    state.sums[SQUARE] = Some(products(&r, &r));
    Ok(())
}

fn sum_pockets(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let (precision, unit) = (state.precision(), state.unit());
    let count = io.before.window(&solved::PHASES)?.pocket_parts as usize;
    let parts = io.after.get(solved::POCKET_PARTS, count)?;
    let listed = parts.last().map_or(0, |part| part.end as usize);
    let cells = io.after.get(solved::POCKET_CELLS, listed)?;
    let values = io.after.reals(&VALUES, precision, state.elements().cells)?;
    let sums = io.after.reals(&solved::POCKET_SUMS, precision, count)?;
    io.table.each(&POCKET_SUM, 0..count, |k| {
        let own = &cells[parts[k].first as usize..parts[k].end as usize];
        let terms = || own.iter().map(|&cell| values[cell as usize]);
        let size: f64 = terms().map(f64::abs).sum();
        pair(
            k,
            sums[k],
            terms().sum::<f64>(),
            [unit, own.len() as f64, size],
        )
    });
    Ok(())
}

/// Compares the flux beside bodies, which the means that were taken from `before` leave by.
fn leak(state: &FlipState, io: &mut Io<'_>, [before, after]: [&[f64]; 2]) -> PassResult {
    let (elements, unit) = (state.elements(), state.unit());
    let flux = elements.scalars(&io.before, buffers::SOLID_FLUX)?;
    let found = elements.scalars(&io.after, buffers::SOLID_FLUX)?;
    let cell = &state.system().cell;
    let largest = before.iter().fold(0.0, |most: f64, b| most.max(b.abs()));
    state.add_rows(io.table, &LEAKED, |row| {
        let e = cell[row] as usize;
        let exact = flux[e] + (before[row] - after[row]);
        (found[e], exact, [unit, largest, exact.abs()])
    });
    Ok(())
}

fn center(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let unit = state.unit();
    let before = state.by_row(&io.before, VALUES)?;
    let found = state.by_row(&io.after, VALUES)?;
    let pockets = state.system().pockets();
    let mut exact = before.clone();
    remove_means(&mut exact, &pockets);
    let phase = io.before.window(&solved::PHASES)?;
    if state.scene.has_bodies() && phase.step == 1 && phase.body_bricks > 0 {
        leak(state, io, [&before, &exact])?;
    }
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
fn count_pockets(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
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

/// Values that `pressure/reduce` leaves, and its decision from a sum that may be near its bound.
struct Reduced {
    /// Found and expected values, with the magnitudes of [`SCALARS`].
    scalars: Vec<(f64, f64, [f64; 4])>,
    decision: Decision,
    /// The sum that decides.
    sum: f64,
    /// Sums, how far rounding may move them, and the bounds that they are compared with.
    near: Vec<[f64; 3]>,
}

/// Compares the sums of the partial sums and the decisions based on them.
fn reduce(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let phase = io.before.window(&solved::PHASES)?;
    let before = io.before.control(state.precision())?;
    let step = STEPS[phase.step as usize];
    let wanted = match step {
        ReduceStep::Verified => VERIFYING,
        _ => ITERATING,
    };
    if !matches!(step, ReduceStep::Begin) && before.state != wanted {
        return Ok(());
    }
    let after = io.after.control(state.precision())?;
    let unit = state.unit();
    let slack = |sum: Sum| OF_SUM.of([unit, f64::from(phase.sum_count), sum.size]);
    let target = f64::from(phase.tolerance_square) * before.rhs_square;
    let limits = Limits {
        target,
        iterations: phase.max_iterations,
    };
    let exact = |found: f64, sum: Sum| (found, sum.value, [slack(sum), 0.0, 0.0, 0.0]);
    let (square, found) = (state.sums[SQUARE], io.after.one(solved::STATS)?.pockets);
    let reduced = match step {
        ReduceStep::Begin => square.map(|square| {
            let wants_pockets = phase.pocket_parts == 0 && found > 0;
            Reduced {
                scalars: vec![
                    exact(after.rhs_square, square),
                    exact(after.residual_square, square),
                ],
                decision: Decision::Begin { wants_pockets },
                sum: square.value,
                near: Vec::new(),
            }
        }),
        ReduceStep::Direction => {
            let sums = [SQUARE, CORRECTED].map(|kind| state.sums[kind].take());
            let [Some(square), Some(product)] = sums else {
                return Ok(());
            };
            let [beta, error] = match before.is_first {
                1 => [0.0; 2],
                _ => {
                    let value = product.value;
                    let magnitudes = [slack(product), unit, value.abs(), before.product];
                    [value / before.product, OF_BETA.of(magnitudes)]
                }
            };
            Some(Reduced {
                scalars: vec![
                    exact(after.residual_square, square),
                    exact(after.product, product),
                    (after.beta, beta, [0.0, 0.0, error, 0.0]),
                ],
                decision: Decision::Direction(limits),
                sum: square.value,
                near: vec![
                    [square.value, slack(square), target],
                    [product.value, slack(product), 0.0],
                ],
            })
        }
        ReduceStep::Length => {
            let sums = [STEEPNESS, OVERLAP, PRODUCT_SQUARE].map(|kind| state.sums[kind].take());
            let [Some(steepness), Some(overlap), Some(square)] = sums else {
                return Ok(());
            };
            let alpha = before.product / steepness.value;
            let part = QUOTIENT.of([slack(steepness), steepness.value, unit]);
            let error = OF_ALPHA.of([alpha.abs(), part]);
            let terms = [
                before.residual_square,
                -2.0 * alpha * overlap.value,
                alpha * alpha * square.value,
            ];
            let left = terms.iter().sum();
            let room = OF_FORESEEN.of([
                unit,
                terms.iter().map(|term| term.abs()).sum(),
                alpha.abs(),
                error,
                overlap.value.abs(),
                slack(overlap),
                square.value,
                slack(square),
            ]);
            Some(Reduced {
                scalars: vec![
                    (after.alpha, alpha, [0.0, error, 0.0, 0.0]),
                    (after.residual_square, left, [0.0, 0.0, 0.0, room]),
                ],
                decision: Decision::Length(limits),
                sum: left,
                near: vec![
                    [left, room, target],
                    [steepness.value, slack(steepness), 0.0],
                ],
            })
        }
        ReduceStep::Verified => square.map(|square| Reduced {
            scalars: vec![exact(after.residual_square, square)],
            decision: Decision::Verified(limits),
            sum: square.value,
            near: vec![[square.value, slack(square), target]],
        }),
    };
    let Some(reduced) = reduced else {
        return Ok(());
    };
    let pairs = reduced.scalars.into_iter().enumerate();
    io.table.add(
        &SCALARS,
        pairs.map(|(k, (found, exact, magnitudes))| pair(k, found, exact, magnitudes)),
    );
    let is_near = |&[value, slack, target]: &[f64; 3]| {
        let room = NEAR_TARGET.of([slack, unit, target]);
        value - target <= room && (target == 0.0 || target - value <= room)
    };
    if reduced.near.iter().any(is_near) {
        io.table.leave_out(&DECIDED, 1);
        return Ok(());
    }
    let expected = progress(&before).after(reduced.decision, reduced.sum);
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
