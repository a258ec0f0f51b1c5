//! Checks beyond a block of water on a floor: curved solids, far walls, substeps after the first.

use std::collections::BTreeMap;

use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary, bounds::Bounds, mesh::TriangleMesh, motion::Motion,
        particles::Particles, solver::Solver, substep::SubstepChoice,
    },
    gpu::adapter::Context,
    scene::{
        Effects, Iteration, Method, PlacedMesh, Placement, Scene, Stop, Wall, WaveMaker,
        moving_solid::{MovingSolid, Slide, Turn},
    },
    solve::{SolveError, flip::Flip, pbf::Pbf, plan::device_limits},
    stage::{
        check::{Checked, check_frame, check_substep},
        prepare::Start,
    },
};

use super::{
    case,
    controls::{Control, control, walls::FLIP_FAR_WALLS},
    faults, lines, over,
};
use crate::support::{D, box_mesh, context, flip_of, lattice, noise, pbf_of};

/// A sphere of 20 · 4² triangles, an icosahedron whose faces are subdivided twice.
fn sphere(centre: DVec3, radius: f64) -> TriangleMesh {
    let golden = (1.0 + 5f64.sqrt()) / 2.0;
    let mut vertices = Vec::new();
    for (a, b) in [
        (1.0, golden),
        (-1.0, golden),
        (1.0, -golden),
        (-1.0, -golden),
    ] {
        vertices.extend([
            DVec3::new(0.0, a, b),
            DVec3::new(a, b, 0.0),
            DVec3::new(b, 0.0, a),
        ]);
    }
    let mut triangles = Vec::new();
    for a in 0..12u32 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                let [x, y, z] = [a, b, c].map(|k| vertices[k as usize]);
                let is_edge = |x: DVec3, y: DVec3| (x.distance(y) - 2.0).abs() < 1e-9;
                if is_edge(x, y) && is_edge(y, z) && is_edge(z, x) {
                    let is_outward = (y - x).cross(z - x).dot(x) > 0.0;
                    triangles.push(if is_outward { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for _ in 0..2 {
        let mut middles = BTreeMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push(vertices[a as usize] + vertices[b as usize]);
                vertices.len() as u32 - 1
            })
        };
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
        for x in &mut vertices {
            *x = x.normalize();
        }
    }
    TriangleMesh {
        vertices: vertices.into_iter().map(|x| centre + radius * x).collect(),
        triangles,
    }
}

/// A tank with moving water and a sphere in it, which may move along a line and rotate about
/// an axis beside it.
fn tank(method: Method, speed: f64) -> (Scene, Start) {
    let (mut scene, _) = case(method);
    scene.effects = Effects::default();
    scene.domain.max = DVec3::new(1.2, 1.6, 1.2);
    pbf_of(&mut scene).cfl = 1.0;
    flip_of(&mut scene).cfl = 1.0;
    scene.water.blocks.push(Bounds {
        min: DVec3::ZERO,
        max: DVec3::new(1.2, 0.7, 1.2),
    });
    let placed = PlacedMesh {
        file: "sphere.obj".into(),
        file_hash: String::new(),
        placement: Placement::default(),
        mesh: sphere(SPHERE.0, SPHERE.1),
        holes: Default::default(),
        rounding: DVec3::ZERO,
        faults: Vec::new(),
    };
    match speed {
        0.0 => scene.solids.push(placed),
        velocity => scene.moving_solids.push(MovingSolid {
            turn: Some(Turn::new(
                SPHERE.0 - 0.1 * DVec3::X,
                DVec3::new(0.3, -0.2, 1.0),
                Motion::ConstantVelocity {
                    velocity: 100.0,
                    until: None,
                },
                &placed.mesh,
            )),
            placed,
            track: None,
            sequence: None,
            body: None,
            floor: None,
            slide: Some(Slide {
                direction: DVec3::new(0.6, 0.0, 0.8),
                motion: Motion::ConstantVelocity {
                    velocity,
                    until: None,
                },
            }),
        }),
    }
    let mut start = Start::of(&scene).unwrap();
    for (k, v) in start.particles.velocity.iter_mut().enumerate() {
        *v = std::array::from_fn(|axis| noise(3 * k as u64 + axis as u64 + 7) as f32);
    }
    (scene, start)
}

/// Centre and radius, m.
const SPHERE: (DVec3, f64) = (DVec3::new(0.63, 0.31, 0.57), 0.26);

