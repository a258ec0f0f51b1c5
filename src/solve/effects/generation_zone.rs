//! Generation zones on the GPU: they relax velocities towards incoming waves, of PBF's particles at
//! the end of a substep, and of FLIP's faces before the projection.

use std::f64::consts::TAU;

use swell_domain::open_waves::WaveComponent;
use swell_gpu::{buffer::Buf, program::Program};
use swell_scene::{Scene, effects::generation_zone::Settings};

use super::{Addition, OnDevice, pass, zone::constants};

/// Two vectors per wave, laid out as in shared/open_waves.wgsl.
pub const OPEN_WAVES: Buf<[f32; 4]> = Buf::new("open_waves");

pub(super) fn pbf(settings: &Settings, scene: &Scene, _particles: usize) -> Addition {
    generation("effects/generate_particles", settings, scene)
}

pub(super) fn flip(settings: &Settings, scene: &Scene, _cells: usize) -> Addition {
    generation("effects/generate_faces", settings, scene)
}

fn generation(name: &'static str, settings: &Settings, scene: &Scene) -> Addition {
    let waves = settings.incoming(scene.water.gravity);
    let count = waves.lines.len();
    let mut constants = constants(settings.zone(), scene);
    constants.push(("WAVE_COUNT", count as f64));
    constants.push(("WAVE_LEVEL", waves.level()));
    constants.push(("WAVE_DEPTH", waves.depth()));
    Addition {
        passes: vec![pass(name, &constants)],
        buffers: vec![OPEN_WAVES.sized(2 * count)],
        ..Addition::default()
    }
}

impl OnDevice for Settings {
    /// Uploads the waves at the given time. Phases are reduced modulo one turn here, where f64 has
    /// the digits for it.
    fn upload(&self, program: &Program, scene: &Scene, (time, _): (f64, f64)) {
        let waves = self.incoming(scene.water.gravity);
        let grown = waves.grown(time);
        let of = |line: &WaveComponent| {
            let k = line.number.length();
            let turns = line.number / TAU;
            let phase = ((line.phase - line.frequency * time) / TAU).rem_euclid(1.0);
            let speed = grown * line.speed / (1.0 + (-2.0 * k * waves.depth()).exp());
            let along = speed * line.number / k;
            [
                [turns.x, turns.y, phase, k].map(|v| v as f32),
                [along.x, along.y, speed, 0.0].map(|v| v as f32),
            ]
        };
        let rows: Vec<[f32; 4]> = waves.lines.iter().flat_map(of).collect();
        program.upload(OPEN_WAVES, 0, &rows);
    }
}
