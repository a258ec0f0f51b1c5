//! Forces: free drops, weightless water, tilted surfaces, vortices and their angular momentum,
//! rooms and windows, and the work that they do.

use std::path::Path;

use glam::{DVec3, Vec3};
use swell::{
    domain::{
        boundary::Boundary,
        bounds::Bounds,
        budget::Watched,
        forces::Medium,
        particles::Particles,
        solver::{Solver, StepReport},
        sources::Window,
    },
    files::parse_scene,
    gpu::adapter::Context,
    scene::{Method, Scene, budget::Before, forces::PlacedForce},
    solve::plan::Plan,
    stage::{device::Opened, drive::Drive, prepare::Start},
};

use crate::support::{
    self, context, flip as of_flip,
    forces::{attract, in_box, in_mesh, law, push, vortex},
    solvers::{self, RATE, SOLVERS, scene},
};

const G: f64 = 9.81;

/// The GPU, and the reference.
fn devices(context: &Context) -> [Option<&Context>; 2] {
    [Some(context), None]
}

/// The state after `frames` frames, and the report of each.
fn run(
    context: Option<&Context>,
    scene: &Scene,
    particles: &Particles,
    frames: u32,
) -> (Particles, Vec<StepReport>) {
    let all = solvers::run(context, scene, particles, frames);
    let reports = all.iter().map(|(_, report)| report.clone()).collect();
    (all.into_iter().next_back().unwrap().0, reports)
}

fn velocity(state: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(state.velocity[k]).as_dvec3()
}

fn place(state: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(state.position[k]).as_dvec3()
}

fn work(reports: &[StepReport]) -> f64 {
    reports.iter().map(|report| report.boundary_work).sum()
}

/// Drops too far apart to interact.
fn drops() -> Particles {
    Particles {
        id: vec![0, 1],
        position: vec![[0.31, 2.52, 0.53], [1.17, 2.47, 0.91]],
        velocity: vec![[0.0; 3], [0.5, 1.0, 0.0]],
        ..Particles::default()
    }
}

/// Both the velocity, and the ledger: m a · (v before + v after) / 2 times the time is the change of
/// the kinetic energy without gravity, and the force's part of it with gravity.
#[test]
fn a_free_drop_gains_exactly_what_the_force_gives() {
    let context = context();
    let (a, seconds) = (DVec3::new(3.0, 5.0, -2.0), 20.0 / RATE);
    for solver in SOLVERS {
        for device in devices(&context) {
            for gravity in [DVec3::ZERO, -G * DVec3::Y] {
                let mut scene = scene(solver, [16.0, 32.0, 16.0]);
                scene.water.gravity = gravity;
                scene.forces = vec![push(a)];
                let (state, reports) = run(device, &scene, &drops(), 20);
                let mut expected = 0.0;
                for k in 0..2 {
                    let before = velocity(&drops(), k);
                    let after = before + (gravity + a) * seconds;
                    let off = (velocity(&state, k) - after).length();
                    // 20 frames of f32 sums, up to 32 substeps each, of 2 m/s at most.
                    assert!(off < 1e-5, "{solver:?} {gravity}: {off}");
                    expected += scene.particle_mass() * a.dot(0.5 * (before + after)) * seconds;
                }
                let found = work(&reports);
                assert!(
                    (found / expected - 1.0).abs() < 1e-5,
                    "{solver:?}: {found} {expected}"
                );
                // Negative control: without the force.
                scene.forces.clear();
                let (state, reports) = run(device, &scene, &drops(), 20);
                let fallen = velocity(&drops(), 1) + gravity * seconds;
                assert!((velocity(&state, 1) - fallen).length() < 1e-5);
                assert_eq!(work(&reports), 0.0);
            }
        }
    }
}

/// A force acts from `from` to `until`, whatever the frames and substeps are.
#[test]
fn a_window_gives_its_length_times_the_acceleration() {
    let context = context();
    // The stronger one shortens the substeps that it acts in.
    let cases = [
        (RATE, 12, 4.0, [0.0333, 0.0825]),
        (24.0, 6, 100.0, [0.085, 0.092]),
    ];
    for solver in SOLVERS {
        for device in devices(&context) {
            for (rate, frames, strength, [from, until]) in cases {
                let mut scene = scene(solver, [16.0, 32.0, 16.0]);
                scene.shot.frames_per_second = rate;
                scene.water.gravity = DVec3::ZERO;
                scene.forces = vec![push(strength * DVec3::X)];
                scene.forces[0].force.window = Window {
                    from,
                    until: Some(until),
                };
                let (state, _) = run(device, &scene, &drops(), frames);
                let gained = velocity(&state, 0).x;
                let expected = strength * (until - from);
                assert!(
                    (gained - expected).abs() < 1e-5 * strength,
                    "{solver:?}, {rate}: {gained} {expected}"
                );
            }
        }
    }
}

