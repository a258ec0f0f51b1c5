//! Keys of the solvers.

use super::super::{
    declare::keys,
    key::{Interval, words},
};
use swell_scene::{
    Iteration, Method,
    flip::{Flip, Precision, Preconditioner, Pressure, Surface, Transfer},
};

/// Metres. Below 10 nm matter is no continuum; 100 km is a tenth of the largest domain.
const SPACING: Interval = 1e-8..=1e5;

/// Largest displacement per substep. With 10 000 substeps per frame, the largest number allowed,
/// 1e-5 amounts to a tenth per frame.
const CFL: Interval = 1e-5..=5.0;

/// Iterations, or substeps per frame.
const MANY: std::ops::RangeInclusive<u32> = 1..=10_000;

keys! { struct SolverSpec {
    method: Method = choice(&words(&Method::NAMED))
        .also(
            ", with a table [solver.pbf] of at least particle_spacing or \
             [solver.flip] of at least cell_size",
        )
        .about("the solver; `--solver` picks as well"),
    pbf: Option<PbfSpec> = table()
        .absent()
        .about("Position-based fluids (Macklin and Müller 2013)"),
    flip: Option<Flip> = table()
        .absent()
        .about("PIC/FLIP (Zhu and Bridson 2005)"),
} }

/// Default of the relaxation ω.
pub(crate) const RELAXATION: f64 = 1.0;

/// Default ω of the Chebyshev semi-iteration; 1 overshoots (table in solve/pbf/iteration.rs).
pub(crate) const CHEBYSHEV_RELAXATION: f64 = 0.7;

keys! { struct PbfSpec {
    particle_spacing: f64 = number(SPACING)
        .unit("metres")
        .also(", with at most 65536 cells along an axis, 2147483647 cells and 134217728 particles")
        .about("d, between neighbours at the start"),
    support_ratio: f64 = number(1.5..=4.0)
        .default("2.0")
        .about("support radius over d"),
    iteration: Iteration = choice(&words(&Iteration::NAMED))
        .default("\"red_black\"")
        .about("how corrections see each other"),
    // Above this, Chebyshev's factors hardly change within 10 000 iterations.
    spectral_radius: Option<f64> = number(0.01..=0.9999)
        .only("iteration", &["chebyshev"])
        .default("0.98")
        .about("ρ of the plain iteration; nearer to 1 reaches deeper"),
    iterations: Option<u32> = whole(MANY)
        .without(&["density_error", "max_iterations"])
        .default("4")
        .about("of each substep"),
    // `f32` resolves relative differences of 6e-8.
    density_error: Option<f64> = number(1e-7..=0.99)
        .absent()
        .with("max_iterations")
        .about("iterate until the mean of max(0, ρ/ρ0 − 1) is below it"),
    max_iterations: Option<u32> = whole(MANY)
        .absent()
        .with("density_error")
        .about("and at most so often"),
    cfl: f64 = number(CFL)
        .default("1.0")
        .about("largest displacement in a substep, in d; as many substeps as that asks"),
    // A relaxation of a hundredth takes a hundred iterations for one.
    relaxation: Option<f64> = number(0.01..=1.5)
        .computed(|| {
            format!("{RELAXATION:?}, {CHEBYSHEV_RELAXATION:?} with iteration = \"chebyshev\"")
        })
        .about("ω, factor on each correction"),
    artificial_pressure: f64 = number(0.0..=10.0)
        .default("0.0")
        .about("k of s_corr, with λ's natural scale as unit"),
    grid_projection: bool = flag().default("true").about(
        "velocities are made free of divergence on a grid of cells of 2 d before particles move \
         (Raveendran 2011), so that iterations correct what is left; a period is then a multiple \
         of 16 d. `false`: the iterations alone, as in the paper by Macklin and Müller (2013)",
    ),
    max_substeps: u32 = whole(MANY)
        .not_physics()
        .default("32")
        .about("more in a frame are an error (exit 5), never silently fewer"),
} }

keys! { fields of Flip {
    cell_size: f64 = number(SPACING)
        .unit("metres")
        .also(
            ", with at least 3 and at most 65536 cells along each axis, 68719476736 cells \
             and 134217728 particles",
        )
        .about("Δx"),
    // Fewer than four particles do not define the density of a cell.
    particles_per_cell: u32 = whole(4..=64)
        .default("8")
        .about("in a full cell at rest, n on a lattice of spacing Δx / ∛n"),
    transfer: Transfer = choice(&words(&Transfer::NAMED))
        .default("\"flip\"")
        .about("`apic` (Jiang 2015) has affine rows as attributes of the frames"),
    pic_blend: f64 = number(0.0..=1.0).default("0.05").about(
        "α, the part of the velocity taken from the grid; a viscosity of α Δx² / \
         (6 Δt); unused by apic",
    ),
    cfl: f64 = number(CFL).default("3.0").about(
        "largest displacement in a substep, in cells; a frame has as many substeps as that and \
         Δt ≤ √(Δx / g) ask",
    ),
    max_substeps: u32 = whole(MANY)
        .not_physics()
        .default("32")
        .about("more in a frame are an error (exit 5), never silently fewer"),
    surface: Surface = choice(&words(&Surface::NAMED))
        .default("\"ghost_fluid\"")
        .about(
            "where the pressure is zero: at the surface (Enright 2003), or in the middle \
             of the first cell of air",
        ),
    density_correction: bool = flag()
        .default("true")
        .about("moves particles so that the volume stays (Kugelstadt 2019)"),
    // Depths are measured within a brick's edge, and two cells beyond the band.
    band: Option<u32> = whole(3..=6)
        .absent()
        .unit("cells")
        .also(
            ", and at least `cfl` + 2; with `transfer = \"flip\"`, 8, 27 or 64 \
             `particles_per_cell`, and a domain of whole cells; without solids, wave makers, \
             emitters, drains and forces",
        )
        .about(
            "particles only so deep below the free surface, and velocities on the grid below \
             (Ferstl 2016); particles are everywhere if absent",
        ),
    pressure: Pressure = table()
        .default("{}")
        .about("The linear solve of the projection"),
} }

keys! { fields of Pressure {
    preconditioner: Preconditioner = choice(&words(&Preconditioner::NAMED))
        .default("\"multigrid\"")
        .about("of the conjugate gradients; `ipp` is Ament 2010"),
    precision: Precision = choice(&words(&Precision::NAMED))
        .default("\"f32_refined\"")
        .also(", the last where the adapter has it")
        .about("one word, iterative refinement, or 64-bit shader floats"),
    // In `f64`, a residual has a rounding error of 2e-16 per term, and a row has seven terms.
    tolerance: f64 = number(1e-14..=0.99)
        .unit("of the right-hand side's norm")
        .default("1e-5")
        .about("true residual at which a solve stops"),
    max_iterations: u32 = whole(MANY)
        .default("400")
        .about("a solve that ends there is reported"),
} }
