//! XSPH viscosity on the device.

use crate::{
    gpu::buffer::Buf,
    scene::{Scene, effects::viscosity::Settings},
};

use super::{Addition, OnDevice, pass};

impl OnDevice for Settings {}

/// What each particle's velocity changes by, and 0, in sorted order, m/s.
pub const CHANGE: Buf<[f32; 4]> = Buf::new("viscosity_change");

pub(super) fn pbf(settings: &Settings, _: &Scene, particles: usize) -> Addition {
    Addition {
        passes: vec![
            pass("effects/viscosity_gather", &[("XSPH", settings.xsph)]),
            pass("effects/viscosity_apply", &[]),
        ],
        buffers: vec![CHANGE.sized(particles)],
        ..Addition::default()
    }
}

/// Nothing of its own: the grid holds the mean of the neighbours' velocities already, and the blend takes more of it.
pub(super) fn flip(_: &Settings, _: &Scene, _cells: usize) -> Addition {
    Addition::default()
}