/// Water under a force that is the opposite of gravity stays where it is, in the air.
#[test]
fn a_force_against_gravity_makes_water_weightless() {
    let context = context();
    for solver in SOLVERS {
        let mut scene = scene(solver, [16.0, 16.0, 16.0]);
        let water = of_flip::block([4, 6, 4], [8, 4, 8]);
        let fastest = |scene: &Scene| {
            let (state, reports) = run(Some(&context), scene, &water, 20);
            (state.max_speed(), work(&reports))
        };
        scene.forces = vec![push(G * DVec3::Y)];
        let (speed, work) = fastest(&scene);
        println!("{solver:?}: {speed:.2e} m/s, {work:.2e} J");
        // g Δt rounds by 2⁻²⁴ of 0.1 m/s in each of some 40 substeps; a projection spreads it.
        assert!(speed < 1e-4, "{solver:?}: {speed}");
        // Negative control.
        scene.forces.clear();
        assert!(fastest(&scene).0 > 1.0);
    }
}

/// In a full box a uniform acceleration changes nothing but the pressure, by ρ a L.
#[test]
fn a_full_box_rests_under_a_force_and_its_pressure_balances_it() {
    let context = context();
    let a = 6.0;
    for solver in [SOLVERS[0], SOLVERS[1]] {
        let mut scene = scene(solver, [16.0, 8.0, 8.0]);
        let water = of_flip::block([0; 3], [16, 8, 8]);
        let points = [DVec3::new(0.35, 0.4, 0.4), DVec3::new(1.25, 0.4, 0.4)];
        let rise = |scene: &Scene| {
            let found = match scene.solver.method() {
                Method::Flip => {
                    let mut flip = of_flip::solver(&context, scene, &water);
                    let last = (0..4).map(|_| flip.advance().unwrap().0).last().unwrap();
                    (last, flip.pressures(&points).unwrap())
                }
                Method::Pbf => {
                    let mut pbf = support::solver(&context, scene, &water, &Boundary::default());
                    let last = (0..4).map(|_| pbf.advance().unwrap().0).last().unwrap();
                    (last, pbf.pressures(&points).unwrap())
                }
            };
            let (state, pressures) = found;
            let pressure = |k: usize| pressures[k].unwrap();
            (state.max_speed(), pressure(1) - pressure(0))
        };
        scene.forces = vec![push(a * DVec3::X)];
        let (speed, pressure) = rise(&scene);
        let expected = scene.water.rest_density * a * 0.9;
        println!("{solver:?}: {speed:.2e} m/s, {pressure} Pa of {expected}");
        // A tenth of a percent of the speed that free water would have.
        assert!(speed < 1e-3 * a * 4.0 / RATE, "{solver:?}: {speed}");
        assert!(
            (pressure / expected - 1.0).abs() < 1e-3,
            "{solver:?}: {pressure} of {expected}"
        );
        // Negative control.
        scene.forces.clear();
        assert!(rise(&scene).1.abs() < 1e-2 * expected);
    }
}

/// Heights of the water in the first and last two columns of cells along x.
fn heights(state: &Particles, cells: usize) -> [f64; 2] {
    let top = |from: f64, to: f64| {
        let there = state
            .position
            .iter()
            .filter(|x| (from..to).contains(&f64::from(x[0])));
        let volume = there.count() as f64 * (of_flip::DX / 2.0).powi(3);
        volume / ((to - from) * 4.0 * of_flip::DX)
    };
    let length = cells as f64 * of_flip::DX;
    [
        top(0.0, 2.0 * of_flip::DX),
        top(length - 2.0 * of_flip::DX, length),
    ]
}

