//! The projection of a substep: the system, its direct solve, and the update of the faces.

use glam::DVec3;

use super::{Centers, Faces, Model, Waters, density_source};
use crate::{
    ReferenceError, Timings,
    poisson::{self, gradients::Solution},
};
use swell_domain::{body::Six, poisson::System, solver::Projection};

/// Result of a substep's projection.
#[derive(Clone, Debug, PartialEq)]
pub struct Projected {
    /// The linear system.
    pub system: System,
    /// q for each row, m/s; times ρ Δx / Δt it is a pressure in pascals.
    pub solution: Solution,
    /// Solution for the density correction's displacements, metres, if the correction is on.
    pub correction: Option<Solution>,
    /// Bodies of water that no air touches.
    pub pockets: u32,
    /// Largest |mean of ∇·u| over such a body, 1/s.
    pub incompatible: f64,
    /// Largest |∇·u| in a cell with a row, before and after the projection, 1/s.
    pub divergence: [f64; 2],
    /// Changes of the bodies' velocities, m/s and rad/s.
    pub changes: Vec<Six>,
}

impl Projected {
    /// Adds this projection to the report of a frame's projections.
    pub(super) fn add_to(&self, all: &mut Projection) {
        all.residual = all.residual.max(self.solution.residual);
        let [before, after] = self.divergence;
        all.divergence_before = all.divergence_before.max(before);
        all.divergence_after = all.divergence_after.max(after);
        all.pockets = all.pockets.max(self.pockets);
        all.incompatible = all.incompatible.max(self.incompatible);
        all.dropped += self.system.dropped.len() as u64;
        let correction = self.correction.iter().map(|s| u64::from(s.iterations));
        all.correction_iterations += correction.sum::<u64>();
    }
}

/// Makes the velocities divergence-free. Returns the results of the solves, and the density
/// correction's displacements if it is on and `centers` are given.
pub(super) fn project(
    model: &Model,
    timings: &mut Timings,
    factor_budget: u64,
    waters: &mut Waters<'_>,
    centers: Option<&Centers>,
    faces: &mut Faces,
) -> Result<(Projected, Option<Vec<DVec3>>), ReferenceError> {
    let system = timings.time("pressure/build_system", || waters.system());
    let solver = timings.time("pressure/prepare", || {
        poisson::Solver::new(&system, factor_budget)
    })?;
    let b = waters.divergence(&system, &faces.velocity);
    let solution = timings.time("pressure/solve", || solver.solve(&b));
    waters.project(
        &waters.by_element(&system, &solution.x),
        &mut faces.velocity,
    );
    let changes: Vec<Six> = system
        .bodies
        .iter()
        .map(|it| it.change(&solution.x))
        .collect();
    let means: Vec<f64> = (solver.pockets().iter())
        .map(|pocket| pocket.iter().map(|&row| b[row as usize]).sum::<f64>() / pocket.len() as f64)
        .collect();
    let incompatible = largest(&means) / model.cell_size();
    let mut flux = vec![0.0; system.cell.len()];
    // Bodies that come to rest squeeze water that no air touches: it may leave (pressure/center).
    if !system.bodies.is_empty() {
        for (pocket, mean) in solver.pockets().iter().zip(&means) {
            pocket.iter().for_each(|&row| flux[row as usize] += mean);
        }
    }
    for (body, change) in system.bodies.iter().zip(&changes) {
        body.add_flux(change, &mut flux);
    }
    waters.add_flux(&system, &flux);
    let after = waters.divergence(&system, &faces.velocity);
    let corrected = centers.filter(|_| model.settings().density_correction);
    // Bodies stand still in the correction.
    let still = (!system.bodies.is_empty()).then(|| System {
        bodies: Vec::new(),
        ..system.clone()
    });
    let still = still.as_ref().filter(|_| corrected.is_some());
    let still = still
        .map(|still| poisson::Solver::new(still, factor_budget))
        .transpose()?;
    let correction = corrected.map(|centers| {
        let source = density_source(model, &system, centers);
        let solver = still.as_ref().unwrap_or(&solver);
        timings.time("pressure/solve", || solver.solve(&source))
    });
    let displacement = (correction.as_ref())
        .map(|correction| waters.displace(&waters.by_element(&system, &correction.x)));
    let pockets = solver.pockets().len() as u32;
    let projected = Projected {
        divergence: [&b, &after].map(|b| largest(b) / model.cell_size()),
        solution,
        correction,
        pockets,
        incompatible,
        changes,
        system,
    };
    Ok((projected, displacement))
}

fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}
