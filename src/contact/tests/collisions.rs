//! Bodies that meet others, walls and moving solids.

use glam::DQuat;
use swell_domain::pose::Pose;

use super::*;

const FRAME: f64 = 1.0 / 24.0;

fn cube(x: f64) -> TriangleMesh {
    cuboid(DVec3::new(x, 0.0, 0.0), DVec3::splat(0.5))
}

/// The passage of a solid that moves and turns about its rest point.
fn passage(at: DVec3, velocity: DVec3, spin: DVec3, time: f64, length: f64) -> Passage {
    let pose = |t: f64| Pose {
        rest: at,
        centre: at + t * velocity,
        turn: DQuat::from_scaled_axis(t * spin),
    };
    Passage::between(pose(time), pose(time + length), length)
}

#[test]
fn a_body_that_is_far_from_all_is_unchanged() {
    let mut run = Run::new(&[&cube(9.0)], &[], vec![cube(0.0), cube(1.0), cube(5.0)]);
    run.states[0].velocity = DVec3::new(3.0, 0.1, -0.2);
    for state in &mut run.states {
        state.spin = DVec3::new(0.1, 1.0 / 3.0, -0.7);
    }
    let before = run.states.clone();
    // Nothing is near.
    run.contacts.resolve(&mut run.states, &nowhere(), 1e-3);
    assert_eq!(run.states, before);
    // The first two meet; the third is in the same world.
    run.contacts.resolve(&mut run.states, &nowhere(), 0.2);
    assert_eq!(run.states[2], before[2]);
    // Negative control.
    assert_ne!(run.states[1], before[1]);
    // In reach of a wall, but not touching it.
    let mut states = before.clone();
    run.contacts.resolve(&mut states, &floor_at(-0.4), 1e-3);
    assert_eq!(states, before);
    run.contacts.resolve(&mut states, &floor_at(-0.2), 1e-3);
    assert_ne!(states, before);
}

fn floor_at(height: f64) -> Surroundings<'static> {
    let mut around = floor();
    around.walls.min.y = height;
    around
}

/// Momentum, and angular momentum about the origin.
fn momentum(run: &Run) -> [DVec3; 2] {
    let each = run.bodies.iter().zip(&run.states);
    each.fold([DVec3::ZERO; 2], |[along, about], (body, state)| {
        let linear = body.mass.mass * state.velocity;
        let spin = body.inertia(state) * state.spin;
        [along + linear, about + state.centre.cross(linear) + spin]
    })
}

#[test]
fn collisions_keep_momentum_and_gain_no_energy() {
    let mut run = Run::new(&[], &[], vec![cube(0.0), cube(0.8)]);
    run.states[0].velocity = DVec3::new(4.0, 0.0, 0.0);
    run.states[0].centre += DVec3::new(0.0, 0.11, 0.07);
    run.states[0].turn = DQuat::from_rotation_z(0.3);
    run.states[1].spin = DVec3::new(0.2, -0.4, 0.6);
    let energy = |run: &Run| -> f64 {
        let each = run.bodies.iter().zip(&run.states);
        each.map(|(body, state)| body.kinetic_energy(state)).sum()
    };
    let (start, first) = (momentum(&run), energy(&run));
    for _ in 0..100 {
        let before = energy(&run);
        run.step(&nowhere(), DVec3::ZERO, STEP);
        assert!(energy(&run) < before * (1.0 + 1e-4));
    }
    let found = momentum(&run);
    let loss = (found[0] - start[0]).length() / start[0].length();
    let twist = (found[1] - start[1]).length() / start[1].length();
    assert!(loss < 1e-9, "{loss}");
    assert!(twist < 1e-9, "{twist}");
    assert!(energy(&run) < 0.8 * first);
    // Negative control: they met, and a heavier body has another momentum.
    assert!(run.states[1].velocity.x > 1.0);
    run.bodies[1].mass.mass *= 1.000_001;
    assert!((momentum(&run)[0] - start[0]).length() > 1e-8 * start[0].length());
}

