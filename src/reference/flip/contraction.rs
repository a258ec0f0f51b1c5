//! Reference pass of flip/find_contraction.

use glam::DVec3;
use swell_domain::poisson::FLUID;

use super::{
    OpenSpace, Unprojected,
    grid::{along, per_cell},
};

/// Walls and solids cut a cell that they leave less of.
pub const WHOLE: f64 = 0.999;

/// Contraction in a substep up to which paths are straight; from twice as much they are not.
pub const MOST: f64 = 0.01;

impl Unprojected<'_> {
    /// Returns whether a cell is full of water that no wall or solid cuts.
    fn is_whole(&self, element: u32) -> bool {
        let e = element as usize;
        self.density[e] >= 0.5 && self.space.volume[e] >= WHOLE
    }

    /// Returns whether the water of a cell counts as contracting.
    pub fn strains(&self, element: u32) -> bool {
        self.space.kind[element as usize] == FLUID && self.is_whole(element)
    }

    /// Returns whether the face of a cell on one side along an axis is closed.
    fn is_shut(&self, element: u32, axis: usize, side: i32) -> bool {
        let face = self.bricks.near(element, along(axis, side.max(0)));
        self.space.open[face as usize][axis] == 0.0
    }

    /// Returns the slope of each component along its own axis in a cell, m/s per cell, and bounds on
    /// the terms that it adds up. Of a closed face the particles near it only know the side that
    /// they are on: there the slope follows from the other two.
    fn along(&self, of: &[DVec3], element: u32) -> [(f64, f64); 3] {
        let upper = |axis: usize| self.bricks.near(element, along(axis, 1)) as usize;
        let own = |axis: usize| of[upper(axis)][axis] - of[element as usize][axis];
        let is_shut = |axis: &usize| {
            [-1, 1]
                .iter()
                .any(|side| self.is_shut(element, *axis, *side))
        };
        let shut: Vec<usize> = (0..3).filter(is_shut).collect();
        [0, 1, 2].map(|axis| {
            let [first, second] = [1, 2].map(|k| own((axis + k) % 3));
            match shut[..] == [axis] {
                true => (-(first + second), first.abs() + second.abs()),
                false => (own(axis), own(axis).abs()),
            }
        })
    }

    /// Returns the products of slopes, (m/s)² per square of a cell, whose sum is that of the second
    /// minors ∂_i u_i ∂_j u_j − ∂_i u_j ∂_j u_i of the gradient of the velocity before forces, and
    /// a bound on each. The former slopes are those in the middle of the cell, the latter those at
    /// its edges: on a staggered grid the sum over all cells between walls is 0, as the minors are
    /// a divergence. On closed faces the product is 0, because water that slides along them has the
    /// same velocity into them everywhere. Of the other edges only those count whose other cells
    /// along the axes are whole.
    pub fn minors(&self, of: &[DVec3], element: u32) -> Vec<(f64, f64)> {
        let middle = self.along(of, element);
        let beside = |axis: usize, side: i32| self.bricks.near(element, along(axis, side));
        // The face of a component on one side of the cell, and the next one across another axis.
        let across = |component: usize, side: i32, axis: usize, to: i32| {
            let mut offset = along(component, side.max(0));
            let own = self.bricks.near(element, offset) as usize;
            offset[axis] = to;
            let next = self.bricks.near(element, offset) as usize;
            f64::from(to) * (of[next][component] - of[own][component])
        };
        let mut found = Vec::new();
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let ((of_a, most_a), (of_b, most_b)) = (middle[a], middle[b]);
            found.push((of_a * of_b, most_a * most_b));
            let is_shut =
                |i: i32, j: i32| self.is_shut(element, a, i) || self.is_shut(element, b, j);
            let sides = [(-1, -1), (-1, 1), (1, -1), (1, 1)];
            let products = sides.into_iter().filter_map(|(i, j)| {
                let is_inner = self.is_whole(beside(a, i)) && self.is_whole(beside(b, j));
                match is_shut(i, j) {
                    true => Some(0.0),
                    false => is_inner.then(|| across(a, i, b, j) * across(b, j, a, i)),
                }
            });
            let products: Vec<f64> = products.collect();
            let parts = products
                .iter()
                .map(|product| product / products.len() as f64);
            found.extend(parts.map(|part| (-part, part.abs())));
        }
        found
    }

    /// Returns what straight paths by the velocities `of` faces contract by in a substep, as a part
    /// of the cell's volume.
    fn contraction(&self, of: &[DVec3], element: u32) -> f64 {
        let sum: f64 = self.minors(of, element).iter().map(|minor| minor.0).sum();
        -self.rate().powi(2) * sum
    }

    /// Returns cells per m/s in a substep.
    pub fn rate(&self) -> f64 {
        self.step.length / self.model.cell_size()
    }
}

/// Returns the part of straight paths at a contraction in a substep.
fn straight_part(contraction: f64) -> f64 {
    (2.0 - contraction.abs() / MOST).clamp(0.0, 1.0)
}

impl OpenSpace {
    /// Returns the space with the contraction's flux taken from each cell's.
    pub fn less(mut self, contraction: &[f64]) -> Self {
        let each = self.solid_flux.iter_mut().zip(contraction);
        each.for_each(|(flux, by)| *flux -= by);
        self
    }
}

/// Returns the fluxes, m/s, that the projection has to let into the cells because water that
/// strains contracts when its particles go straight on: paths x + Δt u multiply volumes by
/// 1 + Δt ∇·u + Δt² m + …, with the sum m of the second minors of ∇u, which ∇·u = −Δt m makes up
/// for.
pub fn find_contraction(water: &Unprojected<'_>) -> Vec<f64> {
    let size = water.model.cell_size();
    per_cell(water.bricks, |element| {
        if !water.strains(element) {
            return 0.0;
        }
        let lost = water.contraction(&water.faces.change, element);
        straight_part(lost) * lost * size / water.step.length
    })
}

/// Returns the part of the midpoint rule in the paths of each cell's particles: where the projected
/// velocities contract the water by much more or less than [`find_contraction`] has made up for,
/// and in cells of which nothing is known.
pub fn bend_paths(water: &Unprojected<'_>) -> Vec<f64> {
    per_cell(water.bricks, |element| {
        if !water.strains(element) {
            return 1.0;
        }
        let before = water.contraction(&water.faces.change, element);
        let lost = water.contraction(&water.faces.velocity, element);
        1.0 - straight_part(lost - straight_part(before) * before)
    })
}
