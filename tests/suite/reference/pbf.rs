//! The f64 reference of PBF: compared with the GPU on the same inputs, and with exact solutions.

use std::{fs, path::Path};
use swell::files::parse_scene;

use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary, budget::Breach, particles::Particles, solver::Solver,
        solver::StepReport,
    },
    reference::{
        ReferenceError, Timings,
        pbf::{
            Colour, Model, Pbf, Sorted, Substep,
            constraint::{converged, distance_to_converged, linearised},
            local,
            passes::{self, Inputs},
        },
    },
    scene::{Iteration, Scene, Stop},
    stage::prepare::Start,
};

use crate::support::{D, context, jitter, lattice, noise, pbf_of, scene, solver};

const BOX: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n";

/// Moving walls, a solid in the water that fits the lattice (the direction of a push of 1e-6 m
/// would be rounding error), both effects and one substep per frame. The water is compressed by 1.5
/// % and moves in all directions.
fn lively(spoil: &str) -> (Scene, Start) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("box.obj"), BOX).unwrap();
    let text = r#"
        [shot]
        name = "lively"
        frames = 1
        frames_per_second = 100
        [domain]
        min = [0.0, 0.0, 0.0]
        max = [1.6, 1.2, 1.0]
        [[water.block]]
        min = [0.0, 0.0, 0.0]
        max = [1.6, 0.8, 1.0]
        [[solid]]
        mesh = "box.obj"
        translate = [0.8, 0.0, 0.3]
        scale = 0.4
        [[wave_maker]]
        wall = "-x"
        motion = { kind = "constant_velocity", velocity = 1.5, until = 1.0 }
        [solver]
        method = "pbf"
        [solver.pbf]
        particle_spacing = 0.1
        [effects]
        viscosity = { xsph = 0.1 }
        vorticity_confinement = { strength = 0.5 }
    "#;
    let spoil: Vec<String> = spoil.split_whitespace().map(Into::into).collect();
    let scene = parse_scene(text, Path::new("lively.toml"), folder.path(), &spoil).unwrap();
    let mut start = Start::of(&scene).unwrap();
    let particles = &mut start.particles;
    jitter(particles, 0.01);
    for (k, v) in particles.velocity.iter_mut().enumerate() {
        *v = [0, 1, 2].map(|axis| noise((7 * k + axis) as u64) as f32);
    }
    (scene, start)
}

fn reference(scene: &Scene, start: &Start) -> (Particles, StepReport) {
    let mut solver = Pbf::new(&scene.with_pbf().unwrap(), &start.boundary);
    solver.load(0, &start.particles).unwrap();
    solver.advance().unwrap()
}

/// Largest and RMS difference of positions in metres, and of velocities in m/s times a substep.
fn gaps(a: &Particles, b: &Particles, step: f64) -> [f64; 4] {
    assert_eq!(a.id, b.id);
    let of = |a: &[[f32; 3]], b: &[[f32; 3]], unit: f64| {
        let distance = |(a, b): (&[f32; 3], &[f32; 3])| {
            DVec3::from_array(a.map(f64::from)).distance(DVec3::from_array(b.map(f64::from))) * unit
        };
        let all: Vec<f64> = a.iter().zip(b).map(distance).collect();
        let squares: f64 = all.iter().map(|d| d * d).sum();
        [
            all.iter().copied().fold(0.0, f64::max),
            (squares / all.len() as f64).sqrt(),
        ]
    };
    let [x, x_rms] = of(&a.position, &b.position, 1.0);
    let [v, v_rms] = of(&a.velocity, &b.velocity, step);
    [x, x_rms, v, v_rms]
}

/// Divergence of the reference when every coordinate of its start is moved by one unit in the last
/// place of f32, up or down: the maximum of four draws.
fn sensitivity(scene: &Scene, start: &Start) -> [f64; 4] {
    let step = scene.shot.frame_seconds();
    let (plain, _) = reference(scene, start);
    let mut most = [0.0f64; 4];
    for seed in 0..4u64 {
        let mut moved = start.clone();
        for (k, x) in moved.particles.position.iter_mut().enumerate() {
            for (axis, x) in x.iter_mut().enumerate() {
                let up = noise(seed * 1_000_003 + 3 * k as u64 + axis as u64) > 0.0;
                *x = if up { x.next_up() } else { x.next_down() };
            }
        }
        let (state, _) = reference(scene, &moved);
        for (most, gap) in most.iter_mut().zip(gaps(&plain, &state, step)) {
            *most = most.max(gap);
        }
    }
    most
}

