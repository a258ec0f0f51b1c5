//! Reference passes of shaders/pbf: one function per pass, with the pass's name.
//!
//! A pass that the GPU runs on one colour takes a [`Colour`] here, and does not change values of
//! the other colour.

use glam::DVec3;

use super::{
    Colour, Model, Substep,
    pairs::{CorrectionSum, RowSums},
};
use crate::{hash::pair_direction, neighbors::Neighbors};
use swell_domain::{lanes::widely, parallel};

/// Inputs of a substep's passes.
#[derive(Clone, Copy, Debug)]
pub struct Inputs<'a> {
    /// Constants and solids.
    pub model: &'a Model,
    /// Δt and walls.
    pub substep: &'a Substep,
    /// Positions, metres: particles, then boundary samples on solids.
    pub points: &'a [DVec3],
    /// Neighbour lists, made at the predicted positions.
    pub neighbors: &'a Neighbors,
    /// Which particles are isolated droplets, as found by the grid projection; empty without a
    /// projection.
    pub is_drop: &'a [bool],
}

impl Inputs<'_> {
    /// Returns how many of the points are particles.
    pub fn particles(&self) -> usize {
        self.points.len() - self.model.samples.len()
    }

    /// Returns the vector from point `j` to the nearest periodic image of point `i`, metres.
    #[inline]
    pub(super) fn between(&self, i: usize, j: usize) -> DVec3 {
        let period = self.model.period();
        period.shortest(self.points[i] - self.points[j])
    }

    /// Returns the weight of a boundary sample, given its index among the points, in units of a
    /// particle's mass.
    pub(super) fn sample_weight(&self, j: u32) -> f64 {
        self.model.sample_weights[j as usize - self.particles()]
    }
}

/// Explicit step of the external forces; what walls and solids remove from the displacement is also
/// removed from the velocity (pbf/predict). Returns the predicted position and the velocity, metres
/// and m/s.
pub fn predict(
    model: &Model,
    substep: &Substep,
    position: DVec3,
    velocity: DVec3,
) -> (DVec3, DVec3) {
    let (x, v, _) = predict_and_work(model, substep, position, velocity);
    (x, v)
}

/// Does the same and also returns the work of moving walls on the particle, over m / Δt².
pub fn predict_and_work(
    model: &Model,
    substep: &Substep,
    position: DVec3,
    velocity: DVec3,
) -> (DVec3, DVec3, f64) {
    let step = substep.time_step;
    let mut v = velocity + model.gravity * step;
    v *= (model.max_displacement() / (step * v.length()).max(1e-30)).min(1.0);
    let free = position + step * v;
    let (x, pushes) = model.confine_by(free, &substep.walls);
    let taken = if step > 0.0 {
        (x - free) / step
    } else {
        DVec3::ZERO
    };
    let work = substep.work_of_push(pushes.of_walls) + pushes.work;
    (model.period().wrap(x), v + taken, work)
}

/// Predicts like [`predict_and_work`] for water that a grid's flow moves: its own velocity did not
/// take it to its position, so it only loses its component into walls and solids (pbf/predict).
pub fn predict_along(
    model: &Model,
    substep: &Substep,
    position: DVec3,
    velocity: DVec3,
) -> (DVec3, DVec3, f64) {
    let (x, _, work) = predict_and_work(model, substep, position, velocity);
    let step = substep.time_step;
    let v = velocity * (model.max_displacement() / (step * velocity.length()).max(1e-30)).min(1.0);
    let free = position + step * v;
    let pushes = model.solid_pushes(free);
    let (push, against) = (pushes.of_solids, v - pushes.pushing);
    let v = v - push * (against.dot(push).min(0.0) / push.length_squared().max(1e-30));
    let y = free + push;
    let contact = model.contact_distance();
    let walls = (substep.walls.min + contact, substep.walls.max - contact);
    let v = DVec3::select(y.cmplt(walls.0), v.max(substep.wall_velocity.min), v);
    let v = DVec3::select(y.cmpgt(walls.1), v.min(substep.wall_velocity.max), v);
    (x, v, work)
}

/// Returns the relative density ρ/ρ0 of each particle, shape (particles) (pbf/measure_density).
pub fn measure_density(inputs: Inputs<'_>) -> Vec<f64> {
    parallel::map(0..inputs.particles(), |i| row(inputs, i).density)
}

/// Computes λ_i = −max(C_i, 0) / (Σ_k |∇_k C_i|² + ε), m², and ρ_i/ρ0 for one colour
/// (pbf/compute_lambda; Macklin and Müller 2013, eq. 11). Shapes (particles).
pub fn compute_lambda(inputs: Inputs<'_>, colour: Colour, lambda: &mut [f64], density: &mut [f64]) {
    let regularization = inputs.model.regularization();
    let rows = parallel::map(0..lambda.len(), |i| colour.holds(i).then(|| row(inputs, i)));
    for (i, row) in rows.into_iter().enumerate() {
        if let Some(row) = row {
            lambda[i] = -(row.density - 1.0).max(0.0) / (row.squares + regularization);
            density[i] = row.density;
        }
    }
}

/// A density constraint at the current positions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DensityConstraint {
    /// ρ/ρ0.
    pub density: f64,
    /// ∇_i C_i, 1/m.
    pub own: DVec3,
    /// Σ_k |∇_k C_i|² over the particle and its neighbours, 1/m².
    pub squares: f64,
}

