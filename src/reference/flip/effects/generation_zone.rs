//! Generation zones: move face velocities from those that particles transferred towards those of
//! the waves.

use glam::DVec3;

use super::{Acts, FaceInputs, led_faces};
use crate::Timings;
use swell_scene::effects::generation_zone::Settings;

impl Acts for Settings {
    fn on_faces(&self, water: FaceInputs<'_>, velocity: &mut Vec<DVec3>, timings: &mut Timings) {
        *velocity = timings.time("effects/generate_faces", || {
            let waves = self.incoming(water.model.scene.water.gravity);
            let time = water.step.start;
            led_faces(self.zone(), water, velocity, |place| {
                waves.velocity(place, time)
            })
        });
    }
}
