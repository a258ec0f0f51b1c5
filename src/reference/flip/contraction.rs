//! Reference pass of flip/find_contraction.

use glam::{DMat3, DVec3};
use swell_domain::poisson::FLUID;

use super::{
    OpenSpace, Unprojected,
    grid::{along, per_cell},
};

/// Walls and solids cut a cell that they leave less of.
pub const WHOLE: f64 = 0.999;

/// Most that a cell contracts by in a substep: bounds what noise of neighbouring particles does.
const MOST: f64 = 0.1;

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

    /// Returns a component on a cell's lower face and on its upper one, m/s: before forces, and
    /// that of the wall or solid where it is closed.
    fn on_faces(&self, element: u32, axis: usize) -> [f64; 2] {
        let upper = self.bricks.near(element, along(axis, 1));
        [element, upper].map(|face| match self.space.open[face as usize][axis] == 0.0 {
            true => self.velocity[face as usize][axis],
            false => self.before[face as usize][axis],
        })
    }

    /// Returns the velocity in the middle of a cell, m/s: means over opposite faces.
    fn in_middle(&self, element: u32) -> DVec3 {
        let mean = |axis: usize| 0.5 * self.on_faces(element, axis).iter().sum::<f64>();
        DVec3::new(mean(0), mean(1), mean(2))
    }

    /// Returns the derivatives of the velocity in a cell, without divergence, m/s per cell: one
    /// column per axis. Those across a component are one-sided beside cells that are not whole.
    pub fn gradient(&self, element: u32) -> DMat3 {
        let own = self.in_middle(element);
        let beside = |axis: usize, side: i32| {
            let other = self.bricks.near(element, along(axis, side));
            self.is_whole(other).then(|| self.in_middle(other))
        };
        let mut gradient = DMat3::from_cols_array_2d(&[0, 1, 2].map(|axis| {
            let slope = match (beside(axis, -1), beside(axis, 1)) {
                (Some(low), Some(high)) => 0.5 * (high - low),
                (Some(low), None) => own - low,
                (None, Some(high)) => high - own,
                (None, None) => DVec3::ZERO,
            };
            slope.to_array()
        }));
        for axis in 0..3 {
            let [lower, upper] = self.on_faces(element, axis);
            gradient.col_mut(axis)[axis] = upper - lower;
        }
        let trace = (0..3).map(|k| gradient.col(k)[k]).sum::<f64>();
        gradient - DMat3::from_diagonal(DVec3::splat(trace / 3.0))
    }

    /// Returns the flux of a gradient's contraction through the faces of a cell, m/s.
    pub fn contraction(&self, gradient: DMat3) -> f64 {
        let square = gradient * gradient;
        let trace: f64 = (0..3).map(|k| square.col(k)[k]).sum();
        let (size, time) = (self.model.cell_size(), self.step.length);
        (0.5 * time / size * trace).clamp(-MOST * size / time, MOST * size / time)
    }
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
/// 1 + Δt ∇·u − ½ Δt² tr (∇u)² + …, which ∇·u = ½ Δt tr (∇u)² makes up for.
pub fn find_contraction(water: &Unprojected<'_>) -> Vec<f64> {
    per_cell(water.bricks, |element| match water.strains(element) {
        true => water.contraction(water.gradient(element)),
        false => 0.0,
    })
}
