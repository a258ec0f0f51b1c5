//! PBF with a grid projection that makes velocities divergence-free: water at rest, waves and
//! walls, on the GPU and in f64, compared with PBF without it.

use std::f64::consts::{PI, TAU};
use swell::files::load_scene;

use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary,
        motion::Motion,
        particles::Particles,
        solver::{Solver, StepReport},
    },
    gpu::adapter::{Context, InjectedFault},
    reference,
    scene::{Iteration, Scene, Wall, WaveMaker},
    solve::{pbf, plan::Plan},
    study::waves,
};

use crate::support::*;

const GRAVITY: f64 = 9.81;

fn projected(size: [f64; 3], frames_per_second: f64) -> Scene {
    let mut scene = scene(size);
    scene.shot.frames_per_second = frames_per_second;
    pbf_of(&mut scene).grid_projection = true;
    scene
}

fn without(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    pbf_of(&mut scene).grid_projection = false;
    scene
}

fn on_gpu(scene: &Scene, particles: &Particles) -> pbf::Pbf {
    solver(&context(), scene, particles, &Boundary::default())
}

fn in_f64(scene: &Scene, particles: &Particles) -> reference::pbf::Pbf {
    let mut solver = reference::pbf::Pbf::new(&scene.with_pbf().unwrap(), &Boundary::default());
    solver.load(0, particles).unwrap();
    solver
}

/// A tank 8 × 8 particles wide and `layers` layers deep, at 60 frames a second.
fn tank(layers: usize) -> (Scene, Particles) {
    let scene = projected([0.8, layers as f64 * D + 1.0, 0.8], 60.0);
    (scene, lattice([0.0; 3], [8, layers, 8], [D; 3]))
}

/// Returns the largest particle speed in the frames after `settled`, m/s, the largest mean
/// compression, and pressures over ρ g depth.
fn at_rest<S: Solver>(
    mut solver: S,
    layers: usize,
    frames: u32,
    settled: u32,
) -> (f64, f64, Vec<f64>)
where
    S::Error: std::fmt::Debug,
{
    let (mut speed, mut compression) = (0.0f64, 0.0f64);
    for frame in 1..=frames {
        let (_, report) = solver.advance().unwrap();
        compression = compression.max(report.density_error_mean);
        if frame > settled {
            speed = speed.max(report.max_speed);
        }
    }
    let depth = layers as f64 * D;
    let points: Vec<DVec3> = [0.0, 0.2, 0.4, 0.6, 0.8]
        .map(|part| DVec3::new(0.4, part * depth, 0.4))
        .to_vec();
    let pressures = solver.pressures(&points).unwrap();
    let ratio = |(at, p): (&DVec3, &Option<f64>)| {
        p.expect("water there") / (1000.0 * GRAVITY * (depth - at.y))
    };
    let ratios = points.iter().zip(&pressures).map(ratio).collect();
    (speed, compression, ratios)
}

/// Largest speed of water at rest after a second, m/s. In the first frames the lattice fills its
/// gaps at walls.
const STILL: f64 = 0.02;

/// Relative to ρ g depth. The least depth of the surface, 0.02 cells, is 0.4 % for the uppermost
/// probe of 10 layers.
const PRESSURE: f64 = 0.02;

fn assert_still((speed, compression, ratios): (f64, f64, Vec<f64>), name: &str) {
    assert!(speed < STILL, "{name}: {speed} m/s");
    assert!(compression < 0.005, "{name}: {compression}");
    assert_eq!(ratios.len(), 5);
    for ratio in ratios {
        assert!((ratio - 1.0).abs() < PRESSURE, "{name}: {ratio}");
    }
}

