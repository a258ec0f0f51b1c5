//! The water that rays are cast into, on its way to the device.

use glam::{DVec3, Vec3};

use crate::{
    RenderError, RenderScene,
    buffers::{LEVEL_TABLE, LEVEL_VALUES, SUN_PATHS},
    paths::{Path, body_of},
    rays::{level_set, sun_in_water, voxel},
    uniform::Particle,
};
use swell_domain::level_set::{LevelSet, sunlight::Sunlight};
use swell_gpu::program::Program;
use swell_scene::look::{Look, MethodSpec};

/// A frame's particles, and the level set of them that the device holds.
pub(super) struct RayWater {
    /// Where the body's particles are and how they go.
    places: Vec<(Vec3, Path)>,
    /// Seconds from the frame at which the level set on the device stands; `None` before there is one of this frame.
    seconds: Option<f32>,
    /// Values that there is room for.
    capacity: usize,
    /// Edge length of a voxel, metres.
    voxel: f64,
    sun: DVec3,
    /// Height below which the water on the device lies, metres.
    top: f64,
}

impl RayWater {
    /// `None` where the look casts no rays.
    pub(super) fn of(look: &Look, scene: &RenderScene) -> Option<Self> {
        (look.spec().renderer.method == MethodSpec::Ray).then(|| Self {
            places: Vec::new(),
            seconds: None,
            capacity: 0,
            voxel: voxel(look, scene),
            sun: sun_in_water(look),
            top: 0.0,
        })
    }

    /// Takes a frame's particles, those that belong to the body; without `paths` they go straight on.
    pub(super) fn take(&mut self, particles: &[Particle], paths: &[Path]) {
        self.places = body_of(particles, paths);
        self.seconds = None;
    }

    /// Has the device hold the level set of so many seconds from the frame; whether a buffer is a new one.
    pub(super) fn stand_at(
        &mut self,
        seconds: f32,
        program: &mut Program,
        scene: &RenderScene,
    ) -> Result<bool, RenderError> {
        if self.seconds == Some(seconds) {
            return Ok(false);
        }
        let level = self.level(seconds, scene);
        let light = Sunlight::new(&level, self.sun);
        let grew = level.values.len() > self.capacity;
        if grew {
            self.capacity = level.values.len();
            program.refit(&[LEVEL_VALUES.sized(self.capacity)], &[])?;
        }
        program.upload(LEVEL_TABLE, 0, &level.table);
        program.upload(LEVEL_VALUES, 0, &level.values);
        program.upload(SUN_PATHS, 0, &light.paths);
        self.seconds = Some(seconds);
        self.top = level.top();
        Ok(grew)
    }

    /// The level set of so many seconds from the frame.
    pub(super) fn level(&self, seconds: f32, scene: &RenderScene) -> LevelSet {
        level_set(scene, self.voxel, &self.places, seconds)
    }

    /// Height below which the water on the device lies, metres.
    pub(super) fn top(&self) -> f64 {
        self.top
    }
}
