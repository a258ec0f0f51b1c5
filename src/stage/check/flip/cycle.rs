//! The multigrid's passes: each block's exact solution in f64 from the values that the device had about it.

mod coarse;

use rayon::prelude::*;

use super::{Checker, fields::*, pair_of};
use crate::{
    compare::{check::Field, rounding::U},
    domain::bricks::CELLS,
    solve::{
        SolveError,
        pressure::{PressureBrick, PressurePhase},
        trace::Traced,
    },
};

/// Least pivot of a block, as a part of its diagonal, that is not a closed pair's rounding; twice the shader's.
const LEAST_PIVOT: f64 = 2e-5;

/// As in pressure/coarsen.
const MOST_AIR: f64 = 4.0;

/// Rows of all levels as the device has them; a cell is named by its place in the arrays.
#[derive(Clone)]
struct Levels {
    phase: PressurePhase,
    bricks: Vec<PressureBrick>,
    /// Of the lower faces.
    coefficient: [Vec<f32>; 3],
    dirichlet: Vec<f64>,
    residual: Vec<f64>,
    correction: Vec<f64>,
    /// Unit roundoff of what they are computed in.
    unit: f64,
}

/// What a block sees about it.
#[derive(Clone, Copy, PartialEq)]
enum About {
    Nothing,
    /// The latest corrections.
    Corrections,
    /// The same with what the coarser level adds to them.
    WithAbove,
}

/// A block's eight rows: its own matrix, what stands on the right, and of that the sum of magnitudes.
struct Block {
    matrix: [[f64; 8]; 8],
    rhs: [f64; 8],
    size: [f64; 8],
    /// What flows in from beyond the block.
    inflow: [f64; 8],
}

/// Place of cell `c` of a block.
fn place(slot: u32, block: u32, c: usize) -> usize {
    (CELLS * slot + block) as usize + 64 * c
}

fn above_offset(block: u32) -> u32 {
    let at = [block & 3, block >> 2 & 3, block >> 4];
    let half = at.map(|a| a >> 1);
    let bit = at.map(|a| a & 1);
    half[0] + 4 * half[1] + 16 * half[2] + 64 * bit[0] + 128 * bit[1] + 256 * bit[2]
}

impl Levels {
    /// First slot and past the last of the level that the phase is at.
    fn slots(&self) -> std::ops::Range<u32> {
        let [first, count, ..] = self.phase.levels[self.phase.level as usize];
        first..first + count
    }

    /// Blocks of the phase's colour with their slots.
    fn coloured(&self) -> Vec<(u32, u32)> {
        let colour = self.phase.colour;
        let is_of =
            move |block: &u32| ((block & 1) + (block >> 2 & 1) + (block >> 4 & 1)) % 2 == colour;
        self.slots()
            .flat_map(|slot| (0..64).filter(is_of).map(move |block| (slot, block)))
            .collect()
    }

    /// Of the cells above a block of the first colour and above its neighbour along x: half of what has flowed into the
    /// former since it was solved, and how much that may be off by; nothing from the latter, which was solved last.
    fn restricted(&self, slot: u32, block: u32) -> [(usize, f64, f64); 2] {
        let found = self.block(slot, block, About::Corrections);
        let above = self.bricks[slot as usize].above;
        let at = |block: u32| (above + above_offset(block)) as usize;
        let sum: f64 = found.inflow.iter().sum();
        // Residuals apart, that is what its size is made of.
        let size: f64 = (0..8)
            .map(|c| found.size[c] - self.residual[place(slot, block, c)].abs())
            .sum();
        [
            (at(block), 0.5 * sum, 4.0 * self.unit * size),
            (at(block ^ 1), 0.0, 0.0),
        ]
    }

    /// The block beyond the face of a block; in slot 0 where there is none.
    fn beside(&self, slot: u32, block: u32, axis: usize, is_up: bool) -> (u32, u32) {
        let step = 4u32.pow(axis as u32);
        let at = block / step % 4;
        match (is_up, at) {
            (false, 1..) => (slot, block - step),
            (true, ..3) => (slot, block + step),
            _ => {
                let far = self.bricks[slot as usize].faces[axis + 3 * usize::from(is_up)];
                let far = if self.slots().contains(&far) { far } else { 0 };
                let across = if is_up {
                    block - 3 * step
                } else {
                    block + 3 * step
                };
                (far, across)
            }
        }
    }

