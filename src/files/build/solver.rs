//! Settings of the solvers. Only the chosen solver is checked against the scene.

use super::{
    super::{
        document::Document,
        keys::{CHEBYSHEV_RELAXATION, PbfSpec, RELAXATION, SolverSpec},
    },
    Lattice, Result,
};
use swell_domain::bounds::{Bounds, cells_over};
use swell_scene::{
    Iteration, Method, Pbf, Solver, Stop, flip::Flip, projection::PROJECTION_CELL, words::shown,
};

/// Largest number of cells of PBF's neighbour grid, whose indices have 32 bits.
const MAX_CELLS: f64 = 2_147_483_647.0;

/// Largest number of cells of FLIP's box, wet or dry: 2²⁷ bricks of 8³, with a table entry of
/// four bytes each.
const MAX_FLIP_CELLS: f64 = 68_719_476_736.0;

const MAX_AXIS_CELLS: f64 = 65_536.0;

/// Least distance between walls, in spacings for PBF and in cells for FLIP; the latter leaves one
/// cell between two that touch a wall.
const LEAST_SPACINGS: f64 = 2.0;
const LEAST_CELLS: f64 = 3.0;

/// Settings of both methods, and the lattice of the chosen one.
pub(super) struct Solvers {
    pub(super) chosen: Solver,
    pub(super) unchosen: Option<Solver>,
    pub(super) lattice: Lattice,
}

/// Reads the method and all given tables.
pub(super) fn solvers(doc: &Document<'_>, spec: SolverSpec, domain: &Bounds) -> Result<Solvers> {
    let pbf = spec.pbf.map(|pbf| Solver::Pbf(pbf.into()));
    let flip = spec.flip.map(Solver::Flip);
    let (chosen, unchosen) = match spec.method {
        Method::Pbf => (pbf, flip),
        Method::Flip => (flip, pbf),
    };
    let Some(chosen) = chosen else {
        let problem = format!("the scene has no table [solver.{}]", spec.method.name());
        return Err(doc.fault_of("solver.method", problem));
    };
    let lattice = match &chosen {
        Solver::Pbf(pbf) => fit_pbf(doc, pbf, domain)?,
        Solver::Flip(flip) => fit_flip(doc, flip, domain)?,
    };
    Ok(Solvers {
        chosen,
        unchosen,
        lattice,
    })
}

fn fit_pbf(doc: &Document<'_>, pbf: &Pbf, domain: &Bounds) -> Result<Lattice> {
    let lattice = Lattice {
        spacing: pbf.particle_spacing,
        key: "solver.pbf.particle_spacing",
        least_gap: LEAST_SPACINGS * pbf.particle_spacing,
    };
    let support_radius = pbf.particle_spacing * pbf.support_ratio;
    check_grid(doc, domain, &lattice, support_radius, MAX_CELLS)?;
    if pbf.grid_projection {
        let cell_size = PROJECTION_CELL * pbf.particle_spacing;
        check_grid(doc, domain, &lattice, cell_size, MAX_FLIP_CELLS)?;
    }
    Ok(lattice)
}

fn fit_flip(doc: &Document<'_>, flip: &Flip, domain: &Bounds) -> Result<Lattice> {
    let lattice = Lattice {
        spacing: flip.particle_spacing(),
        key: "solver.flip.cell_size",
        least_gap: LEAST_CELLS * flip.cell_size,
    };
    check_interior(doc, &lattice, flip.cell_size, domain)?;
    check_grid(doc, domain, &lattice, flip.cell_size, MAX_FLIP_CELLS)?;
    Ok(lattice)
}

impl From<PbfSpec> for Pbf {
    fn from(spec: PbfSpec) -> Self {
        let relaxation = match spec.iteration {
            Iteration::Jacobi | Iteration::RedBlack => RELAXATION,
            Iteration::Chebyshev => CHEBYSHEV_RELAXATION,
        };
        Self {
            particle_spacing: spec.particle_spacing,
            support_ratio: spec.support_ratio,
            iteration: spec.iteration,
            // Unused by the other iterations.
            spectral_radius: spec.spectral_radius.unwrap_or(0.0),
            stop: match (spec.density_error, spec.max_iterations) {
                (Some(density_error), Some(max_iterations)) => Stop::DensityError {
                    density_error,
                    max_iterations,
                },
                _ => Stop::Iterations(spec.iterations.expect("laid down where the others are not")),
            },
            cfl: spec.cfl,
            relaxation: spec.relaxation.unwrap_or(relaxation),
            artificial_pressure: spec.artificial_pressure,
            grid_projection: spec.grid_projection,
            max_substeps: spec.max_substeps,
        }
    }
}

fn metres(domain: &Bounds) -> String {
    let [x, y, z] = domain.size().to_array().map(shown);
    format!("{x} × {y} × {z} m")
}

/// Checks that along every axis some cell touches no wall.
fn check_interior(
    doc: &Document<'_>,
    lattice: &Lattice,
    cell_size: f64,
    domain: &Bounds,
) -> Result<()> {
    let cells = domain.size() / cell_size;
    // Tolerates rounding of decimal fractions: 0.6 m are three cells of 0.2 m.
    if cells.min_element() >= LEAST_CELLS * (1.0 - 1e-9) {
        return Ok(());
    }
    let problem = format!(
        "no interior cell: a domain of {} is {:.3} × {:.3} × {:.3} cells of {} m",
        metres(domain),
        cells.x,
        cells.y,
        cells.z,
        shown(cell_size)
    );
    Err(doc.fault_of(lattice.key, problem))
}

/// Checks the number of cells, in total and along each axis.
fn check_grid(
    doc: &Document<'_>,
    domain: &Bounds,
    lattice: &Lattice,
    cell_size: f64,
    max_cells: f64,
) -> Result<()> {
    let cells = cells_over(domain.size(), cell_size);
    let all = cells.x * cells.y * cells.z;
    let axis = cells.max_element();
    if all > max_cells || axis > MAX_AXIS_CELLS {
        let problem = format!(
            "the grid would overflow: a domain of {} takes {:.3e} × {:.3e} × {:.3e} \
             = {all:.3e} cells of {} m",
            metres(domain),
            cells.x,
            cells.y,
            cells.z,
            shown(cell_size)
        );
        return Err(doc.fault_of(lattice.key, problem));
    }
    Ok(())
}
