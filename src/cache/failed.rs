//! `failed/` in a cache's folder: what the step that could not be made began with, so that it can be made again.
//!
//! No ledger names it and no checksum covers it; a bake that gets past the frame removes it.

use std::{fs, path::Path};

use serde_json::Value;

use super::{
    disk,
    error::{AtPath, CacheError},
    frame::{self, Stamp},
    manifest,
};
use crate::domain::particles::Particles;

/// The folder.
pub const FAILED: &str = "failed";
const REPORT: &str = "report.json";
const START: &str = "start.ply";

/// A frame that could not be computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Failed {
    /// The scene of that run, every default written out; its mesh files stand in the cache above.
    pub scene_toml: String,
    /// The state that the frame began with: that of the last good one.
    pub start: Particles,
    /// The last good frame.
    pub last_frame: u32,
    /// What was seen, for a machine.
    pub report: Value,
}

/// Whether `dir` is such a folder.
pub fn is_failed(dir: &Path) -> bool {
    dir.join(REPORT).is_file() && dir.join(START).is_file()
}

/// Writes `failed/` in the cache at `cache`, in place of one that stands there.
///
/// # Errors
/// [`CacheError::Io`].
pub fn write(cache: &Path, failed: &Failed, stamp: &Stamp<'_>) -> Result<(), CacheError> {
    remove(cache)?;
    let dir = cache.join(FAILED);
    disk::create_directory(&dir)?;
    let file = |name: &str, bytes: &[u8]| {
        disk::write_whole(&dir.join(name), |out| std::io::Write::write_all(out, bytes))
    };
    file(manifest::SCENE, failed.scene_toml.as_bytes())?;
    disk::write_whole(&dir.join(START), |out| {
        frame::encode(out, stamp, &failed.start)
    })?;
    // Last: it is what makes the folder one to replay.
    file(REPORT, format!("{:#}\n", failed.report).as_bytes())
}

/// Reads what [`write()`] wrote to `dir`, the folder itself.
///
/// # Errors
/// [`CacheError::Damaged`], [`CacheError::Io`].
pub fn read(dir: &Path) -> Result<Failed, CacheError> {
    let bytes = |name: &str| {
        let path = dir.join(name);
        fs::read(&path).at(&path)
    };
    let path = dir.join(REPORT);
    let report: Value = serde_json::from_slice(&bytes(REPORT)?)
        .map_err(|error| CacheError::damaged(&path, error.to_string()))?;
    let last_frame = report["last_frame"].as_u64();
    let last_frame = last_frame
        .and_then(|frame| u32::try_from(frame).ok())
        .ok_or_else(|| CacheError::damaged(&path, "it names no last_frame"))?;
    let scene = dir.join(manifest::SCENE);
    Ok(Failed {
        scene_toml: String::from_utf8(bytes(manifest::SCENE)?)
            .map_err(|_| CacheError::damaged(scene, "it is not UTF-8"))?,
        start: frame::decode(&bytes(START)?, &dir.join(START))?,
        last_frame,
        report,
    })
}

/// Removes `failed/` of the cache at `cache`, where it has one.
///
/// # Errors
/// [`CacheError::Io`].
pub fn remove(cache: &Path) -> Result<(), CacheError> {
    let dir = cache.join(FAILED);
    match fs::remove_dir_all(&dir) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(()),
        other => other.at(&dir),
    }
}
