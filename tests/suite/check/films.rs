//! Films on solids, whose particles have friction with them, and gaps below solids that no particle
//! fits into.

use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary, bounds::Bounds, particles::Particles, signed_distance::SignedDistance,
    },
    scene::{Method, Scene},
    stage::{check::check_frame, prepare::Start},
};

use super::{Control, control, faults};
use crate::support::{box_mesh, context, flip as rig, jitter, noise};

const FRICTION: &[Control] = &[
    control(
        "flip/grid_to_particle",
        "const LEAST_SLOPE = 0.5;",
        "const LEAST_SLOPE = 0.51;",
        "flip/grid_to_particle",
        &["velocity"],
    ),
    control(
        "flip/grid_to_particle",
        "beside - friction.normal * dot(beside, friction.normal)",
        "beside",
        "flip/grid_to_particle",
        &["velocity"],
    ),
    control(
        "flip/grid_to_particle",
        "const TOUCHES = 0.25;",
        "const TOUCHES = 0.26;",
        "flip/grid_to_particle",
        &["velocity"],
    ),
];

const GAPS: &[Control] = &[
    control(
        "flip/find_water",
        "select(0.0, beside.x / max(beside.y, 1e-6), is_fed)",
        "0.0",
        "flip/find_water",
        &["distance of the surface"],
    ),
    control(
        "flip/find_water",
        "select(0.0, beside.x / max(beside.y, 1e-6), is_fed)",
        "select(0.0, 0.6 * beside.x / max(beside.y, 1e-6), is_fed)",
        "flip/find_water",
        &["distance of the surface"],
    ),
];

/// Water up to `level` cells over `solid`, with random velocities that friction acts on.
fn water(solid: &Boundary, level: f64) -> (Scene, Start) {
    let mut scene = rig::scene([16.0, 12.0, 8.0]);
    scene.solver.method = Method::Flip;
    let mut particles = rig::block([0; 3], [16, 6, 8]);
    let distance = solid.distance.as_ref().unwrap();
    let keep: Vec<bool> = (0..particles.len())
        .map(|k| {
            let x = rig::position(&particles, k);
            x.y < level * rig::DX && distance.sample(x) > 0.15 * rig::DX
        })
        .collect();
    particles.retain(&keep);
    jitter(&mut particles, 0.02);
    particles.velocity = (0..particles.len() as u64)
        .map(|k| [0, 1, 2].map(|axis| 0.1 * noise(3 * k + axis) as f32))
        .collect();
    let start = Start {
        particles,
        removed: 0,
        asked: None,
        sources: Default::default(),
        boundary: solid.clone(),
    };
    (scene, start)
}

fn checked(solid: &Boundary, level: f64, controls: &[Control]) -> String {
    let (scene, start) = water(solid, level);
    let state: &Particles = &start.particles;
    let checked = |context: &_| check_frame(context, &scene, &start, 0, state);
    faults(&context(), &checked, controls).1
}

#[test]
fn friction_of_films_is_within_tolerance_and_fails_where_it_should() {
    let slope = DVec3::new(0.1, 1.0, 0.03).normalize();
    let found = checked(&rig::half_space(slope, 1.3 * rig::DX), 1.6, FRICTION);
    assert!(found.is_empty(), "{found}");
}

/// A box that hangs so many cells above the floor.
fn hanging(height: f64) -> Boundary {
    let box_of = |min: [f64; 3], max: [f64; 3]| Bounds {
        min: rig::DX * DVec3::from(min),
        max: rig::DX * DVec3::from(max),
    };
    let mesh = box_mesh(box_of([4.3, height, 2.2], [11.4, 3.6, 6.1]));
    let around = box_of([-1.0; 3], [17.0, 13.0, 9.0]);
    let distance = SignedDistance::from_meshes(&[mesh], &around, 0.5 * rig::DX).unwrap();
    Boundary {
        distance,
        ..Boundary::default()
    }
}

/// In the gap of 0.3 cells no particle fits.
#[test]
fn gaps_below_solids_are_water_and_fail_where_they_should() {
    let found = checked(&hanging(0.3), 5.0, GAPS);
    assert!(found.is_empty(), "{found}");
}
