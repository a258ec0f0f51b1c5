//! The grid on which velocities are made divergence-free before particles move (Raveendran et al.
//! 2011).

use glam::DVec3;

use crate::{
    SolveError,
    flip::{Flip, FrameTotals},
    plan::Plan,
    trace::Run,
};
use swell_domain::{
    absorber::AbsorberStates,
    boundary::Boundary,
    particles::Particles,
    solver::{Projection, Solver},
};
use swell_gpu::{adapter::Context, program::Program};
use swell_scene::PbfScene;

/// A FLIP solver that projects velocities but does not move particles.
pub(super) struct ProjectionGrid {
    flip: Flip,
    totals: FrameTotals,
}

impl ProjectionGrid {
    /// Builds the grid if the plan has one.
    pub(super) fn of(
        context: &Context,
        scene: &PbfScene,
        plan: &Plan,
        boundary: &Boundary,
    ) -> Result<Option<Self>, SolveError> {
        let (Some(scene), Some(plan)) = (scene.of_projection(), &plan.projection) else {
            return Ok(None);
        };
        Ok(Some(Self {
            flip: Flip::new(context, &scene, (**plan).clone(), boundary, false)?,
            totals: FrameTotals::default(),
        }))
    }

    pub(super) fn load(&mut self, frame: u32, particles: &Particles) -> Result<(), SolveError> {
        self.flip.load(frame, particles)
    }

    /// Copies the state of absorbing walls, so that the grid's walls match those of the particles.
    pub(super) fn take_absorbers(&mut self, walls: AbsorberStates) {
        self.flip.take_absorbers(walls);
    }

    /// Resets the sums of a frame.
    pub(super) fn begin_frame(&mut self, frame: u32) {
        self.totals = FrameTotals::default();
        self.flip.begin_frame(frame);
    }

    /// Projects the velocities of `program` over the given (start, length), seconds, and reorders
    /// its particles.
    pub(super) fn project(
        &mut self,
        program: &Program,
        span: (f64, f64),
        run: &mut Run<'_>,
    ) -> Result<(), SolveError> {
        (self.flip).project_velocities(program, span, &mut self.totals, run)
    }

    /// Returns the last projection's pressures, Pa.
    pub(super) fn pressures(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, SolveError> {
        self.flip.pressures(points)
    }

    /// Returns the report of the frame's projections, and the work by moving walls in them, joules.
    pub(super) fn done(&self) -> (Projection, f64) {
        (self.totals.projection, self.totals.work)
    }

    pub(super) fn flip(&self) -> &Flip {
        &self.flip
    }
}