#[test]
fn tanks_of_any_depth_stand_still_and_weigh_what_water_weighs() {
    for layers in [10, 20, 40, 80] {
        let (scene, particles) = tank(layers);
        let solver = on_gpu(&scene, &particles);
        assert_still(at_rest(solver, layers, 72, 60), &format!("{layers} layers"));
    }
    let (scene, particles) = tank(20);
    assert_still(at_rest(in_f64(&scene, &particles), 20, 66, 60), "f64");
    // Negative control: iterations without the projection carry pressure by one layer each.
    let mut alone = on_gpu(&without(&scene), &particles);
    let speeds = (1..=66).map(|_| alone.advance().unwrap().1.max_speed);
    let late = speeds.skip(60).fold(0.0, f64::max);
    assert!(late > 10.0 * STILL, "{late} m/s");
}

/// The projection's impulse divided by the time over which it acts, which includes half of the
/// previous substep, gives the pressure.
#[test]
fn pressures_are_those_of_the_weight_after_a_substep_of_any_length() {
    let (scene, mut particles) = tank(10);
    for before in [0.25, 1.0, 4.0] {
        particles.substep = before * scene.shot.frame_seconds();
        for (name, found) in [
            ("GPU", at_rest(on_gpu(&scene, &particles), 10, 1, 1).2),
            ("f64", at_rest(in_f64(&scene, &particles), 10, 1, 1).2),
        ] {
            assert_eq!(found.len(), 5);
            for ratio in found {
                assert!((ratio - 1.0).abs() < PRESSURE, "{name}, {before}: {ratio}");
            }
        }
    }
}

/// Water 20 layers deep with the velocities of a standing wave, half a wavelength per box, ω² = g k
/// tanh kh; and the wave's period, s.
fn wave() -> (Scene, Particles, f64) {
    let (length, depth) = (4.0, 2.0);
    let scene = projected([length, 3.0, 0.4], 60.0);
    let mut particles = lattice([0.0; 3], [40, 20, 4], [D; 3]);
    let k = PI / length;
    for (x, v) in particles.position.iter().zip(&mut particles.velocity) {
        let (kx, ky) = (k * f64::from(x[0]), k * f64::from(x[1]));
        let scale = 0.3 / (k * depth).sinh();
        *v = [
            (scale * kx.sin() * ky.cosh()) as f32,
            (-scale * kx.cos() * ky.sinh()) as f32,
            0.0,
        ];
    }
    let period = TAU / (GRAVITY * k * (k * depth).tanh()).sqrt();
    (scene, particles, period)
}

/// Period over theory's, and amplitude of the third period over that of the first, both of the
/// first mode of the particles' positions.
fn swing(scene: &Scene, particles: &Particles, period: f64) -> (Option<f64>, f64) {
    let mut solver = on_gpu(scene, particles);
    let k = PI / scene.domain.max.x;
    let rate = scene.shot.frames_per_second;
    let frames = (3.2 * period * rate).ceil() as u32;
    let mode = |state: &Particles| {
        let terms = state.position.iter().map(|x| (k * f64::from(x[0])).cos());
        terms.sum::<f64>() / state.len() as f64
    };
    let samples: Vec<(f64, f64)> = (1..=frames)
        .map(|frame| (f64::from(frame) / rate, mode(&solver.advance().unwrap().0)))
        .collect();
    let largest = |from: f64| {
        let within = samples
            .iter()
            .filter(|(t, _)| (from..from + 1.0).contains(&(t / period)));
        within.map(|(_, a)| a.abs()).fold(0.0, f64::max)
    };
    let (first, third) = (largest(0.0), largest(2.2));
    let found = waves::period(&samples, 0.2 * first).map(|found| found / period);
    (found, third / first)
}

#[test]
fn a_standing_wave_keeps_its_height_and_its_period() {
    let (scene, particles, period) = wave();
    let (found, left) = swing(&scene, &particles, period);
    let found = found.expect("a wave that swings");
    assert!((found - 1.0).abs() < 0.02, "{found} of the period");
    assert!(left > 0.6, "{left} left after three periods");
    // Negative control: without the projection.
    let (_, left) = swing(&without(&scene), &particles, period);
    assert!(left < 0.5, "{left}");
}

