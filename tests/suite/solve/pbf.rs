//! PBF on the GPU: compared with a naive f64 implementation and with analysis, and invariants of
//! every run.
mod naive;
mod pairs;
mod solids;

use self::naive::Naive;
use crate::support::*;
use glam::DVec3;
use swell::{
    domain::{boundary::Boundary, budget::Breach, particles::Particles, solver::Solver},
    scene::{Iteration, Scene, Stop, effects},
    solve::{SolveError, pbf::Pbf, plan::*},
};

/// Compressed and jittered water that touches five walls.
fn compressed() -> (Scene, Particles) {
    let mut scene = scene([1.0, 1.4, 1.0]);
    scene.water.gravity = DVec3::ZERO;
    pbf_of(&mut scene).iteration = Iteration::Jacobi;
    pbf_of(&mut scene).stop = Stop::Iterations(1);
    let mut particles = lattice([0.0; 3], [10, 10, 10], [D, 0.96 * D, D]);
    jitter(&mut particles, 0.15 * D);
    (scene, particles)
}

/// f32 sums of about 40 terms of either sign: 40 ε relative to the sum of their magnitudes.
/// Corrections are up to 0.1 d and their terms ten times that, and λ carries the density's own 40 ε
/// over a 4 % excess: 25 · 40 ε. Positions near 1 m round at ε. The total is below 2e-5 d.
const ONE_ITERATION_TOLERANCE: f64 = 2e-5 * D;

fn one_iteration_gap(spoil: f64) -> (f64, f64) {
    let (scene, particles) = compressed();
    let mut naive = Naive::new(&scene, &particles);
    naive.calibration.gradient_scale *= spoil;
    let expected = naive.corrected();
    let (state, _) = run(&context(), &scene, &particles, 1);
    let gap = |k: usize| {
        glam::Vec3::from_array(state.position[k])
            .as_dvec3()
            .distance(expected[k])
    };
    let moved = |k: usize| naive.positions[k].distance(expected[k]);
    let n = particles.len();
    (
        (0..n).map(gap).fold(0.0, f64::max),
        (0..n).map(moved).fold(0.0, f64::max),
    )
}

#[test]
fn one_jacobi_iteration_matches_the_naive_twin() {
    let (gap, moved) = one_iteration_gap(1.0);
    assert!(moved > 0.01 * D, "nothing was corrected: {moved}");
    assert!(gap < ONE_ITERATION_TOLERANCE, "{gap} m, {} d", gap / D);
    // Negative control: the kernel's gradient off by 2 %.
    let (gap, _) = one_iteration_gap(1.02);
    assert!(gap > ONE_ITERATION_TOLERANCE, "{gap}");
}

/// Sums of 34 positive f32 terms: 34 ε, and 8 ε for the rounding of the kernel.
const DENSITY_TOLERANCE: f64 = 42.0 * f32::EPSILON as f64;

#[test]
fn measured_density_matches_the_naive_twin() {
    let (scene, particles) = compressed();
    let mut solver = solver(&context(), &scene, &particles, &Boundary::default());
    let (state, report) = solver.advance().unwrap();
    let naive = Naive::new(&scene, &state);
    let mut errors: Vec<f64> = (0..state.len())
        .map(|i| (naive.density(i) - 1.0).max(0.0))
        .collect();
    let mean = errors.iter().sum::<f64>() / errors.len() as f64;
    errors.sort_by(f64::total_cmp);
    assert!(
        (report.density_error_mean - mean).abs() < DENSITY_TOLERANCE,
        "{} {mean}",
        report.density_error_mean
    );
    assert!((report.density_error_max - errors[999]).abs() < DENSITY_TOLERANCE);
    assert!((report.density_error_p99 - errors[989]).abs() < DENSITY_TOLERANCE);
    assert!(report.density_error_p99 < report.density_error_max);
}

