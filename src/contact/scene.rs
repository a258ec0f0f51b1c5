//! Contacts of a scene's bodies.

use swell_domain::{absorber::AbsorberStates, body::BodyState, budget::Breach, pose::Passage};
use swell_scene::{FlipScene, Scene, step::Substep};

use super::{Contacts, Surroundings};

/// Distance that surfaces keep, in particle spacings.
const MARGIN: f64 = 0.01;

/// Contacts of the bodies of a scene with each other, with its walls and with its solids, but for
/// those whose shape changes.
pub struct SceneContacts(Contacts);

impl SceneContacts {
    /// Prepares a scene's shapes; `None` without bodies.
    ///
    /// # Panics
    ///
    /// Panics if a mesh has no triangles, or a body's no volume, which no scene that was read has.
    pub fn of(scene: &Scene) -> Option<Self> {
        if !scene.has_bodies() {
            return None;
        }
        let statics: Vec<_> = scene.solids.iter().map(|solid| &solid.mesh).collect();
        let (mut moving, mut bodies) = (Vec::new(), Vec::new());
        for solid in &scene.moving_solids {
            match &solid.body {
                None if solid.changes_shape() => {}
                None => moving.push(&solid.placed.mesh),
                Some(it) => bodies.push((&it.body, it.collides.then_some(&solid.placed.mesh))),
            }
        }
        let margin = MARGIN * scene.particle_spacing();
        let contacts = Contacts::new(&statics, &moving, &bodies, margin);
        Some(Self(
            contacts.expect("meshes are checked as a scene is read"),
        ))
    }

    /// Changes the velocities of `bodies`, which are as at the start of `substep`, as
    /// [`Contacts::resolve`].
    pub fn resolve(
        &self,
        scene: &Scene,
        absorbers: &AbsorberStates,
        substep: &Substep,
        bodies: &mut [BodyState],
    ) {
        let Substep { start, length, .. } = *substep;
        let prescribed = scene.moving_solids.iter().filter(|it| it.is_prescribed());
        let prescribed = prescribed.filter(|it| !it.changes_shape());
        let moving: Vec<Passage> = prescribed
            .map(|solid| solid.passage(&[], start, length))
            .collect();
        let velocity = scene.wall_velocity(absorbers, start + length, length);
        let around = Surroundings {
            walls: scene.walls(absorbers, start).moved(scene.domain.min),
            wall_velocities: [velocity.min, velocity.max],
            periodic: scene.periodic,
            moving: &moving,
        };
        self.0.resolve(bodies, &around, length);
    }

    /// Moves `bodies` over a substep without water: by gravity, moorings and contacts.
    pub fn advance(
        &self,
        scene: &Scene,
        absorbers: &AbsorberStates,
        substep: &Substep,
        bodies: &mut [BodyState],
    ) {
        let gravity = scene.water.gravity;
        for (it, state) in scene.bodies().zip(&mut *bodies) {
            // Sums of lengths round.
            state.time = substep.start;
            *state = it.body.accelerated(state, gravity, substep.kick);
        }
        self.resolve(scene, absorbers, substep, bodies);
        for (it, state) in scene.bodies().zip(&mut *bodies) {
            *state = it.body.moved(state, substep.length);
        }
    }

    /// Moves `bodies` over the frame after `frame`, without water; `before` is the length of the
    /// last substep, seconds, and becomes that of this frame's last. Returns the number of
    /// substeps.
    ///
    /// # Errors
    /// If that is more than the scene's `max_substeps`.
    pub fn advance_frame(
        &self,
        scene: &FlipScene<'_>,
        absorbers: &AbsorberStates,
        frame: u32,
        bodies: &mut [BodyState],
        before: &mut f64,
    ) -> Result<u32, Breach> {
        let length = scene.shot.frame_seconds();
        let (start, mut elapsed, mut done) = (f64::from(frame) * length, 0.0, 0);
        loop {
            let (wanted, substep) = scene.flip_substep(
                (absorbers, bodies),
                frame + 1,
                start + elapsed,
                length - elapsed,
                0.0,
                (done, *before),
            )?;
            self.advance(scene, absorbers, &substep, bodies);
            *before = substep.length;
            elapsed += substep.length;
            done += 1;
            if wanted <= 1.0 {
                return Ok(done);
            }
        }
    }
}
