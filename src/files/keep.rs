//! `[keep]`: which data of a bake stay on disk, and their compression.

use serde::Deserialize;

use super::document::Document;
use swell_domain::keep::{Compression, Keep};
use swell_scene::SceneError;

/// Values of `compression`.
pub(super) const COMPRESSIONS: [&str; 2] = ["none", "zstd"];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct KeepSpec {
    #[serde(default = "all")]
    particles: String,
    #[serde(default)]
    compression: CompressionSpec,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum CompressionSpec {
    #[default]
    None,
    Zstd,
}

fn all() -> String {
    Keep::All.to_string()
}

/// Validated settings.
#[derive(Clone, Copy)]
pub(super) struct Kept {
    pub(super) particles: Keep,
    pub(super) compression: Option<Compression>,
}

pub(super) fn build(doc: &Document<'_>, spec: &KeepSpec) -> Result<Kept, SceneError> {
    let text = &spec.particles;
    let particles = text
        .parse()
        .map_err(|error| doc.fault_of("keep.particles", format!("{text:?}: {error}")))?;
    let compression = match spec.compression {
        CompressionSpec::None => None,
        CompressionSpec::Zstd => Some(Compression::Zstd),
    };
    Ok(Kept {
        particles,
        compression,
    })
}

/// Returns the value of `compression` in a scene.
pub(super) fn name(compression: Option<Compression>) -> &'static str {
    match compression {
        None => "none",
        Some(Compression::Zstd) => "zstd",
    }
}
