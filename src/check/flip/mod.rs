//! Compares FLIP's passes with their f64 reference passes, each from the inputs that the GPU had.

mod bodies;
mod cycle;
mod deep;
mod elements;
mod forces;
mod gaps;
mod grid;
mod iteration;
mod particles;
mod pressure;
mod rows;
mod sort;

use std::collections::BTreeMap;

use glam::DVec3;

use swell_domain::{
    absorber::AbsorberStates, body::BodyState, boundary::Boundary, particles::Particles,
    poisson::FLUID,
};
use swell_reference::{
    flip::{FlipSubstep, GridTransfer, Model, OpenSpace, Sorted, is_filling},
    poisson::iteration::Sum,
};
use swell_scene::{FlipScene, step::Substep};
use swell_solve::{flip::buffers, pressure::buffers as solved, trace::Begun};

use super::{
    comparison::{Comparison, Io, NONE, PassResult, State, comparison, names},
    table::pair,
};
use bodies::Touched;
use elements::Elements;
use pressure::Assembled;
use rows::{PLACE, WORK};

/// Comparisons of FLIP's own passes.
const COMPARISONS: &[Comparison<FlipState>] = &[
    comparison("flip/survey", NONE, sort::survey),
    comparison("flip/assign_cells", NONE, sort::assign_cells),
    comparison("flip/reorder", || names![buffers::ID], sort::reorder),
    comparison("flip/cut_cells", NONE, grid::cut_cells),
    comparison("flip/gather_faces", NONE, grid::gather_faces),
    comparison("flip/place_deep", deep::placed, deep::place_deep),
    comparison("flip/gather_centers", NONE, grid::gather_centers),
    comparison("flip/find_water", NONE, grid::find_water),
    comparison(
        "flip/close_gaps",
        || names![buffers::LIQUID_DISTANCE],
        gaps::close_gaps,
    ),
    comparison("flip/find_strain", NONE, gaps::find_strain),
    comparison("flip/find_contraction", NONE, gaps::find_contraction),
    comparison("flip/find_excess", NONE, grid::find_excess),
    comparison(
        "flip/let_in",
        || names![buffers::SOLID_FLUX, buffers::DENSITY_EXCESS],
        grid::let_in,
    ),
    comparison(
        "flip/wall_friction",
        elements::faces_kept,
        grid::wall_friction,
    ),
    comparison("flip/bend_paths", elements::faces_kept, gaps::bend_paths),
    comparison("flip/find_change", elements::faces_kept, grid::find_change),
    comparison("flip/extrapolate", elements::faces_kept, grid::extrapolate),
    comparison("flip/carry_deep", NONE, deep::carry_deep),
    comparison("flip/grid_to_particle", NONE, particles::grid_to_particle),
    comparison("flip/push_apart", NONE, particles::push_apart),
    comparison(
        "flip/advect",
        || names![buffers::COUNTERS, buffers::ID],
        particles::advect,
    ),
    comparison(
        "flip/aim",
        || names![buffers::SORTED_POSITION],
        particles::aim,
    ),
    comparison("flip/boundary_work", NONE, boundary_work),
];

/// Where the results of passes without a row of their own are compared.
const BOTH_HALVES: &str = "compared together with flip/gather_faces and flip/gather_centers";
const LABELLED: &str = "compared after pressure/count_pockets";

/// Returns the comparisons of FLIP's own passes and of its projection.
pub(super) fn comparisons() -> [&'static [Comparison<FlipState>]; 6] {
    [
        COMPARISONS,
        bodies::COMPARISONS,
        forces::COMPARISONS,
        pressure::COMPARISONS,
        iteration::COMPARISONS,
        cycle::COMPARISONS,
    ]
}

/// State that the comparisons share during the substep.
pub(crate) struct FlipState {
    pub(super) scene: FlipScene<'static>,
    boundary: Boundary,
    pub(super) model: Model,
    n: usize,
    /// State of the absorbing walls.
    pub(super) absorbers: AbsorberStates,
    frame: u32,
    pub(super) begun: Begun,
    /// Bodies as the device has them in the present part of the substep.
    pub(super) bodies: Vec<BodyState>,
    /// The substep, if it does not follow from the survey: that of a projection for another solver.
    pub(super) given_substep: Option<Substep>,
    /// What the device has of bodies.
    touched: Touched,
    elements: Option<Elements>,
    sorted: Option<Sorted>,
    space: Option<OpenSpace>,
    /// Densities at cell centres, as on the device.
    density: Option<Vec<f64>>,
    /// Fluxes that make up for contraction, as on the device; empty without any.
    contraction: Vec<f64>,
    /// Weight of the midpoint rule in the slots' paths by the strain before forces, as on the
    /// device.
    strained: Vec<f64>,
    /// Weight of the midpoint rule in the slots' paths, as on the device; empty where it serves
    /// all.
    bend: Vec<f64>,
    assembled: Option<Assembled>,
    given: Option<GridTransfer>,
    /// Number of runs of each pass of an iteration on each level.
    runs: BTreeMap<(&'static str, u32), usize>,
    /// Whether the pockets' sums follow pressure/verify.
    follows_verify: bool,
    /// Expected totals of the partial sums of each kind, by the latest pass that wrote them.
    sums: [Option<Sum>; 4],
}

impl State for FlipState {
    fn particles(&self) -> usize {
        self.n
    }

