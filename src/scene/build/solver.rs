//! The solvers' tables. The keys of each one that stands in a scene are checked; whether the scene fits,
//! only of the one that is chosen.

use toml::Spanned;

use super::{
    super::{
        Iteration, Method, Pbf, Solver, Stop,
        document::Document,
        flip::{Flip, Precision, Preconditioner, Pressure, Surface, Transfer},
        ranges,
        spec::{FlipSpec, PbfSpec, PressureSpec, SolverSpec},
        words::shown,
    },
    Lattice, Result, number, number_or, whole,
};
use crate::domain::bounds::Bounds;

/// Most cells of PBF's neighbour grid; their indices are 32 bits.
const MAX_CELLS: f64 = 2_147_483_647.0;

/// Most cells of FLIP's box, wet or dry: 2²⁷ bricks of 8³, each with four bytes in a table.
const MAX_FLIP_CELLS: f64 = 68_719_476_736.0;

/// Most cells along one axis.
const MAX_AXIS_CELLS: f64 = 65_536.0;

/// Room that walls leave each other: spacings with PBF, cells with FLIP, of which one is then
/// between two that touch a wall.
const LEAST_SPACINGS: f64 = 2.0;
const LEAST_CELLS: f64 = 3.0;

/// Every table that stands there, the method, and the lattice of the chosen one.
pub(super) fn solver(
    doc: &Document<'_>,
    spec: &SolverSpec,
    domain: &Bounds,
) -> Result<(Solver, Lattice)> {
    let method = choice(doc, &spec.method, "method", &Method::NAMED)?;
    let solver = Solver {
        method,
        pbf: match &spec.pbf {
            Some(spec) => Some(pbf(doc, spec)?),
            None => None,
        },
        flip: match &spec.flip {
            Some(spec) => Some(flip(doc, spec)?),
            None => None,
        },
    };
    let lattice = match (method, &spec.pbf, &spec.flip) {
        (Method::Pbf, Some(spec), _) => fit_pbf(doc, spec, solver.pbf(), domain)?,
        (Method::Flip, _, Some(spec)) => fit_flip(doc, spec, solver.flip(), domain)?,
        _ => {
            let problem = format!("the scene has no table [solver.{}]", method.name());
            return Err(doc.fault_at(spec.method.span(), problem));
        }
    };
    Ok((solver, lattice))
}

fn fit_pbf(doc: &Document<'_>, spec: &PbfSpec, pbf: &Pbf, domain: &Bounds) -> Result<Lattice> {
    let lattice = Lattice {
        spacing: pbf.particle_spacing,
        span: spec.particle_spacing.span(),
        least_gap: LEAST_SPACINGS * pbf.particle_spacing,
    };
    let support_radius = pbf.particle_spacing * pbf.support_ratio;
    check_grid(doc, domain, &lattice, support_radius, MAX_CELLS)?;
    Ok(lattice)
}

fn fit_flip(doc: &Document<'_>, spec: &FlipSpec, flip: &Flip, domain: &Bounds) -> Result<Lattice> {
    let lattice = Lattice {
        spacing: flip.particle_spacing(),
        span: spec.cell_size.span(),
        least_gap: LEAST_CELLS * flip.cell_size,
    };
    check_interior(doc, &spec.cell_size, domain)?;
    check_grid(doc, domain, &lattice, flip.cell_size, MAX_FLIP_CELLS)?;
    Ok(lattice)
}

/// The value that a word stands for.
fn choice<T: Copy>(
    doc: &Document<'_>,
    word: &Spanned<String>,
    what: &str,
    named: &[(&str, T)],
) -> Result<T> {
    let given = word.get_ref().as_str();
    if let Some((_, value)) = named.iter().find(|(name, _)| *name == given) {
        return Ok(*value);
    }
    let nearest = named
        .iter()
        .map(|(name, _)| *name)
        .min_by_key(|name| strsim::damerau_levenshtein(name, given))
        .unwrap_or_default();
    let problem = format!("{given:?} is no {what}; the nearest is {nearest:?}");
    Err(doc.fault_at(word.span(), problem))
}

fn choice_or<T: Copy>(
    doc: &Document<'_>,
    word: &Option<Spanned<String>>,
    what: &str,
    named: &[(&str, T)],
    default: T,
) -> Result<T> {
    word.as_ref()
        .map_or(Ok(default), |word| choice(doc, word, what, named))
}

fn whole_or(
    doc: &Document<'_>,
    value: &Option<Spanned<i64>>,
    default: u32,
    max: u32,
) -> Result<u32> {
    value
        .as_ref()
        .map_or(Ok(default), |value| whole(doc, value, max))
}

/// Default ω of the Chebyshev semi-iteration: 1 overshoots (table in solve/iteration.rs).
const CHEBYSHEV_RELAXATION: f64 = 0.7;

