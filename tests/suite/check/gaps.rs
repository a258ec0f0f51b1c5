//! Water that lands within the substep: gaps that close above a floor that fits the cells, and
//! above a solid that cuts them.

use glam::DVec3;
use swell::{
    domain::{boundary::Boundary, bounds::Bounds, motion::Motion, particles::Particles},
    scene::{Scene, Wall, WaveMaker},
    stage::{check::check_frame, prepare::Start},
};

use super::{Control, control, faults};
use crate::support::{context, flip as rig, jitter, mover, noise};

const CONTROLS: &[Control] = &[
    control(
        "flip/close_gaps",
        "CLOSES = 0.75",
        "CLOSES = 7.5",
        "flip/close_gaps",
        &[
            "kind of cell",
            "flux with what fills gaps",
            "distance of the surface",
        ],
    ),
    control(
        "flip/close_gaps",
        "most * params.cell_size",
        "0.99 * most * params.cell_size",
        "flip/close_gaps",
        &["flux with what fills gaps"],
    ),
    control(
        "flip/find_excess",
        "density[found] < 0.5",
        "density[found] < -0.5",
        "flip/find_excess",
        &["density excess"],
    ),
    control(
        "flip/boundary_work",
        " && !is_thin",
        "",
        "flip/boundary_work",
        &["shares of the work"],
    ),
];

/// Controls of surfaces that are hit.
const HIT: &[Control] = &[
    control(
        "flip/close_gaps",
        "LEAST_INFLOW = 2.0",
        "LEAST_INFLOW = 2.001",
        "flip/close_gaps",
        &["distance of the surface"],
    ),
    control(
        "flip/close_gaps",
        "found.inflow -= face_open",
        "found.inflow -= 1.001 * face_open",
        "flip/close_gaps",
        &["distance of the surface"],
    ),
];

/// Water from wall to wall, a little more than a cell above a floor that it reaches in the substep;
/// one wall moves, and the floor too if it is a moving solid.
fn landing(floor: &Boundary, height: f64) -> (Scene, Start) {
    let mut scene = rig::scene([16.0, 24.0, 8.0]);
    scene.shot.frames_per_second = 50.0;
    rig::flip(&mut scene).cfl = 2.0;
    scene.wave_makers.push(WaveMaker {
        wall: Wall::NAMED[0].1,
        motion: Motion::ConstantVelocity {
            velocity: 0.5,
            until: None,
        },
        absorption: None,
    });
    if !floor.moving.is_empty() {
        let bounds = Bounds {
            min: DVec3::splat(-1.0),
            max: DVec3::ONE,
        };
        let motion = Motion::ConstantVelocity {
            velocity: 1.0,
            until: None,
        };
        scene.moving_solids.push(mover(bounds, DVec3::Y, motion));
    }
    let mut particles = rig::block([0, 1, 0], [16, 5, 8]);
    for x in &mut particles.position {
        x[1] += height as f32;
    }
    jitter(&mut particles, 0.005);
    particles.velocity = (0..particles.position.len() as u64)
        .map(|k| {
            [0, 1, 2].map(|axis| {
                let fall = if axis == 1 { 1.4 * rig::DX * 50.0 } else { 0.0 };
                (0.2 * noise(3 * k + axis) - fall) as f32
            })
        })
        .collect();
    let start = Start {
        particles,
        removed: 0,
        asked: None,
        sources: Default::default(),
        boundary: floor.clone(),
    };
    (scene, start)
}

/// A slab in free fall whose flow converges: water runs into cells beside air and no wall, at
/// 3 g Δt.
fn converging() -> (Scene, Start) {
    let mut scene = rig::scene([16.0, 24.0, 8.0]);
    scene.shot.frames_per_second = 100.0;
    let mut particles = rig::block([0, 8, 0], [16, 6, 8]);
    jitter(&mut particles, 0.005);
    let rate = 3.0 * 9.81 / 100.0 / rig::DX;
    particles.velocity = (0..particles.position.len())
        .map(|k| {
            let x = rig::position(&particles, k).x - 8.0 * rig::DX;
            let noise = |axis: u64| (0.05 * noise(3 * k as u64 + axis)) as f32;
            [(-rate * x) as f32, noise(1), noise(2)]
        })
        .collect();
    let start = Start {
        particles,
        removed: 0,
        asked: None,
        sources: Default::default(),
        boundary: Boundary::default(),
    };
    (scene, start)
}

/// The same floor as a moving solid.
fn rising(solid: Boundary) -> Boundary {
    Boundary {
        moving: solid.distance.into_iter().collect(),
        ..Boundary::default()
    }
}

#[test]
fn surfaces_that_are_hit_are_within_tolerance_and_their_row_fails_where_it_should() {
    let (scene, start) = converging();
    let checked = |context: &_| check_frame(context, &scene, &start, 0, &start.particles);
    let all = faults(&context(), &checked, HIT).1;
    assert!(all.is_empty(), "{all}");
}

#[test]
fn gaps_that_close_are_within_tolerance_and_each_row_fails_where_it_should() {
    let mut all = String::new();
    let slope = DVec3::new(0.2, 1.0, 0.0).normalize();
    let solid = rig::half_space(slope, 1.3 * rig::DX);
    for (floor, height) in [
        (Boundary::default(), 0.0),
        (rig::half_space(DVec3::Y, 1.3 * rig::DX), 1.3 * rig::DX),
        (solid.clone(), 1.3 * rig::DX),
        (rising(solid), 1.3 * rig::DX),
    ] {
        let (scene, start) = landing(&floor, height);
        let state: &Particles = &start.particles;
        let checked = |context: &_| check_frame(context, &scene, &start, 0, state);
        all += &faults(&context(), &checked, CONTROLS).1;
    }
    assert!(all.is_empty(), "{all}");
}
