//! Bodies that may not move freely.

use super::*;

/// A box with constraints is hit by a free one.
fn hit(freedom: Freedom) -> Run {
    let meshes = vec![
        cuboid(DVec3::ZERO, DVec3::splat(0.5)),
        cuboid(DVec3::new(-0.8, 0.15, 0.12), DVec3::splat(0.5)),
    ];
    let mut bodies: Vec<_> = meshes.iter().map(free).collect();
    bodies[0].freedom = freedom;
    bodies[1].velocity[0] = 3.0;
    let mut run = Run::of_bodies(&[], &[], meshes, bodies);
    for _ in 0..60 {
        run.step(&nowhere(), DVec3::ZERO, STEP);
    }
    run
}

#[test]
fn locked_axes_stay_locked() {
    for axis in 0..3 {
        let open = |locked: usize| std::array::from_fn(|k| k != locked);
        let freedom = Freedom::Axes {
            along: open(axis),
            about: open((axis + 1) % 3),
        };
        let state = hit(freedom).states[0];
        assert_eq!(state.centre[axis], 0.0);
        assert!(state.spin[(axis + 1) % 3].abs() < 1e-12, "{}", state.spin);
        assert!(state.velocity.length() > 0.1 || axis == 0);
        // Negative control.
        let state = hit(Freedom::ALL).states[0];
        assert!(state.centre[axis] != 0.0 && state.spin[(axis + 1) % 3] != 0.0);
    }
}

/// Without any freedom it is a solid: the other stops, apart from turning off its edge.
#[test]
fn a_body_without_freedom_stands_still() {
    let none = Freedom::Axes {
        along: [false; 3],
        about: [false; 3],
    };
    let run = hit(none);
    assert_eq!(run.states[0].centre, DVec3::ZERO);
    assert_eq!(run.states[0].velocities(), [0.0; 6]);
    assert!(run.states[1].velocity.x < 1.0);
}

/// A gate hinged at its edge turns as the angular momentum about the hinge demands: a blow J at
/// distance r gives it the spin r J / I.
#[test]
fn a_hinged_body_turns_about_its_hinge() {
    let gate = cuboid(DVec3::new(0.0, 0.5, 0.0), DVec3::new(0.1, 1.0, 0.6));
    let ball = cuboid(DVec3::new(-0.4, 0.8, 0.0), DVec3::splat(0.2));
    let mut bodies = vec![free(&gate), free(&ball)];
    bodies[0].freedom = Freedom::Hinge {
        at: DVec3::ZERO,
        axis: DVec3::Z,
    };
    bodies[1].velocity[0] = 2.0;
    bodies[1].freedom = Freedom::Axes {
        along: [true; 3],
        about: [false; 3],
    };
    let mut run = Run::of_bodies(&[], &[], vec![gate, ball], bodies);
    // Until they have met and for no longer than that.
    while run.states[1].velocity.x > 1.9 {
        run.step(&nowhere(), DVec3::ZERO, STEP);
    }
    for _ in 0..3 {
        run.step(&nowhere(), DVec3::ZERO, STEP);
    }
    let [gate, ball] = [&run.states[0], &run.states[1]];
    let mass = run.bodies[0].mass;
    let inertia = mass.inertia.z_axis.z + mass.mass * 0.25;
    let blow = run.bodies[1].mass.mass * (2.0 - ball.velocity.x);
    // The blow is spread over the face from y = 0.7 to 0.9.
    let arm = -gate.spin.z * inertia / blow;
    assert!((0.69..0.91).contains(&arm), "{arm}");
    let hinge = run.bodies[0].pose(gate).place(DVec3::ZERO);
    assert!(hinge.length() < 1e-12, "{hinge}");
    let along = gate.spin.cross(gate.centre);
    assert!((gate.velocity - along).length() < 1e-12);
}

/// A bar hinged 0.3 m above the floor, 1 m long and 0.1 m thick, falls until its end lies on it.
#[test]
fn a_hinged_bar_comes_to_rest_on_the_floor() {
    let bar = cuboid(DVec3::new(0.5, 0.3, 0.0), DVec3::new(1.0, 0.1, 0.2));
    let fallen = |is_hinged: bool| {
        let mut body = free(&bar);
        if is_hinged {
            body.freedom = Freedom::Hinge {
                at: DVec3::new(0.0, 0.3, 0.0),
                axis: DVec3::Z,
            };
        }
        Run::of_bodies(&[], &[], vec![bar.clone()], vec![body]).fall(&floor(), 2.0)
    };
    let run = fallen(true);
    assert!(run.lowest(0).abs() < 1e-4, "{}", run.lowest(0));
    assert!(run.states[0].spin.length() < 1e-3);
    // Negative control: without the hinge it lies flat.
    assert!((run.states[0].centre.y - fallen(false).states[0].centre.y).abs() > 0.1);
}
