//! What a substep computes.

use glam::DVec3;

use super::{
    BodyCells, Centers, Cloud, Faces, FlipSubstep, GridTransfer, Model, OpenSpace, Sorted,
    find_buried, is_filling, projection::Projected,
};
use swell_domain::{body::BodyState, bricks::Bricks, solver::Projection};

/// A substep with all its intermediate results.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Layout of the elements.
    pub bricks: Bricks,
    /// Particles at the substep's start, sorted by cell.
    pub sorted: Sorted,
    /// Open space of the cells.
    pub space: OpenSpace,
    /// Densities at cell centres.
    pub centers: Centers,
    /// Face velocities after the extrapolation of the last layer.
    pub faces: Faces,
    /// The projection from whose density correction particles are displaced.
    pub projected: Projected,
    /// The first projection, if an effect acts between two.
    pub earlier: Option<Projected>,
    /// A projection after contacts, if they stopped a body.
    pub after_contacts: Option<Projected>,
    /// Whether that effect needs more iterations than the settings allow.
    pub is_short: bool,
    /// Pressure by element, Pa; 0 where there is no water.
    pub pressure: Vec<f64>,
    /// Σ ± (1 − f) u_solid of each cell after the projections, m/s.
    pub solid_flux: Vec<f64>,
    /// Work of the scene's forces, joules.
    pub force_work: f64,
    /// Cells that bodies touch.
    pub coupled: Vec<BodyCells>,
    /// Bodies at the substep's start, with the velocities that they move with.
    pub bodies: Vec<BodyState>,
    /// Displacements of the density correction at the lower faces, metres, if it is on.
    pub displacement: Option<Vec<DVec3>>,
    /// Values transferred from the grid to the particles, in the order of `sorted`, before the
    /// particles moved.
    pub given: GridTransfer,
    /// Particles at the substep's end, in the order of `sorted`.
    pub after: Cloud,
    /// Number of particles whose displacement was reduced to the cap.
    pub capped: u64,
}

impl Trace {
    /// Iterates over the projections in order.
    pub fn projections(&self) -> impl Iterator<Item = &Projected> {
        let first = self.earlier.iter().chain([&self.projected]);
        first.chain(&self.after_contacts)
    }

    /// Adds the projections to the report of a frame's projections.
    pub(super) fn add_to(&self, all: &mut Projection) {
        self.projections()
            .for_each(|projected| projected.add_to(all));
        all.missed += u32::from(self.is_short);
    }
}

/// A pressure field on cells.
pub(super) struct PressureField {
    pub(super) bricks: Bricks,
    pub(super) kind: Vec<u32>,
    /// Whether each cell's centre is inside a wall or solid.
    pub(super) is_buried: Vec<bool>,
    /// Pressure by element, Pa.
    pub(super) pressure: Vec<f64>,
    /// See [`swell_domain::gauge::Gauge::taken`].
    pub(super) taken: Vec<[f32; 3]>,
}

impl PressureField {
    /// The field of a substep.
    pub(super) fn of(step: &FlipSubstep<'_>, trace: &Trace) -> Self {
        let taken = |change: &DVec3| (-*change / step.kick).as_vec3().to_array();
        Self {
            is_buried: find_buried(step, &trace.bricks, &trace.space),
            bricks: trace.bricks.clone(),
            kind: trace.space.kind.clone(),
            pressure: trace.pressure.clone(),
            taken: trace.faces.change.iter().map(taken).collect(),
        }
    }
}

impl Model {
    /// Returns the work of walls and solids that move in a substep (flip/boundary_work), and of
    /// forces, joules.
    pub(super) fn boundary_work(&self, step: &FlipSubstep<'_>, trace: &Trace) -> f64 {
        let Trace { bricks, space, .. } = trace;
        let terms = (0..space.kind.len()).map(|e| {
            let is_filling = is_filling(step, bricks, space, &trace.centers.density, e as u32);
            match is_filling {
                true => 0.0,
                false => -trace.pressure[e] * trace.solid_flux[e],
            }
        });
        let sum: f64 = terms.sum();
        self.cell_size().powi(2) * step.kick * sum + trace.force_work
    }
}
