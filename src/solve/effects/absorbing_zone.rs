//! Absorbing zones on the GPU: they damp the velocities of PBF's particles at the end of a substep,
//! and of FLIP's faces before the projection.

use swell_scene::{Scene, effects::absorbing_zone::Settings};

use super::{Addition, OnDevice, pass, zone::constants};

impl OnDevice for Settings {}

pub(super) fn pbf(settings: &Settings, scene: &Scene, _particles: usize) -> Addition {
    absorption("effects/absorb_particles", settings, scene)
}

pub(super) fn flip(settings: &Settings, scene: &Scene, _cells: usize) -> Addition {
    absorption("effects/absorb_faces", settings, scene)
}

fn absorption(name: &'static str, settings: &Settings, scene: &Scene) -> Addition {
    Addition {
        passes: vec![pass(name, &constants(settings.zone(), scene))],
        buffers: Vec::new(),
        ..Addition::default()
    }
}
