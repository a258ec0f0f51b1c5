//! Vorticity confinement on the GPU.

use swell_gpu::buffer::Buf;
use swell_scene::{Scene, effects::vorticity_confinement::Settings};

use super::{Addition, OnDevice, pass};

impl OnDevice for Settings {}

/// Curl of the velocity, 1/s: per particle in sorted order (PBF), or per cell (FLIP).
pub const VORTICITY: Buf<[f32; 3]> = Buf::new("vorticity");
/// Length of [`VORTICITY`], 1/s.
pub const VORTICITY_LENGTH: Buf<f32> = Buf::new("vorticity_length");

pub(super) fn pbf(settings: &Settings, _: &Scene, particles: usize) -> Addition {
    confinement(
        ["effects/vorticity_curl", "effects/vorticity_force"],
        settings,
        particles,
    )
}

pub(super) fn flip(settings: &Settings, _: &Scene, cells: usize) -> Addition {
    confinement(
        ["effects/grid_curl", "effects/grid_confinement"],
        settings,
        cells,
    )
}

fn confinement([curl, force]: [&'static str; 2], settings: &Settings, count: usize) -> Addition {
    Addition {
        passes: vec![
            pass(curl, &[]),
            pass(force, &[("STRENGTH", settings.strength)]),
        ],
        buffers: vec![VORTICITY.sized(count), VORTICITY_LENGTH.sized(count)],
        ..Addition::default()
    }
}
