//! Places sorted by cell.

use std::ops::Range;

use glam::DVec3;
use rayon::prelude::*;

/// Cells within the reach of neighbours, where they are half as long as that: fewer places are looked at than in 3³ cells as long as it.
pub(super) const HALVES: usize = 2;
/// Places by cell, for neighbours within a cell's edge.
pub(super) struct Grid {
    edge: f64,
    min: DVec3,
    cells: [usize; 3],
    starts: Vec<u32>,
    pub(super) order: Vec<u32>,
}

impl Grid {
    pub(super) fn new(places: &[DVec3], edge: f64) -> Self {
        let min = places
            .par_iter()
            .copied()
            .reduce(|| DVec3::INFINITY, DVec3::min);
        let max = places
            .par_iter()
            .copied()
            .reduce(|| DVec3::NEG_INFINITY, DVec3::max);
        let span = ((max - min) / edge).floor().max(DVec3::ZERO);
        let cells = match places.is_empty() {
            true => [1; 3],
            false => span.to_array().map(|n| n as usize + 1),
        };
        let mut grid = Self {
            edge,
            min,
            cells,
            starts: vec![0; cells.iter().product::<usize>() + 1],
            order: vec![0; places.len()],
        };
        let cells: Vec<usize> = (places.par_iter())
            .map(|&p| grid.index(grid.cell(p)))
            .collect();
        for cell in &cells {
            grid.starts[cell + 1] += 1;
        }
        for cell in 1..grid.starts.len() {
            grid.starts[cell] += grid.starts[cell - 1];
        }
        let mut next = grid.starts.clone();
        for (k, &cell) in cells.iter().enumerate() {
            let at = &mut next[cell];
            grid.order[*at as usize] = k as u32;
            *at += 1;
        }
        grid
    }

    /// Of a cell, metres: how far neighbours are found.
    pub(super) fn edge(&self) -> f64 {
        self.edge
    }

    fn cell(&self, p: DVec3) -> [usize; 3] {
        let at = ((p - self.min) / self.edge).to_array();
        [0, 1, 2].map(|axis| (at[axis].max(0.0) as usize).min(self.cells[axis] - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.cells[1] + y) * self.cells[0] + x
    }

    /// Visits those of the 3³ cells about a place, which may lie outside of all, in an order that depends on the places alone.
    pub(super) fn for_each_near(&self, p: DVec3, mut visit: impl FnMut(usize)) {
        self.for_each_run(p, 1, |run| {
            self.order[run].iter().for_each(|&k| visit(k as usize));
        });
    }

    /// Places in the grid's order.
    pub(super) fn sorted(&self, places: &[DVec3]) -> Vec<DVec3> {
        (self.order.par_iter())
            .map(|&k| places[k as usize])
            .collect()
    }

    /// Visits the rows of those of the cells about a place that are up to `reach` from its own, as ranges of the grid's order.
    pub(super) fn for_each_run(&self, p: DVec3, reach: usize, mut visit: impl FnMut(Range<usize>)) {
        let [x, y, z] = self.cell(p);
        let range = |c: usize, n: usize| c.saturating_sub(reach)..=(c + reach).min(n - 1);
        for cz in range(z, self.cells[2]) {
            for cy in range(y, self.cells[1]) {
                let xs = range(x, self.cells[0]);
                let row = self.index([0, cy, cz]);
                let first = self.starts[row + xs.start()] as usize;
                let last = self.starts[row + xs.end() + 1] as usize;
                visit(first..last);
            }
        }
    }
}