/// Water that fills a box below a plane of slope −a/g stays below it under an acceleration a along
/// x; without it, it flows level.
#[test]
fn a_force_across_gravity_tilts_the_surface() {
    let context = context();
    let (cells, slope) = (16, 0.3);
    for solver in [SOLVERS[0], SOLVERS[1]] {
        let mut scene = scene(solver, [cells as f64, 12.0, 4.0]);
        let mut water = of_flip::block([0; 3], [cells, 12, 4]);
        let length = cells as f64 * of_flip::DX;
        let level = |x: f64| 0.5 + slope * (x - 0.5 * length);
        let kept: Vec<bool> = (water.position.iter())
            .map(|x| f64::from(x[1]) < level(f64::from(x[0])))
            .collect();
        water.retain(&kept);
        let expected = [level(of_flip::DX), level(length - of_flip::DX)];
        scene.forces = vec![push(slope * G * DVec3::X)];
        let (state, _) = run(Some(&context), &scene, &water, 60);
        let found = heights(&state, cells);
        println!("{solver:?}: {found:?}, expected {expected:?}");
        for (found, expected) in found.iter().zip(&expected) {
            assert!(
                (found - expected).abs() < 0.5 * of_flip::DX,
                "{solver:?}: {found}"
            );
        }
        // Negative control: half a period of the slow wave later it leans to the other side.
        scene.forces.clear();
        let (state, _) = run(Some(&context), &scene, &water, 60);
        let found = heights(&state, cells);
        assert!(
            found[0] - expected[0] > of_flip::DX,
            "{solver:?}: {found:?}"
        );
    }
}

/// Momentum per mass, and angular momentum per mass about a point, summed over particles.
fn momenta(state: &Particles, about: DVec3) -> [DVec3; 2] {
    let of = |k: usize| {
        let (x, v) = (place(state, k), velocity(state, k));
        [v, (x - about).cross(v)]
    };
    (0..state.len())
        .map(of)
        .fold([DVec3::ZERO; 2], |sum, of| [sum[0] + of[0], sum[1] + of[1]])
}

/// A vortex turns weightless water about its axis: the angular momentum along it rises as the
/// moment of the force says, the other components and the momentum stay 0, and so the axis stays.
#[test]
fn a_vortex_gives_its_moment_and_keeps_its_axis() {
    let context = context();
    let middle = DVec3::splat(0.8);
    let law = law(2.0, 0.2, 1);
    let frames = 4;
    for solver in SOLVERS {
        let mut scene = scene(solver, [16.0; 3]);
        scene.water.gravity = DVec3::ZERO;
        scene.forces = vec![vortex(middle, DVec3::Y, law)];
        let water = of_flip::block([4, 6, 4], [8, 4, 8]);
        let moment: f64 = (0..water.len())
            .map(|k| {
                let around = place(&water, k) - middle;
                let r = DVec3::new(around.x, 0.0, around.z).length();
                r * 2.0 * if r < 0.2 { r / 0.2 } else { 0.2 / r }
            })
            .sum();
        for device in devices(&context) {
            let (state, _) = run(device, &scene, &water, frames);
            let [momentum, spin] = momenta(&state, middle);
            let expected = moment * f64::from(frames) / RATE;
            println!("{solver:?}: spin {spin} of {expected}, momentum {momentum}");
            // The force is sampled at faces half a cell apart, and the PIC part smooths it.
            assert!(
                (spin.y / expected - 1.0).abs() < 0.03,
                "{solver:?}: {spin} {expected}"
            );
            assert!(
                spin.x.abs().max(spin.z.abs()) < 1e-3 * expected,
                "{solver:?}: {spin}"
            );
            assert!(
                momentum.length() < 1e-3 * expected / 0.3,
                "{solver:?}: {momentum}"
            );
        }
        // Negative control: the other way round.
        scene.forces[0] = vortex(middle, -DVec3::Y, law);
        let (state, _) = run(Some(&context), &scene, &water, frames);
        assert!(momenta(&state, middle)[1].y < 0.0);
    }
}

/// An attraction that is the same at any distance beyond its core is a fall of a t² / 2.
#[test]
fn an_attraction_pulls_a_drop_to_its_point_and_a_negative_one_pushes_it_away() {
    let context = context();
    for solver in SOLVERS {
        let [gpu, cpu] = devices(&context);
        for (strength, device) in [(2.0, gpu), (2.0, cpu), (-2.0, gpu)] {
            let mut scene = scene(solver, [16.0, 32.0, 16.0]);
            scene.water.gravity = DVec3::ZERO;
            let start = place(&drops(), 0);
            scene.forces = vec![attract(start + 3.0 * DVec3::X, law(strength, 0.1, 0))];
            let mut drop = drops();
            drop.retain(&[true, false]);
            let (state, reports) = run(device, &scene, &drop, 20);
            let (way, v) = (place(&state, 0) - start, velocity(&state, 0));
            let sign = strength.signum();
            assert!((v.x - strength * 0.2).abs() < 1e-5, "{solver:?}: {v}");
            // Half a substep of the velocity, by which positions and velocities are apart.
            let expected = 0.5 * strength * 0.04;
            assert!(
                (way.x - expected).abs() < 2.0 * 0.5 * 0.4 / RATE,
                "{solver:?}: {way}"
            );
            assert!(sign * way.x > 0.0 && way.y == 0.0 && way.z == 0.0);
            let energy = 0.5 * scene.particle_mass() * v.length_squared();
            assert!((work(&reports) / energy - 1.0).abs() < 1e-5, "{solver:?}");
        }
    }
}