const KINDS: [&str; 6] = [
    "solver.pbf.iteration=jacobi",
    "solver.pbf.iteration=red_black",
    "solver.pbf.iteration=chebyshev",
    "solver.pbf.iteration=jacobi solver.pbf.density_error=0.004 solver.pbf.max_iterations=40",
    "solver.pbf.iteration=red_black solver.pbf.density_error=0.004 solver.pbf.max_iterations=40",
    "solver.pbf.iteration=chebyshev solver.pbf.density_error=0.004 solver.pbf.max_iterations=40",
];

/// The GPU rounds positions once per pass, by half a unit in their last place; its sums of some 33
/// terms round less than that, because corrections are a hundredth of positions. Each pass's error
/// then separates the solutions by no more than the same error at the start. A velocity is a
/// difference of positions over the substep, both of which an error at the start moves: it also has
/// the rounding of the later position, of up to 1.6, 1.2 and 1 m.
fn tolerance(sensitivity: [f64; 4], passes: usize) -> [f64; 4] {
    let place = DVec3::new(1.6, 1.2, 1.0).length() * 0.5 * f64::from(f32::EPSILON);
    let [x, x_rms, v, v_rms] = sensitivity.map(|gap| gap * passes as f64);
    [x, x_rms, v + place, v_rms + place]
}

fn is_within(gap: [f64; 4], tolerance: [f64; 4]) -> bool {
    gap.iter().zip(tolerance).all(|(gap, most)| *gap <= most)
}

fn show(values: &[f64]) -> String {
    let texts: Vec<String> = values.iter().map(|v| format!("{v:.2e}")).collect();
    texts.join(" ")
}

#[test]
fn one_pbf_substep_on_the_gpu_matches_f64() {
    let context = context();
    for kind in KINDS {
        let (scene, start) = lively(kind);
        let step = scene.shot.frame_seconds();
        let mut gpu = solver(&context, &scene, &start.particles, &start.boundary);
        let (state, report) = gpu.advance().unwrap();
        let (exact, expected) = reference(&scene, &start);
        let iterations = expected.iterations;
        assert_eq!(
            (report.substeps, report.iterations),
            (1, iterations),
            "{kind}"
        );
        let is_adaptive = kind.contains("density_error");
        assert_eq!(iterations != 4, is_adaptive, "{kind}");
        // Predict, velocity, three of effects; λ and Δx, for two colours with red/black.
        let passes = 5 + 4 * iterations as usize;
        let tolerance = tolerance(sensitivity(&scene, &start), passes);
        let gap = gaps(&exact, &state, step);
        println!("{kind}: gap {}, tolerance {}", show(&gap), show(&tolerance));
        assert!(is_within(gap, tolerance), "{kind}: {gap:?} {tolerance:?}");
        // Negative controls: a small change in each part of a substep is detected.
        for spoil in [
            "solver.pbf.relaxation=0.99",
            "effects.viscosity.xsph=0.11",
            "effects.vorticity_confinement.strength=0.6",
            "water.gravity=[0,-9.9,0]",
            "wave_maker=[{wall=\"-x\",motion={kind=\"constant_velocity\",velocity=1.51,\
             until=1.0}}]",
        ] {
            let (scene, _) = lively(&format!("{kind} {spoil}"));
            let gap = gaps(&reference(&scene, &start).0, &state, step);
            println!("   {spoil}: {}", show(&gap));
            assert!(
                !is_within(gap, tolerance),
                "{kind} {spoil}: {gap:?} {tolerance:?}"
            );
        }
    }
}

#[test]
fn velocity_that_is_not_a_number_is_an_error() {
    let (scene, mut start) = lively("");
    start.particles.velocity[7][1] = f32::NAN;
    let mut solver = Pbf::new(&scene.with_pbf().unwrap(), &start.boundary);
    solver.load(0, &start.particles).unwrap();
    let fault = solver.advance().unwrap_err();
    assert!(
        matches!(fault, ReferenceError::Numbers(Breach { frame: 1, .. })),
        "{fault}"
    );
}

