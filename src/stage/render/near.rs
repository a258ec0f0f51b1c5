//! The particles that a frame's picture is drawn from: its own, and those of the frames around it.

use std::{collections::BTreeMap, sync::Arc};

use super::{pictures::others, set::FrameState};
use swell_cache::{CacheError, CacheReader};
use swell_domain::{particles::Particles, shape::WaveFloor};
use swell_render::{FrameInputs, REACH, WaterParticles, frames_around};
use swell_scene::{Scene, look::Look};

/// Recently read frames, so that consecutive frames are read only once.
pub(super) struct Near {
    water: DrawnWater,
    read: BTreeMap<u32, Arc<WaterParticles>>,
}

/// The water of a cache as pictures show it: with the part of its depth that is not simulated, as
/// far as the domain reaches.
pub(super) struct DrawnWater {
    floor: Option<WaveFloor>,
    frames_per_second: f64,
}

impl DrawnWater {
    pub(super) fn of(scene: &Scene) -> Self {
        Self {
            floor: scene.wave_floor().cloned(),
            frames_per_second: scene.shot.frames_per_second,
        }
    }

    /// Adds what lies below the floor in a frame.
    pub(super) fn complete(&self, frame: u32, mut water: Particles) -> Particles {
        if let Some(floor) = &self.floor {
            water.extend_at_rest(&floor.water_below(f64::from(frame) / self.frames_per_second));
        }
        water
    }
}

/// A frame with those around it.
pub(super) struct NearbyFrames {
    pub(super) water: Arc<WaterParticles>,
    /// In the order of [`FrameInputs::around`]; `None` if the cache does not have the frame or the
    /// look does not use it.
    others: [Option<Arc<WaterParticles>>; 2 * REACH as usize],
}

impl Near {
    pub(super) fn new(scene: &Scene) -> Self {
        Self {
            water: DrawnWater::of(scene),
            read: BTreeMap::new(),
        }
    }

    /// Reads a frame and the frames around it that `look` needs.
    pub(super) fn around(
        &mut self,
        cache: &CacheReader,
        look: &Look,
        frame: u32,
    ) -> Result<NearbyFrames, CacheError> {
        let reach = frames_around(look);
        self.read.retain(|&other, _| other.abs_diff(frame) <= reach);
        let water = self.read(cache, frame)?;
        let mut found = [const { None }; 2 * REACH as usize];
        for (side, other) in others(frame) {
            if other.abs_diff(frame) <= reach && cache.has_particles(other) {
                found[side] = Some(self.read(cache, other)?);
            }
        }
        Ok(NearbyFrames {
            water,
            others: found,
        })
    }

    fn read(&mut self, cache: &CacheReader, frame: u32) -> Result<Arc<WaterParticles>, CacheError> {
        if let Some(water) = self.read.get(&frame) {
            return Ok(water.clone());
        }
        let water = self.water.complete(frame, cache.read(frame)?);
        let water = Arc::new(WaterParticles::new(water));
        self.read.insert(frame, water.clone());
        Ok(water)
    }
}

impl NearbyFrames {
    /// The same frames without cached results for the frame's own water, as when the frame is first
    /// drawn.
    pub(super) fn anew(&self) -> Self {
        Self {
            water: Arc::new(WaterParticles::new(self.water.particles.clone())),
            others: self.others.clone(),
        }
    }

    /// The state from which the opaque geometry of the picture is made.
    pub(super) fn state(&self) -> FrameState<'_> {
        let [_, before, after, _] = self.others.each_ref();
        FrameState {
            now: &self.water.particles,
            around: [before, after].map(|it| it.as_ref().map(|it| &it.particles)),
        }
    }

    /// The input of a picture, with the frame's whitewater.
    pub(super) fn inputs<'a>(&'a self, white: &'a Particles) -> FrameInputs<'a> {
        FrameInputs {
            water: &self.water,
            around: self.others.each_ref().map(Option::as_deref),
            white,
        }
    }
}
