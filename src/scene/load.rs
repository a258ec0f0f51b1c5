//! From a file to a [`Scene`].

use std::{fs, path::Path};

use serde::Deserialize as _;

use super::{Scene, build, document::Document, error::SceneError, spec::SceneSpec};

impl Scene {
    /// Loads a scene file with overrides (`solver.pbf.iterations=8`: dotted keys, TOML values or
    /// bare words) laid over it. Mesh and table paths are relative to the file.
    ///
    /// # Errors
    /// One [`SceneError`] that names file, line, key, and what is allowed.
    pub fn load(path: &Path, overrides: &[String]) -> Result<Self, SceneError> {
        let text = fs::read_to_string(path).map_err(|source| SceneError::Read {
            file: path.to_owned(),
            source,
        })?;
        let base_dir = path.parent().unwrap_or(Path::new(""));
        Self::parse(&text, path, base_dir, overrides)
    }

    /// [`Self::load`] on a text; `file` names it in messages, `base_dir` is where relative paths
    /// start.
    ///
    /// # Errors
    /// Those of [`Self::load`].
    pub fn parse(
        text: &str,
        file: &Path,
        base_dir: &Path,
        overrides: &[String],
    ) -> Result<Self, SceneError> {
        let (document, root) = Document::parse(text, file, overrides)?;
        let spec = SceneSpec::deserialize(toml::Deserializer::from(root))
            .map_err(|error| document.translate(&error))?;
        build::scene(&document, base_dir, spec)
    }
}
