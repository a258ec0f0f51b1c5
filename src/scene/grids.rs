//! `[grids]`: grids written with each frame beside its particles.

use serde::{Deserialize, Serialize};

use super::{Method, Solver, document::Document, error::SceneError, words::shown};
use swell_domain::{
    bounds::Bounds,
    sparse_grid::{EDGE, Precision},
    surface::{MAX_BRICKS, Raster},
};

/// Grids written with each frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Grids {
    /// Whether to write a level set of the water's surface.
    pub surface: bool,
    /// Whether to write the water's velocity on cell faces.
    pub velocity: bool,
    /// Edge of a voxel, metres. The default is FLIP's cell size, or two particle spacings with PBF,
    /// which is the same for eight particles per cell.
    pub voxel_size: f64,
    /// Storage precision of the values.
    pub precision: Precision,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GridsSpec {
    surface: bool,
    velocity: bool,
    voxel_size: Option<f64>,
    precision: Precision,
}

/// Builds the settings for the chosen solver.
pub(super) fn build(
    doc: &Document<'_>,
    spec: &GridsSpec,
    domain: &Bounds,
    solver: &Solver,
) -> Result<Grids, SceneError> {
    let (spacing, cell_size) = match solver.method {
        Method::Pbf => {
            let spacing = solver.pbf().particle_spacing;
            (spacing, 2.0 * spacing)
        }
        Method::Flip => (solver.flip().particle_spacing(), solver.flip().cell_size),
    };
    if let Some(size) = spec.voxel_size {
        let bricks = (domain.size() / (size * f64::from(EDGE))).ceil();
        let fits = bricks.element_product() <= MAX_BRICKS;
        if !(Raster::VOXEL_RATIO.contains(&(size / spacing)) && fits) {
            let problem = format!("{} is out of range", shown(size));
            return Err(doc.fault_of("grids.voxel_size", problem));
        }
    }
    if !(spec.surface || spec.velocity) {
        let problem = "neither surface nor velocity is requested";
        return Err(doc.fault_of("grids.surface", problem));
    }
    Ok(Grids {
        surface: spec.surface,
        velocity: spec.velocity,
        voxel_size: spec.voxel_size.unwrap_or(cell_size),
        precision: spec.precision,
    })
}