/// In some frames the swing requires two substeps and in others one; its height is as with equal
/// substeps.
#[test]
fn a_standing_wave_that_decides_on_its_substeps_keeps_its_height() {
    let (mut scene, particles, period) = wave();
    scene.shot.frames_per_second = 24.0;
    let mut left = |cfl: f64| {
        pbf_of(&mut scene).cfl = cfl;
        swing(&scene, &particles, period).1
    };
    // (0.2 m/s + g / 24) / 24 is a quarter of a spacing; at up to 0.3 m/s it is 0.3 of one.
    let (equal, changing) = (left(1.0), left(0.254));
    println!("{equal} left in equal substeps, {changing} where they change");
    assert!((changing / equal - 1.0).abs() < 0.05, "{changing} {equal}");
}

/// Water that a wall pushes into a heap, and drops.
fn pushed() -> (Scene, Particles) {
    let mut scene = projected([2.4, 2.0, 0.6], 60.0);
    scene.wave_makers.push(WaveMaker {
        absorption: None,
        wall: Wall::NAMED[0].1,
        motion: Motion::ConstantVelocity {
            velocity: 1.5,
            until: Some(0.4),
        },
    });
    let mut particles = lattice([0.0; 3], [24, 6, 6], [D; 3]);
    let drops = lattice([1.0, 1.2, 0.2], [2, 2, 2], [1.5 * D; 3]);
    particles.position.extend(drops.position);
    particles.velocity.extend(drops.velocity);
    particles.id = (0..particles.position.len() as u32).collect();
    (scene, particles)
}

#[test]
fn frames_are_the_same_bytes_from_any_frame() {
    let (scene, particles) = pushed();
    let mut first = on_gpu(&scene, &particles);
    let states: Vec<Particles> = (0..24).map(|_| first.advance().unwrap().0).collect();
    for frame in [1, 11, 23] {
        let mut resumed = on_gpu(&scene, &particles);
        resumed.load(frame, &states[frame as usize - 1]).unwrap();
        let last = (frame..24).map(|_| resumed.advance().unwrap().0).last();
        assert!(last.as_ref() == Some(&states[23]), "from frame {frame}");
    }
    // Negative control: one bit of one velocity suffices for a different result.
    let mut spoiled = states[10].clone();
    spoiled.velocity[100][0] = f32::from_bits(spoiled.velocity[100][0].to_bits() ^ 1 << 12);
    let mut resumed = on_gpu(&scene, &particles);
    resumed.load(11, &spoiled).unwrap();
    let last = (11..24).map(|_| resumed.advance().unwrap().0).last();
    assert!(last.as_ref() != Some(&states[23]));
}

/// Kinetic plus potential energy of the water, J.
fn energy(report: &StepReport) -> f64 {
    report.kinetic_energy + report.potential_energy
}

#[test]
fn gpu_and_f64_push_alike_and_the_wall_pays_for_it() {
    let (scene, particles) = pushed();
    let (mut gpu, mut cpu) = (on_gpu(&scene, &particles), in_f64(&scene, &particles));
    let (mut work, mut gap) = (0.0, 0.0f64);
    let mut start = None;
    let mut end = 0.0;
    for _ in 0..4 {
        let (found, report) = gpu.advance().unwrap();
        let (exact, of_reference) = cpu.advance().unwrap();
        gap = gap.max(max_distance(&found, &exact));
        start = start.or(Some(energy(&report)));
        if end > 0.0 {
            work += report.boundary_work;
        }
        end = energy(&report);
        let projection = report.projection.expect("a projection");
        let of_reference = of_reference.projection.expect("a projection");
        assert!(projection.divergence_before > 0.1, "{projection:?}");
        assert!(projection.residual <= 1e-5, "{projection:?}");
        assert_eq!(projection.pockets, of_reference.pockets);
    }
    // Four frames of f32 with a projection that stops at 1e-5: the wall's 1.5 m/s and gravity leave
    // some 1e-5 d per frame.
    assert!(gap < 1e-3 * D, "{gap} m");
    let gained = end - start.unwrap();
    assert!(work > 0.0 && gained > 0.0);
    // Within what inelastic corrections take.
    assert!((gained / work - 1.0).abs() < 0.1, "{gained} J of {work} J");
}

