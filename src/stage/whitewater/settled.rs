//! The complete settings of a stream: its own, and those that the shot's scale decides.

use std::path::Path;

use super::{SETTINGS, WhitewaterError};
use swell_cache::CacheReader;
use swell_domain::whitewater::{CompleteSettings, ShotScale};
use swell_files::whitewater::WhitewaterSettings;
use swell_scene::Scene;

/// The settings that a stream was made with.
pub(super) fn recorded(
    stream: &CacheReader,
    directory: &Path,
) -> Result<CompleteSettings, WhitewaterError> {
    let bytes = stream.asset(SETTINGS)?;
    let text = String::from_utf8_lossy(&bytes);
    let file = directory.join("assets").join(SETTINGS);
    let settings = WhitewaterSettings::parse(&text, &file)?;
    // The file has all of them, so the shot decides nothing.
    Ok(settings.settled(&ShotScale::of_volume(1.0)))
}

/// Completes settings by the scale of the shot: its water where it has most, of which `begin` is
/// the number of particles at its start.
pub(super) fn settle(
    settings: &WhitewaterSettings,
    scene: &Scene,
    cache: &CacheReader,
    begin: usize,
) -> Result<CompleteSettings, WhitewaterError> {
    let mut most = begin;
    for frame in cache.first_frame()..=cache.last_frame() {
        most = most.max(cache.entry(frame)?.particles as usize);
    }
    let volume = most as f64 * scene.particle_spacing().powi(3);
    Ok(settings.settled(&ShotScale::of_volume(volume)))
}
