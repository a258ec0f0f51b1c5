//! `[keep]`: which data of a bake stay on disk, and their compression.

use super::{
    document::Document,
    keys::{COMPRESSIONS, KeepSpec},
};
use swell_domain::keep::{Compression, Keep};
use swell_scene::SceneError;

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
    Ok(Kept {
        particles,
        compression: (spec.compression == COMPRESSIONS[1]).then_some(Compression::Zstd),
    })
}

/// Returns the value of `compression` in a scene.
pub(super) fn name(compression: Option<Compression>) -> &'static str {
    match compression {
        None => COMPRESSIONS[0],
        Some(Compression::Zstd) => COMPRESSIONS[1],
    }
}
