//! Water that falls on an obstacle.

use glam::DVec3;
use swell::{
    domain::{boundary::Boundary, particles::Particles},
    scene::Scene,
};

use super::exact::both;
use crate::support::{context, device::spoiled, flip::*};

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
