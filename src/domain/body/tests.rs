use glam::{DMat3, DQuat, DVec3};

use super::{Body, BodyState, Freedom, MassProperties, Mooring, dot};
use crate::mesh::TriangleMesh;

/// A box of these edges with a corner at `corner`, of outward triangles.
pub(super) fn brick(corner: DVec3, edges: DVec3) -> TriangleMesh {
    let vertex = |k: usize| {
        let part = DVec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64);
        corner + part * edges
    };
    TriangleMesh {
        vertices: (0..8).map(vertex).collect(),
        triangles: vec![
            [0, 2, 3],
            [0, 3, 1],
            [4, 5, 7],
            [4, 7, 6],
            [0, 1, 5],
            [0, 5, 4],
            [2, 6, 7],
            [2, 7, 3],
            [0, 4, 6],
            [0, 6, 2],
            [1, 3, 7],
            [1, 7, 5],
        ],
    }
}

pub(super) const EDGES: DVec3 = DVec3::new(0.4, 0.2, 0.7);

pub(super) fn body(freedom: Freedom) -> Body {
    Body {
        mass: MassProperties::of_mesh(&brick(DVec3::new(3.0, -1.0, 2.0), EDGES), 500.0),
        velocity: [0.0; 6],
        freedom,
        moorings: Vec::new(),
    }
}

/// m / 12 (b² + c²) about each axis, wherever the box stands; a turned box has turned inertia.
#[test]
fn mass_properties_of_a_box_are_exact() {
    let found = body(Freedom::ALL).mass;
    let mass = 500.0 * EDGES.element_product();
    let squares = EDGES * EDGES;
    let moments = (DVec3::splat(squares.element_sum()) - squares) * mass / 12.0;
    assert!((found.mass - mass).abs() < 1e-12 * mass);
    let middle = DVec3::new(3.0, -1.0, 2.0) + 0.5 * EDGES;
    assert!((found.centre - middle).length() < 1e-12);
    let off = found.inertia - DMat3::from_diagonal(moments);
    assert!(
        off.to_cols_array().iter().all(|x| x.abs() < 1e-12 * mass),
        "{off}"
    );

    let turn = DQuat::from_rotation_z(0.7);
    let affine = glam::DAffine3::from_quat(turn);
    let turned = brick(DVec3::ZERO, EDGES).transformed(&affine);
    let turned = MassProperties::of_mesh(&turned, 500.0).inertia;
    let by = DMat3::from_quat(turn);
    let off = turned - by * DMat3::from_diagonal(moments) * by.transpose();
    assert!(
        off.to_cols_array().iter().all(|x| x.abs() < 1e-12 * mass),
        "{off}"
    );
    // Negative control: not that of the box before it was turned.
    assert!((turned - found.inertia).x_axis.length() > 1e-3 * mass);
}

/// An impulse changes the momentum by itself; a locked axis takes what belongs to it.
#[test]
fn a_response_is_the_inverse_mass_within_the_freedom() {
    let free = body(Freedom::ALL);
    let mut state = free.at_start();
    state.turn = DQuat::from_scaled_axis(DVec3::new(0.3, -0.8, 0.5));
    let impulse = [1.0, -2.0, 3.0, 0.4, 0.5, -0.6];
    let after = state.pushed(&free.response(&state), &impulse);
    let about = free.inertia(&after) * after.spin;
    let momentum = free.mass.mass * after.velocity;
    let found = [
        momentum.x, momentum.y, momentum.z, about.x, about.y, about.z,
    ];
    for (found, given) in found.iter().zip(&impulse) {
        assert!((found - given).abs() < 1e-12, "{found} {given}");
    }

    let heaves = body(Freedom::Axes {
        along: [false, true, false],
        about: [false; 3],
    });
    let after = state.pushed(&heaves.response(&state), &impulse);
    let expected = [0.0, -2.0 / heaves.mass.mass, 0.0, 0.0, 0.0, 0.0];
    for (found, expected) in after.velocities().iter().zip(&expected) {
        assert!((found - expected).abs() < 1e-15);
    }
}

