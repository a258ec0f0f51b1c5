//! Surface tension on the device: on the grid before the projection, of FLIP's scene or of PBF's.

use swell_gpu::buffer::Buf;
use swell_scene::{Scene, effects::surface_tension::Settings};

use super::{Addition, OnDevice, pass};

impl OnDevice for Settings {}

/// Cells: the water's share, smoothed once, and in the end three times.
pub const SHARE: Buf<f32> = Buf::new("tension_share");
/// Cells: smoothed twice.
pub const BETWEEN: Buf<f32> = Buf::new("tension_between");
/// Cells: the surface's curvature times Δx, and how steep the share is there, a cell.
pub const CURVATURE: Buf<[f32; 2]> = Buf::new("tension_curvature");

/// Nothing on particles: its projection has it.
pub(super) fn pbf(_: &Settings, _: &Scene, _particles: usize) -> Addition {
    Addition::default()
}

pub(super) fn flip(settings: &Settings, scene: &Scene, cells: usize) -> Addition {
    let tension = settings.coefficient / scene.water.rest_density;
    Addition {
        passes: vec![
            pass("effects/tension_share", &[]),
            pass("effects/tension_smooth", &[]),
            pass("effects/tension_smooth_again", &[]),
            pass("effects/tension_curvature", &[]),
            pass("effects/tension_push", &[("TENSION", tension)]),
        ],
        buffers: vec![
            SHARE.sized(cells),
            BETWEEN.sized(cells),
            CURVATURE.sized(cells),
        ],
        ..Addition::default()
    }
}
