//! Solids that move through FLIP's water: the cells that they cut, particles that stay outside, and
//! the volume that they displace.

use std::{collections::BTreeMap, path::Path};
use swell::files::parse_scene;
use swell::files::scene_to_toml;

use crate::support::{self, box_mesh, context, flip_of, lattice, mover};
use glam::{DVec3, Vec3};
use swell::{
    domain::{
        boundary::Boundary, bounds::Bounds, motion::Motion, particles::Particles,
        signed_distance::SignedDistance, solver::Solver, surface::Raster,
    },
    gpu::adapter::Context,
    scene::{
        Scene,
        flip::{Flip as Settings, Precision, Preconditioner, Pressure, Surface, Transfer},
        moving_solid::MovingSolid,
    },
    solve::{
        flip::{
            Flip,
            buffers::{CLOSED_VELOCITY, FACE_OPEN, SOLID_FLUX},
            capacity,
        },
        plan::{Counts, Plan, device_limits},
    },
};

/// Cell size, metres.
const DX: f64 = 0.1;

fn scene(cells: [f64; 3]) -> Scene {
    let mut scene = support::scene(cells.map(|n| n * DX));
    scene.solver = swell::scene::Solver::Flip(Settings {
        cell_size: DX,
        particles_per_cell: 8,
        transfer: Transfer::Flip,
        pic_blend: 0.05,
        cfl: 2.0,
        max_substeps: 64,
        surface: Surface::GhostFluid,
        density_correction: true,
        band: None,
        pressure: Pressure {
            preconditioner: Preconditioner::Multigrid,
            precision: Precision::F32Refined,
            tolerance: 1e-5,
            max_iterations: 400,
        },
    });
    scene
}

fn boundary(scene: &Scene) -> Boundary {
    let distance = |solid: &MovingSolid| {
        let bounds = solid.placed.mesh.bounds().unwrap().grown(2.0 * DX);
        SignedDistance::from_mesh(&solid.placed.mesh, &bounds, 0.5 * DX).unwrap()
    };
    Boundary {
        moving: scene.moving_solids.iter().map(distance).collect(),
        ..Boundary::default()
    }
}

fn solver(context: &Context, scene: &Scene, particles: &Particles) -> Flip {
    let boundary = boundary(scene);
    let counts = Counts {
        particles: particles.len(),
        bricks: capacity(&scene.with_flip().unwrap(), particles),
        ..Counts::of_solids(&boundary)
    };
    let plan = Plan::new(scene, counts, device_limits(context));
    Flip::new(context, &scene.with_flip().unwrap(), plan, &boundary, false).unwrap()
}

/// Water in cells `from` to `to`, without what is inside `solid` or closer to it than half a
/// particle spacing.
fn water(from: [usize; 3], to: [usize; 3], solid: Bounds) -> Particles {
    let counts: [usize; 3] = std::array::from_fn(|axis| 2 * (to[axis] - from[axis]));
    let all = lattice(from.map(|c| c as f64 * DX), counts, [DX / 2.0; 3]);
    let kept = all
        .position
        .iter()
        .filter(|p| box_distance(place(p), solid) > 0.25 * DX);
    let position: Vec<_> = kept.copied().collect();
    Particles {
        velocity: vec![[0.0; 3]; position.len()],
        id: (0..position.len() as u32).collect(),
        position,
        ..Particles::default()
    }
}

fn place(p: &[f32; 3]) -> DVec3 {
    Vec3::from_array(*p).as_dvec3()
}

fn box_distance(p: DVec3, bounds: Bounds) -> f64 {
    let q = (p - 0.5 * (bounds.min + bounds.max)).abs() - 0.5 * bounds.size();
    q.max(DVec3::ZERO).length() + q.max_element().min(0.0)
}

fn moved(bounds: Bounds, by: DVec3) -> Bounds {
    Bounds {
        min: bounds.min + by,
        max: bounds.max + by,
    }
}

