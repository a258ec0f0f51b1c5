//! The twin of pressure/solve_coarse: the cycle's last levels in f64, one step after the other as the other multigrid
//! passes take them.

use super::{About, CELLS, COARSE_RESIDUAL, COARSE_SOLVED, Checker, Levels, pair_of, place};

/// As in pressure/solve_coarse.
const SWEEPS: usize = 8;

/// The levels' values, and by how much the device's may be off: what a block is given by others and its inverse have no
/// negative entry, so that bounds take the same steps as values, and each step adds its own rounding.
struct Twin {
    values: Levels,
    errors: Levels,
}

impl Twin {
    /// From the residuals that the device has on the phase's level.
    fn new(device: &Levels) -> Self {
        let mut values = device.clone();
        let own = (CELLS * device.slots().end) as usize;
        values.residual[own..].fill(0.0);
        values.correction.fill(0.0);
        let mut errors = values.clone();
        errors.residual.fill(0.0);
        Self { values, errors }
    }

    fn turn_to(&mut self, level: u32, colour: u32) {
        for levels in [&mut self.values, &mut self.errors] {
            (levels.phase.level, levels.phase.colour) = (level, colour);
        }
    }

    /// Solves the blocks of one colour; `None` where rounding decides whether one has a solution.
    fn smooth(&mut self, level: u32, colour: u32, about: About) -> Option<()> {
        self.turn_to(level, colour);
        for (slot, block) in self.values.coloured() {
            let rhs_error = self.errors.block(slot, block, about).rhs;
            let found = self.values.block(slot, block, about);
            let solution = found.solution(self.values.unit, rhs_error)?;
            for (c, [exact, off]) in solution.into_iter().enumerate() {
                let at = place(slot, block, c);
                self.values.correction[at] = exact;
                self.errors.correction[at] = off;
            }
        }
        Some(())
    }

    fn restrict(&mut self, level: u32) {
        self.turn_to(level, 0);
        for (slot, block) in self.values.coloured() {
            let found = self.values.restricted(slot, block);
            let carried = self.errors.restricted(slot, block);
            for ((at, exact, off), (_, error, _)) in found.into_iter().zip(carried) {
                self.values.residual[at] = exact;
                self.errors.residual[at] = error + off;
            }
        }
    }

    /// Down to the last level, symmetric sweeps there, and back up.
    fn run(&mut self) -> Option<()> {
        let (first, last) = (self.values.phase.level, self.values.phase.last_level);
        for level in first..last {
            self.smooth(level, 0, About::Nothing)?;
            self.smooth(level, 1, About::Corrections)?;
            self.restrict(level);
        }
        self.smooth(last, 0, About::Nothing)?;
        for _ in 0..SWEEPS {
            self.smooth(last, 1, About::Corrections)?;
            self.smooth(last, 0, About::Corrections)?;
        }
        for level in (first..last).rev() {
            self.smooth(level, 1, About::WithAbove)?;
            self.smooth(level, 0, About::Corrections)?;
        }
        Some(())
    }
}

impl Checker<'_> {
    /// Compares all corrections that the pass leaves, and the residuals that it hands down.
    pub(super) fn solve_coarse(&mut self, levels: &Levels) {
        let slots = levels.slots();
        let [corrections, residuals] =
            [slots.start, slots.end].map(|slot| (CELLS * slot) as usize..levels.correction.len());
        let mut twin = Twin::new(levels);
        if twin.run().is_none() {
            let ties = [corrections.len(), residuals.len()];
            self.table.add::<f64>(&COARSE_SOLVED, &[], ties[0]);
            self.table.add::<f64>(&COARSE_RESIDUAL, &[], ties[1]);
            return;
        }
        let Twin { values, errors } = twin;
        let solved: Vec<_> = corrections
            .map(|at| {
                let found = levels.correction[at];
                pair_of(at, found, values.correction[at], errors.correction[at])
            })
            .collect();
        let handed: Vec<_> = residuals
            .map(|at| {
                let found = levels.residual[at];
                pair_of(at, found, values.residual[at], errors.residual[at])
            })
            .collect();
        self.table.add(&COARSE_SOLVED, &solved, 0);
        self.table.add(&COARSE_RESIDUAL, &handed, 0);
    }
}