#[test]
fn colours_and_stops_converge() {
    let (mut scene, particles) = compressed();
    let context = context();
    let start = run(&context, &scene, &particles, 1).1.density_error_mean;
    for iteration in [Iteration::Jacobi, Iteration::RedBlack] {
        pbf_of(&mut scene).iteration = iteration;
        let mut last = start;
        for count in [4, 16, 64] {
            pbf_of(&mut scene).stop = Stop::Iterations(count);
            let (_, report) = run(&context, &scene, &particles, 1);
            assert_eq!(
                report.iterations,
                u64::from(count) * u64::from(report.substeps)
            );
            // Four times the work: even an error that falls with the square root of the count would
            // halve.
            assert!(
                report.density_error_mean < 0.8 * last,
                "{iteration:?} {count}: {report:?}"
            );
            last = report.density_error_mean;
        }
        // Stopping at a density error: a looser bound takes fewer iterations, and the bound is met.
        let mut counts = Vec::new();
        for density_error in [0.01, 0.002] {
            pbf_of(&mut scene).stop = Stop::DensityError {
                density_error,
                max_iterations: 200,
            };
            let (_, report) = run(&context, &scene, &particles, 1);
            // The loop stops on the density that λ uses, and the black half is older than the last
            // correction: 2 %.
            assert!(
                report.density_error_mean < 1.02 * density_error,
                "{iteration:?}: {report:?}"
            );
            counts.push(report.iterations);
        }
        assert!(
            0 < counts[0] && counts[0] < counts[1] && counts[1] < 200,
            "{iteration:?}: {counts:?}"
        );
    }
}

/// Benefit of colouring: mean density error of a column compressed by 3 %, red/black versus Jacobi,
/// for the same number of iterations and the same work. `--nocapture` prints the table that
/// docs/reliability.md and solve::iteration refer to.
#[test]
fn red_black_leaves_less_error_than_jacobi() {
    let context = context();
    let mut scene = scene([1.6, 3.0, 1.6]);
    scene.water.gravity = DVec3::ZERO;
    scene.shot.frames_per_second = 1000.0;
    let particles = lattice([0.0; 3], [16, 20, 16], [D, 0.97 * D, D]);
    for count in [4, 16, 64] {
        pbf_of(&mut scene).stop = Stop::Iterations(count);
        let [jacobi, red_black] = [Iteration::Jacobi, Iteration::RedBlack].map(|iteration| {
            pbf_of(&mut scene).iteration = iteration;
            let (_, report) = run(&context, &scene, &particles, 1);
            println!(
                "{count:3} {iteration:?}: mean {:.3} %, max {:.2} %",
                100.0 * report.density_error_mean,
                100.0 * report.density_error_max
            );
            report.density_error_mean
        });
        assert!(red_black < jacobi, "{count}: {red_black} {jacobi}");
    }
}

/// In the same column, the Chebyshev semi-iteration reaches in 4 iterations what red/black does not
/// reach in 8, and in 16 what it does not in 32, at the cost of a Jacobi iteration. Negative
/// control: with a spectral radius near zero it is under-relaxed Jacobi, which is worse.
#[test]
fn chebyshev_leaves_less_error_than_red_black() {
    let context = context();
    let mut scene = scene([1.6, 3.0, 1.6]);
    scene.water.gravity = DVec3::ZERO;
    scene.shot.frames_per_second = 1000.0;
    let particles = lattice([0.0; 3], [16, 20, 16], [D, 0.97 * D, D]);
    let mut error = |iteration: Iteration, spectral_radius: f64, count: u32| {
        let pbf = pbf_of(&mut scene);
        pbf.stop = Stop::Iterations(count);
        pbf.iteration = iteration;
        pbf.spectral_radius = spectral_radius;
        pbf.relaxation = match iteration {
            Iteration::Chebyshev => 0.7,
            Iteration::Jacobi | Iteration::RedBlack => 1.0,
        };
        let (_, report) = run(&context, &scene, &particles, 1);
        println!(
            "{count:3} {iteration:?}: mean {:.3} %, max {:.2} %",
            100.0 * report.density_error_mean,
            100.0 * report.density_error_max
        );
        report.density_error_mean
    };
    let (chebyshev, red_black) = (Iteration::Chebyshev, Iteration::RedBlack);
    assert!(error(chebyshev, 0.98, 4) < error(red_black, 0.98, 8));
    assert!(error(chebyshev, 0.98, 16) < error(red_black, 0.98, 32));
    assert!(error(chebyshev, 0.001, 16) > error(red_black, 0.98, 16));
}

