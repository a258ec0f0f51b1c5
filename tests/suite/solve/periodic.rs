//! Periodic domains: results do not depend on where the boundary is, and water flows across it.

use std::f64::consts::{PI, TAU};

use crate::support::{
    self, choose, context, flip as of_flip, jitter, max_distance, noise, pbf_of, solvers::on_cpu,
};
use glam::DVec3;
use swell::{
    domain::{particles::Particles, period::Period, solver::Solver},
    gpu::adapter::{Context, InjectedFault},
    scene::{Iteration, Method, Scene},
};

const METHODS: [Method; 2] = [Method::Flip, Method::Pbf];

/// 16 × 16 × 8 cells of FLIP, or twice as many spacings of PBF, without walls along `periodic`.
fn open_box(method: Method, periodic: [bool; 3]) -> Scene {
    let mut scene = of_flip::scene([16.0, 16.0, 8.0]);
    of_flip::flip(&mut scene).pressure.tolerance = 1e-6;
    pbf_of(&mut scene).particle_spacing = of_flip::DX / 2.0;
    // Which particles are red depends on the order of the cells, and so on where the boundary is.
    pbf_of(&mut scene).iteration = Iteration::Jacobi;
    choose(&mut scene, method);
    scene.periodic = periodic;
    scene.shot.frames_per_second = 50.0;
    scene
}

/// A block of cells, eight particles each.
fn block(cells: [usize; 3]) -> Particles {
    of_flip::block([0; 3], cells)
}

/// State after `frames` frames on the GPU.
fn run(context: &Context, scene: &Scene, particles: &Particles, frames: u32) -> Particles {
    match scene.solver.method() {
        Method::Flip => of_flip::run(context, scene, particles, frames).0,
        Method::Pbf => support::run(context, scene, particles, frames).0,
    }
}

/// Particles moved by `way` and wrapped into the box.
fn shifted(scene: &Scene, particles: &Particles, way: DVec3) -> Particles {
    let mut moved = particles.clone();
    for x in &mut moved.position {
        let there = DVec3::from_array(x.map(f64::from)) + way;
        *x = scene.period().wrap(there).as_vec3().to_array();
    }
    moved
}

/// Largest distance between particles of the same id or their periodic images, after `a` is moved
/// by `way`, metres.
fn apart(period: Period, a: &Particles, b: &Particles, way: DVec3) -> f64 {
    assert_eq!(a.id, b.id);
    let at = |x: &[f32; 3]| DVec3::from_array(x.map(f64::from));
    (a.position.iter().zip(&b.position))
        .map(|(a, b)| period.shortest(at(a) + way - at(b)).length())
        .fold(0.0, f64::max)
}

fn is_inside(scene: &Scene, particles: &Particles) -> bool {
    let all = particles.position.iter();
    let mut places = all.map(|x| DVec3::from_array(x.map(f64::from)));
    places.all(|x| scene.domain.grown(1e-6).contains(x))
}

/// A dam whose velocity varies along z, so that the two ends differ.
fn leaning() -> Particles {
    let mut particles = block([6, 8, 8]);
    jitter(&mut particles, 0.05 * of_flip::DX);
    for (v, x) in particles.velocity.iter_mut().zip(&particles.position) {
        let phase = TAU * f64::from(x[2]) / 0.8;
        *v = [phase.sin() as f32, 0.0, (1.5 + phase.cos()) as f32];
    }
    for x in &mut particles.position {
        x[2] = (x[2] + 0.8) % 0.8;
        x[0] = x[0].max(0.01);
    }
    particles
}