/// A box in general position.
const BOX: Bounds = Bounds {
    min: DVec3::new(0.53, 0.42, 0.47),
    max: DVec3::new(0.96, 0.85, 1.12),
};

#[test]
fn a_moving_box_cuts_cells_where_it_stands_and_pushes_through_its_faces() {
    let context = context();
    let mut scene = scene([16.0; 3]);
    scene.water.gravity = DVec3::ZERO;
    let motion = Motion::ConstantVelocity {
        velocity: 0.7,
        until: None,
    };
    scene.moving_solids = vec![mover(BOX, DVec3::X * 3.0, motion)];
    // After a quarter of a second the box has moved by 17.5 cm.
    let now = moved(BOX, DVec3::X * 0.175);
    let particles = water([0; 3], [16; 3], now);
    let mut solver = solver(&context, &scene, &particles);
    solver.load(25, &particles).unwrap();
    let (_, report) = solver.advance().unwrap();
    assert_eq!(report.substeps, 1);

    let bricks = solver.bricks().clone();
    let stride = solver.plan().counts.bricks.slots * 512;
    let open = solver.field(FACE_OPEN, 3 * stride).unwrap();
    let flux = solver.field(SOLID_FLUX, stride).unwrap();
    let closed = solver.field(CLOSED_VELOCITY, 3 * stride).unwrap();
    let dims = bricks.table_dims.map(|n| n as usize);
    let element = |x: usize, y: usize, z: usize| {
        let slot = bricks.table[(z / 8 * dims[1] + y / 8) * dims[0] + x / 8] as usize;
        512 * slot + x % 8 + 8 * (y % 8) + 64 * (z % 8)
    };
    let cells = || (0..16 * 16 * 16).map(|n| [n % 16, n / 16 % 16, n / 256]);

    // The closed part of each plane of x-faces is the box's cross-section there, 0.43 m by 0.65 m.
    // A plane is fitted to each face's corners: a corner of the box within a face is cut off, by a
    // quarter of the face at most.
    let section = |x: usize| -> f64 {
        let all = cells().filter(|c| c[0] == x);
        all.map(|[x, y, z]| 1.0 - f64::from(open[element(x, y, z)]))
            .sum::<f64>()
            * DX
            * DX
    };
    let area = 0.43 * 0.65;
    for x in 2..15 {
        let at = x as f64 * DX;
        let is_through = at > now.min.x + DX && at < now.max.x - DX;
        let is_clear = at < now.min.x - DX || at > now.max.x + DX;
        if is_through {
            assert!(
                (section(x) - area).abs() < 4.0 * 0.25 * DX * DX,
                "{x}: {}",
                section(x)
            );
        } else if is_clear {
            assert_eq!(section(x), 0.0, "{x}");
        }
    }
    // The volume pushed out in front flows in behind: the section times the speed.
    let pushed = |from: usize, to: usize| -> f64 {
        let half = cells().filter(|c| (from..to).contains(&c[0]));
        half.map(|[x, y, z]| f64::from(flux[element(x, y, z)]))
            .sum::<f64>()
            * DX
            * DX
    };
    let (behind, before) = (pushed(0, 9), pushed(9, 16));
    let through = 0.7 * section(9);
    assert!(
        (behind - through).abs() < 1e-5 * through && (behind + before).abs() < 1e-5 * through,
        "{behind} {before}"
    );
    for [x, y, z] in cells() {
        let e = element(x, y, z);
        for axis in 0..3 {
            let face = axis * stride + e;
            let is_of_box = open[face] == 0.0 && [x, y, z][axis] > 0;
            if is_of_box {
                let expected = if axis == 0 { 0.7 } else { 0.0 };
                assert!(
                    (closed[face] - expected).abs() < 1e-5,
                    "{x} {y} {z} {axis}: {}",
                    closed[face]
                );
            }
        }
    }
    // Control: a box at rest pushes nothing.
    scene.moving_solids[0].slide.as_mut().unwrap().motion = Motion::ConstantVelocity {
        velocity: 0.7,
        until: Some(0.25),
    };
    let mut solver = self::solver(&context, &scene, &particles);
    solver.load(25, &particles).unwrap();
    solver.advance().unwrap();
    let flux = solver.field(SOLID_FLUX, stride).unwrap();
    assert!(flux.iter().all(|&f| f == 0.0));
}

