//! The complete settings of a stream: its own, and thresholds that are calibrated on the shot.

use std::{
    path::Path,
    sync::atomic::{AtomicBool, Ordering},
};

use super::{SETTINGS, WhitewaterError, WhitewaterEvent, WhitewaterRequest, engine::Engine};
use crate::derived::water::WaterReader;
use swell_cache::CacheReader;
use swell_domain::whitewater::{CalibratedSettings, Thresholds};
use swell_files::whitewater::WhitewaterSettings;
use swell_scene::Scene;

/// Most frames that a shot's thresholds are calibrated on.
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
    Ok(settings.settled(scene.particle_spacing(), &Thresholds::calibrate(&[])))
}

/// Settings of a new stream, and how many frames were used to calibrate them; `None` if a signal
/// stopped the calibration.
pub(super) fn settle(
    request: &WhitewaterRequest,
    scene: &Scene,
    (engine, water): (&mut Engine, &mut WaterReader<'_>),
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
        let time = cache.entry(frame)?.clock.time;
        let seconds = 1.0 / cache.manifest().frames_per_second;
        all.extend(engine.survey(&water.at(frame)?, time, seconds)?);
    }
    if count > 0 {
        tell(WhitewaterEvent::Calibrated { done: count, count });
    }
    let shot = Thresholds::calibrate(&all);
    let settings = request.settings.settled(scene.particle_spacing(), &shot);
    let calibrated = request.settings.needs_calibration().then_some(count);
    Ok(Some((settings, calibrated)))
}
