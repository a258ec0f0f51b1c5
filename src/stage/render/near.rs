//! The particles that a frame's picture is drawn from: its own, and those of the frames around it.

use std::{collections::BTreeMap, sync::Arc};

use super::{pictures::others, set::FrameState};
use swell_cache::{CacheError, CacheReader};
use swell_domain::particles::Particles;
use swell_render::{FrameInputs, REACH, WaterParticles, frames_around};
use swell_scene::look::Look;

/// Recently read frames, so that consecutive frames are read only once.
#[derive(Default)]
pub(super) struct Near(BTreeMap<u32, Arc<WaterParticles>>);

/// A frame with those around it.
pub(super) struct NearbyFrames {
    pub(super) water: Arc<WaterParticles>,
    /// In the order of [`FrameInputs::around`]; `None` if the cache does not have the frame or the
    /// look does not use it.
    others: [Option<Arc<WaterParticles>>; 2 * REACH as usize],
}

impl Near {
    /// Reads a frame and the frames around it that `look` needs.
    pub(super) fn around(
        &mut self,
        cache: &CacheReader,
        look: &Look,
        frame: u32,
    ) -> Result<NearbyFrames, CacheError> {
        let reach = frames_around(look);
        self.0.retain(|&other, _| other.abs_diff(frame) <= reach);
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
        if let Some(water) = self.0.get(&frame) {
            return Ok(water.clone());
        }
        let water = Arc::new(WaterParticles::new(cache.read(frame)?));
        self.0.insert(frame, water.clone());
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