    fn block(&self, slot: u32, block: u32, about: About) -> Block {
        let mut found = Block {
            matrix: [[0.0; 8]; 8],
            rhs: [0.0; 8],
            size: [0.0; 8],
            inflow: [0.0; 8],
        };
        for c in 0..8 {
            let own = place(slot, block, c);
            found.matrix[c][c] += self.dirichlet[own];
            found.rhs[c] = self.residual[own];
            found.size[c] = found.rhs[c].abs();
            for k in 0..6 {
                let (axis, is_up) = (k / 2, k % 2 == 1);
                let other_c = c ^ 1 << axis;
                let is_inner = (c >> axis & 1 == 1) != is_up;
                let (there, other_block) = match is_inner {
                    true => (slot, block),
                    false => self.beside(slot, block, axis, is_up),
                };
                let other = place(there, other_block, other_c);
                let owner = if is_up { other } else { own };
                let shared = f64::from(self.coefficient[axis][owner]);
                found.matrix[c][c] += shared;
                if is_inner {
                    found.matrix[c][other_c] -= shared;
                } else if about != About::Nothing {
                    let mut value = self.correction[other];
                    let mut size = value.abs();
                    if about == About::WithAbove {
                        let brick = self.bricks[there as usize].above;
                        let more = self.correction[(brick + above_offset(other_block)) as usize];
                        value += more;
                        size += more.abs();
                    }
                    found.inflow[c] += shared * value;
                    found.size[c] += shared * size;
                }
            }
            found.rhs[c] += found.inflow[c];
        }
        found
    }
}

impl Block {
    /// Solutions of its matrix; `None` where rounding decides whether it has one.
    fn solve<const N: usize>(&self, mut rhs: [[f64; N]; 8]) -> Option<[[f64; N]; 8]> {
        let mut a = self.matrix;
        let is_row = |k: usize| self.matrix[k][k] != 0.0;
        for k in (0..8).filter(|&k| is_row(k)) {
            if a[k][k] < LEAST_PIVOT * self.matrix[k][k] {
                return None;
            }
            let (pivots, known) = (a[k], rhs[k]);
            for (row, rhs) in a.iter_mut().zip(&mut rhs).skip(k + 1) {
                let factor = row[k] / pivots[k];
                for (value, pivot) in row.iter_mut().zip(&pivots).skip(k) {
                    *value -= factor * pivot;
                }
                for (value, known) in rhs.iter_mut().zip(&known) {
                    *value -= factor * known;
                }
            }
        }
        for k in (0..8).rev() {
            rhs[k] = std::array::from_fn(|n| {
                let known: f64 = (k + 1..8).map(|j| a[k][j] * rhs[j][n]).sum();
                match is_row(k) {
                    true => (rhs[k][n] - known) / a[k][k],
                    false => 0.0,
                }
            });
        }
        Some(rhs)
    }

    /// The solution and what may be off by `unit`, the roundoff: elimination solves a matrix and a right-hand side that are 40 u off
    /// (Higham 2002, theorem 9.3; its factors have no greater entries than an M-matrix itself), and the inverse has no
    /// negative entry. The right-hand side itself is `rhs_error` off.
    fn solution(&self, unit: f64, rhs_error: [f64; 8]) -> Option<[[f64; 2]; 8]> {
        let exact = self.solve(self.rhs.map(|b| [b]))?;
        let off = std::array::from_fn(|c| {
            let terms = self.matrix[c].iter().zip(&exact);
            let row: f64 = terms.map(|(a, [z])| (a * z).abs()).sum();
            [rhs_error[c] + 40.0 * unit * (row + self.size[c])]
        });
        let off = self.solve(off)?;
        Some(std::array::from_fn(|c| [exact[c][0], off[c][0]]))
    }
}

