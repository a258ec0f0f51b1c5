//! Reference passes of the multigrid: the exact solution of each block of 2³ cells from the values
//! around it.
//!
//! Cells are named by their indices in the device's arrays: a brick has 8³ cells in 64 blocks; cell
//! `c` of a block is at `512 slot + 64 c + block`.

use std::ops::Range;

use swell_domain::bricks::CELLS;

/// Smallest pivot of a block, relative to its diagonal, that is more than the rounding error of a
/// closed pair; twice the shader's bound.
const LEAST_PIVOT: f64 = 2e-5;

/// Limit for a cell's air coefficient in the coarser level, as in pressure/coarsen.
pub const MOST_AIR: f64 = 4.0;

/// Symmetric sweeps on the last level, as in pressure/solve_coarse.
const SWEEPS: usize = 8;

/// Neighbours of a brick.
#[derive(Clone, Copy, Debug)]
pub struct Brick {
    /// Slots at the lower faces, then at the upper ones.
    pub faces: [u32; 6],
    /// Element on the next level that contains block 0.
    pub above: u32,
}

/// Rows of all levels.
#[derive(Clone, Debug)]
pub struct Levels {
    /// Slots of each level.
    pub levels: Vec<Range<u32>>,
    /// One brick per slot.
    pub bricks: Vec<Brick>,
    /// Coefficients of the lower faces.
    pub coefficient: [Vec<f32>; 3],
    /// Air's contribution to the diagonal.
    pub dirichlet: Vec<f64>,
    /// Right-hand sides.
    pub residual: Vec<f64>,
    /// Solutions.
    pub correction: Vec<f64>,
    /// What the first smoothing left on levels whose bricks are smoothed one by one.
    pub smoothed: Vec<f64>,
}

/// Rounding model of the device.
#[derive(Clone, Copy)]
pub struct Rounding {
    /// Unit roundoff of the levels' precision.
    pub unit: f64,
    /// Error bound of a block's right-hand side, from the unit, |A| |z| and the sum of its own
    /// magnitudes.
    pub block: fn([f64; 3]) -> f64,
    /// Error bound of a restricted residual, from the unit and the sum of magnitudes.
    pub restricted: fn([f64; 2]) -> f64,
}

/// Values around a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Surroundings {
    /// Zero.
    Nothing,
    /// The latest corrections.
    Corrections,
    /// The latest corrections plus the coarser level's.
    WithAbove,
    /// What the first smoothing left.
    Smoothed,
    /// The same in the block's own brick; zero in others.
    SmoothedWithin,
    /// The same in other bricks; zero in the block's own.
    SmoothedBeyond,
    /// What the first smoothing left plus the coarser level's corrections.
    SmoothedWithAbove,
    /// The latest corrections in the block's own brick; in others what the first smoothing left
    /// plus the coarser level's corrections.
    Prolonged,
}

