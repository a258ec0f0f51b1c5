//! Contacts of rigid bodies with each other, with the walls of the domain and with solids.
//!
//! [`Contacts`] holds the shapes. [`Contacts::resolve`] changes the velocities of bodies so that
//! none enters another, a wall or a solid within the next step. It builds a world of the physics
//! engine rapier for each call, so nothing but the arguments decides the result, bit for bit.
//!
//! Contacts are inelastic, with Coulomb friction of coefficient [`FRICTION`]. Bodies that overlap
//! are pushed apart at [`PUSH`] at most.

mod motion;
mod near;
mod scene;
mod shape;
#[cfg(test)]
mod tests;
mod world;

use glam::DVec3;
use rapier3d_f64::geometry::SharedShape;
use swell_domain::{
    body::{Body, BodyState},
    bounds::Bounds,
    mesh::TriangleMesh,
    pose::Passage,
};

pub use scene::SceneContacts;
pub use shape::ShapeError;
use world::World;

/// Coefficient of friction of every contact.
pub const FRICTION: f64 = 0.3;

/// Greatest speed at which surfaces that overlap are pushed apart, m/s. A body keeps this speed
/// until another contact or force changes it; it would lift a body by PUSH²/2g = 2 mm.
pub const PUSH: f64 = 0.2;

/// The shapes that may touch each other. They do not change during a bake.
pub struct Contacts {
    statics: Vec<SharedShape>,
    moving: Vec<Solid>,
    bodies: Vec<Collider>,
    margin: f64,
}

/// A solid with a prescribed motion, in its pose at the start.
struct Solid {
    shape: SharedShape,
    /// Middle of a sphere around it, metres.
    middle: DVec3,
    /// Radius of that sphere, metres.
    radius: f64,
}

/// A rigid body and what of it touches others.
struct Collider {
    body: Body,
    touch: Option<Touch>,
}

/// The shape of a body, relative to the centre of mass in the pose at the start.
struct Touch {
    shape: SharedShape,
    /// Radius of a sphere about the centre of mass that holds the shape, metres.
    radius: f64,
}

/// What surrounds the bodies during a step.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings<'a> {
    /// The walls at the beginning of the step, metres. A body is inside, and a wall that is out of
    /// its reach has no effect.
    pub walls: Bounds,
    /// Velocities of the three lower and of the three upper walls, each along its own axis, m/s.
    pub wall_velocities: [DVec3; 2],
    /// Axes along which the domain is periodic, where it has no walls.
    pub periodic: [bool; 3],
    /// Motion of each solid of `moving` (see [`Contacts::new`]) during the step, in that order.
    pub moving: &'a [Passage],
}

impl Contacts {
    /// Prepares the shapes of solids at rest (`statics`), of solids with a prescribed motion
    /// (`moving`) and of `bodies`. A body without a mesh touches nothing.
    ///
    /// Meshes are closed, in metres, in scene coordinates and in the pose at the start. The mesh of
    /// a body is replaced by its convex hull if it is convex, otherwise by convex parts. Surfaces
    /// keep a distance of `margin` metres.
    ///
    /// # Errors
    ///
    /// Fails if a mesh has no triangles, or if a body's mesh has no volume.
    pub fn new(
        statics: &[&TriangleMesh],
        moving: &[&TriangleMesh],
        bodies: &[(&Body, Option<&TriangleMesh>)],
        margin: f64,
    ) -> Result<Self, ShapeError> {
        let statics = statics.iter().map(|mesh| shape::of_solid(mesh));
        let moving = moving.iter().map(|mesh| Solid::new(mesh));
        let bodies = bodies.iter().map(|(body, mesh)| Collider::new(body, *mesh));
        Ok(Self {
            statics: statics.collect::<Result<_, _>>()?,
            moving: moving.collect::<Result<_, _>>()?,
            bodies: bodies.collect::<Result<_, _>>()?,
            margin,
        })
    }

