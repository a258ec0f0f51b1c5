//! The bodies of a scene in a substep: predicted before the projection, pushed by it, kept apart
//! after it, and moved with the particles.

use swell_domain::body::BodyState;
use swell_scene::step::Substep;

use super::{
    super::{SolveError, pressure::bodies, trace::Run},
    Flip,
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
        let lists = {
            let (bodies, responses) = (&self.state.bodies, &self.responses);
            let first = movers.first_body(&self.scene);
            bodies::Lists::new(&self.scene, &self.bricks, bodies, responses, first)
        };
        lists.upload(&self.program);
        let [bricks, count] = lists.sizes();
        self.pressure.set_bodies(bricks, count);
    }

    /// Adds to the bodies' velocities, and to the faces that they close, what the projection found.
    pub(super) fn push_bodies(&mut self, run: &mut Run<'_>) -> Result<(), SolveError> {
        let Some(carry) = &self.recordings.carry else {
            return Ok(());
        };
        run(&self.program, &[carry])?;
        let precision = self.scene.settings().pressure.precision;
        let changes = bodies::changes(&self.program, precision, self.state.bodies.len())?;
        for (state, change) in self.state.bodies.iter_mut().zip(&changes) {
            *state = state.sped_up(change);
        }
        Ok(())
    }

    /// Keeps bodies out of each other, of walls and of solids, and uploads their way through the
    /// substep.
    pub(super) fn collide_bodies(&mut self, substep: &Substep) {
        let Some(contacts) = &self.contacts else {
            return;
        };
        let (walls, bodies) = (&self.state.walls, &mut self.state.bodies);
        contacts.resolve(&self.scene, walls, substep, bodies);
        self.upload_movers(substep);
    }

    /// Moves the bodies to the end of the substep.
    pub(super) fn move_bodies(&mut self, substep: &Substep) {
        for (it, state) in self.scene.bodies().zip(&mut self.state.bodies) {
            *state = it.body.moved(state, substep.length);
        }
    }
}