fn pbf(doc: &Document<'_>, spec: &PbfSpec) -> Result<Pbf> {
    let particle_spacing = number(doc, &spec.particle_spacing, &ranges::SPACING)?;
    let support_ratio = number_or(doc, &spec.support_ratio, 2.0, &ranges::SUPPORT_RATIO)?;
    let iteration = choice_or(
        doc,
        &spec.iteration,
        "iteration",
        &Iteration::NAMED,
        Iteration::RedBlack,
    )?;
    let relaxation = match iteration {
        Iteration::Jacobi | Iteration::RedBlack => 1.0,
        Iteration::Chebyshev => CHEBYSHEV_RELAXATION,
    };
    if let (Some(radius), Iteration::Jacobi | Iteration::RedBlack) =
        (&spec.spectral_radius, iteration)
    {
        let problem = "given without iteration = \"chebyshev\"";
        return Err(doc.fault_at(radius.span(), problem));
    }
    Ok(Pbf {
        particle_spacing,
        support_ratio,
        iteration,
        spectral_radius: number_or(doc, &spec.spectral_radius, 0.98, &ranges::SPECTRAL_RADIUS)?,
        stop: stop(doc, spec)?,
        cfl: number_or(doc, &spec.cfl, 1.0, &ranges::CFL)?,
        relaxation: number_or(doc, &spec.relaxation, relaxation, &ranges::RELAXATION)?,
        artificial_pressure: number_or(
            doc,
            &spec.artificial_pressure,
            0.0,
            &ranges::ARTIFICIAL_PRESSURE,
        )?,
        max_substeps: whole_or(doc, &spec.max_substeps, 32, 10_000)?,
    })
}

fn stop(doc: &Document<'_>, spec: &PbfSpec) -> Result<Stop> {
    match (&spec.iterations, &spec.density_error, &spec.max_iterations) {
        (None, None, None) => Ok(Stop::Iterations(4)),
        (Some(iterations), None, None) => Ok(Stop::Iterations(whole(doc, iterations, 10_000)?)),
        (None, Some(density_error), Some(max_iterations)) => Ok(Stop::DensityError {
            density_error: number(doc, density_error, &ranges::DENSITY_ERROR)?,
            max_iterations: whole(doc, max_iterations, 10_000)?,
        }),
        (Some(iterations), _, _) => {
            let other = match &spec.density_error {
                Some(_) => "density_error",
                None => "max_iterations",
            };
            Err(doc.fault_at(iterations.span(), format!("given together with {other}")))
        }
        (None, Some(density_error), None) => {
            Err(doc.fault_at(density_error.span(), "given without max_iterations"))
        }
        (None, None, Some(max_iterations)) => {
            Err(doc.fault_at(max_iterations.span(), "given without density_error"))
        }
    }
}

/// Fewer than four in a cell do not tell its density.
fn particles_per_cell(doc: &Document<'_>, value: &Option<Spanned<i64>>) -> Result<u32> {
    let count = whole_or(doc, value, 8, 64)?;
    match value {
        Some(value) if count < 4 => {
            Err(doc.fault_at(value.span(), format!("{count} is out of range")))
        }
        _ => Ok(count),
    }
}

fn flip(doc: &Document<'_>, spec: &FlipSpec) -> Result<Flip> {
    let cell_size = number(doc, &spec.cell_size, &ranges::SPACING)?;
    Ok(Flip {
        cell_size,
        particles_per_cell: particles_per_cell(doc, &spec.particles_per_cell)?,
        transfer: choice_or(
            doc,
            &spec.transfer,
            "transfer",
            &Transfer::NAMED,
            Transfer::Flip,
        )?,
        pic_blend: number_or(doc, &spec.pic_blend, 0.05, &ranges::PART)?,
        cfl: number_or(doc, &spec.cfl, 3.0, &ranges::CFL)?,
        max_substeps: whole_or(doc, &spec.max_substeps, 32, 10_000)?,
        surface: choice_or(
            doc,
            &spec.surface,
            "surface",
            &Surface::NAMED,
            Surface::GhostFluid,
        )?,
        density_correction: spec.density_correction.unwrap_or(true),
        pressure: pressure(doc, &spec.pressure)?,
    })
}

fn pressure(doc: &Document<'_>, spec: &PressureSpec) -> Result<Pressure> {
    Ok(Pressure {
        preconditioner: choice_or(
            doc,
            &spec.preconditioner,
            "preconditioner",
            &Preconditioner::NAMED,
            Preconditioner::Multigrid,
        )?,
        precision: choice_or(
            doc,
            &spec.precision,
            "precision",
            &Precision::NAMED,
            Precision::F32Refined,
        )?,
        tolerance: number_or(doc, &spec.tolerance, 1e-5, &ranges::TOLERANCE)?,
        max_iterations: whole_or(doc, &spec.max_iterations, 400, 10_000)?,
    })
}

fn metres(domain: &Bounds) -> String {
    let [x, y, z] = domain.size().to_array().map(shown);
    format!("{x} × {y} × {z} m")
}

/// A cell that touches no wall on either side, along every axis.
fn check_interior(doc: &Document<'_>, cell_size: &Spanned<f64>, domain: &Bounds) -> Result<()> {
    let cells = domain.size() / *cell_size.get_ref();
    // Decimal fractions: 0.6 m are three cells of 0.2 m.
    if cells.min_element() >= LEAST_CELLS * (1.0 - 1e-9) {
        return Ok(());
    }
    let problem = format!(
        "no interior cell: a domain of {} is {:.3} × {:.3} × {:.3} cells of {} m",
        metres(domain),
        cells.x,
        cells.y,
        cells.z,
        shown(*cell_size.get_ref())
    );
    Err(doc.fault_at(cell_size.span(), problem))
}

/// A grid of at most so many cells, and positions of 32 bits that are fine enough for the lattice.
fn check_grid(
    doc: &Document<'_>,
    domain: &Bounds,
    lattice: &Lattice,
    cell_size: f64,
    max_cells: f64,
) -> Result<()> {
    let span = lattice.span.clone();
    let cells = (domain.size() / cell_size).ceil();
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
        return Err(doc.fault_at(span, problem));
    }
    Ok(())
}
