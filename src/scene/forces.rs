//! Force fields of a scene.

use std::sync::Arc;

use glam::DVec3;

use super::{PlacedMesh, Scene, sources::Region};
use swell_domain::{
    forces::{Force, ForceField, ForceKind, Medium},
    frame::{FrameMotion, Inertia},
    signed_distance::SignedDistanceError,
    sources::{Shape, Window},
};

/// Share of a time in which a force is taken to act. Times that end where another begins overlap
/// by rounding.
const LEAST_SHARE: f64 = 1e-9;

/// A force field, with its room as the scene names it.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedForce {
    /// Room; `None` is everywhere.
    pub region: Option<Region>,
    /// The force, whose room has the shape of `region`.
    pub force: Force,
}

/// The motion of a domain as a force on its water.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingFrame {
    motion: Arc<FrameMotion>,
    /// All of it but Coriolis's acceleration; its kind is [`ForceKind::Frame`].
    force: Force,
}

impl MovingFrame {
    /// Returns the force of a motion.
    pub fn new(motion: FrameMotion) -> Self {
        let motion = Arc::new(motion);
        Self {
            force: Force {
                kind: ForceKind::Frame(Arc::clone(&motion), Inertia::default()),
                room: None,
                fade: 0.0,
                window: Window::default(),
                on: vec![Medium::Water],
            },
            motion,
        }
    }

    /// Returns the motion.
    pub fn motion(&self) -> &FrameMotion {
        &self.motion
    }
}

impl Region {
    /// Returns the shape that forces act in: a mesh by distances that are sampled one particle
    /// spacing apart, metres.
    ///
    /// # Errors
    /// If the signed distance of the mesh cannot be computed.
    pub fn force_room(&self, spacing: f64) -> Result<Arc<Shape>, SignedDistanceError> {
        Ok(Arc::new(match self {
            Self::Block(block) => Shape::from(*block),
            Self::Mesh(placed) => Shape::sampled(&placed.mesh, spacing, spacing)?,
        }))
    }
}

impl Scene {
    /// Returns the forces on a medium in the `length` seconds from `start`.
    pub fn force_field(&self, medium: Medium, span: (f64, f64)) -> ForceField<'_> {
        ForceField::new(self.all_forces(), medium, span)
    }

    /// The scene's forces, then that of the domain's motion.
    fn all_forces(&self) -> impl Iterator<Item = &Force> {
        let own = self.forces.iter().map(|it| &it.force);
        own.chain(self.frame.iter().map(|it| &it.force))
    }

    /// Whether Coriolis's acceleration turns the velocities of the particles.
    pub fn turns_velocities(&self) -> bool {
        self.half_turn((0.0, 0.0)).is_some()
    }

    /// Returns the rotation of the particles' velocities by Coriolis's acceleration over half of a
    /// (start, length), seconds: unit axis and angle, radians; `None` where there is none.
    pub fn half_turn(&self, span: (f64, f64)) -> Option<(DVec3, f64)> {
        let (axis, angle) = self.frame.as_ref()?.motion().velocity_turn(span)?;
        Some((axis, 0.5 * angle))
    }

    /// Returns the forces on a medium, whenever they act.
    pub fn forces_on(&self, medium: Medium) -> impl Iterator<Item = &Force> {
        let all = self.all_forces();
        all.filter(move |force| force.on.contains(&medium))
    }

    /// Whether a force acts on a medium at some time.
    pub fn has_forces_on(&self, medium: Medium) -> bool {
        self.forces_on(medium).next().is_some()
    }

    /// Bounds the acceleration of water by gravity and by the forces that act between `start` and
    /// `end`, seconds; m/s².
    pub fn most_acceleration(&self, start: f64, end: f64) -> f64 {
        let acting = self.forces_on(Medium::Water);
        let acting = acting.filter(|force| force.window.share(start, end - start) > LEAST_SHARE);
        let forces: f64 = acting.map(|force| force.kind.most_in(start, end)).sum();
        self.water.gravity.length() + forces
    }

    /// Returns by how much the velocity of the domain jumps from `start` until `end`, seconds, m/s:
    /// that of the water in it jumps as much.
    pub fn jump_of_domain(&self, start: f64, end: f64) -> f64 {
        (self.frame.as_ref()).map_or(0.0, |frame| frame.motion().jump(start, end))
    }

    /// Moves forces by `way`, metres.
    pub(super) fn carry_forces(&mut self, way: DVec3, carry: &dyn Fn(&mut PlacedMesh, DVec3)) {
        if let Some(frame) = &self.frame {
            let mut motion = frame.motion().clone();
            motion.carry(way);
            self.frame = Some(MovingFrame::new(motion));
        }
        for PlacedForce { region, force } in &mut self.forces {
            force.kind.carry(way);
            force.room =
                (force.room.take()).map(|room| Arc::new(Arc::unwrap_or_clone(room).moved(way)));
            match region {
                Some(Region::Block(block)) => *block = block.moved(way),
                Some(Region::Mesh(placed)) => carry(placed, way),
                None => {}
            }
        }
    }
}