/// Least distance of a particle to the box, m; negative inside.
fn nearest(state: &Particles, bounds: Bounds) -> f64 {
    let all = state
        .position
        .iter()
        .map(|p| box_distance(place(p), bounds));
    all.fold(f64::INFINITY, f64::min)
}

#[test]
fn nothing_ends_within_a_box_faster_than_the_cfl_limit() {
    let context = context();
    let mut scene = scene([24.0, 12.0, 12.0]);
    scene.water.gravity = DVec3::ZERO;
    let start = Bounds {
        min: DVec3::splat(0.31),
        max: DVec3::splat(0.72),
    };
    // 12 m/s at 100 frames a second: 1.2 cells a frame, with cfl 0.5.
    flip_of(&mut scene).cfl = 0.5;
    let motion = Motion::ConstantVelocity {
        velocity: 12.0,
        until: None,
    };
    scene.moving_solids = vec![mover(start, DVec3::new(1.0, 0.1, 0.0), motion)];
    let particles = water([0; 3], [24, 12, 12], start);
    let mut solver = solver(&context, &scene, &particles);
    solver.load(0, &particles).unwrap();
    let mut state = particles.clone();
    for frame in 1..=10 {
        let (next, report) = solver.advance().unwrap();
        state = next;
        assert!(report.substeps >= 3, "{}", report.substeps);
        let by = scene.moving_solids[0]
            .pose(&[], f64::from(frame) / 100.0)
            .centre;
        // Particles keep a tenth of their spacing; the trilinear distance is short by less than
        // that at an edge.
        let least = nearest(&state, moved(start, by));
        assert!(least > -0.1 * DX, "frame {frame}: {least}");
    }
    // Control: at the start there is water at the final position of the box.
    assert!(nearest(&particles, moved(start, DVec3::new(1.19, 0.119, 0.0))) < -0.1);
    assert_eq!(state.len(), particles.len());
}

/// A moving box pushes a drop ahead of it. At the end of each substep the drop is in front of the
/// box's current face, at the contact distance. Sampled distances are exact in front of a flat
/// face.
#[test]
fn a_box_takes_a_drop_along_as_far_as_it_goes() {
    let context = context();
    let mut scene = scene([16.0; 3]);
    scene.water.gravity = DVec3::ZERO;
    let motion = Motion::ConstantVelocity {
        velocity: 5.0,
        until: None,
    };
    scene.moving_solids = vec![mover(BOX, DVec3::X, motion)];
    let drop = Particles {
        position: vec![[0.99, 0.63, 0.79]],
        velocity: vec![[0.0; 3]],
        id: vec![0],
        ..Particles::default()
    };
    let mut solver = solver(&context, &scene, &drop);
    solver.load(0, &drop).unwrap();
    for frame in 1..=3u32 {
        let (state, report) = solver.advance().unwrap();
        assert_eq!(report.substeps, 1);
        let by = DVec3::X * 0.05 * f64::from(frame);
        let apart = box_distance(place(&state.position[0]), moved(BOX, by));
        // A tenth of the particles' spacing; positions of up to 2 m are rounded some ten times.
        let kept = 0.1 * 0.5 * DX;
        assert!((apart - kept).abs() < 10.0 * 1.2e-7, "{frame}: {apart}");
    }
}

