//! `[grids]`: which grids each frame gets beside its particles.

use std::fmt::{self, Write as _};

use serde::Deserialize;
use toml::Spanned;

use super::{Method, Solver, build::out_of_range, document::Document, error::SceneError};
use crate::domain::{
    bounds::Bounds,
    sparse_grid::{EDGE, Precision},
    surface::{MAX_BRICKS, Raster},
};

/// Grids of each frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grids {
    /// A level set of the water's surface.
    pub surface: bool,
    /// Its velocity on cell faces.
    pub velocity: bool,
    /// Metres. Where the scene does not say it: the cell size of FLIP, or two particle spacings,
    /// which is the same for eight particles a cell.
    pub voxel_size: f64,
    /// How values are kept.
    pub precision: Precision,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GridsSpec {
    surface: Option<Spanned<bool>>,
    velocity: Option<bool>,
    voxel_size: Option<Spanned<f64>>,
    precision: Option<Spanned<String>>,
}

/// Builds the table for the chosen solver.
pub(super) fn build(
    doc: &Document<'_>,
    spec: &Spanned<GridsSpec>,
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
    let table = spec.get_ref();
    let grids = Grids {
        surface: table.surface.as_ref().is_some_and(|v| *v.get_ref()),
        velocity: table.velocity.unwrap_or(false),
        voxel_size: match &table.voxel_size {
            None => cell_size,
            Some(size) => {
                let size_in_spacings = |v: f64| Raster::VOXEL_RATIO.contains(&(v / spacing));
                let size_fits = |v: f64| {
                    let bricks = (domain.size() / (v * f64::from(EDGE))).ceil();
                    bricks.element_product() <= MAX_BRICKS
                };
                let v = *size.get_ref();
                if !(size_in_spacings(v) && size_fits(v)) {
                    return Err(out_of_range(doc, size));
                }
                v
            }
        },
        precision: match table.precision.as_ref() {
            None => Precision::Half,
            Some(name) => Precision::NAMED
                .iter()
                .find(|(known, _)| known == name.get_ref())
                .map(|(_, precision)| *precision)
                .ok_or_else(|| {
                    doc.fault_at(name.span(), format!("{:?} is no precision", name.get_ref()))
                })?,
        },
    };
    if grids.surface || grids.velocity {
        return Ok(grids);
    }
    let span = table.surface.as_ref().map_or(spec.span(), Spanned::span);
    Err(doc.fault_at(span, "neither surface nor velocity is asked for"))
}

impl Grids {
    /// As [`super::Scene::to_toml`] writes it.
    pub(super) fn write(&self, out: &mut String) -> fmt::Result {
        writeln!(out, "\n[grids]")?;
        writeln!(out, "surface = {}", self.surface)?;
        writeln!(out, "velocity = {}", self.velocity)?;
        writeln!(out, "voxel_size = {:?}", self.voxel_size)?;
        writeln!(out, "precision = {:?}", self.precision.name())
    }
}
