//! Points sorted by grid cell.

use std::ops::Range;

use crate::parallel;
use glam::DVec3;
use rayon::prelude::*;

/// Cells per search radius. With cells half as long as the radius, a search visits fewer points
/// than with 3³ cells of the full radius.
pub(super) const HALVES: usize = 2;
/// Largest number of cells per point.
const SPARSEST: usize = 16;

/// Points sorted by cell.
pub(super) struct BinnedPoints {
    /// Requested edge length, and that of the cells themselves, metres.
    edge: f64,
    cell: f64,
    min: DVec3,
    cells: [usize; 3],
    starts: Vec<u32>,
    pub(super) order: Vec<u32>,
}

impl BinnedPoints {
    pub(super) fn new(places: &[DVec3], edge: f64) -> Self {
        let min = places
            .par_iter()
            .copied()
            .reduce(|| DVec3::INFINITY, DVec3::min);
        let max = places
            .par_iter()
            .copied()
            .reduce(|| DVec3::NEG_INFINITY, DVec3::max);
        // Without points, max − min is −∞, and there is one cell.
        let counts = |cell: f64| ((max - min) / cell).floor().max(DVec3::ZERO) + 1.0;
        // If points are far apart, most cells would be empty; larger cells find the
        // same neighbours.
        let most = (SPARSEST * (places.len() + 1)) as f64;
        let mut cell = edge;
        while counts(cell).element_product() > most {
            cell *= 2.0;
        }
        let cells = counts(cell).to_array().map(|n| n as usize);
        let mut grid = Self {
            edge,
            cell,
            min,
            cells,
            starts: vec![0; cells.iter().product::<usize>() + 1],
            order: vec![0; places.len()],
        };
        let cells: Vec<usize> = parallel::map_slice(places, |&p| grid.index(grid.cell(p)));
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

    /// Distance up to which [`Self::for_each_near`] finds neighbours, metres.
    pub(super) fn edge(&self) -> f64 {
        self.edge
    }

    fn cell(&self, p: DVec3) -> [usize; 3] {
        let at = ((p - self.min) / self.cell).to_array();
        [0, 1, 2].map(|axis| (at[axis].max(0.0) as usize).min(self.cells[axis] - 1))
    }

    fn index(&self, [x, y, z]: [usize; 3]) -> usize {
        (z * self.cells[1] + y) * self.cells[0] + x
    }

    /// Visits the points of the 3³ cells around `p`, which may lie outside of the grid, in an order
    /// that depends only on the points.
    pub(super) fn for_each_near(&self, p: DVec3, mut visit: impl FnMut(usize)) {
        self.for_each_run(p, 1, |run| {
            self.order[run].iter().for_each(|&k| visit(k as usize));
        });
    }

    /// Copies the points in the grid's order.
    pub(super) fn sorted(&self, places: &[DVec3]) -> Vec<DVec3> {
        parallel::map_slice(&self.order, |&k| places[k as usize])
    }

    /// Visits the rows of cells up to `reach` cells away from that of `p`, as ranges of the
    /// grid's order.
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Two clusters a million cells apart, and one by itself: all points within an edge length are
    /// found, with no more cells than the points warrant.
    #[test]
    fn drops_far_apart_take_few_cells() {
        let clump = |k: usize| DVec3::splat(if k < 50 { 0.0 } else { 1e6 });
        let place = |k: usize| clump(k) + 0.3 * DVec3::new((k % 5) as f64, (k / 5 % 5) as f64, 0.0);
        let scattered: Vec<DVec3> = (0..100).map(place).collect();
        // Points at the limit of f32, and no points.
        let farther: Vec<DVec3> = scattered.iter().map(|p| 1e31 * *p).collect();
        assert_eq!(BinnedPoints::new(&farther, 1.0).order.len(), farther.len());
        assert_eq!(BinnedPoints::new(&[], 1.0).cells, [1; 3]);
        for places in [&scattered[..], &scattered[..50]] {
            let grid = BinnedPoints::new(places, 1.0);
            assert!(grid.starts.len() <= SPARSEST * (places.len() + 1) + 1);
            assert_eq!(grid.edge(), 1.0);
            for &p in places {
                let mut met = vec![false; places.len()];
                grid.for_each_near(p, |k| met[k] = true);
                let near = (places.iter().zip(&met)).filter(|(q, _)| q.distance(p) <= 1.0);
                assert!(near.clone().count() > 20 && near.clone().all(|(_, met)| *met));
            }
        }
        // Negative control: one cluster by itself keeps the requested cell size.
        assert_eq!(BinnedPoints::new(&scattered[..50], 1.0).cell, 1.0);
        assert!(BinnedPoints::new(&scattered, 1.0).cell > 1.0);
    }
}