/// A mesh, here a wedge of a box, and a box push what is in them.
#[test]
fn forces_act_in_their_room_only() {
    let context = context();
    let room = Bounds {
        min: DVec3::new(0.2, 2.0, 0.2),
        max: DVec3::new(0.6, 2.9, 0.9),
    };
    let force = push(5.0 * DVec3::Z);
    let spacing = of_flip::DX / 2.0;
    // The half of the room with x + z < 1.1 (from 0.4 to 1.5): its first drop is inside.
    let mut wedge = support::box_mesh(room);
    for vertex in &mut wedge.vertices {
        if vertex.x > 0.5 && vertex.z > 0.5 {
            *vertex = DVec3::new(0.4, vertex.y, 0.55);
        }
    }
    let rooms: [(&str, PlacedForce); 2] = [
        ("box", in_box(force.clone(), room, 0.0)),
        ("mesh", in_mesh(force, wedge, spacing, 0.0)),
    ];
    for solver in SOLVERS {
        for (name, force) in &rooms {
            for device in devices(&context) {
                let mut scene = scene(solver, [16.0, 32.0, 16.0]);
                scene.water.gravity = DVec3::ZERO;
                scene.forces = vec![force.clone()];
                let mut water = drops();
                water.velocity = vec![[0.0; 3]; 2];
                // In the box, and beyond the wedge's slope.
                water.position.push([0.57, 2.3, 0.85]);
                water.velocity.push([0.0; 3]);
                water.id.push(2);
                let (state, _) = run(device, &scene, &water, 4);
                let speeds = [0, 1, 2].map(|k| velocity(&state, k).z);
                println!("{solver:?} {name}: {speeds:?}");
                let far = if *name == "box" { 0.2 } else { 0.0 };
                for (found, expected) in speeds.into_iter().zip([0.2, 0.0, far]) {
                    assert!(
                        (found - expected).abs() < 1e-5,
                        "{solver:?} {name}: {speeds:?}"
                    );
                }
            }
        }
    }
}

/// A splash that a vortex and an attraction stir in a box: the energy rises by no more than the
/// work, of which the budget takes account.
#[test]
fn energy_rises_by_no_more_than_the_work_of_forces() {
    let context = context();
    for solver in SOLVERS {
        let mut scene = scene(solver, [12.0, 12.0, 12.0]);
        let middle = DVec3::splat(0.6);
        scene.forces = vec![
            vortex(middle, DVec3::Y, law(8.0, 0.3, 0)),
            push(DVec3::new(2.0, 12.0, 0.0)),
        ];
        let water = of_flip::block([0; 3], [12, 5, 12]);
        let (mut energy, mut missing) = (None, 0);
        let (_, reports) = run(Some(&context), &scene, &water, 20);
        for (frame, report) in (1..).zip(&reports) {
            let before = energy.unwrap_or_else(|| {
                let start = scene.report(&water, [].into_iter());
                scene.total_energy(water.len(), &start)
            });
            scene.budget.energy = Some(0.01);
            let state = Before {
                energy: before,
                ..Before::default()
            };
            let check = |report: &StepReport| {
                (scene.budget).check_frame(&scene, frame, water.len(), report, &state)
            };
            assert_eq!(check(report), Ok(()), "{solver:?}");
            // Negative control: without the work.
            let unpaid = StepReport {
                boundary_work: 0.0,
                ..report.clone()
            };
            missing += u32::from(check(&unpaid).is_err_and(|it| it.watched == Watched::Energy));
            energy = Some(scene.total_energy(water.len(), report));
        }
        println!("{solver:?}: {missing} frames exceed the budget without the work");
        assert!(missing > 5, "{solver:?}: {missing}");
    }
}