/// How the brick beside a block enters.
enum Beside<'a> {
    Nothing,
    Values(&'a [f64]),
    WithAbove(&'a [f64]),
}

/// Expected value at an index, with an error bound.
#[derive(Clone, Copy, Debug)]
pub struct ExpectedValue {
    /// Index of the value.
    pub place: usize,
    /// Value in f64.
    pub value: f64,
    /// Bound on the device's rounding error.
    pub error: f64,
}

/// A block's eight rows: its matrix, the right-hand side, and the sum of magnitudes of that.
struct Block {
    matrix: [[f64; 8]; 8],
    rhs: [f64; 8],
    size: [f64; 8],
    /// Inflow from outside the block.
    inflow: [f64; 8],
}

/// Returns the index of cell `c` of a block.
pub fn block_index(slot: u32, block: u32, c: usize) -> usize {
    (CELLS * slot + block) as usize + 64 * c
}

/// Returns the colour of a block.
fn colour(block: u32) -> u32 {
    ((block & 1) + (block >> 2 & 1) + (block >> 4 & 1)) % 2
}

/// Returns the offset of the cell above a block from the cell above block 0.
pub fn above_offset(block: u32) -> u32 {
    let at = [block & 3, block >> 2 & 3, block >> 4];
    let half = at.map(|a| a >> 1);
    let bit = at.map(|a| a & 1);
    half[0] + 4 * half[1] + 16 * half[2] + 64 * bit[0] + 128 * bit[1] + 256 * bit[2]
}

impl Levels {
    /// Returns the blocks of one colour of a level, with their slots.
    pub fn coloured(&self, level: usize, colour: u32) -> Vec<(u32, u32)> {
        let blocks = self.blocks(level).into_iter();
        blocks.filter(|at| self::colour(at.1) == colour).collect()
    }

    /// Returns the blocks of a level, with their slots.
    fn blocks(&self, level: usize) -> Vec<(u32, u32)> {
        (self.levels[level].clone())
            .flat_map(|slot| (0..64).map(move |block| (slot, block)))
            .collect()
    }

    /// Reference pass of `pressure/smooth_first` and of the smoothing of `pressure/restrict`,
    /// `pressure/prolong` and `pressure/advance`: the corrections of a block of a level; `None` if
    /// rounding decides whether it has a solution. `rhs_error` bounds the error of the right-hand
    /// side itself.
    pub fn solved(
        &self,
        level: usize,
        (slot, block): (u32, u32),
        about: Surroundings,
        rounding: Rounding,
        rhs_error: [f64; 8],
    ) -> Option<[ExpectedValue; 8]> {
        let solution = (self.block(level, slot, block, about)).solution(rounding, rhs_error)?;
        Some(std::array::from_fn(|c| ExpectedValue {
            place: block_index(slot, block, c),
            value: solution[c][0],
            error: solution[c][1],
        }))
    }

    /// Reference pass of `pressure/restrict`: the residuals of a level, from the first smoothing of
    /// the finer one. Each is half of what a block left: the first colour was solved with zero
    /// around it, the second with the values of its own brick.
    pub fn restricted(&self, level: usize, rounding: Rounding) -> Vec<ExpectedValue> {
        let of = |(slot, block): (u32, u32)| {
            let about = match colour(block) {
                0 => Surroundings::Smoothed,
                _ => Surroundings::SmoothedBeyond,
            };
            let found = self.block(level - 1, slot, block, about);
            let above = self.bricks[slot as usize].above;
            ExpectedValue {
                place: (above + above_offset(block)) as usize,
                value: 0.5 * found.inflow.iter().sum::<f64>(),
                error: (rounding.restricted)([
                    rounding.unit,
                    self.inflow_size(&found, slot, block),
                ]),
            }
        };
        self.blocks(level - 1).into_iter().map(of).collect()
    }

    /// Returns the sum of magnitudes of a block's inflow.
    fn inflow_size(&self, found: &Block, slot: u32, block: u32) -> f64 {
        let own = |c: usize| self.residual[block_index(slot, block, c)].abs();
        (0..8).map(|c| found.size[c] - own(c)).sum()
    }

    /// Residuals above a block of the first colour and above its neighbour along x, within
    /// `pressure/solve_coarse`. The former gets half of the inflow since it was solved, the latter,
    /// which was solved last, 0.
    fn restricted_pair(
        &self,
        level: usize,
        (slot, block): (u32, u32),
        rounding: Rounding,
    ) -> [ExpectedValue; 2] {
        let found = self.block(level, slot, block, Surroundings::Corrections);
        let above = self.bricks[slot as usize].above;
        let at = |block: u32| (above + above_offset(block)) as usize;
        let sum: f64 = found.inflow.iter().sum();
        let size = self.inflow_size(&found, slot, block);
        [
            ExpectedValue {
                place: at(block),
                value: 0.5 * sum,
                error: (rounding.restricted)([rounding.unit, size]),
            },
            ExpectedValue {
                place: at(block ^ 1),
                value: 0.0,
                error: 0.0,
            },
        ]
    }

    /// Reference pass of `pressure/solve_coarse`: the residuals on level `first` from the finer
    /// level, down to the last level, symmetric sweeps there, and back up. Returns the corrections
    /// and residuals of the levels, and their error bounds; `None` if rounding decides whether a
    /// block has a solution.
    pub fn solve_coarse(&self, first: usize, rounding: Rounding) -> Option<[Self; 2]> {
        let mut values = self.clone();
        let own = (CELLS * self.levels[first].end) as usize;
        values.residual[own..].fill(0.0);
        values.correction.fill(0.0);
        let mut errors = values.clone();
        errors.residual.fill(0.0);
        if first > 0 {
            for passed in self.restricted(first, rounding) {
                values.residual[passed.place] = passed.value;
                errors.residual[passed.place] = passed.error;
            }
        }
        let mut cycle = Cycle {
            values,
            errors,
            rounding,
        };
        cycle.run(first)?;
        Some([cycle.values, cycle.errors])
    }

    /// Returns whether the level has no brick beyond the lower face along `axis` of the cell at an
    /// index.
    pub fn is_closed_end(&self, at: usize, axis: usize) -> bool {
        let (slot, c, block) = (at / 512, at % 512 / 64, at % 64);
        let is_first = block >> (2 * axis) & 3 == 0 && c >> axis & 1 == 0;
        is_first && self.bricks[slot].faces[axis] == 0
    }

    /// Returns the block beyond the face of a block; in slot 0 if there is none.
    fn beside(&self, level: usize, slot: u32, block: u32, axis: usize, is_up: bool) -> (u32, u32) {
        let step = 4u32.pow(axis as u32);
        let at = block / step % 4;
        match (is_up, at) {
            (false, 1..) => (slot, block - step),
            (true, ..3) => (slot, block + step),
            _ => {
                let far = self.bricks[slot as usize].faces[axis + 3 * usize::from(is_up)];
                let far = if self.levels[level].contains(&far) {
                    far
                } else {
                    0
                };
                let across = if is_up {
                    block - 3 * step
                } else {
                    block + 3 * step
                };
                (far, across)
            }
        }
    }

    /// Returns the values beside a block, in its own brick or in another.
    fn around(&self, about: Surroundings, is_own: bool) -> Beside<'_> {
        match (about, is_own) {
            (Surroundings::Nothing, _)
            | (Surroundings::SmoothedWithin, false)
            | (Surroundings::SmoothedBeyond, true) => Beside::Nothing,
            (Surroundings::Corrections, _) | (Surroundings::Prolonged, true) => {
                Beside::Values(&self.correction)
            }
            (Surroundings::WithAbove, _) => Beside::WithAbove(&self.correction),
            (Surroundings::Smoothed, _)
            | (Surroundings::SmoothedWithin, true)
            | (Surroundings::SmoothedBeyond, false) => Beside::Values(&self.smoothed),
            (Surroundings::SmoothedWithAbove, _) | (Surroundings::Prolonged, false) => {
                Beside::WithAbove(&self.smoothed)
            }
        }
    }

    fn block(&self, level: usize, slot: u32, block: u32, about: Surroundings) -> Block {
        let mut found = Block {
            matrix: [[0.0; 8]; 8],
            rhs: [0.0; 8],
            size: [0.0; 8],
            inflow: [0.0; 8],
        };
        for c in 0..8 {
            let own = block_index(slot, block, c);
            found.matrix[c][c] += self.dirichlet[own];
            found.rhs[c] = self.residual[own];
            found.size[c] = found.rhs[c].abs();
            for k in 0..6 {
                let (axis, is_up) = (k / 2, k % 2 == 1);
                let other_c = c ^ 1 << axis;
                let is_inner = (c >> axis & 1 == 1) != is_up;
                let (there, other_block) = match is_inner {
                    true => (slot, block),
                    false => self.beside(level, slot, block, axis, is_up),
                };
                let other = block_index(there, other_block, other_c);
                let owner = if is_up { other } else { own };
                let shared = f64::from(self.coefficient[axis][owner]);
                found.matrix[c][c] += shared;
                if is_inner {
                    found.matrix[c][other_c] -= shared;
                } else {
                    let (values, has_above) = match self.around(about, there == slot) {
                        Beside::Nothing => continue,
                        Beside::Values(values) => (values, false),
                        Beside::WithAbove(values) => (values, true),
                    };
                    let mut value = values[other];
                    let mut size = value.abs();
                    if has_above {
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
    /// Solves the block's matrix for several right-hand sides; `None` if rounding decides whether
    /// it has a solution.
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

    /// Returns the solution and its error bound: elimination solves a matrix and a right-hand side
    /// perturbed by a few roundings (Higham 2002, theorem 9.3; its factors have no larger entries
    /// than the M-matrix itself), and the inverse has no negative entry. `rhs_error` bounds the
    /// error of the right-hand side itself.
    fn solution(&self, rounding: Rounding, rhs_error: [f64; 8]) -> Option<[[f64; 2]; 8]> {
        let exact = self.solve(self.rhs.map(|b| [b]))?;
        let off = std::array::from_fn(|c| {
            let terms = self.matrix[c].iter().zip(&exact);
            let row: f64 = terms.map(|(a, [z])| (a * z).abs()).sum();
            [rhs_error[c] + (rounding.block)([rounding.unit, row, self.size[c]])]
        });
        let off = self.solve(off)?;
        Some(std::array::from_fn(|c| [exact[c][0], off[c][0]]))
    }
}

/// The levels' values and their error bounds. A block's inputs enter with non-negative coefficients
/// and its inverse has no negative entry, so bounds take the same steps as values, and each step
/// adds its own rounding.
struct Cycle {
    values: Levels,
    errors: Levels,
    rounding: Rounding,
}

impl Cycle {
    fn smooth(&mut self, level: usize, colour: u32, about: Surroundings) -> Option<()> {
        for (slot, block) in self.values.coloured(level, colour) {
            let rhs_error = self.errors.block(level, slot, block, about).rhs;
            let at = (slot, block);
            let solved = (self.values).solved(level, at, about, self.rounding, rhs_error)?;
            for ExpectedValue {
                place,
                value,
                error,
            } in solved
            {
                self.values.correction[place] = value;
                self.errors.correction[place] = error;
            }
        }
        Some(())
    }

    fn restrict(&mut self, level: usize) {
        for at in self.values.coloured(level, 0) {
            let found = self.values.restricted_pair(level, at, self.rounding);
            let carried = self.errors.restricted_pair(level, at, self.rounding);
            for (found, carried) in found.into_iter().zip(carried) {
                self.values.residual[found.place] = found.value;
                self.errors.residual[found.place] = carried.value + found.error;
            }
        }
    }

    fn run(&mut self, first: usize) -> Option<()> {
        let last = self.values.levels.len() - 1;
        for level in first..last {
            self.smooth(level, 0, Surroundings::Nothing)?;
            self.smooth(level, 1, Surroundings::Corrections)?;
            self.restrict(level);
        }
        self.smooth(last, 0, Surroundings::Nothing)?;
        for _ in 0..SWEEPS {
            self.smooth(last, 1, Surroundings::Corrections)?;
            self.smooth(last, 0, Surroundings::Corrections)?;
        }
        for level in (first..last).rev() {
            self.smooth(level, 1, Surroundings::WithAbove)?;
            self.smooth(level, 0, Surroundings::Corrections)?;
        }
        Some(())
    }
}
