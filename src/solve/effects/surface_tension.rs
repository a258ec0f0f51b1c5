//! Surface tension on the GPU: forces on the grid before the projection, for FLIP or for PBF's
//! projection.

use swell_gpu::buffer::Buf;
use swell_scene::{Scene, effects::surface_tension::Settings};

use super::{Addition, OnDevice, pass};

impl OnDevice for Settings {}

/// Cells: water fraction, smoothed once; in the end smoothed three times.
pub const SHARE: Buf<f32> = Buf::new("tension_share");
/// Cells: water fraction, smoothed twice.
pub const BETWEEN: Buf<f32> = Buf::new("tension_between");
/// Cells: curvature of the surface times Δx, and the gradient of the water fraction there, per
/// cell.
pub const CURVATURE: Buf<[f32; 2]> = Buf::new("tension_curvature");

/// Adds nothing on particles: PBF's projection applies surface tension on its grid.
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
