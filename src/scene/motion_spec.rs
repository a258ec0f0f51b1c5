//! Motions of walls and solids as a scene has them.

use serde::Deserialize;

/// A motion with the keys of its kind.
#[derive(Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum MotionSpec {
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
    Table {
        file: Option<String>,
        points: Option<Vec<[f64; 2]>>,
    },
}
