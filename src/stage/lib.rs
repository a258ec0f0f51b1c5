//! Jobs of the program: each combines the other crates to turn a typed request into a typed result.
//! No terminal and no printing.

pub mod bake;
pub mod branch;
pub mod check;
pub mod derived;
pub mod device;
pub mod diff;
pub mod drive;
pub mod export;
pub mod gauge;
pub mod inspect;
mod numbering;
pub mod prepare;
mod probes;
pub mod render;
pub mod replay;
pub mod time;
pub mod verify;
pub mod view;
mod watch;
pub mod wet;
pub mod whitewater;

use std::path::Path;
use swell_files::recorded_scene;

use swell_cache::{CacheError, CacheReader};
use swell_domain::{frame_range::FrameRange, signed_distance::SignedDistanceError};
use swell_files::study::{StudyFileError, tune::TuneError};
use swell_gpu::{adapter::GpuError, shader::ShadersError};
use swell_reference::ReferenceError;
use swell_scene::{Scene, SceneError, look::LookError};
use swell_solve::SolveError;

/// The cache's own copy of its scene: what was baked, wherever the cache has been moved.
fn baked_scene(cache: &CacheReader, directory: &Path) -> Result<Scene, SceneError> {
    let file = directory.join("scene.toml");
    recorded_scene(cache.scene_toml(), &file, directory)
}

/// The requested frames of a cache; by default all frames after its first that have particles.
fn frames_of(cache: &CacheReader, asked: Option<&FrameRange>) -> Vec<u32> {
    match asked {
        Some(frames) => frames.iter().collect(),
        None => (cache.first_frame() + 1..=cache.last_frame())
            .filter(|&frame| cache.has_particles(frame))
            .collect(),
    }
}

/// The origin of an error, which alone decides how a caller handles it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Blame {
    /// Arguments, the scene, the look, or a file that they name.
    Input,
    /// No usable device, a scene too large for it, or a lost device.
    Device,
    /// A cache or picture that is damaged, belongs to another scene, or cannot be read or written.
    Files,
    /// Invalid numbers in a solve.
    Numbers,
}

impl From<&GpuError> for Blame {
    fn from(error: &GpuError) -> Self {
        match error {
            GpuError::TooLarge { .. }
            | GpuError::NoF64 { .. }
            | GpuError::NoImprecision { .. }
            | GpuError::NoErrorTerms { .. }
            | GpuError::NoSuchAdapter { .. }
            | GpuError::EditedShader { .. } => Self::Input,
            GpuError::NoAdapter { .. }
            | GpuError::Software { .. }
            | GpuError::Open { .. }
            | GpuError::TooManyBuffers { .. }
            | GpuError::Lost(_)
            | GpuError::Shader { .. } => Self::Device,
        }
    }
}

impl From<&ShadersError> for Blame {
    fn from(_: &ShadersError) -> Self {
        Self::Input
    }
}

impl From<&SolveError> for Blame {
    fn from(error: &SolveError) -> Self {
        match error {
            SolveError::Gpu(error) => error.into(),
            SolveError::Count { .. } | SolveError::Bodies(_) => Self::Files,
            SolveError::NoSubstep { .. } => Self::Input,
            SolveError::Numbers(_) => Self::Numbers,
        }
    }
}

impl From<&ReferenceError> for Blame {
    fn from(error: &ReferenceError) -> Self {
        match error {
            ReferenceError::Bodies(_) => Self::Files,
            ReferenceError::Numbers(_)
            | ReferenceError::Factor(_)
            | ReferenceError::NotConverged { .. } => Self::Numbers,
        }
    }
}

impl From<&CacheError> for Blame {
    fn from(_: &CacheError) -> Self {
        Self::Files
    }
}

impl From<&SceneError> for Blame {
    fn from(_: &SceneError) -> Self {
        Self::Input
    }
}

impl From<&LookError> for Blame {
    fn from(_: &LookError) -> Self {
        Self::Input
    }
}

impl From<&StudyFileError> for Blame {
    fn from(_: &StudyFileError) -> Self {
        Self::Input
    }
}

impl From<&TuneError> for Blame {
    fn from(_: &TuneError) -> Self {
        Self::Input
    }
}

impl From<&SignedDistanceError> for Blame {
    fn from(_: &SignedDistanceError) -> Self {
        Self::Input
    }
}