/// With a little viscosity, as in the shipped scenes, a tank settles at its compressed height and
/// its jitter decays. Without it, 4 iterations at 10 ms leave 0.3 m/s permanently: what one step
/// does not correct, the next turns into velocity.
#[test]
fn still_water_settles() {
    let context = context();
    let mut scene = scene([1.6, 2.0, 1.6]);
    let particles = lattice([0.0; 3], [16, 10, 16], [D; 3]);
    let (_, restless) = run(&context, &scene, &particles, 200);
    scene.effects.viscosity = Some(effects::viscosity::Settings::xsph(0.05));
    let (state, report) = run(&context, &scene, &particles, 200);
    assert!(
        report.density_error_mean < 0.01 && report.density_error_max < 0.05,
        "{report:?}"
    );
    let mass = particles.len() as f64 * 1000.0 * D.powi(3);
    let speed = |energy: f64| (2.0 * energy / mass).sqrt();
    println!(
        "root mean square speed {:.3} m/s without viscosity, {:.3} m/s with",
        speed(restless.kinetic_energy),
        speed(report.kinetic_energy)
    );
    // At most half the speed: measured 0.11 of 0.30 m/s; equal speeds would mean no effect.
    assert!(
        report.kinetic_energy < 0.25 * restless.kinetic_energy,
        "{report:?} {restless:?}"
    );
    // 10 layers at 0.5 m mean height, compressed and rearranged by at most 8 %.
    let mean = state.position.iter().map(|p| f64::from(p[1])).sum::<f64>() / state.len() as f64;
    assert!((0.46..0.5).contains(&mean), "{mean}");
    let inside = |p: &[f32; 3]| {
        p.iter()
            .zip([1.6, 2.0, 1.6])
            .all(|(&x, size)| x > 0.0 && x < size)
    };
    assert!(state.position.iter().all(inside));
}

#[test]
fn same_bytes_twice_and_from_any_frame() {
    let context = context();
    let mut scene = scene([2.4, 1.6, 1.0]);
    scene.effects.viscosity = Some(effects::viscosity::Settings::xsph(0.02));
    scene.effects.vorticity_confinement =
        Some(effects::vorticity_confinement::Settings { strength: 0.1 });
    let mut particles = lattice([0.0; 3], [10, 10, 10], [D; 3]);
    jitter(&mut particles, 0.01);
    let mut first = solver(&context, &scene, &particles, &Boundary::default());
    let states: Vec<Particles> = (0..12).map(|_| first.advance().unwrap().0).collect();
    assert_ne!(states[10], states[11]);
    let (again, _) = run(&context, &scene, &particles, 12);
    assert!(again == states[11]);
    for frame in [1, 5, 11] {
        let mut resumed = solver(&context, &scene, &particles, &Boundary::default());
        resumed.load(frame, &states[frame as usize - 1]).unwrap();
        let last = advance(&mut resumed, 12 - frame);
        assert!(last == states[11], "from frame {frame}");
    }
    // Negative control: one bit of one velocity suffices for a different result.
    let mut spoiled = states[4].clone();
    spoiled.velocity[500][0] = f32::from_bits(spoiled.velocity[500][0].to_bits() ^ 1 << 12);
    let mut resumed = solver(&context, &scene, &particles, &Boundary::default());
    resumed.load(5, &spoiled).unwrap();
    let last = advance(&mut resumed, 12 - 5);
    assert!(last != states[11]);
}

/// Lists and positions in several bindings give the same bytes. Without lists the water is the same
/// except for what a list, built once per substep, cannot contain: neighbours that come within h
/// during the iteration, of weight (δ/h)².
#[test]
fn chunked_lists_and_no_lists() {
    let context = context();
    let scene = scene([3.0, 3.0, 3.0]);
    let mut particles = lattice([0.0; 3], [20, 20, 20], [D; 3]);
    jitter(&mut particles, 0.01);
    let boundary = Boundary::default();
    let whole = run(&context, &scene, &particles, 3).0;
    let with = |limits: DeviceLimits, chunks: usize, has_lists: bool| {
        let counts = Counts {
            particles: particles.len(),
            ..Counts::default()
        };
        let plan = Plan::new(&scene, counts, limits);
        assert_eq!((plan.chunks.len(), plan.has_lists), (chunks, has_lists));
        let mut solver =
            Pbf::new(&context, &scene.with_pbf().unwrap(), plan, &boundary, false).unwrap();
        solver.load(0, &particles).unwrap();
        advance(&mut solver, 3)
    };
    let limits = device_limits(&context);
    let chunked = with(
        DeviceLimits {
            binding: 600_000,
            ..limits
        },
        3,
        true,
    );
    assert!(chunked == whole);
    // Positions in two bindings as well; the first ends in the middle of the water.
    let paged = DeviceLimits {
        binding: 100_000,
        ..limits
    };
    let counts = Counts {
        particles: particles.len(),
        ..Counts::default()
    };
    assert_eq!(Plan::new(&scene, counts, paged).page, Some(6250));
    assert!(with(paged, 16, true) == whole);
    let searched = with(
        DeviceLimits {
            list_budget: 0,
            ..limits
        },
        1,
        false,
    );
    assert!(searched != whole, "the search finds what the lists cannot");
    // A neighbour 0.05 d inside h has (1 − 0.975²)³ = 1e-4 of W(0): one correction differs by that
    // fraction of d. Three substeps of contacts have no derived bound; 2 % of d is far below a
    // correction's own limit, 0.5 d.
    let gap = max_distance(&searched, &whole);
    assert!(gap < 0.02 * D, "{gap}");
}