/// Mean height of the water's surface over columns at least a cell away from the box in plan view,
/// m.
fn level(state: &Particles, bounds: Bounds, cells: [i32; 3]) -> f64 {
    let raster = Raster {
        origin: DVec3::ZERO,
        voxel_size: DX,
        particle_spacing: DX / 2.0,
    };
    let surface = raster.surface(state);
    let mut distance = BTreeMap::new();
    for leaf in &surface.leaves {
        for element in (0..512).filter(|&e| leaf.is_active(e)) {
            distance.insert(leaf.voxel(element), f64::from(leaf.values[element]));
        }
    }
    let (mut sum, mut columns) = (0.0, 0.0);
    for (x, z) in (0..cells[0]).flat_map(|x| (0..cells[2]).map(move |z| (x, z))) {
        let middle = DX * DVec3::new(f64::from(x) + 0.5, 0.0, f64::from(z) + 0.5);
        let beside = (middle - 0.5 * (bounds.min + bounds.max)).abs() - 0.5 * bounds.size();
        if beside.x.max(beside.z) < DX {
            continue;
        }
        let top = (0..cells[1]).rev().find_map(|y| {
            let (below, above) = (distance.get(&[x, y, z])?, distance.get(&[x, y + 1, z])?);
            let crosses = *below < 0.0 && *above >= 0.0;
            crosses.then(|| DX * (f64::from(y) + 0.5 + below / (below - above)))
        });
        sum += top.expect("a surface in each column");
        columns += 1.0;
    }
    sum / columns
}

#[test]
fn a_box_that_dips_into_a_tank_lifts_its_water_by_what_it_displaces() {
    let context = context();
    let mut scene = scene([16.0, 16.0, 16.0]);
    scene.shot.frames_per_second = 50.0;
    // From just above the water, which is 0.8 m deep, 0.35 m down within 0.7 s.
    let start = Bounds {
        min: DVec3::new(0.5, 0.82, 0.5),
        max: DVec3::new(1.1, 1.42, 1.1),
    };
    let motion = Motion::ConstantVelocity {
        velocity: 0.5,
        until: Some(0.7),
    };
    scene.moving_solids = vec![mover(start, -DVec3::Y, motion)];
    let particles = water([0; 3], [16, 8, 16], start);
    let run = |scene: &Scene| {
        let mut solver = solver(&context, scene, &particles);
        solver.load(0, &particles).unwrap();
        let frames = (0..40).map(|_| {
            let (state, report) = solver.advance().unwrap();
            let projection = report.projection.unwrap();
            assert_eq!((projection.missed, projection.pockets), (0, 0));
            let most = 1e-3 * projection.divergence_before.max(1.0);
            assert!(projection.divergence_after < most, "{projection:?}");
            state
        });
        frames.collect::<Vec<_>>()
    };
    let states = run(&scene);
    let (twentieth, next, state) = (&states[19], &states[20], &states[39]);
    // The solid's position follows from the frame number: a run resumed at frame 20 gives the same
    // result.
    let mut resumed = solver(&context, &scene, &particles);
    resumed.load(20, twentieth).unwrap();
    assert_eq!(&resumed.advance().unwrap().0, next);
    let end = moved(start, scene.moving_solids[0].pose(&[], 0.8).centre);
    assert!((end.min.y - 0.47).abs() < 1e-9);
    assert!(nearest(state, end) > -0.1 * DX);
    // Volume: 2.56 L − 0.36 (L − 0.47) = 2.56 · 0.8.
    let expected = (2.56 * 0.8 - 0.36 * 0.47) / (2.56 - 0.36);
    let (before, after) = (level(&particles, end, [16; 3]), level(state, end, [16; 3]));
    println!("{before} {after}, expected {expected}");
    // A tenth of a cell: the error of the surface of jittered particles relative to that of a
    // lattice.
    assert!((before - 0.8).abs() < 0.1 * DX && (after - expected).abs() < 0.1 * DX);
    // Control: without the box the level stays.
    scene.moving_solids.clear();
    let still = level(&run(&scene)[39], end, [16; 3]);
    assert!(
        (still - 0.8).abs() < 0.1 * DX && (still - expected).abs() > 0.3 * DX,
        "{still}"
    );
}

