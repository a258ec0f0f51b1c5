//! Loads a [`Scene`] from a file.

use std::path::Path;

use serde::Deserialize as _;

use super::{
    Reach, Scene, build, difference::younger, document::Document, error::SceneError, keys,
    spec::SceneSpec,
};
use swell_domain::text;

impl Scene {
    /// Loads a scene file with overrides applied. An override is a dotted key and a TOML value or
    /// bare word, such as `solver.pbf.iterations=8`. Mesh and table paths are relative to the file
    /// and must stay below its folder.
    ///
    /// # Errors
    /// [`SceneError`] with file, line, key and allowed values.
    pub fn load(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        Self::load_within(path, overrides, Reach::Folder)
    }

    /// Loads as [`Self::load`] does, with files resolved within `reach`.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn load_within(
        path: &Path,
        overrides: &[String],
        reach: Reach,
    ) -> Result<Self, SceneError> {
        let text = text::read(path).map_err(|source| SceneError::Read {
            file: path.to_owned(),
            source,
        })?;
        let base_dir = path.parent().unwrap_or(Path::new(""));
        Self::parse_within(&text, path, base_dir, overrides, reach)
    }

    /// Parses a scene as [`Self::load`] does; `file` names it in messages. Relative paths start at
    /// `base_dir` and must not leave it.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn parse(
        text: &str,
        file: &Path,
        base_dir: &Path,
        overrides: &[String],
    ) -> Result<Self, SceneError> {
        Self::parse_within(text, file, base_dir, overrides, Reach::Folder)
    }

    /// Parses a scene that [`Self::to_toml`] wrote into a cache. Keys that did not exist then get
    /// the value that reproduces the behaviour of that time, whatever their default is now.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn recorded(text: &str, file: &Path, base_dir: &Path) -> Result<Self, SceneError> {
        Self::parse(text, file, base_dir, &younger(text)?)
    }

    /// Parses as [`Self::parse`] does, with files resolved within `reach`.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn parse_within(
        text: &str,
        file: &Path,
        base_dir: &Path,
        overrides: &[String],
        reach: Reach,
    ) -> Result<Self, SceneError> {
        let (document, mut root) = Document::parse(text, file, overrides, keys::SCENE)?;
        let document = document.within(reach);
        document.settle(&mut root)?;
        let spec = SceneSpec::deserialize(toml::Deserializer::from(root))
            .map_err(|error| document.translate(&error))?;
        build::scene(&document, base_dir, spec)
    }
}

#[cfg(test)]
mod tests;
