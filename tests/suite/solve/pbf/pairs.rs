//! PBF where the result is known: how many lists overflow, how coincident particles separate, and
//! which pressure Σ λ represents.

use glam::{DVec3, Vec3};
use swell::{
    domain::{
        boundary::Boundary,
        particles::Particles,
        probe::{Rate, fitted},
        solver::Solver,
        sph::Calibration,
    },
    gpu::adapter::Context,
    reference::{
        self, Timings,
        pbf::{Model, Sorted, Substep, iterate, local},
    },
    scene::{
        Iteration, Scene, Stop,
        probe::{Probe, ProbeKind},
    },
    solve::{
        pbf::buffers::{ID, LAMBDA_SUM},
        plan::LIST_CAPACITY,
    },
};

use super::{Naive, ONE_ITERATION_TOLERANCE};
use crate::support::{
    D, context, device::spoiled, jitter, lattice, noise, pbf_of, run, scene as box_scene, solver,
};

/// A scene without gravity that runs `iterations` Jacobi iterations.
fn scene(size: [f64; 3], iterations: u32) -> Scene {
    let mut scene = box_scene(size);
    scene.water.gravity = DVec3::ZERO;
    let pbf = pbf_of(&mut scene);
    pbf.iteration = Iteration::Jacobi;
    pbf.stop = Stop::Iterations(iterations);
    scene
}

fn place(particles: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(particles.position[k]).as_dvec3()
}

/// Counts overflowing lists pair by pair, for a cloud that is far too dense. Neighbours are
/// particles less than 258 steps of h/256 apart, each position rounded down to a step
/// (shared/place.wgsl).
#[test]
fn lists_that_overflow_are_counted() {
    let scene = scene([1.4; 3], 1);
    let mut particles = Particles::default();
    for k in 0..500u64 {
        // Denser towards one side, so that only some lists overflow.
        let part = |c: u64| 0.5 + 0.5 * noise(300 + 3 * k + c);
        let x = DVec3::new(part(0).powi(2), part(1), part(2)) * 0.7 + 0.3;
        particles.position.push(x.as_vec3().to_array());
        particles.velocity.push([0.0; 3]);
        particles.id.push(k as u32);
    }
    let h = 2.0 * D;
    let steps =
        |k: usize| (Vec3::from_array(particles.position[k]) * (1.0 / h) as f32 * 256.0).floor();
    let counts: Vec<u32> = (0..particles.len())
        .map(|i| {
            let near = |&j: &usize| {
                let apart = steps(i).distance_squared(steps(j));
                let q = place(&particles, i).distance(place(&particles, j)) / h;
                assert!(
                    q > 1.0 || apart < 258.0 * 258.0,
                    "whoever is within h is listed"
                );
                j != i && apart < 258.0 * 258.0
            };
            (0..particles.len()).filter(near).count() as u32
        })
        .collect();
    let over = |most: u32| counts.iter().filter(|&&count| count > most).count() as u64;
    let context = context();
    let report = run(&context, &scene, &particles, 1).1;
    println!("{} of {} have no list", report.searched, particles.len());
    assert_eq!((report.substeps, report.searched), (1, over(LIST_CAPACITY)));
    assert!((50..450).contains(&report.searched), "{}", report.searched);
    // Negative control: a capacity one larger or smaller gives another count.
    assert!(over(LIST_CAPACITY - 1) > report.searched && over(LIST_CAPACITY + 1) < report.searched);

    // A lattice at rest has no overflow, and a frame counts only its own.
    let calm = lattice([0.3; 3], [6; 3], [D; 3]);
    assert_eq!(run(&context, &scene, &calm, 1).1.searched, 0);
    let mut again = solver(&context, &scene, &particles, &Boundary::default());
    let first = again.advance().unwrap().1.searched;
    again.load(0, &particles).unwrap();
    assert_eq!(
        (first, again.advance().unwrap().1.searched),
        (report.searched, report.searched)
    );
}

/// Blobs of lattice with a second particle on the middle of each: by symmetry of the lattice, only
/// the two coincident particles push each other.
fn doubled(blobs: usize) -> Particles {
    let mut particles = Particles::default();
    for k in 0..blobs {
        let corner = [k % 3, k / 3 % 2, k / 6].map(|c| 0.5 + 1.0 * c as f64);
        let blob = lattice(corner, [5; 3], [0.99 * D; 3]);
        particles.position.extend(&blob.position);
        particles.position.push(blob.position[62]);
    }
    particles.id = (0..particles.position.len() as u32).collect();
    particles.velocity = vec![[0.0; 3]; particles.id.len()];
    particles
}

