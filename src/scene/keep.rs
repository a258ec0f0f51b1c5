//! `[keep]`: what of a bake stays on the disk.

use serde::Deserialize;

use super::{document::Document, error::SceneError};
use crate::domain::keep::Keep;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct KeepSpec {
    particles: String,
}

/// Builds the table.
pub(super) fn build(doc: &Document<'_>, spec: &KeepSpec) -> Result<Keep, SceneError> {
    let text = &spec.particles;
    text.parse()
        .map_err(|error| doc.fault_of("keep.particles", format!("{text:?}: {error}")))
}
