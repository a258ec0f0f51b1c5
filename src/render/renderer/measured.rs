//! Plan of a frame with known particles, without a device.

use super::{
    build::capacity_for,
    cloud::{RayCloud, room_of},
    drawn::{DrawnParticles, cameras},
    load::of_particles,
    setting,
    splats::Pages,
    taken::Taken,
    water::RayWater,
    whitewater::WhitewaterDrawing,
};
use crate::{
    FrameInputs, RenderError, RenderScene,
    buffers::{BLOCKS, CLOUD_WORDS, LEVEL_TABLE, LEVEL_VALUES, PARTICLES, WHITEWATER},
    plan::{Limits, Plan},
};
use swell_scene::look::Look;

impl Plan {
    /// Like [`Plan::new`], with the buffer sizes that the renderer allocates when it draws this
    /// frame. The drops are those of the frame's instant and the level set is the one that serves
    /// it; with an open shutter each sample has its own drops.
    ///
    /// # Errors
    /// As for [`Plan::new`], and [`RenderError::NotFinite`] for a damaged particle.
    pub fn of_frame(
        look: &Look,
        scene: &RenderScene,
        frame: u32,
        inputs: &FrameInputs<'_>,
        limits: &Limits,
    ) -> Result<Self, RenderError> {
        let mut plan = Self::new(look, scene, limits)?;
        let taken = Taken::of(look, scene, frame, inputs)?;
        if let Some(mut water) = RayWater::of(look, scene) {
            water.take(&taken.packed, &taken.ways, scene);
            let built = water.build(water.slice(0.0, true), scene);
            plan.grow(LEVEL_TABLE.sized(built.table.len()));
            plan.grow(LEVEL_VALUES.sized(built.values()));
        }
        if let Some(mut cloud) = RayCloud::of(look, scene) {
            let water = (&taken.packed[..], &taken.ways[..]);
            cloud.take(look, scene, plan.radius, water, inputs.white);
            let (_, words) = cloud.grid(&[0.0], scene);
            plan.grow(CLOUD_WORDS.sized(room_of(words.len(), limits.storage)));
        }
        if let Some(whitewater) = WhitewaterDrawing::of(look, scene) {
            let drawn = whitewater.packed(scene, frame, inputs.white)?;
            plan.grow(WHITEWATER.sized(capacity_for(drawn.len())));
        }
        if !plan.has(PARTICLES.name()) {
            return Ok(plan);
        }
        let cameras = cameras(look, &setting(&plan, scene, 0), frame);
        let drawn = DrawnParticles::of(taken, look, scene, frame, &cameras);
        for buffer in of_particles(look, Pages::new(capacity_for(drawn.seen), limits.storage)) {
            plan.grow(buffer);
        }
        if let Some(blocks) = drawn.blocks {
            plan.grow(BLOCKS.sized(capacity_for(blocks.len())));
        }
        Ok(plan)
    }
}
