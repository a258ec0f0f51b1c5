//! Films on solids, whose particles have friction with them, and gaps below solids that no particle
//! fits into.

use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary, bounds::Bounds, motion::Motion, particles::Particles,
        signed_distance::SignedDistance,
    },
    scene::Scene,
    stage::{check::check_frame, prepare::Start},
};

use super::{Control, control, faults};
use crate::support::{box_mesh, context, flip as rig, jitter, mover, noise};

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

const DROPLETS: &[Control] = &[control(
    "flip/grid_to_particle",
    "select(carried[k + axis], v[axis], falls)",
    "carried[k + axis]",
    "flip/grid_to_particle",
    &["velocity of the grid"],
)];

const MOVING: &[Control] = &[control(
    "flip/grid_to_particle",
    "let beside = v - friction.solid;",
    "let beside = v;",
    "flip/grid_to_particle",
    &["velocity"],
)];

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
    let scene = rig::scene([16.0, 12.0, 8.0]);
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
    let solid = rig::half_space(slope, 1.3 * rig::DX);
    let found = checked(&solid, 1.6, FRICTION);
    assert!(found.is_empty(), "{found}");

    // A droplet that touches the slope, far from other water.
    let (scene, mut start) = water(&solid, 1.6);
    let far: Vec<bool> = (0..start.particles.len())
        .map(|k| rig::position(&start.particles, k).x < 9.0 * rig::DX)
        .collect();
    start.particles.retain(&far);
    let on_slope = |x: f64| (1.45 * rig::DX - slope.x * x - slope.z * 0.8) / slope.y;
    let x = 13.3 * rig::DX;
    start
        .particles
        .position
        .push([x as f32, on_slope(x) as f32, 0.8]);
    start.particles.velocity.push([-0.001, 0.0, 0.0]);
    start.particles.id.push(100_000);
    let state = start.particles.clone();
    let checked = |context: &_| check_frame(context, &scene, &start, 0, &state);
    let found = faults(&context(), &checked, DROPLETS).1;
    assert!(found.is_empty(), "droplet: {found}");

    // The same slope as a solid that moves along itself.
    let (mut scene, mut start) = water(&solid, 1.6);
    let bounds = Bounds {
        min: DVec3::splat(-1.0),
        max: DVec3::ONE,
    };
    let motion = Motion::ConstantVelocity {
        velocity: 0.05,
        until: None,
    };
    scene.moving_solids.push(mover(bounds, DVec3::X, motion));
    start.boundary = Boundary {
        moving: solid.distance.into_iter().collect(),
        ..Boundary::default()
    };
    let state = start.particles.clone();
    let checked = |context: &_| check_frame(context, &scene, &start, 0, &state);
    let found = faults(&context(), &checked, MOVING).1;
    assert!(found.is_empty(), "moving: {found}");
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