#[test]
fn scene_without_projection_plans_no_pass_of_it() {
    let context = context();
    let (scene, particles) = tank(10);
    let plan =
        |scene: &Scene| -> Plan { plan(&context, scene, particles.len(), &Boundary::default()) };
    let (with, bare) = (plan(&scene), plan(&without(&scene)));
    assert!(bare.projection.is_none());
    assert!(with.projection.is_some());
    // Besides the projection's own buffers: flags of particles that count as drops, before and
    // after a sort.
    let flags = |plan: &Plan| -> u64 {
        let found = plan.buffers.iter().filter(|row| row.spec.name == "is_drop");
        found.map(|row| row.spec.bytes).sum()
    };
    assert_eq!(
        (flags(&bare), flags(&with)),
        (0, 2 * 4 * particles.len() as u64)
    );
    let alone = Plan {
        projection: None,
        ..with.clone()
    };
    assert_eq!(bare.bytes().0, alone.bytes().0 - flags(&with));
    let passes = |plan: &Plan| plan.parts().map(|part| part.passes.len()).sum::<usize>();
    assert!(passes(&with) > passes(&bare) + 20);
    let ran = on_gpu(&without(&scene), &particles).recorded_passes();
    assert!(ran.iter().all(|pass| !pass.starts_with("flip/")), "{ran:?}");
    let ran = on_gpu(&scene, &particles).recorded_passes();
    assert!(
        ran.contains(&"flip/aim") && !ran.contains(&"flip/advect"),
        "{ran:?}"
    );
}

/// A period must be a multiple of a brick of the projection: eight cells of two spacings each.
#[test]
fn a_period_is_whole_bricks_of_the_projection() {
    let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/dam-break.toml");
    let load = |width: f64, key: bool| {
        let block = format!("[{{ min = [0.0, 0.0, 0.0], max = [0.5, 0.5, {width}] }}]");
        let sets = [
            format!("domain.max=[2.0, 2.0, {width}]"),
            format!("water.block={block}"),
            "domain.periodic=[\"z\"]".to_owned(),
            "solver.pbf.particle_spacing=0.1".to_owned(),
            format!("solver.pbf.grid_projection={key}"),
        ];
        load_scene(&file, &sets)
    };
    for (width, key) in [(1.6, true), (3.2, true), (0.7, false)] {
        load(width, key).unwrap_or_else(|error| panic!("{width}: {error}"));
    }
    let said = load(0.7, true).expect_err("seven spacings").to_string();
    assert!(said.contains("asks for a multiple of 16"), "{said}");
}

/// A falling column with all lengths scaled by `factor` and all times by its square root; returns
/// each frame's state, with positions divided by `factor`.
fn falling_column(factor: f64, iteration: Iteration, gravity: f64) -> Vec<Particles> {
    let mut scene = projected(
        [2.4 * factor, 2.0 * factor, 0.8 * factor],
        60.0 / factor.sqrt(),
    );
    let pbf = pbf_of(&mut scene);
    (pbf.particle_spacing, pbf.iteration) = (D * factor, iteration);
    scene.water.gravity.y = -gravity;
    let mut solver = on_gpu(&scene, &lattice([0.0; 3], [8, 16, 8], [D * factor; 3]));
    let one = |_| {
        let mut state = solver.advance().unwrap().0;
        for x in state.position.iter_mut().flatten() {
            *x = (f64::from(*x) / factor) as f32;
        }
        state
    };
    (0..10).map(one).collect()
}

