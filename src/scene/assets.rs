//! Mesh files of a scene, and the names of their copies in a cache.

use std::path::{Path, PathBuf};

use super::{PlacedMesh, Scene};

/// Returns the path of a cache's copy of a mesh file, `assets/NAME-HASH.EXT`. The hash keeps files
/// of equal name apart.
pub fn asset_path(file: &Path, file_hash: &str) -> String {
    let part = |s: Option<&std::ffi::OsStr>| -> String {
        s.map(|s| s.to_string_lossy().into_owned())
            .unwrap_or_default()
            .chars()
            .map(|c| {
                if c.is_ascii_alphanumeric() || c == '_' {
                    c
                } else {
                    '-'
                }
            })
            .collect()
    };
    format!(
        "assets/{}{}.{}",
        part(file.file_stem()),
        mark(file_hash),
        part(file.extension()).to_ascii_lowercase()
    )
}

/// Returns the suffix that a copy's name has.
fn mark(file_hash: &str) -> String {
    format!("-{}", file_hash.get(..16).unwrap_or(file_hash))
}

impl PlacedMesh {
    /// Returns the file name without extension; a cache's copy has the name of the original.
    pub fn name(&self) -> String {
        let stem = self.file.file_stem().unwrap_or_default().to_string_lossy();
        let original = stem.strip_suffix(mark(&self.file_hash).as_str());
        original.unwrap_or(&stem).to_owned()
    }
}

impl Scene {
    /// Returns the mesh files of the scene with their BLAKE3 hashes, each once.
    pub fn mesh_files(&self) -> Vec<(PathBuf, String)> {
        let mut files = Vec::new();
        let moving = self.drawn_movers().map(|solid| &solid.placed);
        let placed = self.solids.iter().chain(moving).chain(&self.water.meshes);
        let placed = placed.chain(self.source_meshes());
        let single = placed.map(|placed| (placed.file.clone(), placed.file_hash.clone()));
        let sequences = self.sequences().flat_map(|it| it.files.iter().cloned());
        for file in single.chain(sequences) {
            if !files.contains(&file) {
                files.push(file);
            }
        }
        files
    }
}