/// Cubes, flat or on an edge, and thin plates fly at 0.05 m of solid: 0.4 m a step.
#[test]
fn fast_bodies_do_not_pass_through_thin_solids() {
    let wall = cuboid(DVec3::new(2.0, 0.0, 0.0), DVec3::new(0.05, 4.0, 4.0));
    let bodies = [
        cuboid(DVec3::ZERO, DVec3::splat(0.3)),
        cuboid(DVec3::ZERO, DVec3::new(0.02, 0.4, 0.3)),
        cuboid(DVec3::ZERO, DVec3::splat(0.04)),
    ];
    for (index, mesh) in bodies.iter().enumerate() {
        for case in 0..20 {
            let k = f64::from(case);
            let flown = |resolves: bool| {
                let mut run = Run::new(&[&wall], &[], vec![mesh.clone()]);
                run.states[0].velocity = DVec3::new(10.0, k.sin(), k.cos());
                run.states[0].spin = 6.0 * DVec3::new(k.cos(), (2.0 * k).sin(), k.sin());
                run.states[0].centre.x = 0.02 * k;
                run.states[0].turn = DQuat::from_rotation_y(0.4 * k);
                run.resolves = resolves;
                let mut farthest = 0.0_f64;
                for _ in 0..8 {
                    run.step(&nowhere(), DVec3::ZERO, FRAME);
                    farthest = farthest.max(run.foremost(0));
                }
                farthest - 1.975
            };
            let depth = flown(true);
            assert!(depth < 1e-4, "{index} {case}: {depth}");
            // Negative control.
            assert!(flown(false) > 1.0);
        }
    }
}

#[test]
fn a_moving_solid_pushes_a_body() {
    // Straight ahead, in open space: the body takes over its velocity.
    let solid = cuboid(DVec3::new(-1.0, 0.0, 0.0), DVec3::splat(1.0));
    let velocity = DVec3::new(0.5, 0.0, 0.0);
    let mut run = Run::new(&[], &[&solid], vec![cube(0.0)]);
    for step in 0..240 {
        let at = DVec3::new(-1.0, 0.0, 0.0);
        let moving = [passage(
            at,
            velocity,
            DVec3::ZERO,
            f64::from(step) * STEP,
            STEP,
        )];
        let around = Surroundings {
            moving: &moving,
            ..nowhere()
        };
        run.step(&around, DVec3::ZERO, STEP);
    }
    // It begins 0.25 m ahead of the solid and meets it after half a second.
    let state = run.states[0];
    assert!((state.velocity - velocity).length() < 1e-4, "{state:?}");
    assert!((state.centre.x - 0.25).abs() < 1e-4, "{state:?}");
    assert!(state.spin.length() < 1e-6);
}

/// A paddle turns about the origin at 1 rad/s and hits a box at 1 m: it leaves with at least the
/// speed of the paddle there.
#[test]
fn a_turning_solid_pushes_a_body() {
    let paddle = cuboid(DVec3::new(0.0, 0.0, 0.75), DVec3::new(0.1, 0.4, 1.5));
    let body = cuboid(DVec3::new(0.4, 0.0, 1.0), DVec3::splat(0.2));
    let pushed = |spin: f64| {
        let mut run = Run::new(&[], &[&paddle], vec![body.clone()]);
        for step in 0..240 {
            let spin = DVec3::new(0.0, spin, 0.0);
            let time = f64::from(step) * STEP;
            let moving = [passage(DVec3::ZERO, DVec3::ZERO, spin, time, STEP)];
            let around = Surroundings {
                moving: &moving,
                ..nowhere()
            };
            run.step(&around, DVec3::ZERO, STEP);
        }
        run.states[0].velocity.length()
    };
    let speed = pushed(1.0);
    assert!(speed > 0.9 && speed < 1.6, "{speed}");
    // Negative control: the other way it meets nothing within a second.
    assert_eq!(pushed(-1.0), 0.0);
}

#[test]
fn a_wall_that_moves_pushes_a_body() {
    for periodic in [false, true] {
        let mut run = Run::new(&[], &[], vec![cube(0.5)]);
        for step in 0..240 {
            let mut around = nowhere();
            around.periodic[0] = periodic;
            around.walls.min.x = 0.5 * f64::from(step) * STEP;
            around.wall_velocities[0] = DVec3::new(0.5, 9.0, 9.0);
            run.step(&around, DVec3::ZERO, STEP);
        }
        let expected = if periodic { 0.0 } else { 0.5 };
        let velocity = run.states[0].velocity.x;
        assert!((velocity - expected).abs() < 1e-4, "{velocity}");
        let back = run.states[0].centre.x - 0.25;
        assert!(periodic || (back - 0.5).abs() < 1e-4, "{back}");
    }
}
