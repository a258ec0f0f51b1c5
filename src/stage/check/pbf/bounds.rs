//! Rounding bounds of one particle's values, from its neighbours and the walls as they are.

use glam::DVec3;

use crate::{
    compare::rounding::{self, Sums, U, WallError},
    domain::pbf::CONTACT,
    reference::pbf::passes::{Inputs, Row},
};

/// What the bounds of a pass depend on.
pub(super) struct Bounds<'a>(pub(super) Inputs<'a>);

/// A bound on a position behind walls and solids.
pub(super) struct Confined {
    /// Metres.
    pub(super) error: f64,
    /// Of what the walls alone added to it, metres.
    pub(super) push_error: f64,
    /// Whether they pushed, or may have by rounding alone.
    pub(super) is_touched: bool,
}

impl Bounds<'_> {
    /// Sums over the neighbours of particle `i`, each term weighted.
    pub(super) fn sums(&self, i: usize, weight: impl Fn(usize) -> f64) -> Sums {
        let h = self.0.model.calibration.support_radius;
        let mut sums = Sums::default();
        for j in self.0.neighbors.all(i) {
            let j = j as usize;
            let q = self.0.points[i].distance(self.0.points[j]) / h;
            sums.add(q, weight(j));
        }
        sums
    }

    /// A neighbour's part in sums: 1, or a sample's weight.
    pub(super) fn mass(&self, j: usize) -> f64 {
        j.checked_sub(self.0.particles())
            .map_or(1.0, |sample| self.0.model.sample_weights[sample])
    }

    pub(super) fn walls(&self, x: DVec3) -> WallError {
        let h = self.0.model.calibration.support_radius;
        let walls = &self.0.substep.walls;
        let gaps = [(x - walls.min).to_array(), (walls.max - x).to_array()];
        let faces = gaps
            .iter()
            .flatten()
            .filter(|&&gap| gap < h * 1.001)
            .count();
        WallError::of(faces, self.wall_place() / h)
    }

    /// By how much f32 misplaces a wall, metres.
    fn wall_place(&self) -> f64 {
        let walls = &self.0.substep.walls;
        let off = |x: DVec3| (x - x.as_vec3().as_dvec3()).abs().max_element();
        off(walls.min).max(off(walls.max))
    }

    /// Of the relative density.
    pub(super) fn density(&self, i: usize, density: f64) -> f64 {
        let sums = self.sums(i, |j| self.mass(j));
        self.0.model.calibration.density_scale * (sums.kernel() + 6.0 * U)
            + self.walls(self.0.points[i]).density
            + 2.0 * U * density
    }

    /// Of λ.
    pub(super) fn lambda(&self, i: usize, row: &Row, lambda: f64) -> f64 {
        let calibration = &self.0.model.calibration;
        let scale = calibration.gradient_scale;
        let sums = self.sums(i, |j| self.mass(j));
        let walls = self.walls(self.0.points[i]).gradient / calibration.support_radius;
        let own = row.own.length();
        let own_error = scale * sums.gradient() + walls + 2.0 * U * own;
        let squares = rounding::squares(own, own_error, scale * scale * sums.squares());
        let density = self.density(i, row.density);
        rounding::lambda(
            lambda,
            row.squares + self.0.model.regularization(),
            density,
            squares,
        )
    }

    /// Of a correction before walls and solids, metres.
    pub(super) fn delta(&self, i: usize, lambda: &[f64]) -> f64 {
        let model = self.0.model;
        let calibration = &model.calibration;
        let artificial = model.settings.artificial_pressure / calibration.bulk_gradient_squares;
        let weight = |j: usize| {
            let other = lambda.get(j).copied().unwrap_or(0.0);
            self.mass(j) * (lambda[i].abs() + other.abs())
        };
        // w⁴ of p¹² is at most 4.4 and errs by 12 · 10 u of it.
        let repulsion = self.sums(i, |j| 140.0 * 4.4 * artificial * self.mass(j));
        let walls = self.walls(self.0.points[i]).gradient / calibration.support_radius;
        model.settings.relaxation
            * (calibration.gradient_scale * (self.sums(i, weight).gradient() + U * repulsion.s2)
                + lambda[i].abs() * walls)
    }

    /// Of what walls and solids make of `x`, the position before they push, which errs by `error`. Solids bend the way: the
    /// bound is what the twin answers when `x` moves by its error, and by that of its place in the distance grid, along each
    /// axis. Where the push has taken it the answer is smaller: a curved solid turns a deep push by more.
    pub(super) fn confine(&self, x: DVec3, error: f64) -> Confined {
        let (model, walls) = (self.0.model, &self.0.substep.walls);
        let contact = CONTACT * model.settings.particle_spacing;
        let place = self.wall_place() + U * walls.max.abs().max_element();
        let mut reach = error;
        let mut is_near = false;
        if let Some(grid) = &model.distance {
            reach += U
                * (7.0 * (x - grid.origin).abs().max_element()
                    + grid.origin.abs().max_element()
                    + 48.0 * grid.spacing);
            is_near = grid.sample(x) < contact + reach + 0.5 * grid.spacing;
        }
        if !is_near {
            let slack = error + place;
            let low = walls.min + contact + slack;
            let high = walls.max - contact - slack;
            let is_touched = x.cmplt(low).any() || x.cmpgt(high).any();
            return Confined {
                error: error + if is_touched { place } else { 0.0 },
                push_error: error + place,
                is_touched,
            };
        }
        let (centre, push) = model.confine_by(x, walls);
        let (mut moved, mut pushed) = (0.0, 0.0);
        let mut is_touched = centre != x;
        for axis in DVec3::AXES {
            let (mut most, mut most_pushed) = (0.0f64, 0.0f64);
            for side in [axis * reach, -axis * reach] {
                let (found, other) = model.confine_by(x + side, walls);
                is_touched |= found != x + side;
                most = most.max(found.distance(centre));
                most_pushed = most_pushed.max(other.distance(push));
            }
            moved += most;
            pushed += most_pushed;
        }
        let rounding = place + U * x.length();
        Confined {
            error: if is_touched {
                moved.max(error) + rounding
            } else {
                error
            },
            push_error: pushed.max(error) + rounding,
            is_touched,
        }
    }
}
