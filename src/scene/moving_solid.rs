//! Moving solids: a mesh that slides along a direction, turns about an axis, follows a track,
//! changes its shape, or floats; and the floor that moves with waves.

use glam::{DQuat, DVec3};

use super::{PlacedMesh, Scene, mesh_sequence::MeshSequence, solid_track::Track};
use swell_domain::{
    absorber::AbsorberStates,
    body::{Body, BodyState},
    boundary::Boundary,
    bounds::Bounds,
    mesh::TriangleMesh,
    motion::Motion,
    pose::{Passage, Pose},
    shape::WaveFloor,
};

/// Largest number of moving solids and bodies in a scene; their poses are a uniform of 64 KiB.
pub const MAX_MOVING_SOLIDS: usize = 511;

/// A solid that slides along a line, turns about an axis, follows a track, changes its shape, or
/// floats.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingSolid {
    /// Mesh at its initial placement. Of a solid whose shape changes, the first file, with the
    /// mesh at the start of the shot.
    pub placed: PlacedMesh,
    /// Translation along a line; `None` for a solid that does not slide.
    pub slide: Option<Slide>,
    /// Rotation about an axis, which slides along with the solid.
    pub turn: Option<Turn>,
    /// Poses over time from a file or the scene, in place of both.
    pub track: Option<Track>,
    /// Meshes over time, in place of all of these.
    pub sequence: Option<MeshSequence>,
    /// What the water moves, in place of all of them.
    pub body: Option<FreeBody>,
    /// The floor that moves with the waves above it, in place of all of them.
    pub floor: Option<WaveFloor>,
}

/// A moving solid that the water moves.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeBody {
    /// Index among the scene's bodies, and of its state among theirs.
    pub index: usize,
    /// Mass, constraints and start.
    pub body: Body,
    /// Whether it meets walls, solids and other bodies.
    pub collides: bool,
    /// Distance from the centre of mass to the farthest vertex, metres.
    pub reach: f64,
    /// What its mass and spin were computed from, as written in the scene.
    pub given: GivenMass,
}

/// A body's mass and spin as written in a scene; what is left out is `None`.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GivenMass {
    /// Density, kg/m³.
    pub density: Option<f64>,
    /// Mass, kg.
    pub mass: Option<f64>,
    /// Centre of mass, metres, in world coordinates.
    pub centre: Option<[f64; 3]>,
    /// Moments of inertia, kg m².
    pub inertia: Option<[f64; 3]>,
    /// Angular velocity, degrees/s.
    pub spin: [f64; 3],
}

/// A state whose number of bodies is not the scene's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the scene has {planned} bodies, and the state has {given}")]
pub struct OtherBodies {
    /// Bodies of the scene.
    pub planned: usize,
    /// Bodies of the state.
    pub given: usize,
}

impl FreeBody {
    /// Returns the body's state among `bodies`; at the start if they are not listed.
    pub fn state(&self, bodies: &[BodyState]) -> BodyState {
        (bodies.get(self.index).copied()).unwrap_or_else(|| self.body.at_start())
    }

    /// Bounds the speed of the body's points, m/s.
    fn speed(&self, bodies: &[BodyState]) -> f64 {
        let state = self.state(bodies);
        state.velocity.length() + self.reach * state.spin.length()
    }
}

/// Translation along a line.
#[derive(Clone, Debug, PartialEq)]
pub struct Slide {
    /// Direction as written in the scene; its length is ignored.
    pub direction: DVec3,
    /// Displacement along `direction`, metres.
    pub motion: Motion,
}

/// Rotation about an axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Turn {
    /// A point on the axis at the start, relative to the scene's origin, metres.
    pub pivot: DVec3,
    /// Direction of the axis as written in the scene; its length is ignored.
    pub axis: DVec3,
    /// Angle, degrees, counter-clockwise when looking against `axis`.
    pub motion: Motion,
    /// Distance from the pivot to the farthest vertex, metres.
    pub reach: f64,
}

impl Turn {
    /// Creates the rotation of a solid whose initial placement is `mesh`.
    pub fn new(pivot: DVec3, axis: DVec3, motion: Motion, mesh: &TriangleMesh) -> Self {
        let away = mesh.vertices.iter().map(|x| x.distance(pivot));
        Self {
            pivot,
            axis,
            motion,
            reach: away.fold(0.0, f64::max),
        }
    }
}