/// Returns the constraint of particle `i`.
#[inline]
pub fn row(inputs: Inputs<'_>, i: usize) -> DensityConstraint {
    let (kernel, gradient, squares) = widely(RowSums {
        inputs,
        particle: i,
    });
    let (calibration, x) = (&inputs.model.calibration, inputs.points[i]);
    let scale = calibration.gradient_scale;
    let (wall, wall_gradient) = inputs.model.wall_term(x, &inputs.substep.walls);
    let own = wall_gradient - scale * gradient;
    DensityConstraint {
        density: calibration.density_scale * (1.0 + kernel) + wall,
        own,
        squares: own.length_squared() + scale * scale * squares,
    }
}

/// Extrapolation of corrections in a semi-iteration (Wang 2015, eq. 9).
#[derive(Clone, Copy, Debug)]
pub struct Momentum<'a> {
    /// Factor ω of this iteration.
    pub factor: f64,
    /// Positions of one iteration before, metres. Shape (particles).
    pub before: &'a [DVec3],
}

/// A particle after a correction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corrected {
    /// Position before walls and solids push it, metres.
    pub free: DVec3,
    /// Position after that, metres.
    pub position: DVec3,
    /// Work of moving walls on it, over m / Δt².
    pub work: f64,
}

/// Computes Δx_i = Σ_j (λ_i + λ_j + s_corr) ∇W / ρ0, metres, relaxed, bounded, and confined by
/// walls and solids (pbf/compute_delta; Macklin and Müller 2013, eq. 14). Returns new positions for
/// one colour, and current ones for the other.
pub fn compute_delta(
    inputs: Inputs<'_>,
    colour: Colour,
    momentum: Option<Momentum<'_>>,
    lambda: &[f64],
) -> Vec<Corrected> {
    let model = inputs.model;
    let part = |step: DVec3| (model.max_correction() / step.length().max(1e-30)).min(1.0);
    let bounded = |step: DVec3| step * part(step);
    let one = |i: usize| {
        let x = inputs.points[i];
        if !colour.holds(i) {
            return Corrected {
                free: x,
                position: x,
                work: 0.0,
            };
        }
        let (_, wall) = model.wall_term(x, &inputs.substep.walls);
        let pairs = pair_corrections(inputs, i, lambda);
        let delta = lambda[i] * wall - model.calibration.gradient_scale * pairs;
        let delta = model.settings.relaxation * delta;
        let rate = lambda[i] * (model.wall_rate(x, inputs.substep) + sample_rate(inputs, i));
        let mut work = part(delta) * model.settings.relaxation * rate;
        let mut delta = bounded(delta);
        if let Some(Momentum { factor, before }) = momentum {
            let last = x - before[i];
            if delta.dot(last) > 0.0 {
                delta = bounded(factor * delta + (factor - 1.0) * last);
                // Assumes that the walls' share of the last step was that of this one.
                work *= 2.0 * factor - 1.0;
            }
        }
        let free = x + delta;
        let (position, pushes) = model.confine_by(free, &inputs.substep.walls);
        work += inputs.substep.work_of_push(pushes.of_walls) + pushes.work;
        Corrected {
            free,
            position,
            work,
        }
    };
    parallel::map(0..lambda.len(), one)
}

/// Returns Σ_j (λ_i + λ_j + s_corr) m_j (1 − q)² times the unit vector from j, m².
#[inline]
fn pair_corrections(inputs: Inputs<'_>, i: usize, lambda: &[f64]) -> DVec3 {
    let Model {
        calibration,
        settings,
        ..
    } = inputs.model;
    let (sum, nearest) = widely(CorrectionSum {
        inputs,
        particle: i,
        lambda,
        artificial: settings.artificial_pressure / calibration.bulk_gradient_squares,
    });
    let is_coincident = |r: f64| r / calibration.support_radius < 1e-6;
    if !is_coincident(nearest) {
        return sum;
    }
    let on_the_spot = |j: &u32| is_coincident(inputs.between(i, *j as usize).length());
    let last = inputs.neighbors.all(i).filter(on_the_spot).last();
    last.map_or(sum, |j| sum + pair_direction(i as u32, j) * 2.0 * lambda[i])
}

/// Returns the sum over boundary samples of each sample's density gradient times its velocity, 1/s.
fn sample_rate(inputs: Inputs<'_>, i: usize) -> f64 {
    let model = inputs.model;
    if model.movers.is_empty() {
        return 0.0;
    }
    let inverse_h = 1.0 / model.calibration.support_radius;
    let rate = |&j: &u32| {
        let d = inputs.between(i, j as usize);
        let r = d.length();
        let s = (1.0 - r * inverse_h).max(0.0);
        let velocity = model.sample_velocities[j as usize - inputs.particles()];
        inputs.sample_weight(j) * s * s / r.max(1e-15) * d.dot(velocity)
    };
    let (_, solid) = inputs.neighbors.of(i);
    -model.calibration.gradient_scale * solid.iter().map(rate).sum::<f64>()
}

/// Computes v += (x* − x*_0) / Δt, where x*_0 is the prediction before any correction; a
/// displacement above the cap is reduced (pbf/update_velocity). Returns position, velocity, and
/// whether it was reduced.
pub fn update_velocity(
    model: &Model,
    substep: &Substep,
    predicted: DVec3,
    start: DVec3,
    velocity: DVec3,
) -> (DVec3, DVec3, bool) {
    let step = substep.time_step;
    let v = velocity + (predicted - start) / step;
    let distance = v.length() * step;
    if distance > model.max_displacement() {
        let excess = v * (1.0 - model.max_displacement() / distance);
        let x = predicted - excess * step;
        return (model.period().wrap(x), v - excess, true);
    }
    (model.period().wrap(predicted), v, false)
}
