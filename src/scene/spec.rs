//! The scene as it is written: types for serde, with spans for messages, and no logic.

use serde::Deserialize;
use toml::Spanned;

use super::{Effects, budget::BudgetSpec, grids::GridsSpec, probe::ProbeSpec};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneSpec {
    pub(super) shot: ShotSpec,
    pub(super) domain: BoxSpec,
    #[serde(default)]
    pub(super) water: WaterSpec,
    #[serde(default)]
    pub(super) solid: Vec<SolidSpec>,
    #[serde(default)]
    pub(super) wave_maker: Vec<WaveMakerSpec>,
    pub(super) solver: SolverSpec,
    pub(super) grids: Option<Spanned<GridsSpec>>,
    #[serde(default)]
    pub(super) probe: Vec<Spanned<ProbeSpec>>,
    #[serde(default)]
    pub(super) budget: BudgetSpec,
    #[serde(default)]
    pub(super) effects: Effects,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ShotSpec {
    pub(super) name: Spanned<String>,
    pub(super) frames: Spanned<i64>,
    pub(super) frames_per_second: Spanned<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BoxSpec {
    pub(super) min: Spanned<[f64; 3]>,
    pub(super) max: Spanned<[f64; 3]>,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WaterSpec {
    pub(super) rest_density: Option<Spanned<f64>>,
    pub(super) gravity: Option<Spanned<[f64; 3]>>,
    #[serde(default)]
    pub(super) block: Vec<BoxSpec>,
    #[serde(default)]
    pub(super) mesh: Vec<WaterMeshSpec>,
    #[serde(default)]
    pub(super) particles: Vec<SwarmSpec>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SwarmSpec {
    pub(super) at: Spanned<Vec<[f64; 3]>>,
    pub(super) velocity: Option<Spanned<[f64; 3]>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WaterMeshSpec {
    pub(super) file: Spanned<String>,
    pub(super) blake3: Option<Spanned<String>>,
    pub(super) translate: Option<Spanned<[f64; 3]>>,
    pub(super) rotate_degrees: Option<Spanned<[f64; 3]>>,
    pub(super) scale: Option<Spanned<ScaleSpec>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SolidSpec {
    pub(super) mesh: Spanned<String>,
    pub(super) blake3: Option<Spanned<String>>,
    pub(super) translate: Option<Spanned<[f64; 3]>>,
    pub(super) rotate_degrees: Option<Spanned<[f64; 3]>>,
    pub(super) scale: Option<Spanned<ScaleSpec>>,
    pub(super) direction: Option<Spanned<[f64; 3]>>,
    pub(super) motion: Option<Spanned<MotionSpec>>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
pub(super) enum ScaleSpec {
    Uniform(f64),
    PerAxis([f64; 3]),
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WaveMakerSpec {
    pub(super) wall: Spanned<String>,
    pub(super) motion: Spanned<MotionSpec>,
}

/// One flat table for every kind: serde's tagged enums would lose the spans.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MotionSpec {
    pub(super) kind: Spanned<String>,
    pub(super) velocity: Option<Spanned<f64>>,
    pub(super) until: Option<Spanned<f64>>,
    pub(super) stroke: Option<Spanned<f64>>,
    pub(super) period: Option<Spanned<f64>>,
    pub(super) ramp: Option<Spanned<f64>>,
    pub(super) height: Option<Spanned<f64>>,
    pub(super) depth: Option<Spanned<f64>>,
    pub(super) file: Option<Spanned<String>>,
    pub(super) points: Option<Spanned<Vec<[f64; 2]>>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SolverSpec {
    pub(super) method: Spanned<String>,
    pub(super) pbf: Option<PbfSpec>,
    pub(super) flip: Option<FlipSpec>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PbfSpec {
    pub(super) particle_spacing: Spanned<f64>,
    pub(super) support_ratio: Option<Spanned<f64>>,
    pub(super) iteration: Option<Spanned<String>>,
    pub(super) spectral_radius: Option<Spanned<f64>>,
    pub(super) iterations: Option<Spanned<i64>>,
    pub(super) density_error: Option<Spanned<f64>>,
    pub(super) max_iterations: Option<Spanned<i64>>,
    pub(super) cfl: Option<Spanned<f64>>,
    pub(super) relaxation: Option<Spanned<f64>>,
    pub(super) artificial_pressure: Option<Spanned<f64>>,
    pub(super) max_substeps: Option<Spanned<i64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FlipSpec {
    pub(super) cell_size: Spanned<f64>,
    pub(super) particles_per_cell: Option<Spanned<i64>>,
    pub(super) transfer: Option<Spanned<String>>,
    pub(super) pic_blend: Option<Spanned<f64>>,
    pub(super) cfl: Option<Spanned<f64>>,
    pub(super) max_substeps: Option<Spanned<i64>>,
    pub(super) surface: Option<Spanned<String>>,
    pub(super) density_correction: Option<bool>,
    #[serde(default)]
    pub(super) pressure: PressureSpec,
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PressureSpec {
    pub(super) preconditioner: Option<Spanned<String>>,
    pub(super) precision: Option<Spanned<String>>,
    pub(super) tolerance: Option<Spanned<f64>>,
    pub(super) max_iterations: Option<Spanned<i64>>,
}
