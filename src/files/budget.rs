//! Reads `[budget]`: limits on a bake, which stops where one is exceeded.

use serde::{Deserialize, Serialize};

use swell_scene::{Budget, Method, SceneError, Shot, Solver, budget::SPEED_JUMP, words::shown};

use super::{document::Document, keys::BudgetSpec};

/// Defaults that depend on the scene; the others are in the table of keys.
const SPEED: f64 = 4.0;

const RESIDUAL: f64 = 1e-2;

/// Boundary work misses what a wall does to the drops that it overtakes without pressure: 6 % of a
/// frame in the small box of tests/hard_cases/24-leaving.toml, 0.1 % in the quickstart.
const FLIP_ENERGY: f64 = 0.1;

/// With few corrections and long frames PBF creates energy: 4 % per frame in the quickstart, 7 %
/// with Chebyshev's iteration.
const PBF_ENERGY: f64 = 0.25;

/// Default with FLIP. Splashes of the shipped scenes reach 0.9, water that leaked along a wall 24.
const DENSITY_ERROR_MAX: f64 = 4.0;

/// Least default speed limit, spacings per frame, for scenes without gravity or moving walls.
const LEAST_SPEED: f64 = 10.0;

/// Describes the default of `budget.speed`.
pub(super) fn speed_words() -> String {
    format!(
        "{SPEED} (√(2 g × the domain's diagonal) + the fastest wall or moving solid), at least \
         {LEAST_SPEED} spacings a frame"
    )
}

pub(super) fn speed_jump_words() -> String {
    format!("false with pbf, {SPEED_JUMP:?} with flip")
}

pub(super) fn density_error_max_words() -> String {
    format!("false with pbf, {DENSITY_ERROR_MAX:?} with flip")
}

pub(super) fn residual_words() -> String {
    format!("{RESIDUAL}, or the tolerance where that is larger")
}

pub(super) fn energy_words() -> String {
    format!(
        "{PBF_ENERGY} with pbf, {FLIP_ENERGY} with flip, false in a wind or with surface tension"
    )
}

/// A limit as written.
#[derive(Clone, Copy, Debug, Deserialize, Serialize)]
#[serde(untagged)]
pub(crate) enum Limit {
    /// `false`: nothing is too much.
    Off(bool),
    Most(f64),
}

impl From<Option<f64>> for Limit {
    fn from(limit: Option<f64>) -> Self {
        limit.map_or(Self::Off(false), Self::Most)
    }
}

impl From<Limit> for Option<f64> {
    fn from(limit: Limit) -> Self {
        match limit {
            Limit::Off(_) => None,
            Limit::Most(limit) => Some(limit),
        }
    }
}

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
