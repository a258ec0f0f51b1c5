//! Compares PBF's passes with their f64 reference passes, each from the inputs that the GPU had.

pub(super) mod bounds;
pub(super) mod forces;
mod lists;
mod passes;
mod rows;
mod stop;
mod whole;
mod work;

use glam::DVec3;

use swell_domain::{absorber::AbsorberStates, body::BodyState, boundary::Boundary};
use swell_reference::{
    neighbors::Neighbors,
    pbf::{Model, Substep, passes::Inputs},
};
use swell_scene::{PbfScene, Stop};
use swell_solve::{SolveError, params::IterationControl, pbf::buffers, plan::Plan};

use super::{
    comparison::{Comparison, Io, NONE, PassResult, State, TracedBuffers, comparison, names, wide},
    table::pair,
};
use lists::Lists;
use rows::{SAMPLES, WEIGHTS};
use whole::Whole;

/// Comparisons of PBF's own passes.
pub(super) const COMPARISONS: &[Comparison<PbfState>] = &[
    comparison("pbf/predict", || names![buffers::VELOCITY], passes::predict),
    comparison("pbf/assign_cells", NONE, passes::assign_cells),
    comparison(
        "pbf/reorder",
        || names![buffers::ID, buffers::IS_DROP],
        passes::reorder,
    ),
    comparison("pbf/build_neighbors", NONE, lists::build_neighbors),
    comparison(
        "pbf/compute_lambda",
        || names![buffers::PREDICTED, buffers::PREDICTED_HIGH],
        passes::compute_lambda,
    ),
    comparison(
        "pbf/compute_delta",
        || names![buffers::CORRECTED, buffers::WALL_WORK],
        passes::compute_delta,
    ),
    comparison(
        "pbf/exchange",
        || {
            names![
                buffers::PREDICTED,
                buffers::PREDICTED_HIGH,
                buffers::CORRECTED
            ]
        },
        passes::exchange,
    ),
    comparison("pbf/sum_error", NONE, stop::sum_error),
    comparison(
        "pbf/decide",
        || names![buffers::CONTROL, buffers::COUNTERS],
        stop::decide,
    ),
    comparison(
        "pbf/update_velocity",
        || {
            names![
                buffers::PREDICTED,
                buffers::PREDICTED_HIGH,
                buffers::COUNTERS,
                buffers::ID,
                buffers::IS_DROP
            ]
        },
        passes::update_velocity,
    ),
    comparison("pbf/measure_density", NONE, passes::measure_density),
    comparison(
        "pbf/boundary_work",
        || names![buffers::BOUNDARY_WORK],
        work::boundary_work,
    ),
];

/// State that the comparisons share during the substep.
pub(super) struct PbfState {
    pub(super) scene: PbfScene<'static>,
    model: Model,
    /// Whether the model's samples are those of the device.
    has_samples: bool,
    pub(super) substep: Substep,
    plan: Plan,
    lists: Lists,
    whole: Whole,
    /// Bodies that the model's solids stand for.
    bodies: Vec<BodyState>,
    /// Whether the velocities have been updated: later passes measure the frame's end.
    is_over: bool,
}

impl State for PbfState {
    fn particles(&self) -> usize {
        self.plan.counts.particles
    }

    const ELSEWHERE: &'static [(&'static str, &'static str)] = &[];
}

impl PbfState {
    /// Creates the state for a substep that ends at time `end` after `time_step` seconds.
    pub(super) fn new(
        scene: &PbfScene,
        boundary: &Boundary,
        plan: Plan,
        (absorbers, bodies): (&AbsorberStates, &[BodyState]),
        (end, time_step): (f64, f64),
    ) -> Self {
        let mut model = Model::new(scene, boundary);
        model.stand(scene, bodies, end, time_step);
        Self {
            scene: scene.to_owned_scene(),
            model,
            has_samples: false,
            substep: Substep::new(scene, absorbers, end, time_step),
            lists: Lists::new(&plan),
            plan,
            whole: Whole::default(),
            is_over: false,
            bodies: bodies.to_vec(),
        }
    }

