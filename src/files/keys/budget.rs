//! Keys of a scene's `[budget]`.

use serde::{Deserialize, Serialize};

use super::super::{declare::keys, key::Interval};
use swell_scene::budget::SPEED_JUMP;

/// Defaults that depend on the scene; the others are in the table of keys.
pub(crate) const SPEED: f64 = 4.0;

pub(crate) const RESIDUAL: f64 = 1e-2;

/// Boundary work misses what a wall does to the drops that it overtakes without pressure: 6 % of a
/// frame in the small box of tests/hard_cases/24-leaving.toml, 0.1 % in the quickstart.
pub(crate) const FLIP_ENERGY: f64 = 0.1;

/// With few corrections and long frames PBF creates energy: 4 % per frame in the quickstart, 7 %
/// with Chebyshev's iteration.
pub(crate) const PBF_ENERGY: f64 = 0.25;

/// Default with FLIP. Splashes of the shipped scenes reach 0.9, water that leaked along a wall 24.
pub(crate) const DENSITY_ERROR_MAX: f64 = 4.0;

/// Least default speed limit, spacings per frame, for scenes without gravity or moving walls.
pub(crate) const LEAST_SPEED: f64 = 10.0;

/// Describes the default of `budget.speed`.
fn speed_words() -> String {
    format!(
        "{SPEED} (√(2 g × the domain's diagonal) + the fastest wall or moving solid), at least \
         {LEAST_SPEED} spacings a frame"
    )
}

fn speed_jump_words() -> String {
    format!("false with pbf, {SPEED_JUMP:?} with flip")
}

fn density_error_max_words() -> String {
    format!("false with pbf, {DENSITY_ERROR_MAX:?} with flip")
}

fn residual_words() -> String {
    format!("{RESIDUAL}, or the tolerance where that is larger")
}

fn energy_words() -> String {
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

/// Range of a limit in its unit, wider than any value that `f32` resolves or that a
/// simulation reaches.
const LIMIT: Interval = 1e-12..=1e12;

// Defaults are a few times the values of the shipped scenes; docs/scene.md lists the largest of
// these.
keys! { struct BudgetSpec {
    speed: Option<Limit> = number_or_false(LIMIT)
        .unit("m/s")
        .computed(speed_words)
        .about("of a particle at a frame's end"),
    speed_jump: Option<Limit> = number_or_false(LIMIT)
        .unit("times")
        .computed(speed_jump_words)
        .about(
            "of a frame's fastest particle over the fastest before it with what gravity, \
             walls and moving solids add",
        ),
    density_error_mean: Limit = number_or_false(LIMIT)
        .unit("of the rest density")
        .default("0.5")
        .about("mean of max(0, ρ/ρ0 − 1) at a frame's end"),
    density_error_p99: Limit = number_or_false(LIMIT)
        .unit("of the rest density")
        .default("5.0")
        .about("its 99th percentile"),
    density_error_max: Option<Limit> = number_or_false(LIMIT)
        .unit("of the rest density")
        .computed(density_error_max_words)
        .about("its largest"),
    capped: Limit = number_or_false(LIMIT)
        .unit("of all particles in all substeps")
        .default("0.01")
        .about("times that a particle was slowed to the displacement cap"),
    residual: Option<Limit> = number_or_false(LIMIT)
        .unit("of the right-hand side's norm")
        .also(", at least solver.flip.pressure.tolerance")
        .computed(residual_words)
        .about("true residual of a projection"),
    divergence: Limit = number_or_false(LIMIT)
        .unit("of a cell's volume in a substep")
        .default("0.1")
        .about("largest |∇·u| Δt after a projection"),
    volume: Limit = number_or_false(LIMIT)
        .unit("of the volume at the start")
        .default("false")
        .about("how far the volume may be off; measured only where it is set"),
    energy: Option<Limit> = number_or_false(LIMIT)
        .unit("of the total energy in a frame")
        .computed(energy_words)
        .about("rise of kinetic and potential energy beyond the work of walls and solids"),
    particles: Limit = number_or_false(1.0..=134_217_728.0)
        .default("false")
        .about(
            "how many there may be, with what emitters bring; a bake that is known to have more is \
             refused before it begins",
        ),
} }
