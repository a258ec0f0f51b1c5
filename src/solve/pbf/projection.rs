//! The grid on which velocities are made free of divergence before particles move (Raveendran et al. 2011).

use glam::DVec3;

use crate::{
    SolveError,
    flip::{Flip, FrameTotals},
    plan::Plan,
    trace::Run,
};
use swell_domain::{
    boundary::Boundary,
    particles::Particles,
    solver::{Projection, Solver},
};
use swell_gpu::{adapter::Context, program::Program};
use swell_scene::Scene;

/// FLIP up to what it gives to particles.
pub(super) struct Grid {
    flip: Flip,
    totals: FrameTotals,
}

impl Grid {
    /// Where the plan has one.
    pub(super) fn of(
        context: &Context,
        scene: &Scene,
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

    /// Its walls stand where those of the particles do.
    pub(super) fn take_answers(&mut self, state: &Particles) {
        self.flip.take_answers(state);
    }

    /// Zeroes what adds up over a frame.
    pub(super) fn begin_frame(&mut self, frame: u32) {
        self.totals = FrameTotals::default();
        self.flip.begin_frame(frame);
    }

    /// Changes the velocities of `program`, and the order of its particles, for `length` seconds from `start` on.
    pub(super) fn project(
        &mut self,
        program: &Program,
        span: (f64, f64),
        run: &mut Run<'_>,
    ) -> Result<(), SolveError> {
        (self.flip).project_velocities(program, span, &mut self.totals, run)
    }

    /// The last projection's, Pa.
    pub(super) fn pressures(&self, points: &[DVec3]) -> Result<Vec<Option<f64>>, SolveError> {
        self.flip.pressures(points)
    }

    /// What the frame's projections did, and what moving walls did in them, joule.
    pub(super) fn done(&self) -> (Projection, f64) {
        (self.totals.projection, self.totals.work)
    }

    pub(super) fn flip(&self) -> &Flip {
        &self.flip
    }
}