    /// Changes the velocities of `bodies`, which are in the order of [`Self::new`], so that
    /// [`Body::moved`] over `length` seconds takes none of them into another, a wall or a solid.
    ///
    /// A body that touches nothing within that time keeps its velocities bit for bit. One that
    /// would reach another within it is slowed so that it arrives at its end, and loses the rest of
    /// its speed in the next step.
    ///
    /// A step in which a body moves far compared with its size is resolved in parts.
    ///
    /// # Panics
    ///
    /// Panics if `bodies` or `around.moving` are not as many as in [`Self::new`].
    pub fn resolve(&self, bodies: &mut [BodyState], around: &Surroundings, length: f64) {
        assert_eq!(bodies.len(), self.bodies.len(), "a state for each body");
        assert_eq!(
            around.moving.len(),
            self.moving.len(),
            "a passage for each solid"
        );
        match self.parts(bodies, around, length) {
            0 => {}
            1 => self.resolve_part(bodies, around, length),
            parts => self.resolve_parts(bodies, around, length, parts),
        }
    }

    fn resolve_part(&self, bodies: &mut [BodyState], around: &Surroundings, length: f64) {
        let Some(near) = self.near(bodies, around, length) else {
            return;
        };
        let mut world = World::new(self, &near, length);
        for (collider, state) in self.bodies.iter().zip(bodies.iter()) {
            world.add_body(collider, state);
        }
        world.step();
        for (index, (collider, state)) in self.bodies.iter().zip(bodies).enumerate() {
            world.read(index, &collider.body, state);
        }
    }

    /// Resolves the parts of a step one after another, and gives each body that touched something
    /// the velocities that take it to where it is after the last.
    fn resolve_parts(
        &self,
        bodies: &mut [BodyState],
        around: &Surroundings,
        length: f64,
        parts: usize,
    ) {
        let part = length / parts as f64;
        let mut states = bodies.to_vec();
        let mut is_changed = vec![false; bodies.len()];
        for index in 0..parts {
            let shares = [index, index + 1].map(|k| k as f64 / parts as f64);
            let moving = around.passages(shares, part);
            let around = around.later(shares[0] * length, &moving);
            let before = states.clone();
            self.resolve_part(&mut states, &around, part);
            for (index, collider) in self.bodies.iter().enumerate() {
                is_changed[index] |= states[index] != before[index];
                states[index] = collider.body.moved(&states[index], part);
            }
        }
        for (index, collider) in self.bodies.iter().enumerate() {
            if is_changed[index] {
                let end = &states[index];
                bodies[index] = motion::between(&collider.body, &bodies[index], end, length);
            }
        }
    }
}

impl Surroundings<'_> {
    /// Returns the passages between two shares of the step, of which the way between takes
    /// `length` seconds.
    fn passages(&self, [from, to]: [f64; 2], length: f64) -> Vec<Passage> {
        let part = |p: &Passage| Passage::between(p.at(from), p.at(to), length);
        self.moving.iter().map(part).collect()
    }

    /// Returns the surroundings `time` seconds later.
    fn later<'a>(&self, time: f64, moving: &'a [Passage]) -> Surroundings<'a> {
        let [lower, upper] = self.wall_velocities;
        Surroundings {
            walls: Bounds {
                min: self.walls.min + time * lower,
                max: self.walls.max + time * upper,
            },
            wall_velocities: self.wall_velocities,
            periodic: self.periodic,
            moving,
        }
    }
}

impl Solid {
    fn new(mesh: &TriangleMesh) -> Result<Self, ShapeError> {
        let bounds = mesh.bounds().ok_or(ShapeError::Empty)?;
        let middle = 0.5 * (bounds.min + bounds.max);
        Ok(Self {
            shape: shape::of_solid(mesh)?,
            middle,
            radius: shape::radius(mesh, middle),
        })
    }
}

impl Collider {
    fn new(body: &Body, mesh: Option<&TriangleMesh>) -> Result<Self, ShapeError> {
        let centre = body.mass.centre;
        let touch = |mesh| -> Result<Touch, ShapeError> {
            Ok(Touch {
                shape: shape::of_body(mesh, centre)?,
                radius: shape::radius(mesh, centre),
            })
        };
        Ok(Self {
            body: body.clone(),
            touch: mesh.map(touch).transpose()?,
        })
    }
}
