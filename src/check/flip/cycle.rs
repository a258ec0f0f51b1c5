//! Compares the multigrid's passes, from the values that the device had around each block.

use std::ops::Range;

use crate::{
    comparison::{Comparison, Io, NONE, PassResult, comparison},
    table::{CheckEntry, each, pair},
};
use swell_domain::bricks::CELLS;
use swell_reference::poisson::multigrid::{
    Brick, Levels, MOST_AIR, Rounding, Surroundings, above_offset, block_index,
};
use swell_solve::{
    SolveError,
    pressure::{PressureBrick, PressurePhase, buffers as solved},
};

use super::{FlipState, iteration::CORRECTED, rows::*};

/// Comparisons of the multigrid's passes.
pub(super) const COMPARISONS: &[Comparison<FlipState>] = &[
    of_level("pressure/coarsen", coarsen),
    of_level("pressure/smooth_first", |state, io| {
        let cycle = Cycle::of(state, io)?;
        smoothed(&cycle, io, &SMOOTHED_FIRST);
        Ok(())
    }),
    of_level("pressure/restrict", restrict),
    of_level("pressure/solve_coarse", solve_coarse),
    of_level("pressure/prolong", prolong),
];

/// Returns a comparison of the first few runs on each level.
const fn of_level(
    pass: &'static str,
    compare: fn(&mut FlipState, &mut Io<'_>) -> PassResult,
) -> Comparison<FlipState> {
    Comparison {
        is_due,
        ..comparison(pass, NONE, compare)
    }
}

fn is_due(state: &mut FlipState, io: &Io<'_>) -> Result<bool, SolveError> {
    let level = io.before.window(&solved::PHASES)?.level;
    let is_turn = io.pass == "pressure/coarsen" || state.is_turn(io)?;
    Ok(is_turn && state.is_due(io, level))
}

/// The levels after the pass.
pub(super) struct Cycle {
    phase: PressurePhase,
    levels: Levels,
    rounding: Rounding,
}

impl Cycle {
    pub(super) fn of(state: &FlipState, io: &Io<'_>) -> Result<Self, SolveError> {
        let phase = io.before.window(&solved::PHASES)?;
        let reals = |buffer, cells| io.after.reals(&buffer, state.precision(), cells);
        let level = |&[first, count, ..]: &[u32; 4]| first..first + count;
        let all = &phase.levels[..=phase.last_level as usize];
        let levels: Vec<Range<u32>> = all.iter().map(level).collect();
        let slots = levels[phase.last_level as usize].end as usize;
        let (cells, stride) = (slots * CELLS as usize, phase.stride as usize);
        let corrections = reals(solved::CORRECTION, stride + cells)?;
        let planes = io.after.get(solved::COEFFICIENT, 2 * stride + cells)?;
        let bricks = io.after.get(solved::BRICKS, slots)?;
        let brick = |brick: &PressureBrick| Brick {
            faces: brick.faces,
            above: brick.above,
        };
        Ok(Self {
            phase,
            levels: Levels {
                levels,
                bricks: bricks.iter().map(brick).collect(),
                coefficient: [0, 1, 2].map(|axis| planes[axis * stride..][..cells].to_vec()),
                dirichlet: reals(solved::DIRICHLET, cells)?,
                residual: reals(solved::RESIDUAL, cells)?,
                correction: corrections[..cells].to_vec(),
                smoothed: corrections[stride..].to_vec(),
            },
            rounding: Rounding {
                unit: state.unit(),
                block: OF_BLOCK.of,
                restricted: OF_RESTRICTION.of,
            },
        })
    }

    fn level(&self) -> usize {
        self.phase.level as usize
    }

    /// Compares one colour of the phase's level with `found`.
    fn compare(
        &self,
        io: &mut Io<'_>,
        entry: &'static CheckEntry<1>,
        (colour, about): (u32, Surroundings),
        found: &[f64],
    ) {
        let blocks = self.levels.coloured(self.level(), colour);
        let solved = each(0..blocks.len(), |k| {
            let levels = &self.levels;
            let solved = levels.solved(self.level(), blocks[k], about, self.rounding, [0.0; 8]);
            let pairs = solved.map(|cells| {
                cells.map(|cell| {
                    let found = found[cell.place];
                    Some(pair(cell.place, found, cell.value, [cell.error]))
                })
            });
            pairs.unwrap_or([None; 8])
        });
        io.table.add(entry, solved.into_iter().flatten());
    }
}

/// Compares the first smoothing of the phase's level.
pub(super) fn smoothed(cycle: &Cycle, io: &mut Io<'_>, entry: &'static CheckEntry<1>) {
    let found = &cycle.levels.smoothed;
    cycle.compare(io, entry, (0, Surroundings::Nothing), found);
    cycle.compare(io, entry, (1, Surroundings::SmoothedWithin), found);
}

fn restrict(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let cycle = Cycle::of(state, io)?;
    let passed = cycle.levels.restricted(cycle.level(), cycle.rounding);
    let pairs = passed.into_iter().map(|cell| {
        let found = cycle.levels.residual[cell.place];
        pair(cell.place, found, cell.value, [cell.error])
    });
    io.table.add(&RESTRICTED, pairs);
    smoothed(&cycle, io, &SMOOTHED);
    Ok(())
}

fn prolong(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let cycle = Cycle::of(state, io)?;
    let found = &cycle.levels.correction;
    cycle.compare(io, &PROLONGED, (1, Surroundings::SmoothedWithAbove), found);
    cycle.compare(io, &PROLONGED, (0, Surroundings::Prolonged), found);
    if cycle.level() == 0 {
        state.note_sum(io, CORRECTED, [solved::RESIDUAL, solved::CORRECTION])?;
    }
    Ok(())
}

/// Compares all corrections that the pass leaves, and the residuals that it passes down.
fn solve_coarse(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let cycle = Cycle::of(state, io)?;
    let levels = &cycle.levels;
    let Range { start, end } = levels.levels[cycle.level()];
    // The finest level's residuals are those of the solve.
    let passed = if cycle.level() == 0 { end } else { start };
    let [corrections, residuals] =
        [start, passed].map(|slot| (CELLS * slot) as usize..levels.correction.len());
    if cycle.level() == 0 {
        state.note_sum(io, CORRECTED, [solved::RESIDUAL, solved::CORRECTION])?;
    }
    let Some([values, errors]) = levels.solve_coarse(cycle.level(), cycle.rounding) else {
        io.table.leave_out(&COARSE_SOLVED, corrections.len());
        io.table.leave_out(&COARSE_RESIDUAL, residuals.len());
        return Ok(());
    };
    io.table.each(&COARSE_SOLVED, corrections, |at| {
        let found = levels.correction[at];
        pair(at, found, values.correction[at], [errors.correction[at]])
    });
    io.table.each(&COARSE_RESIDUAL, residuals, |at| {
        let found = levels.residual[at];
        pair(at, found, values.residual[at], [errors.residual[at]])
    });
    Ok(())
}

fn coarsen(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let cycle = Cycle::of(state, io)?;
    let (levels, unit) = (&cycle.levels, state.unit());
    let is_end = |at, axis| state.is_periodic() && levels.is_closed_end(at, axis);
    let kinds = io.after.get(solved::BLOCK, levels.bricks.len() * 64)?;
    let (mut shared, mut airs) = (Vec::new(), Vec::new());
    let mut full = vec![[true; 2]; kinds.len()];
    let mut is_child = vec![false; kinds.len()];
    for slot in levels.levels[cycle.level() - 1].clone() {
        for block in 0..64 {
            let at = (levels.bricks[slot as usize].above + above_offset(block)) as usize;
            for axis in 0..3 {
                let lower = (0..8).filter(|c| c >> axis & 1 == 0);
                let fine = &levels.coefficient[axis];
                let faces = lower.map(|c| f64::from(fine[block_index(slot, block, c)]));
                let is_end = is_end(at, axis);
                let exact = if is_end {
                    0.0
                } else {
                    0.25 * faces.sum::<f64>()
                };
                shared.push(pair(at, fine[at], exact, [exact]));
            }
            let air = (0..8).map(|c| levels.dirichlet[block_index(slot, block, c)]);
            let exact = 0.5 * air.map(|air| air.min(MOST_AIR)).sum::<f64>();
            airs.push(pair(at, levels.dirichlet[at], exact, [unit, exact]));
            let kind = kinds[(64 * slot + block) as usize] & 3;
            let coarse = at / 512 * 64 + at % 64;
            let is_among =
                !state.is_periodic() || levels.bricks[at / 512].faces.iter().all(|&face| face != 0);
            let is_full = full[coarse][0] && kind == 1 && is_among;
            full[coarse] = [is_full, full[coarse][1] && kind == 0];
            is_child[coarse] = true;
        }
    }
    let children = || (0..kinds.len()).filter(|&k| is_child[k]);
    let found: Vec<u32> = children().map(|k| kinds[k]).collect();
    let expected: Vec<u32> = children()
        .map(|k| match full[k] {
            [_, true] => 0,
            [true, _] => 1,
            _ => 2,
        })
        .collect();
    io.table.add(&COARSE_COEFFICIENT, shared);
    io.table.add(&COARSE_AIR, airs);
    io.table.add_exact(&COARSE_KIND, &found, &expected);
    Ok(())
}