impl MovingSolid {
    /// Returns the key of its motion, the first one if there are two.
    pub fn key(&self) -> &'static str {
        match (&self.sequence, &self.track, &self.slide) {
            (Some(_), _, _) => "sequence",
            (None, Some(_), _) => "track",
            (None, None, Some(_)) => "motion",
            (None, None, None) => "turn",
        }
    }

    /// Returns the name of its file, or what the names of its files have in common.
    pub fn name(&self) -> String {
        let name = self.placed.name();
        match &self.sequence {
            Some(_) => MeshSequence::stem(&name).to_owned(),
            None => name,
        }
    }

    /// Whether its shape changes.
    pub fn changes_shape(&self) -> bool {
        self.sequence.is_some() || self.floor.is_some()
    }

    /// Returns the smallest box around it at all times, if its shape changes.
    pub fn changing_bounds(&self) -> Option<Bounds> {
        let sequence = self.sequence.as_ref().map(|it| it.shape.bounds());
        sequence.or_else(|| self.floor.as_ref().map(WaveFloor::bounds))
    }

    /// Returns whether its motion follows from the scene alone.
    pub fn is_prescribed(&self) -> bool {
        self.body.is_none()
    }

    /// Whether it is one of the scene file, which pictures and exports show.
    pub fn is_drawn(&self) -> bool {
        self.floor.is_none()
    }

    /// Whether the solid may rotate.
    pub fn turns(&self) -> bool {
        self.turn.is_some() || self.track.is_some() || self.body.is_some()
    }

    /// Returns the mesh in its pose at time `t`, seconds, with bodies as in [`Self::pose`].
    pub fn mesh(&self, bodies: &[BodyState], t: f64) -> TriangleMesh {
        let way = self.pose(bodies, t).affine();
        match &self.sequence {
            Some(sequence) => sequence.shape.mesh(t).transformed(&way),
            None => self.placed.mesh.transformed(&way),
        }
    }

    /// Returns the pose at time `t`, seconds, always that at the start where the shape changes. A
    /// body moves on from its state among `bodies` without forces.
    pub fn pose(&self, bodies: &[BodyState], t: f64) -> Pose {
        if let Some(it) = &self.body {
            let state = it.state(bodies);
            let length = t - state.time;
            return it.body.pose(&match length {
                0.0 => state,
                length => it.body.moved(&state, length),
            });
        }
        if let Some(track) = &self.track {
            return track.pose(t);
        }
        let way = self.slide.as_ref().map_or(DVec3::ZERO, |slide| {
            slide.motion.displacement(t) * slide.direction.normalize()
        });
        let (rest, turn) = match &self.turn {
            None => (DVec3::ZERO, DQuat::IDENTITY),
            Some(turn) => {
                let angle = turn.motion.displacement(t).to_radians();
                let axis = turn.axis.normalize();
                (turn.pivot, DQuat::from_axis_angle(axis, angle))
            }
        };
        Pose {
            rest,
            centre: rest + way,
            turn,
        }
    }

    /// Returns the motion from the pose at `start` over `length` seconds.
    pub fn passage(&self, bodies: &[BodyState], start: f64, length: f64) -> Passage {
        let [before, after] = [start, start + length].map(|t| self.pose(bodies, t));
        Passage::between(before, after, length)
    }

    /// Returns the motion over the `step` seconds that end at `time`; with a step of 0 the
    /// solid rests there.
    pub fn passage_to(&self, bodies: &[BodyState], time: f64, step: f64) -> Passage {
        match step {
            0.0 => Passage::resting(self.pose(bodies, time)),
            step => self.passage(bodies, time - step, step),
        }
    }

    /// Bounds the speed of the solid's points within `[t0, t1]`, m/s; that of a body is its present
    /// one.
    pub fn peak_speed(&self, bodies: &[BodyState], t0: f64, t1: f64) -> f64 {
        if let Some(body) = &self.body {
            return body.speed(bodies);
        }
        if let Some(track) = &self.track {
            return track.peak_speed(t0, t1);
        }
        if let Some(sequence) = &self.sequence {
            return sequence.shape.peak_speed(t0, t1);
        }
        if let Some(floor) = &self.floor {
            return floor.peak_speed();
        }
        let slide = self.slide.as_ref();
        let slide = slide.map_or(0.0, |slide| slide.motion.peak_speed(t0, t1));
        let turn = self.turn.as_ref().map_or(0.0, |turn| {
            turn.reach * turn.motion.peak_speed(t0, t1).to_radians()
        });
        slide + turn
    }
}

impl Scene {
    /// Iterates over the bodies that the water moves.
    pub fn bodies(&self) -> impl Iterator<Item = &FreeBody> {
        self.moving_solids.iter().filter_map(|it| it.body.as_ref())
    }

    /// Whether the water moves any body.
    pub fn has_bodies(&self) -> bool {
        self.bodies().next().is_some()
    }

