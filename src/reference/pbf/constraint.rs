//! Exact solution of the density constraints, which PBF's iterations approach.
//!
//! With G = ∇C of the compressed particles, whose masses are equal, an iteration of PBF replaces G
//! Gᵀ + εI by its diagonal; this module factorises the whole matrix (faer's sparse Cholesky). A row
//! couples the particles within 2h, 250 of them at h = 2d, and the factor fills in between:
//! docs/accuracy.md states the cost.

use std::{collections::BTreeMap, fmt::Debug};

use faer::{
    Mat, Side,
    prelude::Solve,
    sparse::{SparseColMat, Triplet},
};
use glam::DVec3;

use super::{
    Model, Sorted, Substep, local,
    passes::{DensityConstraint, Inputs, measure_density, row},
};
use crate::{ReferenceError, Timings};
use swell_domain::{boundary::Boundary, parallel, particles::Particles};
use swell_scene::PbfScene;

/// Newton steps after which the nonlinear solve fails.
const MAX_STEPS: usize = 100;

/// A correction that satisfies the linearised constraints.
#[derive(Clone, Debug)]
pub struct Correction {
    /// λ of each particle, m²; 0 if it is not compressed. Shape (particles).
    pub lambda: Vec<f64>,
    /// Δx = Gᵀ λ of each particle, metres; neither bounded nor confined. Shape (particles).
    pub delta: Vec<DVec3>,
    /// Number of compressed particles.
    pub active: usize,
}

/// Particles that satisfy their constraints.
#[derive(Clone, Debug)]
pub struct Converged {
    /// Positions, metres. Shape (particles).
    pub position: Vec<DVec3>,
    /// Number of linear solves.
    pub steps: usize,
    /// Largest remaining max(0, C).
    pub error: f64,
    /// Mean of max(0, C) over all particles.
    pub mean_error: f64,
}

/// Solves (G Gᵀ + εI) λ = −C over the particles with C > 0, with the iteration's G from the spiky
/// kernel; ε = `regularization`, 1/m².
///
/// # Errors Returns [`ReferenceError::Factor`] if the matrix is not positive definite or memory
/// does not hold its factor.
pub fn linearised(inputs: Inputs<'_>, regularization: f64) -> Result<Correction, ReferenceError> {
    let rows: Vec<DensityConstraint> = parallel::map(0..inputs.particles(), |i| row(inputs, i));
    let gradients = Gradients {
        inputs,
        own: rows.iter().map(|row| row.own).collect(),
        is_exact: false,
    };
    let excess: Vec<f64> = rows.iter().map(|row| row.density - 1.0).collect();
    solve(&gradients, &excess, regularization)
}

/// Returns the smallest Δx with G Δx = −C over the particles whose C, `excess`, is positive.
fn solve(
    gradients: &Gradients<'_>,
    excess: &[f64],
    regularization: f64,
) -> Result<Correction, ReferenceError> {
    let n = excess.len();
    let active: Vec<usize> = (0..n).filter(|&i| excess[i] > 0.0).collect();
    let mut correction = Correction {
        lambda: vec![0.0; n],
        delta: vec![DVec3::ZERO; n],
        active: active.len(),
    };
    if active.is_empty() {
        return Ok(correction);
    }
    let fault = |error: &dyn Debug| ReferenceError::Factor(format!("{error:?}"));
    let triplets = gradients.products(&active, regularization);
    let count = active.len();
    let factor = SparseColMat::<usize, f64>::try_new_from_triplets(count, count, &triplets)
        .map_err(|error| fault(&error))?
        .sp_cholesky(Side::Lower)
        .map_err(|error| fault(&error))?;
    let solution = factor.solve(&Mat::from_fn(count, 1, |k, _| -excess[active[k]]));
    for (k, &i) in active.iter().enumerate() {
        let lambda = solution[(k, 0)];
        correction.lambda[i] = lambda;
        for (moved, gradient) in gradients.of(i) {
            correction.delta[moved] += lambda * gradient;
        }
    }
    Ok(correction)
}

/// Newton's method on C = 0 over the particles with C > 0. Each step is the smallest one in the sum
/// of squares, bounded like an iteration's correction and kept out of walls and solids; it ends
/// when no particle is compressed by more than `tolerance`. Here G is the exact derivative of C,
/// from poly6: a block squeezed by 2 % along each axis takes 21 steps to 1e-8, and 47 with the
/// iteration's spiky gradient. If there is too little space, poly6's flat top lets pairs collapse.
///
/// # Errors Returns [`ReferenceError::Factor`], or [`ReferenceError::NotConverged`] after a hundred
/// steps.
pub fn converged(
    model: &Model,
    substep: &Substep,
    position: &[DVec3],
    tolerance: f64,
) -> Result<Converged, ReferenceError> {
    let n = position.len();
    let id: Vec<u32> = (0..n as u32).collect();
    let mut position = position.to_vec();
    let mut error = f64::INFINITY;
    for steps in 0..=MAX_STEPS {
        let sorted = Sorted::new(model, &position, &id, &mut Timings::default());
        let inputs = sorted.inputs(model, substep);
        let density = measure_density(inputs);
        let errors = || density.iter().map(|rho| (rho - 1.0).max(0.0));
        error = errors().fold(0.0, f64::max);
        if error <= tolerance && density.iter().all(|rho| rho.is_finite()) {
            return Ok(Converged {
                mean_error: errors().sum::<f64>() / n.max(1) as f64,
                position,
                steps,
                error,
            });
        }
        let excess: Vec<f64> = density.iter().map(|rho| rho - 1.0).collect();
        let gradients = Gradients::exact(inputs);
        let epsilon = 1e-12 * model.calibration.bulk_gradient_squares;
        let correction = solve(&gradients, &excess, epsilon)?;
        for (&k, delta) in sorted.order.iter().zip(&correction.delta) {
            let bound = (model.max_correction() / delta.length().max(1e-300)).min(1.0);
            position[k] = model.confine(position[k] + *delta * bound, &substep.walls);
        }
    }
    Err(ReferenceError::NotConverged {
        steps: MAX_STEPS,
        error,
        tolerance,
    })
}