    pub(super) fn inputs<'b>(
        &'b self,
        points: &'b [DVec3],
        neighbors: &'b Neighbors,
    ) -> Inputs<'b> {
        Inputs {
            model: &self.model,
            substep: &self.substep,
            points,
            neighbors,
            is_drop: &[],
        }
    }

    /// Takes over the bodies at the substep's end.
    pub(super) fn stand(&mut self, boundary: &Boundary, bodies: &[BodyState]) {
        if self.bodies != bodies {
            self.bodies = bodies.to_vec();
            let step = self.substep.time_step;
            self.model = Model::new(&self.scene, boundary);
            (self.model).stand(&self.scene, bodies, self.substep.time, step);
        }
    }

    /// Takes the boundary samples from the device, as inputs of its passes, and compares them as
    /// outputs of the upload.
    fn take_samples(&mut self, io: &mut Io<'_>) -> PassResult {
        let (n, samples) = (self.particles(), self.plan.counts.boundary_samples);
        if samples == 0 || std::mem::replace(&mut self.has_samples, true) {
            return Ok(());
        }
        let (places, weights) = self.places(&io.after, n + samples)?;
        let (places, weights) = (places[n..].to_vec(), weights[n..].to_vec());
        let (model, table) = (&mut self.model, &mut *io.table);
        table.each(&SAMPLES, 0..samples, |k| {
            let at = model.samples[k];
            pair(k, places[k], at, [at.length()])
        });
        table.each(&WEIGHTS, 0..samples, |k| {
            let expected = model.sample_weights[k];
            pair(k, weights[k], expected, [expected])
        });
        (model.samples, model.sample_weights) = (places, weights);
        Ok(())
    }

    /// Reads the state of the iteration to a density error before the pass; `None` if the number of
    /// iterations is fixed.
    fn control(&self, io: &Io<'_>) -> Result<Option<IterationControl>, SolveError> {
        match self.scene.settings().stop {
            Stop::DensityError { .. } => Ok(Some(io.before.one(buffers::CONTROL)?)),
            _ => Ok(None),
        }
    }

    /// Reads the positions that a pass reads, followed by the samples, and λ.
    fn stored(&self, io: &Io<'_>) -> Result<(Vec<DVec3>, Vec<f64>), SolveError> {
        let n = self.particles();
        let (mut points, lambda) = self.places(&io.before, n)?;
        points.extend(&self.model.samples);
        Ok((points, lambda))
    }

    /// Reads the first `count` entries of `predicted`: positions, and the values in w.
    fn places(
        &self,
        view: &TracedBuffers<'_>,
        count: usize,
    ) -> Result<(Vec<DVec3>, Vec<f64>), SolveError> {
        let low = self.plan.page.unwrap_or(count).min(count);
        let mut all = view.get(buffers::PREDICTED, low)?;
        if low < count {
            all.extend(view.get(buffers::PREDICTED_HIGH, count - low)?);
        }
        let places = all.iter().map(|&[x, y, z, _]| wide(&[[x, y, z]])[0]);
        Ok((
            places.collect(),
            all.iter().map(|value| f64::from(value[3])).collect(),
        ))
    }

    /// Reads which particles the grid found to be isolated droplets, in storage order.
    pub(super) fn drops(&self, view: &TracedBuffers<'_>) -> Result<Vec<bool>, SolveError> {
        let n = self.particles();
        if !self.model.settings.grid_projection {
            return Ok(vec![false; n]);
        }
        let flags = view.get(buffers::IS_DROP, n)?;
        Ok(flags.into_iter().map(|flag| flag > 0.0).collect())
    }

    /// Reads positions followed by the samples, as effects see them.
    pub(super) fn moved(&self, io: &Io<'_>) -> Result<Vec<DVec3>, SolveError> {
        let mut points = io.before.vectors(buffers::POSITION, self.particles())?;
        points.extend(&self.model.samples);
        Ok(points)
    }
}
