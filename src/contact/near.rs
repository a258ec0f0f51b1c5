//! Which walls and solids bodies may reach within a step.

use glam::DVec3;
use rapier3d_f64::{
    geometry::{Aabb, SharedShape},
    parry::bounding_volume::BoundingVolume,
};
use swell_domain::{body::BodyState, pose::Passage};

use crate::{Contacts, PUSH, Solid, Surroundings, Touch, shape::vector};

/// What bodies may reach within a step.
pub(crate) struct Near<'a> {
    /// Walls within reach.
    pub walls: Vec<Wall>,
    /// Solids at rest within reach.
    pub statics: Vec<&'a SharedShape>,
    /// Moving solids within reach.
    pub moving: Vec<(&'a SharedShape, Passage)>,
    /// How far two surfaces may approach within the step, metres.
    pub travel: f64,
}

/// A wall: a half-space.
#[derive(Clone, Copy)]
pub(crate) struct Wall {
    /// A point on it, metres.
    pub at: DVec3,
    /// Unit vector into the domain.
    pub inward: DVec3,
    /// Velocity, m/s.
    pub velocity: DVec3,
}

/// A sphere around a body that may touch others.
struct Ball {
    centre: DVec3,
    radius: f64,
}

/// How far a body moves within a part of a step, relative to its radius.
const PART: f64 = 0.25;
/// The most parts of a step.
const MOST_PARTS: f64 = 64.0;

impl Contacts {
    /// Returns in how many parts a step is resolved; 0 if no body can touch anything.
    pub(crate) fn parts(&self, states: &[BodyState], around: &Surroundings, length: f64) -> usize {
        if self.near(states, around, length).is_none() {
            return 0;
        }
        let others = fastest_solid(&self.moving, around.moving).max(fastest_wall(around));
        let relative = |(touch, state): (&Touch, _)| (speed(touch, state) + others) / touch.radius;
        let fastest = self.touches(states).map(relative).fold(0.0, f64::max);
        (fastest * length / PART).ceil().clamp(1.0, MOST_PARTS) as usize
    }

    fn touches<'a>(
        &'a self,
        states: &'a [BodyState],
    ) -> impl Iterator<Item = (&'a Touch, &'a BodyState)> {
        let both = self.bodies.iter().zip(states);
        both.filter_map(|(body, state)| Some((body.touch.as_ref()?, state)))
    }

    /// Returns what bodies may reach; `None` if none can touch anything.
    pub(crate) fn near<'a>(
        &'a self,
        states: &[BodyState],
        around: &Surroundings,
        length: f64,
    ) -> Option<Near<'a>> {
        let speeds = self
            .touches(states)
            .map(|(touch, state)| speed(touch, state));
        let fastest = speeds
            .fold(0.0, f64::max)
            .max(fastest_solid(&self.moving, around.moving))
            .max(fastest_wall(around));
        let travel = 2.0 * length * (fastest + PUSH);
        let ball = |(touch, state): (&Touch, &BodyState)| Ball {
            centre: state.centre,
            radius: touch.radius + self.margin + travel,
        };
        let balls: Vec<_> = self.touches(states).map(ball).collect();
        let moving = self.moving.iter().zip(around.moving);
        let near = Near {
            walls: walls(around)
                .filter(|wall| balls.iter().any(|ball| ball.reaches_wall(wall)))
                .collect(),
            statics: self.statics.iter().filter(|s| reach(s, &balls)).collect(),
            moving: moving
                .filter(|(solid, passage)| reach(&solid.shape, &relative(&balls, passage)))
                .map(|(solid, passage)| (&solid.shape, *passage))
                .collect(),
            travel,
        };
        let alone = near.walls.is_empty() && near.statics.is_empty() && near.moving.is_empty();
        (!alone || any_pair(&balls)).then_some(near)
    }
}

impl Ball {
    fn reaches_wall(&self, wall: &Wall) -> bool {
        (self.centre - wall.at).dot(wall.inward) <= self.radius
    }

    fn bounds(&self) -> Aabb {
        let half = DVec3::splat(self.radius);
        Aabb::new(vector(self.centre - half), vector(self.centre + half))
    }
}

/// Returns the greatest speed of a point of a body, m/s.
fn speed(touch: &Touch, state: &BodyState) -> f64 {
    state.velocity.length() + state.spin.length() * touch.radius
}

/// Returns the greatest speed of a point of a moving solid, m/s.
fn fastest_solid(solids: &[Solid], passages: &[Passage]) -> f64 {
    let speed = |(solid, passage): (&Solid, &Passage)| {
        let farthest = (solid.middle - passage.start.rest).length() + solid.radius;
        passage.velocity.length() + passage.spin.length() * farthest
    };
    solids.iter().zip(passages).map(speed).fold(0.0, f64::max)
}

fn fastest_wall(around: &Surroundings) -> f64 {
    let speeds = around.wall_velocities.map(|v| v.abs().max_element());
    speeds[0].max(speeds[1])
}

/// The walls of a domain.
fn walls(around: &Surroundings) -> impl Iterator<Item = Wall> {
    let Surroundings {
        walls,
        wall_velocities: [lower, upper],
        periodic,
        ..
    } = *around;
    let sides = [(walls.min, lower, 1.0), (walls.max, upper, -1.0)];
    let axes = (0..3).filter(move |&axis| !periodic[axis]);
    axes.flat_map(move |axis| {
        sides.map(|(at, velocity, sign)| Wall {
            at: DVec3::AXES[axis] * at[axis],
            inward: DVec3::AXES[axis] * sign,
            velocity: DVec3::AXES[axis] * velocity[axis],
        })
    })
}

/// Returns whether the box of any triangle meets that of any ball.
fn reach(shape: &SharedShape, balls: &[Ball]) -> bool {
    let Some(mesh) = shape.as_trimesh() else {
        return true;
    };
    balls.iter().any(|ball| {
        let bounds = ball.bounds();
        let mut leaves = mesh.bvh().leaves(|node| node.aabb().intersects(&bounds));
        leaves.next().is_some()
    })
}

/// Returns the balls in the coordinates of a solid in its pose at the start.
fn relative(balls: &[Ball], passage: &Passage) -> Vec<Ball> {
    let back = |ball: &Ball| Ball {
        centre: passage.start.back(ball.centre),
        ..*ball
    };
    balls.iter().map(back).collect()
}

/// Returns whether any two balls meet.
fn any_pair(balls: &[Ball]) -> bool {
    balls.iter().enumerate().any(|(index, a)| {
        let mut rest = balls[index + 1..].iter();
        rest.any(|b| (a.centre - b.centre).length() <= a.radius + b.radius)
    })
}
