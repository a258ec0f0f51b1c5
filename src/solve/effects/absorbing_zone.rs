//! Absorbing zones on the device: PBF's particles lose velocity at a step's end, FLIP's faces before the projection.

use crate::scene::{Scene, Wall, effects::absorbing_zone::Settings};

use super::{Addition, pass};

pub(super) fn pbf(settings: &Settings, scene: &Scene, _particles: usize) -> Addition {
    absorption("effects/absorb_particles", settings, scene)
}

pub(super) fn flip(settings: &Settings, scene: &Scene, _cells: usize) -> Addition {
    absorption("effects/absorb_faces", settings, scene)
}

fn absorption(name: &'static str, settings: &Settings, scene: &Scene) -> Addition {
    let size = scene.domain.size();
    let walls: u32 = settings.walls.iter().map(Wall::bit).sum();
    let constants = [
        ("ABSORBING", f64::from(walls)),
        ("RATE", settings.rate()),
        ("INVERSE_LENGTH", 1.0 / settings.length),
        ("SIZE_X", size.x),
        ("SIZE_Y", size.y),
        ("SIZE_Z", size.z),
    ];
    Addition {
        passes: vec![pass(name, &constants)],
        buffers: Vec::new(),
    }
}