/// Displacement of each of the two: 2 λ ∇W as r → 0, that is 2 |λ| times the slope there, with λ =
/// −C / (Σ|∇C|² + ε) of two particles in the middle of a lattice, where the gradient along the
/// particle's own displacement is 0. Metres.
fn push_length() -> f64 {
    let calibration = Calibration::new(D, 2.0);
    let (mut kernel, mut squares) = (2.0, 1.0);
    for k in (0..125i32).filter(|&k| k != 62) {
        let step = [k % 5 - 2, k / 5 % 5 - 2, k / 25 - 2].map(f64::from);
        let q = 0.99 / 2.0 * DVec3::from_array(step).length();
        if q < 1.0 {
            kernel += (1.0 - q * q).powi(3);
            squares += (1.0 - q).powi(4);
        }
    }
    let slope = calibration.gradient_scale;
    let epsilon = 1e-3 * calibration.bulk_gradient_squares;
    let excess = calibration.density_scale * kernel - 1.0;
    2.0 * slope * excess / (slope * slope * squares + epsilon)
}

/// Displacement of the two coincident particles of each blob in one iteration, on the GPU and with
/// the reference.
fn pushes(context: &Context, particles: &Particles, blobs: usize) -> [Vec<[DVec3; 2]>; 2] {
    let scene = scene([4.0, 3.0, 3.0], 1);
    let mut cpu = reference::pbf::Pbf::new(&scene.with_pbf().unwrap(), &Boundary::default());
    cpu.load(0, particles).unwrap();
    let states = [
        run(context, &scene, particles, 1).0,
        cpu.advance().unwrap().0,
    ];
    states.map(|state| {
        let moved = |k: usize| place(&state, k) - place(particles, k);
        (0..blobs)
            .map(|blob| [126 * blob + 62, 126 * blob + 125].map(moved))
            .collect()
    })
}

/// Two coincident particles separate along a direction of their own, opposite to each other, as far
/// as λ says. λ has the density's 40 ε over an excess of a seventh, and positions of 3 m round by
/// 1e-7 beside pushes of 0.03: 280 ε and 1.4e-5, together below 1e-4. The tolerance of one
/// iteration applies to differences between device and reference, and to the sum of the two pushes.
#[test]
fn two_on_one_spot_part_as_far_as_lambda_says() {
    const BLOBS: usize = 12;
    let context = context();
    let particles = doubled(BLOBS);
    let found = pushes(&context, &particles, BLOBS);
    let length = push_length();
    assert!(length > 0.1 * D && length < 0.45 * D, "{length}");
    let mut worst: f64 = 0.0;
    for [one, other] in found.iter().flatten() {
        assert!(
            (*one + *other).length() < ONE_ITERATION_TOLERANCE,
            "{one} {other}"
        );
        worst = worst.max((one.length() / length - 1.0).abs());
    }
    println!("{length} m within {worst:.1e}");
    assert!(worst < 1e-4, "{worst:e}");
    // The same on the device and with the reference, and in every run.
    let parted = |a: &[[DVec3; 2]], b: &[[DVec3; 2]]| {
        let gaps = a.iter().zip(b).map(|(a, b)| a[0].distance(b[0]));
        gaps.fold(0.0, f64::max)
    };
    let gap = parted(&found[0], &found[1]);
    assert!(gap < ONE_ITERATION_TOLERANCE, "{gap:e}");
    assert_eq!(pushes(&context, &particles, BLOBS)[0], found[0]);
    let ways: Vec<DVec3> = found[1].iter().map(|push| push[0].normalize()).collect();
    // Each pair has its own direction: of twelve random ones, two are this close once in a thousand
    // cases.
    for (k, a) in ways.iter().enumerate() {
        assert!(ways[..k].iter().all(|b| a.distance(*b) > 0.01), "{ways:?}");
    }
    let middle = ways.iter().sum::<DVec3>() / BLOBS as f64;
    assert!(middle.length() < 0.7, "{middle}");

    // Negative controls: no push, one that is 1 % too long, one that is the same for both, and
    // another direction.
    for (from, to) in [
        (
            "delta += pair_direction(i, coincident) * 2.0",
            "delta += 0.0 * pair_direction(i, coincident) * 2.0",
        ),
        (
            "pair_direction(i, coincident) * 2.0",
            "pair_direction(i, coincident) * 2.02",
        ),
        ("select(-1.0, 1.0, a < b)", "1.0"),
        ("vec3f(2u * bits) - 1023.0", "vec3f(2u * bits) - 1003.0"),
    ] {
        let control = spoiled("pbf/compute_delta", from, to);
        let [other, _] = pushes(&control, &particles, BLOBS);
        let gap = parted(&other, &found[1]);
        let both = other.iter().map(|[a, b]| (*a + *b).length());
        let sum = both.fold(0.0, f64::max);
        println!("{to}: {gap:.1e} m, {sum:.1e} m");
        assert!(gap.max(sum) > 4.0 * ONE_ITERATION_TOLERANCE, "{to} {gap:e}");
    }
}

/// A block in free space that is too dense by a tenth. The set of neighbours does not change: the
/// next ones are 0.12 d beyond h.
fn pressed(iterations: u32) -> (Scene, Particles) {
    let mut scene = scene([2.0; 3], iterations);
    scene.probes.push(Probe {
        name: "p".to_owned(),
        kind: ProbeKind::Pressure { at: DVec3::ONE },
        rate: Rate::Frame,
        window: None,
    });
    let mut particles = lattice([0.7; 3], [6; 3], [0.95 * D; 3]);
    jitter(&mut particles, 0.01 * D);
    (scene, particles)
}