/// Frames over which the sphere's tank is checked; a third of them if the sphere moves through PBF
/// without a projection.
const FRAMES: u32 = 12;

/// Solves `frames` frames with `solver` and checks the step after each.
fn follow(
    context: &Context,
    scene: &Scene,
    start: &Start,
    mut solver: impl Solver<Error = SolveError>,
    frames: u32,
) -> (String, Particles) {
    let mut state = start.particles.clone();
    solver.load(0, &state).unwrap();
    let mut faults = String::new();
    for frame in 0..frames {
        let table = check_frame(context, scene, start, frame, &state).unwrap();
        if !over(&table).is_empty() {
            let out = lines(&table);
            let out = out.lines().filter(|line| !line.contains(" 0 over"));
            faults += &format!("frame {frame}: {}\n", out.collect::<Vec<_>>().join("\n"));
        }
        state = solver.advance().unwrap().0;
    }
    (faults, state)
}

fn pbf_solver(context: &Context, scene: &Scene, start: &Start) -> Pbf {
    let plan = start.plan(scene, device_limits(context));
    let scene = scene.with_pbf().unwrap();
    Pbf::new(context, &scene, plan, &start.boundary, false).unwrap()
}

/// The bound of corrections that end in a curved solid must not begin where the solid pushed the
/// particles to: two of three frames would be out of tolerance here, by up to 1.58.
#[test]
fn a_sphere_in_a_tank_of_pbf_is_within_tolerance() {
    let context = context();
    let (scene, start) = tank(Method::Pbf, 0.0);
    let solver = pbf_solver(&context, &scene, &start);
    let (faults, mut state) = follow(&context, &scene, &start, solver, FRAMES);
    assert!(faults.is_empty(), "{faults}");
    // Particles may not touch it by themselves: one is placed inside.
    state.position[0] = (SPHERE.0 + 0.5 * SPHERE.1 * DVec3::Y).as_vec3().to_array();
    push_is_seen(
        &context,
        &scene,
        &start,
        &state,
        "pbf/compute_delta",
        "corrected position",
    );
}

/// The same with a sphere that moves and turns: its samples and its distance field follow,
/// and their work on the water is counted; with the iterations only, and with velocities that
/// a grid projects.
#[test]
fn a_sphere_that_moves_through_pbf_is_within_tolerance() {
    let context = context();
    for grid_projection in [true, false] {
        let (mut scene, start) = tank(Method::Pbf, 0.9);
        pbf_of(&mut scene).grid_projection = grid_projection;
        let solver = pbf_solver(&context, &scene, &start);
        let frames = if grid_projection { 2 } else { FRAMES / 3 };
        let (faults, mut state) = follow(&context, &scene, &start, solver, frames);
        assert!(faults.is_empty(), "{faults}");
        if grid_projection {
            // One is placed inside the sphere, on the side that moves towards it.
            let time = f64::from(frames) * scene.shot.frame_seconds();
            let within =
                scene.moving_solids[0].pose(&[], time).place(SPHERE.0) + 0.5 * SPHERE.1 * DVec3::X;
            state.position[0] = within.as_vec3().to_array();
            let place = (
                "pbf/predict",
                "share * posed_solids.length",
                "0.99 * share * posed_solids.length",
            );
            spoils(&context, &scene, &start, (frames, &state), place);
            continue;
        }
        for (pass, from, to) in [
            (
                "pbf/predict",
                "share * posed_solids.length",
                "0.99 * share * posed_solids.length",
            ),
            (
                "pbf/compute_delta",
                "rate -= params.gradient_scale",
                "rate += params.gradient_scale",
            ),
            (
                "pbf/compute_delta",
                "cross(solid_spin, x - solid_centre)",
                "cross(x - solid_centre, solid_spin)",
            ),
        ] {
            spoils(&context, &scene, &start, (frames, &state), (pass, from, to));
        }
    }
}

