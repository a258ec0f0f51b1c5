//! Forces of all kinds, in rooms of all kinds, against their f64 reference passes, and a fault for
//! each row.

use glam::DVec3;
use swell::{
    check::{
        CheckTable,
        whitewater::{Frame, check},
    },
    domain::{
        boundary::Boundary,
        bounds::Bounds,
        frame::{FrameMotion, FrameTurn},
        motion::Motion,
        sources::Window,
        whitewater::WhitewaterKind,
    },
    gpu::adapter::{Context, InjectedFault},
    scene::{Method, Scene, forces::MovingFrame},
    stage::{check::check_frame, prepare::Start},
};

use super::{
    controls::{Control, control},
    faults, lines, over,
};
use crate::support::{
    self, D, choose, context, flip as of_flip,
    forces::{attract, in_box, in_mesh, law, push, vortex},
    noise, pbf_of,
    whitewater::{settings, white},
};

/// Faults in the law of a force, seen in the pass that pushes.
const fn laws(pass: &'static str, fields: &'static [&'static str]) -> [Control; 6] {
    [
        control(pass, "ratio * ratio,", "ratio,", pass, fields),
        control(
            pass,
            "cross(way, forces[k].axis)",
            "cross(forces[k].axis, way)",
            pass,
            fields,
        ),
        control(
            pass,
            "min(depth * forces[k].fade_rate",
            "min(1.02 * depth * forces[k].fade_rate",
            pass,
            fields,
        ),
        control(
            pass,
            "return mix(low, high, t.z);",
            "return mix(low, high, 0.9 * t.z);",
            pass,
            fields,
        ),
        control(
            pass,
            "max(r, forces[k].core)",
            "max(r, 1.01 * forces[k].core)",
            pass,
            fields,
        ),
        control(pass, "depth > 0.0)", "depth > 0.01)", pass, fields),
    ]
}

const TURNED: &str = "velocity turned by Coriolis's acceleration";
const TURNED_DROPS: &str = "velocity with which drops move";

const FLIP: [Control; 11] = [
    control(
        "effects/push_faces",
        "forces[k].core * cross",
        "0.99 * forces[k].core * cross",
        "effects/push_faces",
        &["velocity at faces"],
    ),
    control(
        "effects/push_faces",
        "forces[k].strength * outward",
        "0.99 * forces[k].strength * outward",
        "effects/push_faces",
        &["velocity at faces"],
    ),
    control(
        "effects/turn_sorted",
        "v + change_by_turn(v)",
        "v + 1.001 * change_by_turn(v)",
        "effects/turn_sorted",
        &[TURNED, TURNED_DROPS],
    ),
    control(
        "effects/turn_sorted",
        "select(carried[k], turned[axis], is_drop)",
        "turned[axis]",
        "effects/turn_sorted",
        &[TURNED_DROPS],
    ),
    control(
        "effects/push_faces",
        "params.kick * force_at",
        "1.01 * params.kick * force_at",
        "effects/push_faces",
        &["velocity at faces"],
    ),
    control(
        "effects/push_drops",
        "sorted_velocity[k] + change[axis]",
        "sorted_velocity[k] + 1.001 * change[axis]",
        "effects/push_drops",
        &["velocity", "velocity of the grid"],
    ),
    control(
        "effects/push_drops",
        "carried[k] = v;",
        "carried[k] = 1.001 * v;",
        "effects/push_drops",
        &["velocity of the grid"],
    ),
    // Not only droplets.
    control(
        "effects/push_drops",
        "select(0, 1, is_drop)",
        "1",
        "effects/push_drops",
        &["velocity"],
    ),
    control(
        "effects/work_by_cells",
        "0.5 * face_change[face]",
        "0.55 * face_change[face]",
        "effects/work_by_cells",
        &["shares of the work"],
    ),
    control(
        "effects/work_by_cells",
        "after - 0.5 * (",
        "after - 0.6 * (",
        "effects/work_by_cells",
        &["shares of the work"],
    ),
    control(
        "effects/work_by_cells",
        "sum_of_group(local, work)",
        "sum_of_group(local, select(work, 0.0, local >= 32u))",
        "effects/work_by_cells",
        &["shares of the work"],
    ),
];

const PBF: [Control; 5] = [
    control(
        "effects/turn_particles",
        "v + change_by_turn(v)",
        "v + 1.001 * change_by_turn(v)",
        "effects/turn_particles",
        &[TURNED],
    ),
    control(
        "effects/push_particles",
        "packed(before + change)",
        "packed(before + 1.001 * change)",
        "effects/push_particles",
        &["velocity"],
    ),
    control(
        "effects/push_particles",
        "params.time_step * force_at",
        "1.001 * params.time_step * force_at",
        "effects/push_particles",
        &[
            "velocity",
            "change of the velocity",
            "change times the velocity before",
        ],
    ),
    control(
        "effects/work_by_particles",
        "force_impulse[order[i]]",
        "force_impulse[i]",
        "effects/work_by_particles",
        &["shares of the work"],
    ),
    control(
        "effects/work_by_particles",
        "select(0.0, work, is_inside)",
        "select(0.0, work, is_inside && local > 0u)",
        "effects/work_by_particles",
        &["shares of the work"],
    ),
];

/// Forces of each kind: in boxes and meshes with sharp and soft edges, and in a part of the step.
fn with_forces(scene: &mut Scene, spacing: f64) {
    let middle = DVec3::new(0.7, 0.3, 0.4);
    let room = Bounds {
        min: DVec3::new(0.13, -1.0, 0.07),
        max: DVec3::new(0.91, 3.0, 0.71),
    };
    let mut slanted = support::box_mesh(room.grown(0.05));
    for vertex in &mut slanted.vertices {
        vertex.x += 0.1 * vertex.y;
    }
    let late = push(DVec3::new(1.0, -2.0, 0.5));
    scene.forces = vec![
        in_box(push(DVec3::new(3.0, 1.0, -2.0)), room, 0.0),
        in_box(
            vortex(middle, DVec3::new(0.6, 0.8, 0.0), law(9.0, 0.15, 2)),
            room,
            0.3,
        ),
        in_mesh(
            push(DVec3::new(-4.0, 2.0, 1.0)),
            slanted.clone(),
            spacing,
            0.0,
        ),
        in_mesh(attract(middle, law(-7.0, 0.2, 1)), slanted, spacing, 0.25),
        attract(middle, law(5.0, 0.4, 0)),
        late,
    ];
    scene.forces[5].force.window = Window {
        from: 1e-4,
        until: None,
    };
}

/// A moving block of water with drops over it.
fn case(method: Method, has_projection: bool) -> (Scene, Start) {
    let mut scene = of_flip::scene([16.0, 24.0, 8.0]);
    let pbf = pbf_of(&mut scene);
    pbf.particle_spacing = of_flip::DX / 2.0;
    pbf.grid_projection = has_projection;
    choose(&mut scene, method);
    with_forces(&mut scene, of_flip::DX / 2.0);
    let sine = |stroke, period| Motion::Sine {
        stroke,
        period,
        ramp: 0.0,
    };
    scene.frame = Some(MovingFrame::new(FrameMotion {
        slide: Some((DVec3::new(1.0, 0.5, -0.3), sine(0.2, 0.7))),
        turn: Some(FrameTurn {
            pivot: DVec3::new(0.4, 0.9, -0.2),
            axis: DVec3::new(0.3, 1.0, -0.6),
            motion: sine(80.0, 0.9),
        }),
        gravity: scene.water.gravity,
        reach: 3.0,
    }));
    let mut particles = of_flip::block([1, 0, 1], [9, 5, 6]);
    support::jitter(&mut particles, 0.01);
    for k in 0..12u32 {
        let x = [0.18 + 0.11 * k as f32, 1.1 + 0.1 * k as f32, 0.41];
        particles.position.push(x);
        particles.id.push(particles.id.len() as u32);
        particles.velocity.push([0.0; 3]);
    }
    for (k, v) in (0..).zip(&mut particles.velocity) {
        *v = [0, 1, 2].map(|axis| noise(3 * k + axis + 7) as f32);
    }
    // A quarter of a frame before: forces act for half of both substeps.
    particles.substep = 0.25 * scene.shot.frame_seconds();
    let start = Start {
        particles,
        removed: 0,
        asked: None,
        sources: Default::default(),
        boundary: Boundary::default(),
    };
    (scene, start)
}

fn hold(method: Method, has_projection: bool, controls: &[Control]) {
    let (scene, start) = case(method, has_projection);
    // The fourth frame, in which the domain moves.
    let checked = |context: &Context| check_frame(context, &scene, &start, 3, &start.particles);
    let (clean, mut found) = faults(&context(), &checked, controls);
    let of_forces = clean.rows.iter().filter(|row| {
        let pass = row.field.pass;
        ["effects/push_", "effects/work_", "effects/turn_"]
            .iter()
            .any(|head| pass.starts_with(head))
    });
    for row in of_forces {
        let field = row.field;
        let is_of = |it: &Control| it.pass == field.pass && it.fields.contains(&field.name);
        if !controls.iter().any(is_of) {
            found += &format!("no control: {} {}\n", field.pass, field.name);
        }
        // Most values are compared rather than counted as ties.
        assert!(
            4 * row.ties < row.values,
            "{}: {} ties",
            field.name,
            row.ties
        );
    }
    assert!(found.is_empty(), "{found}\n{}", lines(&clean));
}

#[test]
fn forces_on_the_grid_are_within_tolerance_and_fail_where_they_should() {
    let laws = laws("effects/push_faces", &["velocity at faces"]);
    let all: Vec<Control> = FLIP.into_iter().chain(laws).collect();
    hold(Method::Flip, true, &all);
    // The same passes before PBF's particles move.
    hold(Method::Pbf, true, &FLIP);
}

#[test]
fn forces_on_particles_are_within_tolerance_and_fail_where_they_should() {
    let laws = laws(
        "effects/push_particles",
        &["velocity", "change of the velocity"],
    );
    let all: Vec<Control> = PBF.into_iter().chain(laws).collect();
    hold(Method::Pbf, false, &all);
}

/// Spray and foam over a pool under the same forces.
fn whitewater(context: &Context, has_forces: bool) -> CheckTable {
    let mut scene = support::scene([1.6, 2.4, 0.9]);
    if has_forces {
        with_forces(&mut scene, D);
    }
    let scene = scene.of_whitewater();
    let water = support::lattice([0.0; 3], [16, 5, 9], [D; 3]);
    let all: Vec<_> = (0..2000u64)
        .map(|k| {
            let number = |axis: u64| noise(70_000 + 7 * k + axis);
            let x = DVec3::new(
                0.8 + 0.7 * number(0),
                1.2 + 1.1 * number(1),
                0.45 + 0.4 * number(2),
            );
            let v = 2.0 * DVec3::new(number(3), number(4), number(5));
            (x, v, WhitewaterKind::ALL[k as usize % 3])
        })
        .collect();
    let frame = Frame {
        scene: &scene,
        boundary: &Boundary::default(),
        settings: &settings(),
        water: &water,
        white: &white(&all),
        time: 0.2,
        seconds: 0.02,
    };
    check(context, frame).unwrap()
}

#[test]
fn forces_on_spray_are_within_tolerance_and_their_faults_are_seen() {
    let context = context();
    let clean = whitewater(&context, true);
    assert!(over(&clean).is_empty(), "{}", lines(&clean));
    let row = |table: &CheckTable| {
        let row = table.rows.iter().find(|row| row.field.name == "velocity");
        row.map(|row| (row.values, row.ties)).unwrap()
    };
    let (values, ties) = row(&clean);
    // Drops near an edge are left out beside those that are always.
    assert!(ties < values, "{ties} of {values}");
    let bare = row(&whitewater(&context, false)).1;
    assert!(ties > bare, "{ties} and {bare}");
    for (from, to) in [
        (
            "step * force_at(place + flight.way)",
            "0.99 * step * force_at(place + flight.way)",
        ),
        (
            "force_at(place + flight.way)",
            "force_at(place + 0.9 * flight.way)",
        ),
        ("step * force_at(start)", "0.99 * step * force_at(start)"),
    ] {
        let pass = "whitewater/advance";
        let mut spoiled = context.clone();
        spoiled.spoil = Some(InjectedFault { pass, from, to });
        let found = over(&whitewater(&spoiled, true));
        assert!(found.contains(&(pass, "velocity")), "{from}: {found:?}");
    }
}
