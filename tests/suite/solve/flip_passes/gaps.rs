//! Water that hits an obstacle.

use glam::DVec3;
use swell::{
    domain::{boundary::Boundary, motion::Motion, particles::Particles},
    gpu::adapter::Context,
    scene::{Scene, Wall, WaveMaker},
};

use super::exact::both;
use crate::support::{context, device::spoiled, flip::*, lattice};

/// A slab of water from wall to wall, one cell above a floor that it would pass within the substep,
/// at `speed` cells per substep.
fn slab(speed: f64) -> (Scene, Particles) {
    let mut scene = scene([8.0, 16.0, 8.0]);
    scene.water.gravity = DVec3::ZERO;
    scene.shot.frames_per_second = 50.0;
    flip(&mut scene).cfl = 2.0;
    let mut particles = block([0, 1, 0], [8, 5, 8]);
    particles
        .velocity
        .fill([0.0, (-speed * DX * 50.0) as f32, 0.0]);
    (scene, particles)
}

/// Within the substep the slab fills the gap and goes no farther: it is left with one cell per
/// substep, up to the projection's tolerance of 1e-5 of a source of at most one cell, times √N in a
/// norm over N = 8² columns.
#[test]
fn a_slab_that_lands_within_a_substep_goes_as_far_as_the_floor() {
    const TOLERANCE: f64 = 8.0 * 1e-5;
    let floor = Boundary::default();
    let speeds = |context: &_, speed: f64| {
        let (scene, particles) = slab(speed);
        both(context, &scene, &particles, &floor, 1).map(|(name, state, report)| {
            assert_eq!(report.substeps, 1);
            let cells = (0..state.len()).map(|k| velocity(&state, k).y / (DX * 50.0));
            let (least, most) = cells.fold((f64::MAX, f64::MIN), |(a, b), v| (a.min(v), b.max(v)));
            (name, least, most)
        })
    };
    for speed in [0.9, 1.4, 1.9] {
        let expected = -f64::min(speed, 1.0);
        for (name, least, most) in speeds(&context(), speed) {
            println!("{name}, {speed}: {least} {most}");
            let off = (least - expected).abs().max((most - expected).abs());
            assert!(off < TOLERANCE, "{name} {speed}: {least} {most}");
        }
    }
    // Where it does not reach the floor, it flies on.
    for (name, least, most) in speeds(&context(), 0.7) {
        assert!(
            (least + 0.7).abs().max((most + 0.7).abs()) < 1e-6,
            "{name}: {least} {most}"
        );
    }
    // Control: if gaps count as air, it flies on into the floor.
    let control = spoiled("flip/close_gaps", "CLOSES = 0.75", "CLOSES = 7.5");
    let [(_, least, _), _] = speeds(&control, 1.4);
    assert!((least + 1.4).abs() < 1e-6, "{least}");
}

/// Speed of a wall that starts to move, m/s.
const WALL: f64 = 4.0;

/// Largest speed two frames after a wall has started to move through water of `layers` half cells.
fn speeds_beside_a_wall(context: &Context, layers: usize) -> [(&'static str, f64); 2] {
    let mut scene = scene([32.0, 16.0, 4.0]);
    scene.shot.frames_per_second = 50.0;
    scene.wave_makers.push(WaveMaker {
        wall: Wall::NAMED[0].1,
        motion: Motion::ConstantVelocity {
            velocity: WALL,
            until: None,
        },
        absorption: None,
    });
    let particles = lattice([0.0; 3], [64, layers, 8], [DX / 2.0; 3]);
    both(context, &scene, &particles, &Boundary::default(), 2).map(|(name, state, _)| {
        let speeds = (0..state.len()).map(|k| velocity(&state, k).length());
        (name, speeds.fold(0.0, f64::max))
    })
}

/// A wall that starts to move throws water up: by Bernoulli's equation in its frame, along the free
/// surface, at √2 times its speed once the jet is steady, and faster at first. Where the surface
/// cuts the cells must not decide how fast. Depths of 5 and 5.5 cells put it at a face and at a
/// cell's centre; √1.1 is what depth itself may change.
#[test]
fn water_that_a_wall_throws_up_is_as_fast_wherever_the_surface_cuts_the_cells() {
    const MOST: f64 = 1.2;
    let ratio = |context: &_| {
        let [even, odd] = [10, 11].map(|layers| speeds_beside_a_wall(context, layers));
        [0, 1].map(|k| {
            let ((name, even), (_, odd)) = (even[k], odd[k]);
            println!(
                "{name}: {} and {} times the wall's",
                even / WALL,
                odd / WALL
            );
            assert!(even.min(odd) > 2f64.sqrt() * WALL, "{name}: {even} {odd}");
            (name, even.max(odd) / even.min(odd))
        })
    };
    for (name, ratio) in ratio(&context()) {
        assert!(ratio < MOST, "{name}: {ratio}");
    }
    // Control: with the surface's distance alone it does.
    let control = spoiled(
        "flip/close_gaps",
        "LEAST_INFLOW = 2.0",
        "LEAST_INFLOW = 2e9",
    );
    let [(_, off), _] = ratio(&control);
    assert!(off > MOST, "{off}");
}
