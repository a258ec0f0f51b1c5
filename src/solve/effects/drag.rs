//! Air drag on the GPU: on PBF's particles at the end of a substep, on FLIP's particles before the
//! transfer to the grid.

use crate::air;
use swell_domain::{flip, pbf};
use swell_scene::{Scene, effects::drag::Settings};

use super::{Addition, OnDevice, pass};

impl OnDevice for Settings {}

pub(super) fn pbf(settings: &Settings, scene: &Scene, _particles: usize) -> Addition {
    let gravity = scene.water.gravity;
    let mut constants = constants(settings, pbf::PLANE_SHARE);
    constants.push(("GRAVITY_X", gravity.x));
    constants.push(("GRAVITY_Y", gravity.y));
    constants.push(("GRAVITY_Z", gravity.z));
    Addition {
        passes: vec![pass("effects/drag_by_density", &constants)],
        ..Addition::default()
    }
}

pub(super) fn flip(settings: &Settings, _: &Scene, _cells: usize) -> Addition {
    Addition {
        on_particles: vec![pass(
            "effects/drag_by_cells",
            &constants(settings, flip::PLANE_SHARE),
        )],
        ..Addition::default()
    }
}

fn constants(settings: &Settings, of_plane: f64) -> Vec<(&'static str, f64)> {
    let mut constants = air::constants(settings.drop_radius, settings.wind);
    constants.push(("PLANE_SHARE", of_plane));
    constants
}
