//! The bodies of a scene in a substep: predicted before the projection, pushed by it, kept apart
//! after it, and moved with the particles.

use swell_domain::body::BodyState;
use swell_scene::step::{Substep, projected_substep};

use super::{
    super::{
        SolveError,
        pressure::{Round, bodies},
        trace::Run,
    },
    Flip, FrameTotals,
};

impl Flip {
    /// Returns the states of the bodies.
    pub(crate) fn bodies(&self) -> &[BodyState] {
        &self.state.bodies
    }

    /// Lets gravity and moorings act on the bodies, without the water.
    pub(super) fn predict_bodies(&mut self, substep: &Substep) {
        let gravity = self.scene.water.gravity;
        self.responses.clear();
        for (it, state) in self.scene.bodies().zip(&mut self.state.bodies) {
            // Sums of lengths round.
            state.time = substep.start;
            let kick = substep.kick;
            let response = it.body.held_response(state, kick);
            self.responses.push(response);
            *state = it.body.accelerated(state, gravity, kick);
        }
    }

    /// Uploads the poses of moving solids and bodies over a substep.
    pub(super) fn upload_movers(&self, substep: &Substep) {
        if let Some(movers) = &self.movers {
            let time = (substep.start, substep.length);
            movers.upload(&self.program, &self.scene, &self.state.bodies, time);
        }
    }

    /// Lists where the bodies may touch the water.
    pub(super) fn list_bodies(&mut self) {
        let Some(movers) = self.movers.as_ref().filter(|_| self.scene.has_bodies()) else {
            return;
        };
        self.touched = {
            let (bodies, responses) = (&self.state.bodies, &self.responses);
            let first = movers.first_body(&self.scene);
            bodies::Lists::new(&self.scene, &self.bricks, bodies, responses, first)
        };
        self.touched.upload(&self.program);
        let [bricks, count] = self.touched.sizes();
        self.pressure.set_bodies(bricks, count);
    }

    /// Adds to the bodies' velocities, and to the faces that they close, what the projection found.
    /// What contacts changed before it, the states have already.
    pub(super) fn push_bodies(
        &mut self,
        round: Round,
        run: &mut Run<'_>,
    ) -> Result<(), SolveError> {
        let Some(carry) = &self.recordings.carry else {
            return Ok(());
        };
        run(&self.program, &[carry])?;
        let precision = self.scene.settings().pressure.precision;
        let count = self.state.bodies.len();
        let [by_pressure, before] = bodies::changes(&self.program, precision, count)?;
        for (k, state) in self.state.bodies.iter_mut().enumerate() {
            if round != Round::AfterContacts {
                *state = state.sped_up(&before[k]);
            }
            *state = state.sped_up(&by_pressure[k]);
        }
        Ok(())
    }

    /// Keeps bodies out of each other, of walls and of solids. Returns whether that changed the
    /// velocities of any by so much that the water has to be projected again, for which all is
    /// ready.
    pub(super) fn collide_bodies(&mut self, substep: &Substep) -> bool {
        let Some(contacts) = &self.contacts else {
            return false;
        };
        let before = self.state.bodies.clone();
        let (walls, bodies) = (&self.state.walls, &mut self.state.bodies);
        contacts.resolve(&self.scene, walls, substep, bodies);
        let held = self.scene.stopped(&before, bodies, substep.length);
        if !held.contains(&true) {
            return false;
        }
        let changes: Vec<_> = (before.iter().zip(&*bodies))
            .map(|(before, after)| after.change_since(before))
            .collect();
        let precision = self.scene.settings().pressure.precision;
        bodies::upload_changes(&self.program, precision, &changes);
        self.touched.upload_held(&self.program, &held);
        true
    }

    /// Moves the bodies to the end of the substep.
    pub(super) fn move_bodies(&mut self, substep: &Substep) {
        for (it, state) in self.scene.bodies().zip(&mut self.state.bodies) {
            *state = it.body.moved(state, substep.length);
        }
    }

    /// Moves the bodies over a frame that has no particles.
    pub(super) fn run_without_water(&mut self) -> Result<FrameTotals, SolveError> {
        let (state, mut totals) = (&mut self.state, FrameTotals::default());
        if let Some(contacts) = &self.contacts {
            let (walls, bodies) = (&state.walls, &mut state.bodies);
            let (frame, before) = (self.frame, &mut state.substep);
            totals.substeps = contacts.advance_frame(&self.scene, walls, frame, bodies, before)?;
        }
        Ok(totals)
    }

    /// Moves the bodies over a substep, of (start, length) in seconds, that has no particles.
    pub(crate) fn advance_bodies(&mut self, (start, length): (f64, f64)) {
        let substep = projected_substep(start, length, self.state.substep);
        if let Some(contacts) = &self.contacts {
            let bodies = &mut self.state.bodies;
            contacts.advance(&self.scene, &self.state.walls, &substep, bodies);
        }
        self.state.substep = length;
    }
}
