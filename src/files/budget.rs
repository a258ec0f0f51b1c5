//! Reads `[budget]`: limits on a bake, which stops where one is exceeded.

use serde::{Deserialize, Deserializer};

use swell_scene::{Budget, Method, SceneError, Shot, Solver, budget::SPEED_JUMP, words::shown};

use super::document::Document;

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

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BudgetSpec {
    speed: Option<Limit>,
    speed_jump: Option<Limit>,
    density_error_mean: Limit,
    density_error_p99: Limit,
    density_error_max: Option<Limit>,
    capped: Limit,
    residual: Option<Limit>,
    divergence: Limit,
    volume: Limit,
    energy: Option<Limit>,
    particles: Limit,
}

#[derive(Clone, Copy)]
struct Limit(Option<f64>);

impl<'de> Deserialize<'de> for Limit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Written {
            Off(#[expect(dead_code, reason = "only `false` is allowed")] bool),
            Limit(f64),
        }
        Ok(Self(match Written::deserialize(deserializer)? {
            Written::Off(_) => None,
            Written::Limit(limit) => Some(limit),
        }))
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
        Some(Limit(Some(limit))) if limit < tolerance => {
            let problem = format!("{} is out of range", shown(limit));
            return Err(doc.fault_of("budget.residual", problem));
        }
        Some(Limit(limit)) => limit,
        None => Some(RESIDUAL.max(tolerance)),
    };
    Ok(Budget {
        speed: spec.speed.map_or(Some(speed), |limit| limit.0),
        speed_jump: spec.speed_jump.map_or(of_flip(SPEED_JUMP), |limit| limit.0),
        density_error_mean: spec.density_error_mean.0,
        density_error_p99: spec.density_error_p99.0,
        density_error_max: (spec.density_error_max)
            .map_or(of_flip(DENSITY_ERROR_MAX), |limit| limit.0),
        capped: spec.capped.0,
        residual,
        divergence: spec.divergence.0,
        volume: spec.volume.0,
        energy: spec.energy.map_or(energy, |limit| limit.0),
        particles: spec.particles.0,
    })
}