/// The same with FLIP, in whose advection the sphere pushes particles, at rest and in motion.
#[test]
fn a_sphere_in_a_tank_of_flip_is_within_tolerance() {
    let context = context();
    for speed in [0.0, 0.9] {
        let (scene, start) = tank(Method::Flip, speed);
        let plan = start.plan(&scene, device_limits(&context));
        let solver = Flip::new(
            &context,
            &scene.with_flip().unwrap(),
            plan,
            &start.boundary,
            false,
        )
        .unwrap();
        let (faults, mut state) = follow(&context, &scene, &start, solver, FRAMES);
        assert!(faults.is_empty(), "{faults}");
        // Particles rarely touch it by themselves: one is placed inside.
        let time = f64::from(FRAMES) * scene.shot.frame_seconds();
        let pose = scene
            .moving_solids
            .first()
            .map(|solid| solid.pose(&[], time));
        let centre = pose.map_or(SPHERE.0, |pose| pose.place(SPHERE.0));
        let within = centre + 0.5 * SPHERE.1 * DVec3::Y;
        state.position[0] = within.as_vec3().to_array();
        push_is_seen(&context, &scene, &start, &state, "flip/advect", "position");
        if speed > 0.0 {
            let spin = "cross(solid_spin, x - solid_centre)";
            spoils(
                &context,
                &scene,
                &start,
                (FRAMES, &state),
                ("flip/advect", spin, "vec3f(0.0)"),
            );
        }
    }
}