/// Counters that the ledger reports for a frame: lists that overflowed, and particles slowed to the
/// displacement cap.
#[test]
fn lists_that_overflow_and_particles_that_are_slowed_are_counted() {
    let context = context();
    let mut scene = scene([2.0, 2.0, 2.0]);
    scene.water.gravity = DVec3::ZERO;
    const CAP: f64 = 0.2;
    pbf_of(&mut scene).cfl = CAP;
    let (frame, mut counted) = (scene.shot.frame_seconds(), Vec::new());
    // Particles far apart, and a cluster in which each particle has all others as neighbours: more
    // than a list holds, or fewer.
    for knot in [[5, 4, 3], [4, 5, 2]] {
        let mut particles = lattice([0.0; 3], [4, 4, 2], [0.4; 3]);
        for at in lattice([1.0, 1.0, 1.4], knot, [0.01; 3]).position {
            particles.position.push(at);
            particles.velocity.push([0.0; 3]);
            particles.id.push(particles.id.len() as u32);
        }
        let mut solver = solver(&context, &scene, &particles, &Boundary::default());
        let (state, report) = solver.advance().unwrap();
        assert_eq!(report.substeps, 1, "from rest");
        let crowd: usize = knot.iter().product();
        let expected = if crowd - 1 > LIST_CAPACITY as usize {
            crowd
        } else {
            0
        };
        assert_eq!(report.searched, expected as u64);
        // In one substep from rest the displacement is velocity times time; ten roundings.
        let is_slowed = |v: &&[f32; 3]| {
            let way = glam::Vec3::from_array(**v).as_dvec3().length() * frame;
            way > CAP * D * (1.0 - 10.0 * f64::from(f32::EPSILON))
        };
        let slowed = state.velocity.iter().filter(is_slowed).count();
        assert_eq!(report.capped, slowed as u64);
        counted.push((expected, slowed));
    }
    assert!(
        counted[0].0 > 0 && counted[1].0 == 0 && counted.iter().any(|c| c.1 > 0),
        "{counted:?}"
    );
}

#[test]
fn coincident_particles_part() {
    let context = context();
    let mut scene = scene([1.0, 1.0, 1.0]);
    scene.water.gravity = DVec3::ZERO;
    let mut particles = lattice([0.0; 3], [10, 10, 10], [D; 3]);
    for k in 1..20 {
        particles.position[k] = particles.position[0];
    }
    let (state, _) = run(&context, &scene, &particles, 30);
    let mut least = f64::INFINITY;
    for i in 0..20 {
        for j in 0..i {
            let [a, b] = [i, j].map(|k| glam::Vec3::from_array(state.position[k]));
            least = least.min(f64::from(a.distance(b)));
        }
    }
    // Twenty particles at one position must only separate: the artificial pressure that would space
    // them is off.
    assert!(least > 0.2 * D, "{least}");
    assert!(state == run(&context, &scene, &particles, 30).0);
}

#[test]
fn too_fast_for_its_substeps_is_an_error() {
    let context = context();
    let mut scene = scene([1.0; 3]);
    pbf_of(&mut scene).max_substeps = 4;
    let mut particles = lattice([0.3; 3], [2, 2, 2], [D; 3]);
    particles.velocity[3] = [100.0, 0.0, 0.0];
    let mut solver = solver(&context, &scene, &particles, &Boundary::default());
    let error = solver.advance().unwrap_err();
    assert!(
        matches!(error, SolveError::Numbers(Breach { frame: 1, .. })),
        "{error}"
    );
    assert!(error.to_string().contains("max_substeps"), "{error}");
}

#[test]
fn velocity_that_is_not_a_number_is_an_error() {
    let context = context();
    let scene = scene([1.0; 3]);
    let mut particles = lattice([0.3; 3], [3, 3, 3], [D; 3]);
    particles.velocity[5][1] = f32::NAN;
    let mut solver = solver(&context, &scene, &particles, &Boundary::default());
    let error = solver.advance().unwrap_err();
    assert!(error.to_string().contains("not finite"), "{error}");
}

#[test]
fn no_particles_make_an_empty_frame() {
    let (state, report) = run(&context(), &scene([1.0; 3]), &Particles::default(), 2);
    assert!(state.is_empty());
    assert_eq!(report.density_error_max, 0.0);
}