    /// Checks that a state has as many bodies as the scene.
    ///
    /// # Errors
    /// [`OtherBodies`] with both numbers.
    pub fn check_bodies(&self, state: &[BodyState]) -> Result<(), OtherBodies> {
        let (planned, given) = (self.bodies().count(), state.len());
        match planned == given {
            true => Ok(()),
            false => Err(OtherBodies { planned, given }),
        }
    }

    /// Returns the states of the bodies at the start of the shot.
    pub fn bodies_at_start(&self) -> Vec<BodyState> {
        self.bodies().map(|it| it.body.at_start()).collect()
    }

    /// Bounds the speed of the points of bodies, m/s. Bodies that are wholly outside the domain,
    /// where they meet nothing, do not count.
    pub fn fastest_body(&self, bodies: &[BodyState]) -> f64 {
        let is_inside = |it: &&FreeBody| {
            let centre = it.state(bodies).centre;
            self.domain.grown(it.reach).contains(centre)
        };
        let speeds = self.bodies().filter(is_inside).map(|it| it.speed(bodies));
        speeds.fold(0.0, f64::max)
    }

    /// Bounds the speed of the surfaces of solids whose shape changes within `[t0, t1]`, m/s.
    pub fn fastest_shape(&self, t0: f64, t1: f64) -> f64 {
        let shapes = self.moving_solids.iter().filter(|it| it.changes_shape());
        let speeds = shapes.map(|it| it.peak_speed(&[], t0, t1));
        speeds.fold(0.0, f64::max)
    }

    /// Iterates over the moving solids that pictures and exports show.
    pub fn drawn_movers(&self) -> impl Iterator<Item = &MovingSolid> + Clone {
        self.moving_solids.iter().filter(|it| it.is_drawn())
    }

    /// Iterates over the shapes of the solids whose shape changes.
    pub fn sequences(&self) -> impl Iterator<Item = &MeshSequence> {
        self.moving_solids
            .iter()
            .filter_map(|it| it.sequence.as_ref())
    }

    /// Bounds the speed of wave makers, with what absorbing ones add to their own motion, of moving
    /// solids and of the current that zones lead to within `[t0, t1]`, m/s.
    pub fn peak_boundary_speed(
        &self,
        absorbers: &AbsorberStates,
        bodies: &[BodyState],
        t0: f64,
        t1: f64,
    ) -> f64 {
        let makers = self.makers(absorbers);
        let makers = makers.map(|(maker, absorber)| maker.peak_speed(absorber, t0, t1));
        let solids = self.moving_solids.iter().filter(|it| it.is_prescribed());
        let solids = solids.map(|solid| solid.peak_speed(bodies, t0, t1));
        let of_zones = match self.effects.absorbing()[..] {
            [] => 0.0,
            _ => self.water.current.length(),
        };
        let fastest = self.fastest_body(bodies).max(of_zones);
        makers.chain(solids).fold(fastest, f64::max)
    }
}

/// A sample of a solid's surface at one instant.
#[derive(Clone, Copy, Debug)]
pub struct SolidSample {
    /// Position relative to the domain's least corner, metres; wrapped into the domain
    /// along periodic axes.
    pub position: DVec3,
    /// Surface area that the sample represents, m².
    pub area: f64,
    /// Velocity of the surface, m/s.
    pub velocity: DVec3,
}

impl Scene {
    /// Returns the samples of `boundary` at `time`, those of static solids first. Samples of moving
    /// solids have their mean velocity over the last `step` seconds; with a step of 0 they rest.
    pub fn solid_samples(
        &self,
        boundary: &Boundary,
        bodies: &[BodyState],
        time: f64,
        step: f64,
    ) -> Vec<SolidSample> {
        let least = self.domain.min;
        let still = boundary.samples.iter().map(|sample| SolidSample {
            position: sample.position - least,
            area: sample.area,
            velocity: DVec3::ZERO,
        });
        let mut all: Vec<_> = still.collect();
        let period = self.period();
        for (index, solid) in self.moving_solids.iter().enumerate() {
            if let Some(shape) = boundary.shape(index) {
                let samples = shape.samples.iter().flat_map(|it| it.at(time, step));
                all.extend(samples.map(|sample| SolidSample {
                    position: period.wrap(sample.position - least),
                    area: sample.area,
                    velocity: sample.velocity,
                }));
                continue;
            }
            let samples = boundary.moving_samples.get(index);
            let passage = solid.passage_to(bodies, time, step);
            let pose = passage.at(1.0);
            all.extend(samples.into_iter().flatten().map(|sample| {
                let x = pose.place(sample.position);
                SolidSample {
                    position: period.wrap(x - least),
                    area: sample.area,
                    velocity: passage.velocity_at(x, pose.centre),
                }
            }));
        }
        all
    }
}
