//! Tests of contacts, each with a control that spoils it.

mod collisions;
mod freedom;
mod resting;
mod shapes;

use swell_domain::{
    body::{Freedom, MassProperties},
    bounds::FAR,
};

use super::*;

const GRAVITY: DVec3 = DVec3::new(0.0, -9.81, 0.0);
const STEP: f64 = 1.0 / 240.0;

/// A closed mesh of eight corners, numbered by bits: x is 1, y is 2, z is 4.
fn hexahedron(corners: [DVec3; 8]) -> TriangleMesh {
    let quads: [[u32; 4]; 6] = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    TriangleMesh {
        vertices: corners.to_vec(),
        triangles: quads.into_iter().flat_map(halves).collect(),
    }
}

/// A box.
fn cuboid(middle: DVec3, size: DVec3) -> TriangleMesh {
    let corner = |n: usize| {
        let side = |bit: usize| if n & bit == 0 { -0.5 } else { 0.5 };
        middle + size * DVec3::new(side(1), side(2), side(4))
    };
    hexahedron(std::array::from_fn(corner))
}

fn free(mesh: &TriangleMesh) -> Body {
    Body {
        mass: MassProperties::of_mesh(mesh, 500.0),
        velocity: [0.0; 6],
        freedom: Freedom::ALL,
        moorings: Vec::new(),
    }
}

/// A floor at y = 0 and no other walls.
fn floor() -> Surroundings<'static> {
    let far = DVec3::splat(FAR);
    Surroundings {
        walls: Bounds {
            min: DVec3::new(-FAR, 0.0, -FAR),
            max: far,
        },
        wall_velocities: [DVec3::ZERO; 2],
        periodic: [false; 3],
        moving: &[],
    }
}

/// No walls at all.
fn nowhere() -> Surroundings<'static> {
    Surroundings {
        periodic: [true; 3],
        ..floor()
    }
}

/// Bodies with their meshes, and how they move.
struct Run {
    contacts: Contacts,
    bodies: Vec<Body>,
    meshes: Vec<TriangleMesh>,
    states: Vec<BodyState>,
    resolves: bool,
}

impl Run {
    fn new(statics: &[&TriangleMesh], moving: &[&TriangleMesh], meshes: Vec<TriangleMesh>) -> Self {
        let bodies = meshes.iter().map(free).collect();
        Self::of_bodies(statics, moving, meshes, bodies)
    }

    /// Bodies that may move as the given ones do.
    fn of_bodies(
        statics: &[&TriangleMesh],
        moving: &[&TriangleMesh],
        meshes: Vec<TriangleMesh>,
        bodies: Vec<Body>,
    ) -> Self {
        let pairs: Vec<_> = bodies.iter().zip(meshes.iter().map(Some)).collect();
        Self {
            contacts: Contacts::new(statics, moving, &pairs, 0.0).unwrap(),
            states: bodies.iter().map(Body::at_start).collect(),
            bodies,
            meshes,
            resolves: true,
        }
    }

    fn step(&mut self, around: &Surroundings, gravity: DVec3, length: f64) {
        for (body, state) in self.bodies.iter().zip(&mut self.states) {
            *state = body.accelerated(state, gravity, length);
        }
        if self.resolves {
            self.contacts.resolve(&mut self.states, around, length);
        }
        for (body, state) in self.bodies.iter().zip(&mut self.states) {
            *state = body.moved(state, length);
        }
    }

    fn fall(mut self, around: &Surroundings, seconds: f64) -> Self {
        for _ in 0..(seconds / STEP).round() as usize {
            self.step(around, GRAVITY, STEP);
        }
        self
    }

    fn corners(&self, index: usize) -> impl Iterator<Item = DVec3> {
        let pose = self.bodies[index].pose(&self.states[index]);
        let vertices = self.meshes[index].vertices.iter();
        vertices.map(move |&x| pose.place(x))
    }

    fn lowest(&self, index: usize) -> f64 {
        self.corners(index).map(|x| x.y).fold(FAR, f64::min)
    }

    fn foremost(&self, index: usize) -> f64 {
        self.corners(index).map(|x| x.x).fold(-FAR, f64::max)
    }

    fn fastest(&self) -> f64 {
        let speeds = self.states.iter().map(|s| s.velocity.length());
        speeds.fold(0.0, f64::max)
    }
}
