//! Rounding bounds of one particle's values, from its neighbours and the walls at their current
//! positions.

use glam::{DQuat, DVec3};

use swell_compare::rounding::{
    DENSITY, GRADIENT_SQUARES, LAMBDA, OTHER_GRADIENTS, OWN_GRADIENT, Sums, U, WALL_DENSITY,
    WALL_GRADIENT, WALL_PLACE,
};
use swell_domain::{bounds::FAR, pbf::CONTACT, pose::Pose};
use swell_reference::pbf::passes::{DensityConstraint, Inputs};

use super::rows::{DELTA, OF_SOLIDS, PUSHED, REACH, REPULSION};
use crate::solids::{GRID, SHAPED, TURNED};

/// Inputs that the bounds of a pass depend on.
pub(crate) struct Bounds<'a>(pub(crate) Inputs<'a>);

/// Bounds on a position after walls and solids.
pub(crate) struct Confined {
    /// Magnitudes of its tolerance.
    pub(crate) magnitudes: [f64; 4],
    /// [`PUSHED`]: bound on the displacement by walls, metres.
    pub(crate) push_error: f64,
    /// [`OF_SOLIDS`]: bound on the work of moving solids, over m / Δt².
    pub(crate) work_error: f64,
    /// Whether walls or solids pushed, or may have within rounding.
    pub(crate) is_touched: bool,
    /// Error of the position for the lookup in the solids' grid, metres.
    pub(crate) reach: f64,
}

