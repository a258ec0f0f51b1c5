//! Reads `[budget]`: limits on a bake, which stops where one is exceeded.

use swell_scene::{Budget, Method, SceneError, Shot, Solver, budget::SPEED_JUMP, words::shown};

use super::{
    document::Document,
    keys::{
        BudgetSpec,
        budget::{DENSITY_ERROR_MAX, FLIP_ENERGY, LEAST_SPEED, Limit, PBF_ENERGY, RESIDUAL, SPEED},
    },
};

/// Speeds that a scene causes by itself, m/s, its particle spacing, metres, and the tolerance of
/// its pressure solve.
pub(super) struct Scales {
    pub(super) fall: f64,
    pub(super) push: f64,
    /// Wind and other effects whose work is not counted.
    pub(super) wind: f64,
    pub(super) spacing: f64,
    /// Of FLIP's settings, chosen or not; 0 without them.
    pub(super) tolerance: f64,
}

/// Builds the limits for the chosen solver.
pub(super) fn build(
    doc: &Document<'_>,
    spec: &BudgetSpec,
    shot: &Shot,
    solver: &Solver,
    scales: &Scales,
) -> Result<Budget, SceneError> {
    let tolerance = scales.tolerance;
    let slowest = LEAST_SPEED * scales.spacing * shot.frames_per_second;
    let speed = (SPEED * (scales.fall + scales.push + scales.wind)).max(slowest);
    let energy = match solver.method() {
        Method::Pbf => PBF_ENERGY,
        Method::Flip => FLIP_ENERGY,
    };
    let energy = (scales.wind == 0.0).then_some(energy);
    let of_flip = |limit: f64| (solver.method() == Method::Flip).then_some(limit);
    let residual = match spec.residual {
        Some(Limit::Most(limit)) if limit < tolerance => {
            let problem = format!("{} is out of range", shown(limit));
            return Err(doc.fault_of("budget.residual", problem));
        }
        Some(limit) => limit.into(),
        None => Some(RESIDUAL.max(tolerance)),
    };
    Ok(Budget {
        speed: spec.speed.map_or(Some(speed), Limit::into),
        speed_jump: spec.speed_jump.map_or(of_flip(SPEED_JUMP), Limit::into),
        density_error_mean: spec.density_error_mean.into(),
        density_error_p99: spec.density_error_p99.into(),
        density_error_max: (spec.density_error_max).map_or(of_flip(DENSITY_ERROR_MAX), Limit::into),
        capped: spec.capped.into(),
        residual,
        divergence: spec.divergence.into(),
        volume: spec.volume.into(),
        energy: spec.energy.map_or(energy, Limit::into),
        particles: spec.particles.into(),
    })
}

impl From<&Budget> for BudgetSpec {
    fn from(budget: &Budget) -> Self {
        Self {
            speed: Some(budget.speed.into()),
            speed_jump: Some(budget.speed_jump.into()),
            density_error_mean: budget.density_error_mean.into(),
            density_error_p99: budget.density_error_p99.into(),
            density_error_max: Some(budget.density_error_max.into()),
            capped: budget.capped.into(),
            residual: Some(budget.residual.into()),
            divergence: budget.divergence.into(),
            volume: budget.volume.into(),
            energy: Some(budget.energy.into()),
            particles: budget.particles.into(),
        }
    }
}
