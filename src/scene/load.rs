//! From a file to a [`Scene`].

use std::path::Path;

use serde::Deserialize as _;

use super::{
    Reach, Scene, build, difference::younger, document::Document, error::SceneError, keys,
    spec::SceneSpec,
};
use swell_domain::text;

impl Scene {
    /// Loads a scene file with overrides (`solver.pbf.iterations=8`: dotted keys, TOML values or
    /// bare words) laid over it. Mesh and table paths are relative to the file, and stay below its folder.
    ///
    /// # Errors
    /// One [`SceneError`] that names file, line, key, and what is allowed.
    pub fn load(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        Self::load_within(path, overrides, Reach::Folder)
    }

    /// [`Self::load`] with files from as far as `reach` says.
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

    /// [`Self::load`] on a text; `file` names it in messages, `base_dir` is where relative paths
    /// start, and what they may not leave.
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

    /// [`Self::parse`] on what [`Self::to_toml`] once wrote into a cache: a key that there was not yet has the value by which
    /// nothing differs from then, whatever its default is now.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn recorded(text: &str, file: &Path, base_dir: &Path) -> Result<Self, SceneError> {
        Self::parse(text, file, base_dir, &younger(text)?)
    }

    /// [`Self::parse`] where paths may lead as far as `reach` says.
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