/// Negative control: a pass with a replaced expression is out of tolerance.
fn spoils(
    context: &Context,
    scene: &Scene,
    start: &Start,
    (frame, state): (u32, &Particles),
    (pass, from, to): (&'static str, &'static str, &'static str),
) {
    let Control { spoil, .. } = control(pass, from, to, pass, &[]);
    let mut spoiled = context.clone();
    spoiled.spoil = Some(spoil);
    let table = check_frame(&spoiled, scene, start, frame, state).unwrap();
    let faults = over(&table);
    let is_seen = faults.iter().any(|(name, _)| *name == pass);
    assert!(is_seen, "{to}: {}", lines(&table));
}

/// Negative control: a push that is slightly too long is out of tolerance.
fn push_is_seen(
    context: &Context,
    scene: &Scene,
    start: &Start,
    state: &Particles,
    pass: &'static str,
    field: &'static str,
) {
    let Control { spoil, .. } = control(
        pass,
        "(params.contact_distance - distance)",
        "(params.contact_distance - distance) * 1.001",
        pass,
        &[],
    );
    let mut spoiled = context.clone();
    spoiled.spoil = Some(spoil);
    let table = check_frame(&spoiled, scene, start, FRAMES, state).unwrap();
    assert!(over(&table).contains(&(pass, field)), "{}", lines(&table));
}

/// Adds walls that close in, by index and speed in m/s.
fn close_in(scene: &mut Scene, walls: &[(usize, f64)]) {
    for &(index, velocity) in walls {
        scene.wave_makers.push(WaveMaker {
            absorption: None,
            wall: Wall::NAMED[index].1,
            motion: Motion::ConstantVelocity {
                velocity,
                until: None,
            },
        });
    }
}

/// Walls that close in on moving water, with several substeps per frame.
fn pressed(method: Method) -> (Scene, Start) {
    let (mut scene, start) = case(method);
    pbf_of(&mut scene).cfl = 0.06;
    flip_of(&mut scene).cfl = 0.03;
    close_in(&mut scene, &[(0, 2.0), (5, 0.7)]);
    (scene, start)
}

/// Water in the far corner of a box whose wall at +z closes in on it. Along x the box ends within a
/// cell, one past a brick of cells and too thin for particles.
fn far_corner(method: Method) -> (Scene, Start) {
    let (mut scene, mut start) = case(method);
    scene.effects = Effects::default();
    scene.domain.max = DVec3::new(1.68, 1.6, 1.6);
    start.boundary = Boundary::default();
    let velocity = std::mem::take(&mut start.particles.velocity);
    start.particles = lattice([0.87, 0.0, 0.92], [8, 7, 7], [0.09, 0.09, 0.1]);
    let n = start.particles.len();
    start.particles.velocity = velocity.into_iter().cycle().take(n).collect();
    close_in(&mut scene, &[(5, 1.5)]);
    (scene, start)
}

/// Checks water at the upper walls, and upper walls that move.
#[test]
fn far_walls_are_within_tolerance_and_fail_where_they_should() {
    let context = context();
    let of_push = control(
        "pbf/predict",
        "dot(min(push, vec3f(0.0)), params.wall_velocity_max)",
        "dot(min(push, vec3f(0.0)), params.wall_velocity_min)",
        "pbf/predict",
        &["work of walls"],
    );
    let of_step = control(
        "pbf/compute_delta",
        "work *= 2.0 * phase.acceleration - 1.0;",
        "work *= phase.acceleration;",
        "pbf/compute_delta",
        &["work of walls"],
    );
    let chebyshev = |scene: &mut Scene| {
        let settings = pbf_of(scene);
        (settings.iteration, settings.relaxation) = (Iteration::Chebyshev, 0.7);
    };
    let as_it_is = |_: &mut Scene| {};
    far_walls_hold(&context, Method::Pbf, as_it_is, &[of_push]);
    far_walls_hold(&context, Method::Pbf, chebyshev, &[of_step]);
    far_walls_hold(&context, Method::Flip, as_it_is, FLIP_FAR_WALLS);
}

fn far_walls_hold(context: &Context, method: Method, change: fn(&mut Scene), controls: &[Control]) {
    let (mut scene, start) = far_corner(method);
    change(&mut scene);
    let checked = |context: &Context| check_frame(context, &scene, &start, 0, &start.particles);
    let (_, faults) = faults(context, &checked, controls);
    assert!(faults.is_empty(), "{faults}");
}

fn of_substep(context: &Context, scene: &Scene, start: &Start, which: SubstepChoice) -> Checked {
    check_substep(context, scene, start, 0, &start.particles, which).unwrap()
}

/// Each substep of a frame is within tolerance. Faults in what a substep inherits from the previous
/// one, which the first substep cannot show, are detected in the last.
fn substeps_are_checked(method: Method, spoils: &[Control]) {
    let context = context();
    let (scene, start) = pressed(method);
    let last = of_substep(&context, &scene, &start, SubstepChoice::Last);
    let count = last.substep.unwrap();
    assert!(count >= 3, "{count}");
    for number in 1..=count {
        let checked = of_substep(&context, &scene, &start, SubstepChoice::Number(number));
        assert_eq!(checked.substep, Some(number));
        let table = &checked.table;
        assert!(over(table).is_empty(), "{number}: {}", lines(table));
        assert_eq!(number == count, lines(table) == lines(&last.table));
    }
    let beyond = SubstepChoice::Number(count + 1);
    let error = check_substep(&context, &scene, &start, 0, &start.particles, beyond);
    let found = match error {
        Err(SolveError::NoSubstep {
            asked,
            frame,
            count,
        }) => (asked, frame, count),
        other => panic!("{other:?}"),
    };
    assert_eq!(found, (count + 1, 0, count));
    for spoil in spoils {
        let mut spoiled = context.clone();
        spoiled.spoil = Some(spoil.spoil);
        let first = of_substep(&spoiled, &scene, &start, SubstepChoice::default());
        assert!(over(&first.table).is_empty(), "{}", lines(&first.table));
        let last = of_substep(&spoiled, &scene, &start, SubstepChoice::Last);
        let expected: Vec<_> = spoil
            .fields
            .iter()
            .map(|&field| (spoil.pass, field))
            .collect();
        assert_eq!(over(&last.table), expected, "{:?}", spoil.spoil);
    }
}

#[test]
fn every_substep_of_pbf_is_within_tolerance() {
    let spoils = [control(
        "pbf/boundary_work",
        "boundary_work[thread / 64u] += sum;",
        "boundary_work[thread / 64u] = sum;",
        "pbf/boundary_work",
        &["shares of the work"],
    )];
    substeps_are_checked(Method::Pbf, &spoils);
}

#[test]
fn every_substep_of_flip_is_within_tolerance() {
    let spoils = [
        control(
            "flip/boundary_work",
            "boundary_work[thread / 64u] = sum;",
            "boundary_work[thread / 64u] += sum;",
            "flip/boundary_work",
            &["shares of the work"],
        ),
        // Values that the previous substep stored.
        control(
            "flip/gather_faces",
            "select(face_layer[element], 0u, component == 0u)",
            "face_layer[element]",
            "flip/gather_faces",
            &["whether particles are near"],
        ),
    ];
    substeps_are_checked(Method::Flip, &spoils);
}

/// Asserts that a control's row is out of tolerance in the last substep of a frame, and that
/// without the fault no row is.
fn last_substep_sees(scene: &Scene, start: &Start, controls: &[Control]) {
    let context = context();
    let sound = of_substep(&context, scene, start, SubstepChoice::Last).table;
    assert!(over(&sound).is_empty(), "{}", lines(&sound));
    for control in controls {
        let mut spoiled = context.clone();
        spoiled.spoil = Some(control.spoil);
        let table = of_substep(&spoiled, scene, start, SubstepChoice::Last).table;
        for &field in control.fields {
            let row = (control.pass, field);
            assert!(over(&table).contains(&row), "{row:?}: {}", lines(&table));
        }
    }
}

/// A block compressed by 2 % along each axis throws its particles apart, by more than the cap of
/// two CFL lengths per substep. With three substeps per frame they begin the next one at the cap,
/// and gravity takes them over it; with one, some come to within a hundredth of it.
#[test]
fn particles_at_the_cap_are_within_tolerance() {
    let (mut scene, mut start) = case(Method::Pbf);
    scene.effects = Effects::default();
    scene.shot.frames_per_second = 100.0;
    start.boundary = Boundary::default();
    start.particles = lattice([0.3, 0.1, 0.3], [10, 8, 9], [0.98 * D; 3]);
    let begins = control(
        "pbf/predict",
        "min(1.0, params.max_displacement / max(",
        "min(1.0, 1.01 * params.max_displacement / max(",
        "pbf/predict",
        &["predicted position", "velocity"],
    );
    let ends = control(
        "pbf/update_velocity",
        "if distance > params.max_displacement {",
        "if distance > 1.01 * params.max_displacement {",
        "pbf/update_velocity",
        &["position", "velocity"],
    );
    for (cfl, control) in [(0.004, begins), (0.024, ends)] {
        pbf_of(&mut scene).cfl = cfl;
        last_substep_sees(&scene, &start, &[control]);
    }
}

/// A wall moves by a spacing in the first step, against a lattice at rest: every particle of a
/// layer rounds in the same direction, which adds up. A bound for independent particles would be
/// exceeded by factors of 1.06 (corrections) to 3.5 (λ).
#[test]
fn layers_that_round_alike_are_within_tolerance() {
    let context = context();
    let (mut scene, mut start) = case(Method::Pbf);
    scene.effects = Effects::default();
    scene.domain.max = DVec3::new(1.6, 1.6, 1.0);
    start.boundary = Boundary::default();
    start.particles = lattice([D / 2.0; 3], [16, 6, 10], [D; 3]);
    let settings = pbf_of(&mut scene);
    (settings.cfl, settings.iteration, settings.stop) =
        (1.0, Iteration::RedBlack, Stop::Iterations(4));
    let speed = D / scene.shot.frame_seconds();
    close_in(&mut scene, &[(0, speed)]);
    let control = control(
        "pbf/compute_delta",
        "delta *= params.relaxation;",
        "delta *= 1.01 * params.relaxation;",
        "whole solve",
        &[
            "corrections, RMS error",
            "relative density, RMS error",
            "lambda, RMS error",
        ],
    );
    let sound = check_frame(&context, &scene, &start, 0, &start.particles).unwrap();
    assert!(over(&sound).is_empty(), "{}", lines(&sound));
    let mut spoiled = context.clone();
    spoiled.spoil = Some(control.spoil);
    let table = check_frame(&spoiled, &scene, &start, 0, &start.particles).unwrap();
    for &field in control.fields {
        assert!(
            over(&table).contains(&(control.pass, field)),
            "{}",
            lines(&table)
        );
    }
}

/// A plate within the water covers the faces of one plane and leaves the cells on both sides open:
/// nothing accelerates those faces.
#[test]
fn faces_that_a_plate_closes_are_within_tolerance() {
    let (mut scene, start) = tank(Method::Flip, 0.0);
    let velocity = start.particles.velocity;
    scene.effects = case(Method::Flip).0.effects;
    let cell = flip_of(&mut scene).cell_size;
    let at = 3.0 * cell;
    scene.solids[0].mesh = box_mesh(Bounds {
        min: DVec3::new(at - 0.4 * cell, -0.1, -0.1),
        max: DVec3::new(at + 0.4 * cell, 0.5, 1.3),
    });
    let mut start = Start::of(&scene).unwrap();
    for (v, moved) in start.particles.velocity.iter_mut().zip(velocity) {
        *v = moved;
    }
    let controls = [control(
        "effects/grid_confinement",
        "face_open[face] > 0.0",
        "face_open[face] >= 0.0",
        "effects/grid_confinement",
        &["velocity at faces"],
    )];
    last_substep_sees(&scene, &start, &controls);
}
