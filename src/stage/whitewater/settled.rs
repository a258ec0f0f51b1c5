//! The complete settings of a stream: its own, and those that the shot's scale decides.

use std::{
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
};

use super::{SETTINGS, WhitewaterError, WhitewaterEvent, WhitewaterRequest};
use crate::derived::water::WaterReader;
use swell_cache::CacheReader;
use swell_domain::{
    parallel,
    whitewater::{CalibratedSettings, ShotScale},
};
use swell_files::whitewater::WhitewaterSettings;
use swell_scene::Scene;

/// Most frames that a shot's scale is calibrated on.
const CALIBRATED_ON: usize = 16;

/// The settings that a stream was made with.
pub(super) fn recorded(
    stream: &CacheReader,
    directory: &Path,
    scene: &Scene,
) -> Result<CalibratedSettings, WhitewaterError> {
    let bytes = stream.asset(SETTINGS)?;
    let text = String::from_utf8_lossy(&bytes);
    let file = directory.join("assets").join(SETTINGS);
    let settings = WhitewaterSettings::parse(&text, &file)?;
    // The file has all of them, so the shot decides nothing.
    Ok(settings.settled(&scale(scene, &[])))
}

/// The scale of a shot whose water has these specific energies, J/kg.
fn scale(scene: &Scene, energies: &[f64]) -> ShotScale {
    let gravity = scene.water.gravity.length();
    ShotScale::calibrate(energies, gravity, scene.domain.size().min_element())
}

/// Settings of a new stream, and how many frames were used to calibrate them; `None` if a signal
/// stopped the calibration.
pub(super) fn settle(
    request: &WhitewaterRequest,
    scene: &Scene,
    water: &mut WaterReader<'_>,
    (stop, tell): (&AtomicBool, &mut dyn FnMut(WhitewaterEvent)),
) -> Result<Option<(CalibratedSettings, Option<usize>)>, WhitewaterError> {
    let cache = water.cache();
    let frames: Vec<u32> = match request.settings.needs_calibration() {
        true => (cache.first_frame() + 1..=cache.last_frame())
            .filter(|&frame| cache.has_particles(frame))
            .collect(),
        false => Vec::new(),
    };
    let step = frames.len().div_ceil(CALIBRATED_ON).max(1);
    // Counted from the end, so that the last frame is included.
    let mut chosen: Vec<u32> = frames.into_iter().rev().step_by(step).collect();
    chosen.reverse();
    let mut all = Vec::new();
    let count = chosen.len();
    for (done, &frame) in chosen.iter().enumerate() {
        tell(WhitewaterEvent::Calibrated { done, count });
        if stop.load(Ordering::Relaxed) {
            return Ok(None);
        }
        all.extend(parallel::map_slice(&water.at(frame)?.velocity, |v| {
            0.5 * v.iter().map(|x| f64::from(x * x)).sum::<f64>()
        }));
    }
    if count > 0 {
        tell(WhitewaterEvent::Calibrated { done: count, count });
    }
    let settings = request.settings.settled(&scale(scene, &all));
    let calibrated = request.settings.needs_calibration().then_some(count);
    Ok(Some((settings, calibrated)))
}
