//! Generation zones: move face velocities from those that particles transferred towards those of
//! the waves and the current.

use glam::DVec3;

use super::{Acts, FaceInputs, led_faces};
use crate::Timings;
use swell_scene::effects::generation_zone::Settings;

impl Acts for Settings {
    fn on_faces(&self, water: FaceInputs<'_>, velocity: &mut Vec<DVec3>, timings: &mut Timings) {
        *velocity = timings.time("effects/generate_faces", || {
            let still = &water.model.scene.water;
            let waves = self.incoming(still.gravity);
            let time = water.step.start;
            led_faces(self.zone(), water, velocity, |place| {
                still.current + waves.velocity(place, time)
            })
        });
    }
}
