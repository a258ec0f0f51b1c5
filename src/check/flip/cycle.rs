//! The multigrid's passes, from the values that the device had about each block.

use std::ops::Range;

use crate::{
    check::{
        engine::{Io, Twin, twin},
        table::{Entry, Table, each, pair},
    },
    domain::bricks::CELLS,
    reference::poisson::multigrid::{
        About, Brick, Levels, MOST_AIR, Rounding, above_offset, place,
    },
    solve::{
        SolveError,
        pressure::{PressureBrick, PressurePhase},
    },
};

use super::{FlipState, rows::*};

/// Twins of the multigrid's passes.
pub(super) const TWINS: &[Twin<FlipState>] = &[
    twin("pressure/coarsen", &[], coarsen),
    twin("pressure/smooth_first", &[], |state, io, table| {
        smooth(state, io, table, &SMOOTHED_FIRST, About::Nothing)
    }),
    twin("pressure/smooth", &[], |state, io, table| {
        // The last sweep of a cycle leaves the sums; a cycle has any number of them.
        if state.is_turn(io)? && state.is_early() {
            state.note_sum(io, ["pressure_residual", "pressure_correction"])?;
        }
        smooth(state, io, table, &SMOOTHED, About::Corrections)
    }),
    twin("pressure/smooth_corrected", &[], |state, io, table| {
        smooth(state, io, table, &SMOOTHED_CORRECTED, About::WithAbove)
    }),
    twin("pressure/restrict", &[], restrict),
    twin("pressure/solve_coarse", &[], solve_coarse),
];

/// The levels as the pass left them.
struct Cycle {
    phase: PressurePhase,
    levels: Levels,
    rounding: Rounding,
}

impl Cycle {
    /// What the pass runs on, as often on each level as other passes are compared; `None` where it is not its turn.
    fn of(state: &mut FlipState, io: &Io<'_>) -> Result<Option<Self>, SolveError> {
        let phase = io.uniform::<PressurePhase>("phase")?;
        let is_turn = io.pass() == "pressure/coarsen" || state.is_turn(io)?;
        if !(is_turn && state.is_due(io, phase.level)) {
            return Ok(None);
        }
        let level = |&[first, count, ..]: &[u32; 4]| first..first + count;
        let all = &phase.levels[..=phase.last_level as usize];
        let levels: Vec<Range<u32>> = all.iter().map(level).collect();
        let slots = levels[phase.last_level as usize].end as usize;
        let (cells, stride) = (slots * CELLS as usize, phase.stride as usize);
        let planes = io.after::<f32>("pressure_coefficient", 2 * stride + cells)?;
        let bricks = io.after::<PressureBrick>("pressure_bricks", slots)?;
        let brick = |brick: &PressureBrick| Brick {
            faces: brick.faces,
            above: brick.above,
        };
        Ok(Some(Self {
            phase,
            levels: Levels {
                levels,
                bricks: bricks.iter().map(brick).collect(),
                coefficient: [0, 1, 2].map(|axis| planes[axis * stride..][..cells].to_vec()),
                dirichlet: state.reals(io, "pressure_dirichlet", cells)?,
                residual: state.reals(io, "pressure_residual", cells)?,
                correction: state.reals(io, "pressure_correction", cells)?,
            },
            rounding: Rounding {
                unit: state.unit(),
                block: OF_BLOCK.of,
                restricted: OF_RESTRICTION.of,
            },
        }))
    }

    fn level(&self) -> usize {
        self.phase.level as usize
    }

    /// Blocks of the phase's colour with their slots.
    fn blocks(&self) -> Vec<(u32, u32)> {
        self.levels.coloured(self.level(), self.phase.colour)
    }
}