#[test]
fn scenes_without_moving_solids_have_nothing_for_them() {
    let context = context();
    let mut scene = scene([8.0; 3]);
    let particles = water([0; 3], [4; 3], BOX);
    let names = |scene: &Scene, boundary: &Boundary| {
        let counts = Counts {
            particles: particles.len(),
            bricks: capacity(&scene.with_flip().unwrap(), &particles),
            ..Counts::of_solids(boundary)
        };
        let plan = Plan::new(scene, counts, device_limits(&context));
        let is_moving = plan
            .passes
            .iter()
            .any(|p| p.spec.defines.contains(&"MOVING_SOLIDS"));
        let buffers: Vec<_> = plan.buffers.into_iter().map(|b| b.spec.name).collect();
        let has = |name: &str| buffers.iter().any(|b| b == name);
        (
            is_moving,
            has("posed_solids"),
            has("closed_velocity"),
            has("solid_grid"),
        )
    };
    let mesh = box_mesh(BOX);
    let distance = SignedDistance::from_mesh(&mesh, &BOX.grown(0.2), 0.05).unwrap();
    let standing = Boundary {
        distance: Some(distance),
        ..Boundary::default()
    };
    assert_eq!(
        names(&scene, &Boundary::default()),
        (false, false, false, false)
    );
    assert_eq!(names(&scene, &standing), (false, false, false, true));
    let motion = Motion::Sine {
        stroke: 0.1,
        period: 1.0,
        ramp: 1.0,
    };
    scene.moving_solids = vec![mover(BOX, DVec3::Y, motion)];
    assert_eq!(names(&scene, &boundary(&scene)), (true, true, true, false));
}

const SCENE: &str = r#"
[shot]
name = "ram"
frames = 48
frames_per_second = 24
[domain]
min = [0, 0, 0]
max = [4, 2, 2]
[[water.block]]
min = [0, 0, 0]
max = [4, 1, 2]
[[solid]]
mesh = "box.obj"
direction = [0, -2, 0]
motion = { kind = "sine", stroke = 0.5, period = 2.0 }
[solver]
method = "flip"
[solver.flip]
cell_size = 0.2
[solver.pbf]
particle_spacing = 0.1
"#;

const OBJ: &str = "v 1 1 1\nv 2 1 1\nv 1 2 1\nv 2 2 1\nv 1 1 2\nv 2 1 2\nv 1 2 2\nv 2 2 2\n\
    f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";

