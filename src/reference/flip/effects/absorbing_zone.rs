//! Absorbing zones: move the velocity that particles transferred to faces towards that of the
//! undisturbed water.

use glam::DVec3;

use super::{Acts, FaceInputs, led_faces};
use crate::Timings;
use swell_scene::effects::absorbing_zone::Settings;

impl Acts for Settings {
    fn on_faces(&self, water: FaceInputs<'_>, velocity: &mut Vec<DVec3>, timings: &mut Timings) {
        *velocity = timings.time("effects/absorb_faces", || {
            let current = water.model.scene.water.current;
            led_faces(self.zone(), water, velocity, |_| current)
        });
    }
}