/// A door turns by the moment about its hinge, with the moment of inertia about it, and its hinge
/// stays where it is.
#[test]
fn a_hinged_body_turns_about_its_hinge() {
    let at = DVec3::new(3.0, -1.0, 2.0);
    let door = body(Freedom::Hinge { at, axis: DVec3::Y });
    let mut state = door.at_start();
    let arm = state.centre - at;
    let about = door.mass.inertia.y_axis.y + door.mass.mass * (arm.x * arm.x + arm.z * arm.z);
    let force = DVec3::new(2.0, 7.0, -1.0);
    let moment = arm.cross(force).y;
    let impulse = [force.x, force.y, force.z, 0.0, 0.0, 0.0];
    state = state.pushed(&door.response(&state), &impulse);
    assert!((state.spin - DVec3::Y * moment / about).length() < 1e-12);
    let energy = door.kinetic_energy(&state);
    for _ in 0..1000 {
        state = door.moved(&state, 0.01);
    }
    let hinge = door.pose(&state).place(at);
    assert!((hinge - at).length() < 1e-12, "{hinge}");
    assert!(state.velocity_at(at).length() < 1e-12);
    assert!((door.kinetic_energy(&state) / energy - 1.0).abs() < 1e-9);
}

/// The angular momentum of a free body stays, though its spin does not.
#[test]
fn a_free_body_keeps_its_momentum() {
    let free = body(Freedom::ALL);
    let mut state = BodyState {
        velocity: DVec3::new(0.1, 0.2, -0.3),
        spin: DVec3::new(5.0, 0.2, 0.1),
        ..free.at_start()
    };
    let (spin, momentum) = (state.spin, free.inertia(&state) * state.spin);
    for _ in 0..500 {
        state = free.moved(&state, 1.0 / 240.0);
    }
    let after = free.inertia(&state) * state.spin;
    assert!((after - momentum).length() < 1e-12 * momentum.length());
    assert!((state.spin - spin).length() > 0.05, "{}", state.spin);
    assert!((state.turn.length() - 1.0).abs() < 1e-14);
    assert_eq!(state.velocity, DVec3::new(0.1, 0.2, -0.3));
}

/// A weight on a spring hangs at g m / k below the length; stiffness that an explicit spring could
/// not take at this step (k Δt² / m = 3 000) does not make it swing up.
#[test]
fn a_mooring_holds_a_weight_at_any_stiffness() {
    let step = 1.0 / 24.0;
    let gravity = -9.81 * DVec3::Y;
    for (stiffness, damping) in [(2.0e3, 200.0), (5.0e7, 0.0)] {
        let mut weight = body(Freedom::ALL);
        let at = weight.mass.centre;
        weight.moorings = vec![Mooring {
            anchor: at + 2.0 * DVec3::Y,
            at,
            length: 2.0,
            stiffness,
            damping,
        }];
        let mut state = weight.at_start();
        let mut highest = f64::NEG_INFINITY;
        for _ in 0..2400 {
            state = weight.accelerated(&state, gravity, step);
            state = weight.moved(&state, step);
            highest = highest.max(state.centre.y);
        }
        let hangs = at.y - weight.mass.mass * 9.81 / stiffness;
        assert!(
            (state.centre.y - hangs).abs() < 1e-3,
            "{} {hangs}",
            state.centre.y
        );
        assert!(highest < at.y + 1e-3, "{highest}");
    }
    // A slack one does nothing.
    let mut loose = body(Freedom::ALL);
    loose.moorings = vec![Mooring {
        anchor: loose.mass.centre + DVec3::Y,
        at: loose.mass.centre,
        length: 1.5,
        stiffness: 1e4,
        damping: 1e4,
    }];
    let fallen = loose.accelerated(&loose.at_start(), gravity, step);
    assert_eq!(fallen.velocity, gravity * step);
    assert_eq!(
        dot(&fallen.velocities(), &[0.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
        0.0
    );
}