    const ELSEWHERE: &'static [(&'static str, &'static str)] = &[
        (
            "flip/find_not_finite",
            "it counts what is not finite, which is nothing here",
        ),
        ("flip/spread_faces", BOTH_HALVES),
        ("flip/spread_centers", BOTH_HALVES),
        ("pressure/label_cells", LABELLED),
        ("pressure/merge_labels", LABELLED),
    ];
}

impl FlipState {
    /// Creates the state for the particles at the end of a frame.
    pub(super) fn new(
        scene: &FlipScene,
        boundary: &Boundary,
        (frame, particles): (u32, &Particles),
    ) -> Self {
        Self {
            scene: scene.to_owned_scene(),
            boundary: boundary.clone(),
            model: Model::new(scene, boundary),
            n: particles.len(),
            absorbers: particles.walls,
            frame,
            begun: Begun::default(),
            bodies: particles.bodies.clone(),
            given_substep: None,
            touched: Touched::default(),
            elements: None,
            sorted: None,
            space: None,
            density: None,
            contraction: Vec::new(),
            strained: Vec::new(),
            bend: Vec::new(),
            assembled: None,
            given: None,
            runs: BTreeMap::new(),
            follows_verify: false,
            sums: [None; 4],
        }
    }

    pub(super) fn elements(&self) -> &Elements {
        self.elements.as_ref().expect("after flip/survey")
    }

    /// Takes over what is known when a substep begins.
    pub(super) fn begin(&mut self, begun: &Begun) {
        if self.begun != *begun {
            self.bodies.clone_from(&begun.bodies);
            self.begun = begun.clone();
        }
    }

    fn is_periodic(&self) -> bool {
        self.scene.is_periodic()
    }

    pub(super) fn sorted(&self) -> &Sorted {
        self.sorted.as_ref().expect("after flip/reorder")
    }

    /// Sets the velocities of the sorted particles to the device's current ones.
    pub(super) fn carry_velocities(&mut self, velocity: Vec<DVec3>) {
        if let Some(sorted) = &mut self.sorted {
            sorted.cloud.velocity = velocity;
        }
    }

    pub(super) fn space(&self) -> &OpenSpace {
        self.space.as_ref().expect("after flip/cut_cells")
    }

    pub(super) fn density(&self) -> &[f64] {
        self.density.as_ref().expect("after flip/gather_centers")
    }

    pub(super) fn step(&self) -> FlipSubstep<'_> {
        self.model
            .step(&self.elements().substep, &self.absorbers, &self.bodies)
    }

    /// Returns [`PLACE`], the rounding error of a position in cells.
    fn place(&self) -> f64 {
        let cells = self.model.cells.into_iter().max().unwrap_or(1);
        PLACE.of([f64::from(cells)])
    }
}

/// Compares the work, from the pressure and the flux on the device.
fn boundary_work(state: &mut FlipState, io: &mut Io<'_>) -> PassResult {
    let elements = state.elements();
    let pressure = elements.scalars(&io.after, solved::PRESSURE)?;
    let flux = elements.scalars(&io.after, buffers::SOLID_FLUX)?;
    let kind = io.before.get(buffers::CELL_KIND, elements.cells)?;
    let (step, bricks, space) = (state.step(), &elements.bricks, state.space());
    let density = elements.scalars(&io.before, buffers::DENSITY)?;
    let is_filling = |e: usize| is_filling(&step, bricks, space, &density, e as u32);
    let wet = elements.wet();
    let sums = io.after.get(buffers::BOUNDARY_WORK, wet.len() / 64)?;
    let term = |e: usize| match kind[e] {
        FLUID if !is_filling(e) => -pressure[e] * flux[e],
        _ => 0.0,
    };
    io.table.each(&WORK, 0..sums.len(), |group| {
        let first = wet.start + 64 * group;
        let terms = (first..first + 64).map(term);
        let sizes: f64 = terms.clone().map(f64::abs).sum();
        pair(group, sums[group], terms.sum::<f64>(), [sizes])
    });
    Ok(())
}