/// Compares Σ λ of two iterations, computed pair by pair in f64, with both solvers'. λ has an error
/// of 25 · 40 ε (see `ONE_ITERATION_TOLERANCE`) per iteration; the sums, of one sign, add none.
#[test]
fn lambda_is_summed_over_the_corrections() {
    const ITERATIONS: u32 = 2;
    let (scene, particles) = pressed(ITERATIONS);
    let n = particles.len();
    let mut naive = Naive::new(&scene, &particles);
    let mut sums = vec![0.0; n];
    let mut single = vec![0.0; n];
    for _ in 0..ITERATIONS {
        for (k, sum) in sums.iter_mut().enumerate() {
            single[k] = naive.lambda(k);
            *sum += single[k];
        }
        naive.positions = naive.corrected();
    }
    let largest = sums.iter().fold(0.0, |most: f64, sum| most.max(sum.abs()));
    assert!(single.iter().fold(0.0, |most: f64, l| most.max(l.abs())) > 0.02 * largest);

    let model = Model::new(&scene.with_pbf().unwrap(), &Boundary::default());
    let substep = Substep::new(&scene, &Default::default(), 0.01, 0.01);
    let mut timings = Timings::default();
    let mut sorted = Sorted::new(
        &model,
        &local(&scene, &particles),
        &particles.id,
        &mut timings,
    );
    iterate(&model, &substep, &mut sorted, &mut timings);
    let of_reference = sorted.unsorted(&sorted.lambda_sum);

    let mut gpu = solver(&context(), &scene, &particles, &Boundary::default());
    let (state, _) = gpu.advance().unwrap();
    let (ids, found) = (gpu.field(ID, n), gpu.field(LAMBDA_SUM, n));
    let mut of_gpu = vec![0.0; n];
    for (id, sum) in ids.unwrap().into_iter().zip(found.unwrap()) {
        of_gpu[id as usize] = f64::from(sum);
    }
    let gap = |found: &[f64], part: f64| {
        let gaps = found.iter().zip(&sums).map(|(a, b)| (a - part * b).abs());
        gaps.fold(0.0, f64::max) / largest
    };
    let tolerance = f64::from(ITERATIONS) * 1000.0 * f64::from(f32::EPSILON);
    println!(
        "{:.1e} {:.1e} of {tolerance:.1e}",
        gap(&of_gpu, 1.0),
        gap(&of_reference, 1.0)
    );
    assert!(gap(&of_gpu, 1.0) < tolerance);
    // Positions begin as f32 on either side; only the order of the sums differs.
    assert!(gap(&of_reference, 1.0) < 1e-10);
    // Negative control: sums 1 % off.
    assert!(gap(&of_gpu, 1.01) > 2.0 * tolerance);

    // Pressures follow by ρ κ / Δt², with κ by its definition
    // (`a_linear_pressure_pushes_by_its_gradient`).
    let scale = -1000.0 * naive.calibration.linear_gradient / (0.01 * 0.01);
    let h = naive.calibration.support_radius;
    let mut cpu = reference::pbf::Pbf::new(&scene.with_pbf().unwrap(), &Boundary::default());
    cpu.load(0, &particles).unwrap();
    cpu.advance().unwrap();
    for at in [DVec3::ONE, DVec3::new(0.93, 1.04, 0.99)] {
        let points = (0..n).map(|k| (place(&state, k), scale * sums[k]));
        let expected = fitted(points, at, h).unwrap();
        let found = [
            gpu.pressures(&[at]).unwrap()[0],
            cpu.pressures(&[at]).unwrap()[0],
        ];
        println!("{expected} Pa, {found:?}");
        for found in found {
            assert!((found.unwrap() / expected - 1.0).abs() < 2.0 * tolerance);
        }
    }
}

/// The scale from Σ λ to p: where Σ λ rises linearly along an axis of the bulk lattice, the
/// corrections equal the displacement by the gradient of p over Δt², −∇p Δt² / ρ.
#[test]
fn a_linear_pressure_pushes_by_its_gradient() {
    let naive = Naive::new(&scene([1.0; 3], 1), &lattice([0.0; 3], [9; 3], [D; 3]));
    let middle = naive.positions.len() / 2;
    let lambda = |k: usize| -1e-4 * (0.3 + naive.positions[k].y);
    let correction: DVec3 = (0..naive.positions.len())
        .map(|j| (lambda(middle) + lambda(j)) * naive.gradient(middle, j))
        .sum();
    let (density, step) = (998.0, 0.004);
    let scale = naive.calibration.pressure_scale(density, 1.0, step);
    let gradient = DVec3::Y * scale * -1e-4;
    let pushed = -gradient * step * step / density;
    let gap = correction.distance(pushed) / pushed.length();
    // Positions are f32, 3e-8 of 0.1, and λ at the middle is eight times its increase over a
    // spacing.
    assert!(gap < 1e-5, "{correction} {pushed}");
    // A relaxed correction represents a pressure that is smaller by the relaxation factor.
    let relaxed = naive.calibration.pressure_scale(density, 0.7, step);
    assert!((relaxed / scale - 0.7).abs() < 1e-12);
}
