//! Serde types of the motions of walls and solids.

use serde::Deserialize;

use swell_domain::motion::Spectrum;
use swell_scene::words::shown;

/// A translation with the keys of its kind.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum MotionSpec {
    Still,
    ConstantVelocity {
        velocity: f64,
        until: Option<f64>,
    },
    Sine {
        stroke: f64,
        period: f64,
        ramp: Option<f64>,
    },
    Solitary {
        height: f64,
        depth: f64,
    },
    Stokes {
        height: f64,
        period: f64,
        depth: f64,
        ramp: Option<f64>,
    },
    Cnoidal {
        height: f64,
        period: f64,
        depth: f64,
        ramp: Option<f64>,
    },
    Sea {
        significant_height: f64,
        seed: u32,
        spectrum: Spectrum,
        peak_enhancement: Option<f64>,
        peak_period: f64,
        shortest_period: Option<f64>,
        depth: f64,
        ramp: Option<f64>,
        second_order: bool,
    },
    Focused {
        height: f64,
        at: f64,
        time: f64,
        spectrum: Spectrum,
        peak_enhancement: Option<f64>,
        peak_period: f64,
        shortest_period: Option<f64>,
        depth: f64,
        ramp: Option<f64>,
        second_order: bool,
    },
    Table {
        file: Option<String>,
        points: Option<Vec<[f64; 2]>>,
    },
}

/// A rotation with the keys of its kind.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum TurnSpec {
    ConstantVelocity {
        degrees_per_second: f64,
        until: Option<f64>,
    },
    Sine {
        swing_degrees: f64,
        period: f64,
        ramp: Option<f64>,
    },
    Table {
        file: Option<String>,
        points: Option<Vec<[f64; 2]>>,
    },
}

/// Largest speed of a motion, m/s; equal to the largest `velocity`.
const MAX_SPEED: f64 = 1e5;

/// Checks that the speed that results from all keys of a motion is within the range of a velocity.
pub(super) fn check_speed(speed: f64) -> Result<(), String> {
    if speed <= MAX_SPEED {
        return Ok(());
    }
    Err(format!(
        "it moves at {} m/s; allowed: up to {} m/s",
        shown(speed),
        shown(MAX_SPEED)
    ))
}
