//! Serde types of the scene file, without logic. Ranges are checked and defaults filled in before
//! deserialization.

use glam::DVec3;
use serde::Deserialize;

use super::{
    axis::Axis,
    budget::BudgetSpec,
    grids::GridsSpec,
    keep::KeepSpec,
    motion_spec::{MotionSpec, TurnSpec},
    probe::ProbeSpec,
};
use swell_scene::{Effects, Iteration, Method, Shot, Wall, flip::Flip, start_waves::StartWave};

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SceneSpec {
    pub(super) shot: Shot,
    pub(super) domain: DomainSpec,
    pub(super) water: WaterSpec,
    #[serde(default)]
    pub(super) solid: Vec<MeshSpec>,
    #[serde(default)]
    pub(super) wave_maker: Vec<WaveMakerSpec>,
    #[serde(default)]
    pub(super) emitter: Vec<EmitterSpec>,
    #[serde(default)]
    pub(super) drain: Vec<DrainSpec>,
    pub(super) solver: SolverSpec,
    pub(super) grids: Option<GridsSpec>,
    pub(super) keep: Option<KeepSpec>,
    #[serde(default)]
    pub(super) probe: Vec<ProbeSpec>,
    pub(super) budget: BudgetSpec,
    pub(super) effects: Effects,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BoxSpec {
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DomainSpec {
    pub(super) min: [f64; 3],
    pub(super) max: [f64; 3],
    pub(super) walls: Option<String>,
    #[serde(default)]
    pub(super) no_slip: Vec<Wall>,
    #[serde(default)]
    pub(super) periodic: Vec<Axis>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WaterSpec {
    pub(super) rest_density: f64,
    pub(super) gravity: [f64; 3],
    #[serde(default)]
    pub(super) block: Vec<BoxSpec>,
    #[serde(default)]
    pub(super) mesh: Vec<MeshSpec>,
    #[serde(default)]
    pub(super) wave: Vec<StartWave>,
    #[serde(default)]
    pub(super) particles: Vec<SwarmSpec>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SwarmSpec {
    pub(super) at: Vec<[f64; 3]>,
    pub(super) velocity: [f64; 3],
}

/// A mesh of water or of a solid; water uses the key `file` and does not move.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct MeshSpec {
    #[serde(alias = "mesh")]
    pub(super) file: String,
    pub(super) blake3: Option<String>,
    pub(super) translate: [f64; 3],
    pub(super) rotate_degrees: [f64; 3],
    pub(super) scale: ScaleSpec,
    pub(super) direction: Option<[f64; 3]>,
    pub(super) motion: Option<MotionSpec>,
    pub(super) pivot: Option<[f64; 3]>,
    pub(super) axis: Option<[f64; 3]>,
    pub(super) turn: Option<TurnSpec>,
    pub(super) track: Option<TrackSpec>,
}

/// Poses of a solid over time.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct TrackSpec {
    pub(super) file: Option<String>,
    pub(super) node: Option<String>,
    pub(super) start: Option<f64>,
    pub(super) poses: Option<Vec<[f64; 8]>>,
}

impl MeshSpec {
    /// Whether it is a moving solid.
    pub(super) fn moves(&self) -> bool {
        self.motion.is_some() || self.turn.is_some() || self.track.is_some()
    }
}

#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
pub(super) enum ScaleSpec {
    Uniform(f64),
    PerAxis([f64; 3]),
}

impl From<ScaleSpec> for DVec3 {
    fn from(scale: ScaleSpec) -> Self {
        match scale {
            ScaleSpec::Uniform(scale) => Self::splat(scale),
            ScaleSpec::PerAxis(scale) => Self::from_array(scale),
        }
    }
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WaveMakerSpec {
    pub(super) wall: Wall,
    pub(super) motion: MotionSpec,
    pub(super) absorption: Option<AbsorptionSpec>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct AbsorptionSpec {
    pub(super) depth: f64,
    pub(super) period: f64,
    pub(super) room: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct EmitterSpec {
    pub(super) min: Option<[f64; 3]>,
    pub(super) max: Option<[f64; 3]>,
    pub(super) mesh: Option<MeshSpec>,
    pub(super) velocity: [f64; 3],
    pub(super) level: Option<f64>,
    pub(super) from: f64,
    pub(super) until: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DrainSpec {
    pub(super) min: Option<[f64; 3]>,
    pub(super) max: Option<[f64; 3]>,
    pub(super) mesh: Option<MeshSpec>,
    pub(super) level: Option<f64>,
    pub(super) rate: Option<f64>,
    pub(super) from: f64,
    pub(super) until: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SolverSpec {
    pub(super) method: Method,
    pub(super) pbf: Option<PbfSpec>,
    pub(super) flip: Option<Flip>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PbfSpec {
    pub(super) particle_spacing: f64,
    pub(super) support_ratio: f64,
    pub(super) iteration: Iteration,
    pub(super) spectral_radius: Option<f64>,
    pub(super) iterations: Option<u32>,
    pub(super) density_error: Option<f64>,
    pub(super) max_iterations: Option<u32>,
    pub(super) cfl: f64,
    pub(super) relaxation: Option<f64>,
    pub(super) artificial_pressure: f64,
    pub(super) grid_projection: bool,
    pub(super) max_substeps: u32,
}