/// The same dam shifted by half a period gives the same shot, shifted. The allowed difference is
/// ten times the response of the dam to a rounding of its initial state, because the two runs sum
/// in different orders in each step.
#[test]
fn where_the_joint_is_does_not_matter() {
    let context = context();
    for method in METHODS {
        let mut scene = open_box(method, [false, false, true]);
        // Its solve stops at a residual of 1e-2, after different iterations.
        of_flip::flip(&mut scene).density_correction = false;
        let (start, way, frames) = (leaning(), DVec3::new(0.0, 0.0, 0.4), 6);
        let there = run(&context, &scene, &start, frames);
        let moved = run(&context, &scene, &shifted(&scene, &start, way), frames);
        let mut rounded = start.clone();
        jitter(&mut rounded, 2e-7);
        let answer = max_distance(&there, &run(&context, &scene, &rounded, frames));
        let off = apart(scene.period(), &there, &moved, way);
        println!("{method:?}: {off:.2e}, a rounding {answer:.2e}");
        assert!(off <= 10.0 * answer, "{method:?}: {off} {answer}");
        assert!(10.0 * answer < 0.02 * of_flip::DX, "{answer}");
        assert!(is_inside(&scene, &there) && is_inside(&scene, &moved));
        // Many crossed the boundary, by more than a tenth of the period.
        let ways = start.position.iter().zip(&there.position);
        assert!(ways.filter(|(a, b)| b[2] < a[2] - 0.4).count() > 200);

        // Negative controls: one pass that does not see across the boundary, and walls there.
        let mut blind = context.clone();
        blind.spoil = Some(match method {
            Method::Flip => InjectedFault {
                pass: "flip/grid_to_particle",
                from: "to_after = select(to_after, vec3i(1), is_periodic());",
                to: "",
            },
            Method::Pbf => InjectedFault {
                pass: "pbf/build_neighbors",
                from: "wrapped_cell(centre +",
                to: "(centre +",
            },
        });
        let other = run(&blind, &scene, &shifted(&scene, &start, way), frames);
        let off = apart(scene.period(), &there, &other, way);
        assert!(off > 20.0 * answer, "{method:?} without sight: {off}");
        let mut walled = scene.clone();
        walled.periodic = [false; 3];
        let other = run(&context, &walled, &start, frames);
        let off = apart(scene.period(), &there, &other, DVec3::ZERO);
        assert!(off > 20.0 * answer, "{method:?} with walls: {off}");
    }
}

/// The same for the f64 solvers.
#[test]
fn where_the_joint_is_does_not_matter_to_the_reference() {
    for method in METHODS {
        let scene = open_box(method, [false, false, true]);
        let (start, way, frames) = (leaning(), DVec3::new(0.0, 0.0, 0.4), 2);
        let there = on_cpu(&scene, &start, frames);
        let moved = on_cpu(&scene, &shifted(&scene, &start, way), frames);
        let mut rounded = start.clone();
        jitter(&mut rounded, 2e-7);
        let answer = max_distance(&there, &on_cpu(&scene, &rounded, frames));
        let off = apart(scene.period(), &there, &moved, way);
        println!("{method:?}: {off:.2e}, a rounding {answer:.2e}");
        assert!(off <= 10.0 * answer, "{method:?}: {off} {answer}");
        assert!(10.0 * answer < 0.02 * of_flip::DX, "{answer}");
        assert!(is_inside(&scene, &there) && is_inside(&scene, &moved));
        let walled = open_box(method, [false; 3]);
        let off = apart(
            scene.period(),
            &there,
            &on_cpu(&walled, &start, frames),
            DVec3::ZERO,
        );
        assert!(off > 20.0 * answer, "{method:?} with walls: {off}");
    }
}

/// A box full of water that streams along all three axes: no pressure, and each particle moves at
/// constant velocity; with FLIP 1.7 times around the box along x. Each substep may change a
/// velocity by the rounding of its sums, 40 of 6e-8, and by the projection's tolerance times its
/// input, which is the same rounding again. A lattice is not a stable equilibrium of PBF, which
/// turns roundings of its density into pressure: a tenth of a second, and a thousandth of the
/// speed.
#[test]
fn a_stream_keeps_its_speed_and_its_particles() {
    let context = context();
    let stream = DVec3::new(1.7, -0.9, 0.4);
    for method in METHODS {
        let mut scene = open_box(method, [true; 3]);
        scene.water.gravity = DVec3::ZERO;
        let mut particles = block([16, 16, 8]);
        particles.velocity.fill(stream.as_vec3().to_array());
        let frames = match method {
            Method::Flip => 80,
            Method::Pbf => 5,
        };
        let seconds = f64::from(frames) / 50.0;
        let after = run(&context, &scene, &particles, frames);
        let expected = shifted(&scene, &particles, seconds * stream);
        let off = apart(scene.period(), &after, &expected, DVec3::ZERO);
        let speeds = after.velocity.iter();
        let change = speeds
            .map(|v| (DVec3::from_array(v.map(f64::from)) - stream).length())
            .fold(0.0, f64::max);
        println!("{method:?}: off by {off:.2e} m, by {change:.2e} m/s");
        let slack = stream.length()
            * match method {
                Method::Flip => 160.0 * 40.0 * 6e-8,
                Method::Pbf => 1e-3,
            };
        assert!(change < slack, "{method:?}: {change}");
        assert!(off < slack * seconds + 1e-5, "{method:?}: {off}");
        assert!(is_inside(&scene, &after));
        let mut ids = after.id.clone();
        ids.sort_unstable();
        assert!(ids.into_iter().eq(0..particles.len() as u32));
        // Negative control: walls stop the stream.
        scene.periodic = [false; 3];
        let walled = run(&context, &scene, &particles, 4);
        let off = apart(
            Period::default(),
            &walled,
            &shifted(&scene, &particles, 0.08 * stream),
            DVec3::ZERO,
        );
        assert!(off > 0.01, "{method:?}: {off}");
    }
}