/// Returns the distance of a frame's final state from one that satisfies its density constraints:
/// the RMS over particles of the distance between x and x' over d, where [`converged`] turns x into
/// x'. It measures the displacement that further iterations would add, and is 0 once they have
/// converged. States that different iterations converge to differ among themselves, because C ≤ 0
/// has many solutions.
///
/// # Errors Returns the errors of [`converged`].
pub fn distance_to_converged(
    scene: &PbfScene,
    boundary: &Boundary,
    frame: u32,
    state: &Particles,
    tolerance: f64,
) -> Result<f64, ReferenceError> {
    let mut model = Model::new(scene, boundary);
    let time = f64::from(frame) * scene.shot.frame_seconds();
    let substep = Substep::new(scene, &state.walls, time, 0.0);
    model.stand(scene, &state.bodies, time, 0.0);
    let position = local(scene, state);
    let solved = converged(&model, &substep, &position, tolerance)?;
    let pairs = position.iter().zip(&solved.position);
    let squares: f64 = pairs.map(|(a, b)| a.distance_squared(*b)).sum();
    let mean = squares / position.len().max(1) as f64;
    Ok(mean.sqrt() / model.settings.particle_spacing)
}

/// Rows and columns of G, which is never stored.
struct Gradients<'a> {
    inputs: Inputs<'a>,
    /// ∇_i C_i, 1/m.
    own: Vec<DVec3>,
    /// Whether gradients are those of poly6, the exact derivative of C, rather than of spiky.
    is_exact: bool,
}

impl<'a> Gradients<'a> {
    fn exact(inputs: Inputs<'a>) -> Self {
        let mut gradients = Self {
            inputs,
            own: Vec::new(),
            is_exact: true,
        };
        let own = |i: usize| {
            let (fluid, solid) = inputs.neighbors.of(i);
            let mut sum: DVec3 = fluid.iter().map(|&j| gradients.pair(i, j as usize)).sum();
            for &j in solid {
                sum += inputs.sample_weight(j) * gradients.pair(i, j as usize);
            }
            inputs
                .model
                .wall_derivative(inputs.points[i], &inputs.substep.walls)
                - sum
        };
        gradients.own = parallel::map(0..inputs.particles(), own);
        gradients
    }

    /// Returns the lower half of G Gᵀ + εI over `active` as (row, column, value).
    fn products(&self, active: &[usize], regularization: f64) -> Vec<Triplet<usize, usize, f64>> {
        let mut place = vec![usize::MAX; self.own.len()];
        for (k, &i) in active.iter().enumerate() {
            place[i] = k;
        }
        let row = |(k, &i): (usize, &usize)| {
            let mut entries = BTreeMap::from([(k, regularization)]);
            for (moved, own) in self.of(i) {
                // The particles whose density depends on that one: itself and its neighbours.
                for (other, theirs) in self.felt_by(moved) {
                    if place[other] <= k {
                        *entries.entry(place[other]).or_insert(0.0) += own.dot(theirs);
                    }
                }
            }
            let entries = entries.into_iter();
            entries.map(move |(column, value)| Triplet::new(k, column, value))
        };
        parallel::flat_map(0..active.len(), |k| row((k, &active[k])))
    }

    /// Iterates over ∇_j C_i for i itself and its fluid neighbours j.
    fn of(&self, i: usize) -> impl Iterator<Item = (usize, DVec3)> + '_ {
        let others = self.inputs.neighbors.fluid(i).iter().map(|&j| j as usize);
        std::iter::once((i, self.own[i])).chain(others.map(move |j| (j, self.pair(i, j))))
    }

    /// Iterates over ∇_j C_k for all k whose density depends on j.
    fn felt_by(&self, j: usize) -> impl Iterator<Item = (usize, DVec3)> + '_ {
        let others = self.inputs.neighbors.fluid(j).iter().map(|&k| k as usize);
        std::iter::once((j, self.own[j])).chain(others.map(move |k| (k, self.pair(k, j))))
    }

    /// Returns ∇_j C_i of two different points; moving j towards i increases C_i.
    fn pair(&self, i: usize, j: usize) -> DVec3 {
        let calibration = &self.inputs.model.calibration;
        let h = calibration.support_radius;
        let d = self.inputs.between(i, j);
        if self.is_exact {
            let p = (1.0 - d.length_squared() / (h * h)).max(0.0);
            return d * (6.0 * calibration.density_scale * p * p / (h * h));
        }
        let r = d.length();
        let s = (1.0 - r / h).max(0.0);
        d * (calibration.gradient_scale * s * s / r.max(1e-15))
    }
}
