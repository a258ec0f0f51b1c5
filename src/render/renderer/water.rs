//! Uploads the water into which rays are cast.

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

/// Particles of a frame's body, and the state of their level set on the device.
pub(super) struct RayWater {
    /// Positions of the body's particles with their paths.
    places: Vec<(Vec3, Path)>,
    /// Seconds from the frame for which the device holds the level set; `None` before the first one
    /// of this frame.
    seconds: Option<f32>,
    /// Allocated values.
    capacity: usize,
    /// Edge length of a voxel, metres.
    voxel: f64,
    sun: DVec3,
    /// Upper bound of the height of the water on the device, metres.
    top: f64,
}

impl RayWater {
    /// Returns `None` where the look casts no rays.
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

    /// Takes the particles of a frame that belong to the body; without `paths` they move in
    /// straight lines.
    pub(super) fn take(&mut self, particles: &[Particle], paths: &[Path]) {
        self.places = body_of(particles, paths);
        self.seconds = None;
    }

    /// Uploads the level set for an instant, in seconds from the frame. Returns whether a buffer
    /// was reallocated.
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

    /// Builds the level set for an instant, in seconds from the frame.
    pub(super) fn level(&self, seconds: f32, scene: &RenderScene) -> LevelSet {
        level_set(scene, self.voxel, &self.places, seconds)
    }

    pub(super) fn top(&self) -> f64 {
        self.top
    }
}