/// By Froude scaling. Differences in f32 rounding must not grow; without a projection they do, a
/// hundred times faster.
#[test]
fn similar_scenes_stay_similar_at_any_scale() {
    for iteration in [Iteration::Jacobi, Iteration::RedBlack] {
        let own = falling_column(1.0, iteration, GRAVITY);
        let gap = |other: Vec<Particles>| {
            let pairs = own.iter().zip(&other);
            pairs.map(|(a, b)| max_distance(a, b)).fold(0.0, f64::max)
        };
        for factor in [0.01, 100.0] {
            let gap = gap(falling_column(factor, iteration, GRAVITY));
            assert!(gap < 1e-3 * D, "{iteration:?} at {factor}: {gap} m");
        }
        // Negative control: gravity 1 % off.
        let gap = gap(falling_column(100.0, iteration, 1.01 * GRAVITY));
        assert!(gap > 1e-3 * D, "{gap} m");
    }
}

/// Velocities that the grid does not resolve, of neighbours against each other, decay at the rate
/// at which particles take on the grid's velocity: 0.17 √(g / Δx). Those in cells beside air are
/// clamped to the grid's at once.
#[test]
fn what_the_grid_does_not_see_calms_down_at_the_rate_that_is_documented() {
    let noise = 0.05;
    let left = |gravity: f64| {
        let (mut scene, mut particles) = tank(8);
        scene.water.gravity.y = -gravity;
        let places = particles.position.iter();
        let parity = |x: &[f32; 3]| x.iter().map(|x| (f64::from(*x) / D) as u32).sum::<u32>() % 2;
        particles.velocity = places
            .map(|x| [if parity(x) == 0 { noise } else { -noise }, 0.0, 0.0])
            .collect();
        let mut solver = on_gpu(&scene, &particles);
        let last = (0..30).map(|_| solver.advance().unwrap().0).last().unwrap();
        // The uppermost of four rows of cells is beside air.
        let is_below = |k: &usize| f64::from(particles.position[*k][1]) < 6.0 * D;
        let left = |is_inside: bool| {
            let some = (0..particles.len()).filter(|k| is_below(k) == is_inside);
            let parts = some.map(|k| f64::from(last.velocity[k][0] / particles.velocity[k][0]));
            parts.clone().sum::<f64>() / parts.count() as f64
        };
        (left(true), left(false))
    };
    let expected = |gravity: f64| (-0.17 * (gravity / (2.0 * D)).sqrt() * 0.5).exp();
    for gravity in [GRAVITY, 4.0 * GRAVITY] {
        let ((left, above), expected) = (left(gravity), expected(gravity));
        // A particle at a wall has fewer neighbours against it.
        assert!((left / expected - 1.0).abs() < 0.03, "{left} of {expected}");
        assert!(above.abs() < 0.03, "{above}");
    }
    // Negative control: the two rates are distinguishable.
    assert!(expected(4.0 * GRAVITY) < 0.6 * expected(GRAVITY));
}

/// Two coincident particles at the surface, where nothing is compressed.
#[test]
fn particles_on_one_spot_part_also_at_the_surface() {
    let (scene, mut particles) = tank(6);
    // In the middle of the uppermost layer.
    let top = (8 * 6) * 4 + 8 * 5 + 4;
    assert!(particles.position[top][1] > 0.5);
    particles.position.push(particles.position[top]);
    particles.velocity.push([0.0; 3]);
    particles.id.push(particles.id.len() as u32);
    let last = particles.len() - 1;
    let apart = |context: &Context| {
        let mut solver = solver(context, &scene, &particles, &Boundary::default());
        let state = (0..30).map(|_| solver.advance().unwrap().0).last().unwrap();
        let [a, b] = [top, last].map(|k| glam::Vec3::from_array(state.position[k]).as_dvec3());
        (a - b).length()
    };
    let context = context();
    let distance = apart(&context);
    assert!(distance > 0.4 * D, "{distance} m");
    // Negative control: without the push.
    let mut spoiled = context;
    spoiled.spoil = Some(InjectedFault {
        pass: "flip/push_apart",
        from: "const SHARE = 0.25;",
        to: "const SHARE = 0.0;",
    });
    let distance = apart(&spoiled);
    assert!(distance < 0.4 * D, "{distance} m");
}