#[test]
fn scenes_say_where_solids_go() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("box.obj"), OBJ).unwrap();
    let parse = |text: &str, set: &[&str]| {
        let set: Vec<_> = set.iter().map(|&s| s.to_owned()).collect();
        parse_scene(text, Path::new("a.toml"), dir.path(), &set)
    };
    let scene = parse(SCENE, &[]).unwrap();
    assert!(scene.solids.is_empty());
    let solid = &scene.moving_solids[0];
    assert!((solid.pose(&[], 3.0).centre - DVec3::new(0.0, -0.5, 0.0)).length() < 1e-12);
    assert_eq!(scene.mesh_files().len(), 1);
    let written = scene_to_toml(&scene, &|_, _| "box.obj".into());
    assert_eq!(parse(&written, &[]).unwrap(), scene);
    // The motion is part of the physics hash.
    let other = parse(SCENE, &["solid[0].motion.stroke=0.4"]).unwrap();
    assert_ne!(
        swell::files::physics_hash(&scene),
        swell::files::physics_hash(&other)
    );

    for (set, key, words) in [
        (
            &["solid[0].direction=[0, 0, 0]"][..],
            "solid[0].direction",
            "no direction",
        ),
        (
            &["solid[0].direction=[0, nan, 0]"],
            "solid[0].direction",
            "out of range",
        ),
        (
            &["solid[0].motion.stroke=50"],
            "solid[0].motion",
            "moves 50 m",
        ),
        (
            &["solid[0].translate=[9, 0, 0]"],
            "solid[0].motion",
            "never enters the domain",
        ),
        (
            &["solid[0].motion={kind=\"solitary\", height=0.1, depth=1}"],
            "solid[0].motion.kind",
            "made by a wall",
        ),
        (
            &["solid[0].motion={kind=\"sine\", period=1}"],
            "solid[0].motion.stroke",
            "missing",
        ),
    ] {
        let error = parse(SCENE, set).unwrap_err().to_string();
        assert!(
            error.contains(key) && error.contains(words),
            "{set:?}: {error}"
        );
    }
    // The solid also rotates, about an axis that moves with it, or without translating.
    const TURN: &[&str] = &[
        "solid[0].pivot=[1.5, 1, 1.5]",
        "solid[0].axis=[0, 0, -1]",
        "solid[0].turn={ kind = \"table\", points = [[0, 0], [1, 90], [2, -30]] }",
    ];
    let both = parse(SCENE, TURN).unwrap();
    let solid = &both.moving_solids[0];
    // After a second, halfway through the ramp, the solid is at half of its stroke, 0.25 m down,
    // and a point to the right of the pivot has moved below it.
    let at = solid.pose(&[], 1.0).place(DVec3::new(2.0, 1.0, 1.5));
    assert!((at - DVec3::new(1.5, 0.25, 1.5)).length() < 1e-12, "{at}");
    assert!(
        solid.peak_speed(&[], 0.0, 2.0)
            > both.moving_solids[0]
                .slide
                .as_ref()
                .unwrap()
                .motion
                .peak_speed(0.0, 2.0)
    );
    let written = scene_to_toml(&both, &|_, _| "box.obj".into());
    assert_eq!(parse(&written, &[]).unwrap(), both);
    let alone: String = SCENE
        .lines()
        .filter(|line| !line.starts_with("direction =") && !line.starts_with("motion ="))
        .map(|line| format!("{line}\n"))
        .collect();
    let swing = "solid[0].turn={ kind = \"sine\", swing_degrees = 40, period = 2 }";
    let swings = parse(&alone, &[TURN[0], TURN[1], swing]).unwrap();
    let written = scene_to_toml(&swings, &|_, _| "box.obj".into());
    assert!(
        written.contains("swing_degrees = 40") && !written.contains("stroke"),
        "{written}"
    );
    assert_eq!(parse(&written, &[]).unwrap(), swings);
    for (set, key, words) in [
        (&TURN[..2], "solid[0].", "given without turn"),
        (&[TURN[0], TURN[2]], "solid[0].", "given without axis"),
        (
            &[TURN[0], TURN[2], "solid[0].axis=[0, 0, 0]"],
            "solid[0].axis",
            "no direction",
        ),
        (
            &[
                TURN[0],
                TURN[1],
                "solid[0].turn={ kind = \"constant_velocity\", degrees_per_second = 1e8 }",
            ],
            "solid[0].turn",
            "it moves at",
        ),
        (
            &[
                "solid[0].pivot=[90, 1, 1.5]",
                "solid[0].translate=[88, 0, 0]",
                TURN[1],
                swing,
            ],
            "solid[0].turn",
            "never enters the domain",
        ),
    ] {
        let error = parse(&alone, set).unwrap_err().to_string();
        assert!(
            error.contains(key) && error.contains(words),
            "{set:?}: {error}"
        );
    }
    for key in ["direction", "motion"] {
        let without: String = SCENE
            .lines()
            .filter(|line| !line.starts_with(&format!("{key} =")))
            .map(|line| format!("{line}\n"))
            .collect();
        let error = parse(&without, &[]).unwrap_err().to_string();
        assert!(error.contains(&format!("given without {key}")), "{error}");
    }
}
