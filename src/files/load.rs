//! Loads a [`Scene`] from a file.

use std::path::Path;

use serde::Deserialize as _;

use swell_domain::text;
use swell_scene::{Scene, SceneError};

#[cfg(doc)]
use super::scene_to_toml;
use super::{
    Reach, build,
    difference::younger,
    document::Document,
    keys::{self, SceneSpec},
};

/// Loads a scene file with overrides applied. An override is a dotted key and a TOML value or
/// bare word, such as `solver.pbf.iterations=8`. Mesh and table paths are relative to the file
/// and must stay below its folder.
///
/// # Errors
/// [`SceneError`] with file, line, key and allowed values.
pub fn load_scene(path: &Path, overrides: &[String]) -> Result<Scene, SceneError> {
    load_scene_within(path, overrides, Reach::Folder)
}

/// Loads as [`load_scene`] does, with files resolved within `reach`.
///
/// # Errors
/// Those of [`load_scene`].
pub fn load_scene_within(
    path: &Path,
    overrides: &[String],
    reach: Reach,
) -> Result<Scene, SceneError> {
    let text = text::read(path).map_err(|source| SceneError::Read {
        file: path.to_owned(),
        source,
    })?;
    let base_dir = path.parent().unwrap_or(Path::new(""));
    parse_scene_within(&text, path, base_dir, overrides, reach)
}

/// Parses a scene as [`load_scene`] does; `file` names it in messages. Relative paths start at
/// `base_dir` and must not leave it.
///
/// # Errors
/// Those of [`load_scene`].
pub fn parse_scene(
    text: &str,
    file: &Path,
    base_dir: &Path,
    overrides: &[String],
) -> Result<Scene, SceneError> {
    parse_scene_within(text, file, base_dir, overrides, Reach::Folder)
}

/// Parses a scene that [`scene_to_toml`] wrote into a cache. Keys that did not exist then get
/// the value that reproduces the behaviour of that time, whatever their default is now.
///
/// # Errors
/// Those of [`load_scene`].
pub fn recorded_scene(text: &str, file: &Path, base_dir: &Path) -> Result<Scene, SceneError> {
    parse_scene(text, file, base_dir, &younger(text)?)
}

/// Parses as [`parse_scene`] does, with files resolved within `reach`.
///
/// # Errors
/// Those of [`load_scene`].
pub fn parse_scene_within(
    text: &str,
    file: &Path,
    base_dir: &Path,
    overrides: &[String],
    reach: Reach,
) -> Result<Scene, SceneError> {
    let (document, mut root) = Document::parse(text, file, overrides, keys::SCENE)?;
    let document = document.within(reach);
    document.settle(&mut root)?;
    let spec = SceneSpec::deserialize(toml::Deserializer::from(root))
        .map_err(|error| document.translate(&error))?;
    build::scene(&document, base_dir, spec)
}

#[cfg(test)]
mod tests;