/// Taylor–Green vortices, a steady flow without damping: u = U sin kx cos ky, v = −U cos kx sin ky.
/// Linear interpolation between centres has an error of at most (k Δx)²/8 of U, 2 % at 16 cells per
/// wavelength: once to the grid and once back, along each of two axes.
#[test]
fn vortices_stand_still_in_a_periodic_box() {
    let (context, k) = (context(), TAU / 1.6);
    let field = |x: &[f32; 3]| {
        let [x, y] = [f64::from(x[0]) * k, f64::from(x[1]) * k];
        DVec3::new(x.sin() * y.cos(), -x.cos() * y.sin(), 0.0)
    };
    let rms = |state: &Particles| {
        let both = state.position.iter().zip(&state.velocity);
        let sum: f64 = both
            .map(|(x, v)| (DVec3::from_array(v.map(f64::from)) - field(x)).length_squared())
            .sum();
        (sum / state.len() as f64).sqrt()
    };
    let after = |periodic, seconds: f64| {
        let mut scene = open_box(Method::Flip, periodic);
        scene.water.gravity = DVec3::ZERO;
        of_flip::flip(&mut scene).pic_blend = 0.0;
        scene.shot.frames_per_second = 200.0;
        let mut particles = block([16, 16, 8]);
        let at = particles.position.iter();
        particles.velocity = at.map(|x| field(x).as_vec3().to_array()).collect();
        // Shifted so that the boundary is not a line of symmetry, where walls would give the same
        // flow.
        let way = DVec3::new(0.3, 0.5, 0.0);
        let mut start = particles.clone();
        for x in &mut start.position {
            let there = DVec3::from_array(x.map(f64::from)) + way;
            let size = scene.domain.size();
            *x = (there - size * (there / size).floor()).as_vec3().to_array();
        }
        let mut state = run(&context, &scene, &start, (seconds * 200.0).round() as u32);
        for x in &mut state.position {
            *x = (DVec3::from_array(x.map(f64::from)) - way)
                .as_vec3()
                .to_array();
        }
        rms(&state)
    };
    let interpolation = (k * of_flip::DX).powi(2) / 8.0;
    let (periodic, walled) = (after([true; 3], 0.1), after([false; 3], 0.1));
    println!("{periodic:.4} of 1 m/s, with walls {walled:.4}; interpolation {interpolation:.4}");
    assert!(periodic < 4.0 * interpolation, "{periodic}");
    // Negative control: walls deflect the flow.
    assert!(walled > 2.0 * 4.0 * interpolation, "{walled}");
    assert!((interpolation - (PI / 8.0).powi(2) / 8.0).abs() < 1e-12);
}

/// Still water in a periodic slab: the pressure of its depth and no motion, as with side walls.
#[test]
fn still_water_in_a_slab_has_its_depth_s_pressure() {
    let context = context();
    for periodic in [[false, false, true], [true, false, true]] {
        let scene = open_box(Method::Flip, periodic);
        let mut solver = of_flip::solver(&context, &scene, &block([16, 10, 8]));
        let (_, report) = solver.advance().unwrap();
        let points: Vec<DVec3> = (0..40)
            .map(|i| {
                let at = |axis: u64| 0.5 + 0.5 * noise(3 * i + axis);
                DVec3::new(1.6 * at(0), 0.1 + 0.8 * at(1), 0.8 * at(2))
            })
            .collect();
        let found = solver.pressures(&points).unwrap();
        for (x, found) in points.iter().zip(found) {
            let expected = 1000.0 * 9.81 * (1.0 - x.y);
            let off = (found.unwrap() / expected - 1.0).abs();
            // The projection's tolerance, and the error of the surface between centres: 5e-4 of the
            // depth above.
            assert!(off < 2e-3, "{x}: {found:?} {expected}");
        }
        assert!(report.max_speed < 1e-3, "{}", report.max_speed);
    }
}

/// Water at rest without any walls: there is no excess density to move.
#[test]
fn a_full_box_at_rest_stays() {
    let context = context();
    for method in METHODS {
        let mut scene = open_box(method, [true; 3]);
        scene.water.gravity = DVec3::ZERO;
        let particles = block([16, 16, 8]);
        for after in [
            run(&context, &scene, &particles, 2),
            on_cpu(&scene, &particles, 2),
        ] {
            let off = max_distance(&after, &particles);
            assert!(off < 1e-6, "{method:?}: {off}");
        }
    }
}
