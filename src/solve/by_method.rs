//! The plan of the solver that a scene selects.

use swell_gpu::recording::Command;
use swell_scene::{ByMethod, Scene};

use super::{
    flip, pbf,
    plan::{Counts, DeviceLimits, Plan},
};

impl Plan {
    /// Plans the solver that `scene` selects.
    pub fn new(scene: &Scene, counts: Counts, limits: DeviceLimits) -> Self {
        match &scene.by_method() {
            ByMethod::Pbf(scene) => pbf::plan::plan(scene, counts, limits),
            ByMethod::Flip(scene) => flip::plan::plan(scene, counts, true),
        }
    }

    /// Returns every command that a solver with this plan may run for `scene`.
    pub fn commands(&self, scene: &Scene) -> Vec<Command> {
        match &scene.by_method() {
            ByMethod::Pbf(scene) => pbf::plan::commands(self, scene),
            ByMethod::Flip(scene) => flip::plan::commands(self, scene),
        }
    }
}