impl Checker<'_> {
    /// Compares a pass of the multigrid, on each level as often as other passes.
    pub(super) fn cycle(&mut self, traced: Traced<'_>) -> Result<(), SolveError> {
        let field = match traced.pass {
            "pressure/smooth_first" => &SMOOTHED_FIRST,
            "pressure/smooth" => &SMOOTHED,
            "pressure/smooth_corrected" => &SMOOTHED_CORRECTED,
            "pressure/restrict" => &RESTRICTED,
            "pressure/coarsen" => &COARSE_AIR,
            "pressure/solve_coarse" => &COARSE_SOLVED,
            _ => return Ok(()),
        };
        let phase = traced.uniform::<PressurePhase>("phase")?;
        if !self.iteration.is_due((traced.pass, phase.level)) {
            return Ok(());
        }
        let levels = self.read_levels(traced, phase)?;
        match traced.pass {
            "pressure/restrict" => self.restrict(&levels),
            "pressure/coarsen" => self.coarsen(traced, &levels)?,
            "pressure/solve_coarse" => self.solve_coarse(&levels),
            _ => self.smooth(&levels, field),
        }
        Ok(())
    }

    fn read_levels(&self, traced: Traced<'_>, phase: PressurePhase) -> Result<Levels, SolveError> {
        let [first, count, ..] = phase.levels[phase.last_level as usize];
        let slots = (first + count) as usize;
        let (cells, stride) = (slots * CELLS as usize, phase.stride as usize);
        let planes = traced.read::<f32>("pressure_coefficient", 2 * stride + cells)?;
        Ok(Levels {
            phase,
            bricks: traced.read("pressure_bricks", slots)?,
            coefficient: [0, 1, 2].map(|axis| planes[axis * stride..][..cells].to_vec()),
            dirichlet: self.reals(traced, "pressure_dirichlet", cells)?,
            residual: self.reals(traced, "pressure_residual", cells)?,
            correction: self.reals(traced, "pressure_correction", cells)?,
            unit: self.unit(),
        })
    }

    fn smooth(&mut self, levels: &Levels, field: &'static Field) {
        let about = match field.pass {
            "pressure/smooth_first" => About::Nothing,
            "pressure/smooth_corrected" => About::WithAbove,
            _ => About::Corrections,
        };
        let blocks = levels.coloured();
        let one = |&(slot, block): &(u32, u32)| {
            let found = levels.block(slot, block, about);
            let solution = found.solution(levels.unit, [0.0; 8])?;
            Some([0, 1, 2, 3, 4, 5, 6, 7].map(|c| {
                let at = place(slot, block, c);
                let [exact, off] = solution[c];
                pair_of(at, levels.correction[at], exact, off)
            }))
        };
        let found: Vec<_> = blocks.par_iter().map(one).collect();
        let pairs: Vec<_> = found.iter().flatten().flatten().copied().collect();
        self.table.add(field, &pairs, 8 * found.len() - pairs.len());
    }

    fn restrict(&mut self, levels: &Levels) {
        let blocks = levels.coloured();
        let found = blocks
            .iter()
            .flat_map(|&(slot, block)| levels.restricted(slot, block));
        let pairs: Vec<_> = found
            .map(|(at, exact, tolerance)| pair_of(at, levels.residual[at], exact, tolerance))
            .collect();
        self.table.add(&RESTRICTED, &pairs, 0);
    }

    fn coarsen(&mut self, traced: Traced<'_>, levels: &Levels) -> Result<(), SolveError> {
        let kinds = traced.read::<u32>("pressure_block", levels.bricks.len() * 64)?;
        let fine = levels.phase.levels[levels.phase.level as usize - 1];
        let (mut shared, mut airs) = (Vec::new(), Vec::new());
        let (mut found, mut expected) = (Vec::new(), Vec::new());
        let mut full = vec![[true; 2]; kinds.len()];
        let mut is_child = vec![false; kinds.len()];
        for slot in fine[0]..fine[0] + fine[1] {
            for block in 0..64 {
                let at = (levels.bricks[slot as usize].above + above_offset(block)) as usize;
                let faces = |axis: usize| {
                    let lower = (0..8).filter(move |c| c >> axis & 1 == 0);
                    lower.map(move |c| f64::from(levels.coefficient[axis][place(slot, block, c)]))
                };
                for axis in 0..3 {
                    let exact = 0.25 * faces(axis).sum::<f64>();
                    let value = f64::from(levels.coefficient[axis][at]);
                    shared.push(pair_of(at, value, exact, 3.0 * U * exact));
                }
                let air = (0..8).map(|c| levels.dirichlet[place(slot, block, c)]);
                let exact = 0.5 * air.map(|air| air.min(MOST_AIR)).sum::<f64>();
                let value = levels.dirichlet[at];
                airs.push(pair_of(at, value, exact, 8.0 * levels.unit * exact));
                let kind = kinds[(64 * slot + block) as usize] & 3;
                let coarse = at / 512 * 64 + at % 64;
                full[coarse] = [full[coarse][0] && kind == 1, full[coarse][1] && kind == 0];
                is_child[coarse] = true;
            }
        }
        for k in (0..kinds.len()).filter(|&k| is_child[k]) {
            found.push(kinds[k]);
            expected.push(match full[k] {
                [_, true] => 0,
                [true, _] => 1,
                _ => 2,
            });
        }
        self.table.add(&COARSE_COEFFICIENT, &shared, 0);
        self.table.add(&COARSE_AIR, &airs, 0);
        self.table.add_exact(&COARSE_KIND, &found, &expected);
        Ok(())
    }
}