/// Builds the dense system by hand: (G Gᵀ + εI, −C) of the compressed particles.
fn dense(inputs: Inputs<'_>, epsilon: f64) -> (Vec<usize>, Vec<Vec<f64>>, Vec<f64>) {
    let n = inputs.particles();
    let calibration = &inputs.model.calibration;
    let x = inputs.points;
    let density = passes::measure_density(inputs);
    let slope = |i: usize, j: usize| {
        let d = x[i] - x[j];
        let q = d.length() / calibration.support_radius;
        d.normalize() * calibration.gradient_scale * (1.0 - q).max(0.0).powi(2)
    };
    let active: Vec<usize> = (0..n).filter(|&i| density[i] > 1.0).collect();
    let gradient = |i: usize| -> Vec<DVec3> {
        let mut row: Vec<DVec3> = (0..n)
            .map(|j| if i == j { DVec3::ZERO } else { slope(i, j) })
            .collect();
        let walls = inputs.model.wall_term(x[i], &inputs.substep.walls).1;
        row[i] = walls - row.iter().sum::<DVec3>();
        row
    };
    let rows: Vec<Vec<DVec3>> = active.iter().map(|&i| gradient(i)).collect();
    let product = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
    let matrix = (0..active.len())
        .map(|k| {
            let mut line: Vec<f64> = rows.iter().map(|row| product(&rows[k], row)).collect();
            line[k] += epsilon;
            line
        })
        .collect();
    let right = active.iter().map(|&i| 1.0 - density[i]).collect();
    (active, matrix, right)
}

fn norm(values: impl Iterator<Item = f64>) -> f64 {
    values.map(|v| v * v).sum::<f64>().sqrt()
}

/// A block of particles in a box of its own, compressed by 2 % in each direction and jittered.
fn squeezed(count: usize) -> (Scene, Particles) {
    let side = 0.98 * count as f64 * D;
    let scene = scene([side, 2.0 * side, side]);
    let mut particles = lattice([0.0; 3], [count; 3], [0.98 * D; 3]);
    jitter(&mut particles, 0.005);
    (scene, particles)
}

fn sorted(scene: &Scene, particles: &Particles) -> (Model, Substep, Sorted) {
    let model = Model::new(&scene.with_pbf().unwrap(), &Boundary::default());
    let substep = Substep::new(scene, &particles.walls, 0.0, 0.0);
    let position = local(scene, particles);
    let sorted = Sorted::new(&model, &position, &particles.id, &mut Timings::default());
    (model, substep, sorted)
}

#[test]
fn linearised_constraints_are_met() {
    let (scene, particles) = squeezed(7);
    let (model, substep, sorted) = sorted(&scene, &particles);
    let inputs = sorted.inputs(&model, &substep);
    let epsilon = model.regularization();
    let solved = linearised(inputs, epsilon).unwrap();
    let (active, matrix, right) = dense(inputs, epsilon);
    assert_eq!(solved.active, active.len());
    assert!(active.len() > 200, "{}", active.len());
    let lambda: Vec<f64> = active.iter().map(|&i| solved.lambda[i]).collect();
    let apply = |matrix: &[Vec<f64>], lambda: &[f64]| -> Vec<f64> {
        let line = |line: &Vec<f64>| line.iter().zip(lambda).map(|(a, x)| a * x).sum();
        matrix.iter().map(line).collect()
    };
    let residual = |matrix: &[Vec<f64>], lambda: &[f64]| {
        let left = apply(matrix, lambda);
        norm(left.iter().zip(&right).map(|(a, b)| a - b)) / norm(right.iter().copied())
    };
    let exact = residual(&matrix, &lambda);
    println!("residual {exact:.2e}");
    // 2^-53 times the condition number, at most Σ|∇C|² over ε, 1e3 times the longest
    // row's sum of 10.
    assert!(exact < 1e-10, "{exact:.2e}");
    // Negative control: a matrix with another ε is another system.
    let (_, other, _) = dense(inputs, 1.001 * epsilon);
    assert!(residual(&other, &lambda) > 1e-7);

    // The first Jacobi step from zero is the λ of the iteration.
    let n = inputs.particles();
    let (mut first, mut density) = (vec![0.0; n], vec![0.0; n]);
    passes::compute_lambda(inputs, Colour::All, &mut first, &mut density);
    for (k, &i) in active.iter().enumerate() {
        let expected = right[k] / matrix[k][k];
        assert!((first[i] - expected).abs() < 1e-12 * expected.abs());
    }
    // Many steps, under-relaxed so that they converge (Gershgorin), approach the exact λ.
    let rows = matrix.iter().enumerate();
    let largest = rows.map(|(k, line)| line.iter().map(|a| a.abs()).sum::<f64>() / line[k]);
    let relaxation = 1.0 / largest.fold(0.0, f64::max);
    let mut iterate = vec![0.0; lambda.len()];
    let mut errors = Vec::new();
    for k in 1..=4096 {
        let left = apply(&matrix, &iterate);
        for (i, x) in iterate.iter_mut().enumerate() {
            *x += relaxation * (right[i] - left[i]) / matrix[i][i];
        }
        if [4, 64, 1024, 4096].contains(&k) {
            let gap = iterate.iter().zip(&lambda).map(|(a, b)| a - b);
            errors.push(norm(gap) / norm(lambda.iter().copied()));
        }
    }
    println!("relaxation {relaxation:.3}, errors {}", show(&errors));
    assert!(errors[3] < 0.01, "{errors:?}");
    assert!(
        errors.windows(2).all(|pair| pair[1] < pair[0]),
        "{errors:.3?}"
    );
}

