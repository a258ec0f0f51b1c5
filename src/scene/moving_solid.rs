//! Moving solids: a mesh that slides along a direction, turns about an axis, or both.

use glam::{DQuat, DVec3};

use super::{PlacedMesh, Scene, solid_track::Track};
use swell_domain::{
    absorber::AbsorberStates,
    boundary::Boundary,
    mesh::TriangleMesh,
    motion::Motion,
    pose::{Passage, Pose},
};

/// Largest number of moving solids in a scene; a shader pass loops over all of them.
pub const MAX_MOVING_SOLIDS: usize = 7;

/// A solid that slides along a line, turns about an axis, or follows a track.
#[derive(Clone, Debug, PartialEq)]
pub struct MovingSolid {
    /// Mesh at its initial placement.
    pub placed: PlacedMesh,
    /// Translation along a line; `None` for a solid that does not slide.
    pub slide: Option<Slide>,
    /// Rotation about an axis, which slides along with the solid.
    pub turn: Option<Turn>,
    /// Poses over time from a file or the scene, in place of both.
    pub track: Option<Track>,
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
        match (&self.track, &self.slide) {
            (Some(_), _) => "track",
            (None, Some(_)) => "motion",
            (None, None) => "turn",
        }
    }

    /// Whether the solid may rotate.
    pub fn turns(&self) -> bool {
        self.turn.is_some() || self.track.is_some()
    }

    /// Returns the pose at time `t`, seconds.
    pub fn pose(&self, t: f64) -> Pose {
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
    pub fn passage(&self, start: f64, length: f64) -> Passage {
        Passage::between(self.pose(start), self.pose(start + length), length)
    }

    /// Returns the motion over the `step` seconds that end at `time`; with a step of 0 the
    /// solid rests there.
    pub fn passage_to(&self, time: f64, step: f64) -> Passage {
        match step {
            0.0 => Passage::resting(self.pose(time)),
            step => self.passage(time - step, step),
        }
    }

    /// Bounds the speed of the solid's points within `[t0, t1]`, m/s.
    pub fn peak_speed(&self, t0: f64, t1: f64) -> f64 {
        if let Some(track) = &self.track {
            return track.peak_speed(t0, t1);
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
    /// Bounds the speed of wave makers, with what absorbing ones add to their own motion, and of
    /// moving solids within `[t0, t1]`, m/s.
    pub fn peak_boundary_speed(&self, absorbers: &AbsorberStates, t0: f64, t1: f64) -> f64 {
        let makers = self.makers(absorbers);
        let makers = makers.map(|(maker, absorber)| maker.peak_speed(absorber, t0, t1));
        let solids = self.moving_solids.iter();
        let solids = solids.map(|solid| solid.peak_speed(t0, t1));
        makers.chain(solids).fold(0.0, f64::max)
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
    pub fn solid_samples(&self, boundary: &Boundary, time: f64, step: f64) -> Vec<SolidSample> {
        let least = self.domain.min;
        let still = boundary.samples.iter().map(|sample| SolidSample {
            position: sample.position - least,
            area: sample.area,
            velocity: DVec3::ZERO,
        });
        let mut all: Vec<_> = still.collect();
        let period = self.period();
        for (solid, samples) in self.moving_solids.iter().zip(&boundary.moving_samples) {
            let passage = solid.passage_to(time, step);
            let pose = passage.at(1.0);
            all.extend(samples.iter().map(|sample| {
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
