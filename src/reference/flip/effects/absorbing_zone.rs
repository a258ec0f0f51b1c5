//! Absorbing zones: damp the velocity that particles transferred to faces.

use glam::DVec3;

use super::{Acts, FaceInputs, led_faces};
use crate::Timings;
use swell_scene::effects::absorbing_zone::Settings;

impl Acts for Settings {
    fn on_faces(&self, water: FaceInputs<'_>, velocity: &mut Vec<DVec3>, timings: &mut Timings) {
        *velocity = timings.time("effects/absorb_faces", || {
            led_faces(self.zone(), water, velocity, |_| DVec3::ZERO)
        });
    }
}
