//! Reads `[grids]`: grids written with each frame beside its particles.

use swell_domain::{
    bounds::Bounds,
    sparse_grid::EDGE,
    surface::{MAX_BRICKS, Raster},
};
use swell_scene::{SceneError, Solver, grids::Grids, words::shown};

use super::{document::Document, keys::GridsSpec};

/// Builds the settings for the chosen solver.
pub(super) fn build(
    doc: &Document<'_>,
    spec: &GridsSpec,
    domain: &Bounds,
    solver: &Solver,
) -> Result<Grids, SceneError> {
    if let Some(size) = spec.voxel_size {
        let bricks = (domain.size() / (size * f64::from(EDGE))).ceil();
        let fits = bricks.element_product() <= MAX_BRICKS;
        if !(Raster::VOXEL_RATIO.contains(&(size / solver.particle_spacing())) && fits) {
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
        voxel_size: spec.voxel_size.unwrap_or(solver.cell_size()),
        precision: spec.precision,
    })
}