fn smooth(
    state: &mut FlipState,
    io: &Io<'_>,
    table: &mut Table,
    entry: &'static Entry<1>,
    about: About,
) -> Result<(), SolveError> {
    let Some(cycle) = Cycle::of(state, io)? else {
        return Ok(());
    };
    let (levels, blocks) = (&cycle.levels, cycle.blocks());
    let solved = each(0..blocks.len(), |k| {
        let solved = levels.solved(cycle.level(), blocks[k], about, cycle.rounding, [0.0; 8]);
        let pairs = solved.map(|cells| {
            cells.map(|cell| {
                let found = levels.correction[cell.place];
                Some(pair(cell.place, found, cell.value, [cell.error]))
            })
        });
        pairs.unwrap_or([None; 8])
    });
    table.add(entry, solved.into_iter().flatten());
    Ok(())
}

fn restrict(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    let Some(cycle) = Cycle::of(state, io)? else {
        return Ok(());
    };
    let blocks = cycle.blocks().into_iter();
    let above = |block| (cycle.levels).restricted(cycle.level(), block, cycle.rounding);
    let pairs = blocks.flat_map(above).map(|cell| {
        let found = cycle.levels.residual[cell.place];
        pair(cell.place, found, cell.value, [cell.error])
    });
    table.add(&RESTRICTED, pairs);
    Ok(())
}

/// All corrections that the pass leaves, and the residuals that it hands down.
fn solve_coarse(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    let Some(cycle) = Cycle::of(state, io)? else {
        return Ok(());
    };
    let levels = &cycle.levels;
    let Range { start, end } = levels.levels[cycle.level()];
    let [corrections, residuals] =
        [start, end].map(|slot| (CELLS * slot) as usize..levels.correction.len());
    let Some([values, errors]) = levels.solve_coarse(cycle.level(), cycle.rounding) else {
        table.leave_out(&COARSE_SOLVED, corrections.len());
        table.leave_out(&COARSE_RESIDUAL, residuals.len());
        return Ok(());
    };
    table.each(&COARSE_SOLVED, corrections, |at| {
        let found = levels.correction[at];
        pair(at, found, values.correction[at], [errors.correction[at]])
    });
    table.each(&COARSE_RESIDUAL, residuals, |at| {
        let found = levels.residual[at];
        pair(at, found, values.residual[at], [errors.residual[at]])
    });
    Ok(())
}

fn coarsen(state: &mut FlipState, io: &Io<'_>, table: &mut Table) -> Result<(), SolveError> {
    let Some(cycle) = Cycle::of(state, io)? else {
        return Ok(());
    };
    let (levels, unit) = (&cycle.levels, state.unit());
    let kinds = io.after::<u32>("pressure_block", levels.bricks.len() * 64)?;
    let (mut shared, mut airs) = (Vec::new(), Vec::new());
    let mut full = vec![[true; 2]; kinds.len()];
    let mut is_child = vec![false; kinds.len()];
    for slot in levels.levels[cycle.level() - 1].clone() {
        for block in 0..64 {
            let at = (levels.bricks[slot as usize].above + above_offset(block)) as usize;
            for axis in 0..3 {
                let lower = (0..8).filter(|c| c >> axis & 1 == 0);
                let fine = &levels.coefficient[axis];
                let faces = lower.map(|c| f64::from(fine[place(slot, block, c)]));
                let exact = 0.25 * faces.sum::<f64>();
                shared.push(pair(at, fine[at], exact, [exact]));
            }
            let air = (0..8).map(|c| levels.dirichlet[place(slot, block, c)]);
            let exact = 0.5 * air.map(|air| air.min(MOST_AIR)).sum::<f64>();
            airs.push(pair(at, levels.dirichlet[at], exact, [unit, exact]));
            let kind = kinds[(64 * slot + block) as usize] & 3;
            let coarse = at / 512 * 64 + at % 64;
            full[coarse] = [full[coarse][0] && kind == 1, full[coarse][1] && kind == 0];
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
    table.add(&COARSE_COEFFICIENT, shared);
    table.add(&COARSE_AIR, airs);
    table.add_exact(&COARSE_KIND, &found, &expected);
    Ok(())
}