#[test]
fn nonlinear_constraints_are_met() {
    let (mut scene, particles) = squeezed(8);
    // Air above, so that the water can expand.
    scene.domain.max.y *= 2.0;
    let (model, substep, _) = sorted(&scene, &particles);
    let position = local(&scene, &particles);
    let solved = converged(&model, &substep, &position, 1e-8).unwrap();
    println!(
        "{} steps, {:.2e} {:.2e}",
        solved.steps, solved.error, solved.mean_error
    );
    assert!(solved.error <= 1e-8 && solved.mean_error <= solved.error);
    assert!(solved.steps > 0);
    // Half the volume: the error reports the remaining density error.
    scene.domain.max.y =
        particles.len() as f64 * 0.5 * D.powi(3) / (scene.domain.max.x * scene.domain.max.z);
    let (model, substep, _) = sorted(&scene, &particles);
    let fault = converged(&model, &substep, &position, 1e-8).unwrap_err();
    println!("{fault}");
    assert!(
        matches!(fault, ReferenceError::NotConverged { error, .. } if error > 0.1),
        "{fault}"
    );
}

/// More iterations leave a smaller distance to the converged solution.
#[test]
fn iterations_approach_what_is_converged() {
    let (mut scene, particles) = squeezed(8);
    scene.water.gravity = DVec3::ZERO;
    let boundary = Boundary::default();
    for iteration in [Iteration::Jacobi, Iteration::RedBlack, Iteration::Chebyshev] {
        let mut distances = Vec::new();
        for count in [1, 4, 16, 64] {
            let settings = pbf_of(&mut scene);
            settings.iteration = iteration;
            settings.stop = Stop::Iterations(count);
            settings.relaxation = if iteration == Iteration::Chebyshev {
                0.7
            } else {
                1.0
            };
            let start = Start {
                particles: particles.clone(),
                removed: 0,
                asked: None,
                boundary: boundary.clone(),
                sources: Default::default(),
            };
            let (state, _) = reference(&scene, &start);
            distances.push(
                distance_to_converged(&scene.with_pbf().unwrap(), &boundary, 1, &state, 1e-8)
                    .unwrap(),
            );
        }
        println!("{iteration:?}: {}", show(&distances));
        // A hundredth of a spacing is invisible in a film frame; Chebyshev is far below.
        assert!(distances[3] < 0.01, "{iteration:?} {distances:?}");
        assert!(
            distances.windows(2).all(|pair| pair[1] < pair[0]),
            "{iteration:?} {distances:.3?}"
        );
    }
}

/// Cost of the sparse factor: `cargo test --release --test suite reference::pbf::sparse_factor_cost_is_printed_by_size --
/// --ignored --nocapture`.
#[test]
#[ignore = "minutes and gigabytes"]
fn sparse_factor_cost_is_printed_by_size() {
    for count in [13, 20, 25, 31] {
        let (scene, particles) = squeezed(count);
        let (model, substep, sorted) = sorted(&scene, &particles);
        let begin = std::time::Instant::now();
        let solved = linearised(sorted.inputs(&model, &substep), model.regularization()).unwrap();
        let seconds = begin.elapsed().as_secs_f64();
        // Linux reports the peak memory so far.
        let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
        let peak = status
            .lines()
            .find(|line| line.starts_with("VmHWM"))
            .unwrap_or("");
        println!(
            "{} particles, {} compressed: {seconds:.2} s, {peak}",
            particles.len(),
            solved.active
        );
        assert!(solved.active > particles.len() / 2);
    }
}