/// A force adds its passes and buffers to scenes that name one, and nothing to others.
#[test]
fn a_scene_that_names_no_force_pays_for_none() {
    let context = context();
    for solver in SOLVERS {
        let mut scene = scene(solver, [16.0, 8.0, 8.0]);
        let plan = |scene: &Scene| support::plan(&context, scene, 1000, &Boundary::default());
        let bare = plan(&scene);
        let mut of_whitewater = push(DVec3::X);
        of_whitewater.force.on = vec![Medium::Whitewater];
        scene.forces = vec![of_whitewater];
        assert_eq!(plan(&scene), bare);
        scene.forces = vec![push(DVec3::X)];
        let with = plan(&scene);
        let names = |plan: &Plan| -> Vec<&'static str> {
            let passes = plan.parts().flat_map(|part| &part.passes);
            passes.map(|pass| pass.spec.name).collect()
        };
        let mut added = names(&with);
        added.retain(|name| !names(&bare).contains(name));
        let expected: &[&str] = match solver.1 {
            true => &[
                "effects/push_faces",
                "effects/push_drops",
                "effects/work_by_cells",
            ],
            false => &["effects/push_particles", "effects/work_by_particles"],
        };
        assert_eq!(added, expected);
        let owners = |plan: &Plan| plan.shares(&[]).iter().any(|share| share.owner == "forces");
        assert!(owners(&with) && !owners(&bare));
    }
}

/// Water on a slope of 1 in 4 off the lattice, before a wall that moves, after half a second of this
/// gravity and this force: the mean position of its particles, metres.
fn beside_slope_and_maker(opened: &Opened, method: Method, gravity: DVec3, force: DVec3) -> DVec3 {
    let text = format!(
        "[shot]\nname = \"equal\"\nframes = 12\nframes_per_second = 24\n\
         [domain]\nmin = [0, 0, 0]\nmax = [1.4, 0.8, 0.48]\n\
         [water]\ngravity = {:?}\n\
         [[water.block]]\nmin = [0, 0, 0]\nmax = [1.4, 0.4, 0.48]\n\
         [[solid]]\nmesh = \"box.obj\"\ntranslate = [1.17, -0.1697, 0.35]\n\
         rotate_degrees = [0, 0, 14.03624]\nscale = [2.4, 0.8, 1]\n\
         [[wave_maker]]\nwall = \"-x\"\n\
         motion = {{ kind = \"sine\", stroke = 0.1, period = 1.0 }}\n\
         [[force]]\nkind = \"acceleration\"\nacceleration = {:?}\n\
         [solver]\nmethod = \"{}\"\n[solver.flip]\ncell_size = 0.06\n\
         [solver.pbf]\nparticle_spacing = 0.03\n",
        gravity.to_array(),
        force.to_array(),
        method.name(),
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hard_cases");
    let scene = parse_scene(&text, Path::new("equal.toml"), &folder, &[]).unwrap();
    let start = Start::of(&scene).unwrap();
    let mut drive = Drive::new(opened, &scene, &start, false).unwrap();
    let state = (0..12).map(|_| drive.advance().unwrap().particles).last();
    let position = state.unwrap().position;
    let sum: DVec3 = position
        .iter()
        .map(|x| Vec3::from_array(*x).as_dvec3())
        .sum();
    sum / position.len() as f64
}

/// A force everywhere is as good as gravity, also on a slope and at a wall that moves. Only the
/// friction of films on solids, which gravity alone presses on, tells them apart.
#[test]
fn a_force_everywhere_does_what_gravity_does() {
    let context: &Context = &context();
    let opened = Opened::Gpu(Box::new(context.clone()));
    let (down, aside) = (-G * DVec3::Y, DVec3::new(-1.5, 0.0, 0.7));
    for method in [Method::Flip, Method::Pbf] {
        let mean = |gravity, force| beside_slope_and_maker(&opened, method, gravity, force);
        let rest = mean(down, DVec3::ZERO);
        let by_gravity = mean(down + aside, DVec3::ZERO);
        let way = (by_gravity - rest).length();
        let apart = |part: f64| (mean(down, part * aside) - by_gravity).length() / way;
        let [exact, more] = [1.0, 1.02].map(apart);
        println!("{method:?}: {way:.4} m, {exact:.1e}, with 2 % more {more:.1e}");
        assert!(way > 0.05 && exact < 0.005, "{method:?}: {way} {exact}");
        // Negative control.
        assert!(more > 0.01, "{method:?}: {more}");
    }
}