/// State after `frames` more frames.
fn advance(solver: &mut Pbf, frames: u32) -> Particles {
    let mut last = None;
    for _ in 0..frames {
        last = Some(solver.advance().unwrap().0);
    }
    last.unwrap()
}

fn names(plan: &Plan) -> (Vec<&str>, Vec<&str>) {
    let mut passes: Vec<&str> = plan.passes.iter().map(|pass| pass.spec.name).collect();
    let mut buffers: Vec<&str> = plan
        .buffers
        .iter()
        .map(|buffer| buffer.spec.name.as_str())
        .collect();
    passes.sort_unstable();
    buffers.sort_unstable();
    (passes, buffers)
}

/// What the scene does not name costs no pass, no buffer and no byte, and exactly the planned
/// passes run.
#[test]
fn plan_of_a_bare_scene_has_no_pass_or_buffer_of_effects() {
    let context = context();
    let mut scene = scene([1.0; 3]);
    let particles = lattice([0.0; 3], [5, 5, 5], [D; 3]);
    let bare = plan(&context, &scene, particles.len(), &Boundary::default());
    let (passes, buffers) = names(&bare);
    assert!(
        passes.iter().all(|pass| !pass.starts_with("effects/")),
        "{passes:?}"
    );
    assert!(
        buffers.iter().all(|name| !name.contains("visc")
            && !name.contains("vort")
            && !name.contains("solid"))
    );

    scene.effects.viscosity = Some(effects::viscosity::Settings::xsph(0.01));
    let viscous = plan(&context, &scene, particles.len(), &Boundary::default());
    let added = |after: &[&str], before: &[&str]| -> Vec<String> {
        after
            .iter()
            .filter(|name| !before.contains(name))
            .map(|name| (*name).to_owned())
            .collect()
    };
    assert_eq!(
        added(&names(&viscous).0, &passes),
        ["effects/viscosity_apply", "effects/viscosity_gather"]
    );
    assert_eq!(added(&names(&viscous).1, &buffers), ["viscosity_change"]);
    assert_eq!(viscous.bytes().0 - bare.bytes().0, 12 * 125);

    scene.effects.vorticity_confinement =
        Some(effects::vorticity_confinement::Settings { strength: 1.0 });
    for effects_on in [false, true] {
        if !effects_on {
            scene.effects = Default::default();
        } else {
            scene.effects.vorticity_confinement =
                Some(effects::vorticity_confinement::Settings { strength: 1.0 });
        }
        let solver = solver(&context, &scene, &particles, &Boundary::default());
        let mut recorded = solver.recorded_passes();
        recorded.sort_unstable();
        recorded.dedup();
        assert_eq!(recorded, names(solver.plan()).0);
        assert_eq!(solver.built(), names(solver.plan()));
    }
}

/// Memory without lists and effects: at most 200 bytes per particle at the cell density of a
/// typical shot.
#[test]
fn bytes_per_particle() {
    let mut scene = scene([25.0, 12.6, 15.0]);
    pbf_of(&mut scene).particle_spacing = 0.1;
    let counts = Counts {
        particles: 201_000,
        ..Counts::default()
    };
    let limits = DeviceLimits {
        binding: 128 << 20,
        buffer: 2 << 30,
        list_budget: LIST_BUDGET,
    };
    let (all, lists) = Plan::new(&scene, counts, limits).bytes();
    let each = (all - lists) as f64 / 201_000.0;
    assert!(each < 200.0, "{each}");
    assert!(lists > 0);
}

#[test]
fn viscosity_damps_and_confinement_feeds() {
    let context = context();
    let mut scene = scene([1.2; 3]);
    scene.water.gravity = DVec3::ZERO;
    let mut particles = lattice([0.0; 3], [12, 12, 12], [D; 3]);
    for (position, velocity) in particles.position.iter().zip(&mut particles.velocity) {
        // A vortex in the middle that decays toward the walls.
        let (x, y) = (position[0] - 0.6, position[1] - 0.6);
        let strength = 2.0 * (-(x * x + y * y) / 0.08).exp();
        *velocity = [-y * strength, x * strength, 0.0];
    }
    let energy = |scene: &Scene| run(&context, scene, &particles, 5).1.kinetic_energy;
    let plain = energy(&scene);
    scene.effects.viscosity = Some(effects::viscosity::Settings::xsph(0.1));
    let damped = energy(&scene);
    scene.effects = Default::default();
    scene.effects.vorticity_confinement =
        Some(effects::vorticity_confinement::Settings { strength: 2.0 });
    let fed = energy(&scene);
    assert!(
        damped < 0.98 * plain && plain < fed,
        "{damped} {plain} {fed}"
    );
}