impl Bounds<'_> {
    /// Sums over the neighbours of particle `i`, with a weight for each term.
    pub(crate) fn sums(&self, i: usize, weight: impl Fn(usize) -> f64) -> Sums {
        let h = self.0.model.calibration.support_radius;
        let mut sums = Sums::default();
        for j in self.0.neighbors.all(i) {
            let j = j as usize;
            let way = self.0.points[i] - self.0.points[j];
            let q = self.0.model.period().shortest(way).length() / h;
            sums.add(q, weight(j));
        }
        sums
    }

    /// Returns a neighbour's weight in sums: 1 for a particle, or that of a boundary sample.
    fn mass(&self, j: usize) -> f64 {
        j.checked_sub(self.0.particles())
            .map_or(1.0, |sample| self.0.model.sample_weights[sample])
    }

    /// Returns [`WALL_DENSITY`] and, divided by h, [`WALL_GRADIENT`] at `x`.
    fn walls(&self, x: DVec3) -> [f64; 2] {
        let h = self.0.model.calibration.support_radius;
        let walls = &self.0.substep.walls;
        let gaps = [(x - walls.min).to_array(), (walls.max - x).to_array()];
        let faces = gaps
            .iter()
            .flatten()
            .filter(|&&gap| gap < h * 1.001)
            .count() as f64;
        let q = WALL_PLACE.of([self.wall_place() / h]);
        let density = WALL_DENSITY.of([faces, q]);
        [density, WALL_GRADIENT.of([faces, q, density]) / h]
    }

    /// Returns the rounding error of the walls' positions in f32, metres.
    fn wall_place(&self) -> f64 {
        let walls = &self.0.substep.walls;
        let off = |x: DVec3| (x - x.as_vec3().as_dvec3()).abs().max_element();
        off(walls.min).max(off(walls.max))
    }

    /// Returns the bound [`DENSITY`].
    pub(crate) fn density(&self, i: usize, density: f64) -> f64 {
        let sums = self.sums(i, |j| self.mass(j));
        let [walls, _] = self.walls(self.0.points[i]);
        let scale = self.0.model.calibration.density_scale;
        DENSITY.of([scale, sums.kernel(), walls, density])
    }

    /// Returns the bound [`LAMBDA`].
    pub(super) fn lambda(&self, i: usize, row: &DensityConstraint, lambda: f64) -> f64 {
        let scale = self.0.model.calibration.gradient_scale;
        let sums = self.sums(i, |j| self.mass(j));
        let [_, walls] = self.walls(self.0.points[i]);
        let own = row.own.length();
        let own_error = OWN_GRADIENT.of([scale, sums.gradient(), walls, own]);
        let others = OTHER_GRADIENTS.of([scale, sums.squares()]);
        let squares = GRADIENT_SQUARES.of([own, own_error, others]);
        let denominator = row.squares + self.0.model.regularization();
        LAMBDA.of([
            lambda.abs(),
            denominator,
            self.density(i, row.density),
            squares,
        ])
    }

    /// Returns [`DELTA`]: the bound on a correction before walls and solids, metres.
    pub(super) fn delta(&self, i: usize, lambda: &[f64]) -> f64 {
        let model = self.0.model;
        let calibration = &model.calibration;
        let artificial = model.settings.artificial_pressure / calibration.bulk_gradient_squares;
        let weight = |j: usize| {
            let other = lambda.get(j).copied().unwrap_or(0.0);
            self.mass(j) * (lambda[i].abs() + other.abs())
        };
        let repulsion = self.sums(i, |j| REPULSION.of([artificial, self.mass(j)]));
        let [_, walls] = self.walls(self.0.points[i]);
        DELTA.of([
            model.settings.relaxation,
            calibration.gradient_scale,
            self.sums(i, weight).gradient(),
            repulsion.s2,
            lambda[i].abs(),
            walls,
        ])
    }

    /// Returns bounds for a position after walls and solids; `x` is the position before they push,
    /// with an error of `error`. Solids deflect the displacement, so the bound is the reference's
    /// response when `x` moves along each axis by its error, and by that of its position in the
    /// distance grid. After the push the response would be smaller: a curved solid deflects a deep
    /// push by more.
    pub(super) fn confine(&self, x: DVec3, error: f64) -> Confined {
        let (model, walls) = (self.0.model, &self.0.substep.walls);
        let contact = CONTACT * model.settings.particle_spacing;
        let there = walls.max.to_array().map(f64::abs).into_iter();
        let farthest = there.filter(|&wall| wall < FAR).fold(0.0, f64::max);
        let place = self.wall_place() + U * farthest;
        let mut reach = error;
        let mut is_near = false;
        let still = model
            .distance
            .iter()
            .map(|grid| (grid, Pose::START, false, false));
        let moving = model.movers.iter();
        let moving = moving.map(|it| {
            (
                &it.solid.grid,
                it.solid.pose,
                it.passage.spin != DVec3::ZERO,
                it.shape.is_some(),
            )
        });
        for (grid, pose, turns, changes) in still.chain(moving) {
            let there = pose.back(x);
            let offset = (there - grid.origin).abs().max_element();
            let origin = grid.origin.abs().max_element();
            let mut place = GRID.of([offset, origin, grid.spacing]);
            if turns || pose.turn != DQuat::IDENTITY {
                let centre = pose.centre.length();
                place = TURNED.of([place, (x - pose.centre).length(), centre]);
            }
            if changes {
                place = SHAPED.of([place, contact + 4.0 * grid.spacing]);
            }
            let own = REACH.of([error, place]);
            is_near |= grid.sample(there) < contact + own + 0.5 * grid.spacing;
            reach = reach.max(own);
        }
        if !is_near {
            let slack = error + place;
            let low = walls.min + contact + slack;
            let high = walls.max - contact - slack;
            let is_touched = x.cmplt(low).any() || x.cmpgt(high).any();
            return Confined {
                magnitudes: [error, 0.0, if is_touched { place } else { 0.0 }, 0.0],
                push_error: PUSHED.of([error, 0.0, place, 0.0]),
                work_error: 0.0,
                is_touched,
                reach,
            };
        }
        let (centre, push) = model.confine_by(x, walls);
        let (mut moved, mut pushed, mut worked) = (0.0, 0.0, 0.0);
        let mut is_touched = centre != x;
        for axis in DVec3::AXES {
            let (mut most, mut most_pushed, mut most_worked) = (0.0f64, 0.0f64, 0.0f64);
            for side in [axis * reach, -axis * reach] {
                let (found, other) = model.confine_by(x + side, walls);
                is_touched |= found != x + side;
                most = most.max(found.distance(centre));
                most_pushed = most_pushed.max(other.of_walls.distance(push.of_walls));
                most_worked = most_worked.max((other.work - push.work).abs());
            }
            moved += most;
            pushed += most_pushed;
            worked += most_worked;
        }
        let magnitudes = match is_touched {
            true => [error, moved, place, x.length()],
            false => [error, 0.0, 0.0, 0.0],
        };
        Confined {
            magnitudes,
            push_error: PUSHED.of([error, pushed, place, x.length()]),
            work_error: OF_SOLIDS.of([
                worked,
                push.work.abs(),
                push.of_solids.length(),
                model.fastest_solid(),
            ]),
            is_touched,
            reach,
        }
    }
}

/// Returns the relative speed of a particle and its neighbour; 0 for boundary samples.
pub(crate) fn relative_speed(velocity: &[DVec3], i: usize) -> impl Fn(usize) -> f64 + '_ {
    move |j| velocity.get(j).map_or(0.0, |v| v.distance(velocity[i]))
}
