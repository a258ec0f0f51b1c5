//! Vorticity confinement (Fedkiw et al. 2001).

use glam::DVec3;

use super::{Acts, FaceInputs};
use crate::{
    Timings,
    flip::{grid_confinement, grid_curl},
};
use swell_scene::effects::vorticity_confinement::Settings;

impl Acts for Settings {
    fn on_faces(&self, water: FaceInputs<'_>, velocity: &mut Vec<DVec3>, timings: &mut Timings) {
        let FaceInputs {
            model,
            step,
            bricks,
            space,
            ..
        } = water;
        let vorticity = timings.time("effects/grid_curl", || {
            grid_curl(model, bricks, space, velocity)
        });
        *velocity = timings.time("effects/grid_confinement", || {
            let strength = self.strength;
            grid_confinement(model, step, bricks, space, strength, &vorticity, velocity)
        });
    }
}
