//! Both solvers, on the GPU and in f64, compared with sums written out here from the papers'
//! formulas. A comparison between GPU and reference cannot detect errors that they share, such as
//! in the calibration of the kernels.

use crate::support::flip::{self as rig, DX, block, flip, position, velocity};
use crate::support::paper::Paper;
use crate::support::{self, D, box_mesh, context, jitter, lattice, pbf_of, scene};
use glam::{DVec3, Vec3};
use swell::{
    domain::{
        boundary::Boundary,
        bounds::Bounds,
        motion::Motion,
        particles::Particles,
        sampling::boundary_samples,
        signed_distance::SignedDistance,
        solver::{Solver, StepReport},
    },
    reference::{
        Timings,
        flip::{Flip as FlipReference, grid_confinement, grid_curl, survey},
        pbf::{Model, Pbf as PbfReference, Sorted, Substep, effects as twins, local, passes},
    },
    scene::{Iteration, Method, Scene, Stop, Wall, WaveMaker, effects, step},
    solve::{flip, pbf},
};

/// State and report after `frames` frames on the GPU and on the CPU.
fn both(scene: &Scene, particles: &Particles, frames: u32) -> [(Particles, StepReport); 2] {
    let none = Boundary::default();
    fn on<S: Solver<Error: std::fmt::Debug>>(
        mut solver: S,
        particles: &Particles,
        frames: u32,
    ) -> (Particles, StepReport) {
        solver.load(0, particles).unwrap();
        (0..frames)
            .map(|_| solver.advance().unwrap())
            .last()
            .unwrap()
    }
    match scene.solver.method() {
        Method::Pbf => [
            support::run(&context(), scene, particles, frames),
            on(
                PbfReference::new(&scene.with_pbf().unwrap(), &none),
                particles,
                frames,
            ),
        ],
        Method::Flip => [
            rig::run(&context(), scene, particles, frames),
            on(
                FlipReference::new(&scene.with_flip().unwrap(), &none),
                particles,
                frames,
            ),
        ],
    }
}

pub fn close(found: f64, expected: f64, part: f64, what: &str) {
    assert!(
        (found - expected).abs() <= part * expected.abs(),
        "{what}: {found} and not {expected}"
    );
}

/// Spacing d, m, and h/d.
const CASES: [(f64, f64); 3] = [(0.1, 2.0), (0.08, 1.7), (0.05, 2.6)];

/// The constants uploaded for the passes, rounded to f32. The wall scale has the error of the
/// midpoint rule, 1e-6 of itself.
#[test]
fn passes_are_given_the_papers_constants() {
    let context = context();
    for (d, ratio) in CASES {
        let paper = Paper::new(d, ratio);
        let mut scene = scene([10.0 * d, 12.0 * d, 8.0 * d]);
        let pbf = pbf_of(&mut scene);
        (pbf.particle_spacing, pbf.support_ratio) = (d, ratio);
        (pbf.relaxation, pbf.artificial_pressure, pbf.cfl) = (0.7, 0.2, 0.9);
        scene.shot.frames_per_second = 200.0;
        let solid = box_mesh(Bounds {
            min: DVec3::splat(5.0 * d),
            max: DVec3::new(7.0 * d, 9.0 * d, 7.0 * d),
        });
        let boundary = boundary_of(&solid, &scene.domain, d);
        let particles = lattice([0.0; 3], [4, 3, 5], [d; 3]);
        let mut solver = support::solver(&context, &scene, &particles, &boundary);
        solver.advance().unwrap();
        let params = solver.field(pbf::buffers::PARAMS, 1).unwrap()[0];
        let slope = paper
            .gradient(DVec3::new(1e-9 * paper.h, 0.0, 0.0))
            .length();
        for (name, found, expected) in [
            ("h", params.support_radius, paper.h),
            ("1/h", params.inverse_support_radius, 1.0 / paper.h),
            ("density", params.density_scale, paper.density(DVec3::ZERO)),
            ("gradient", params.gradient_scale, slope),
            ("walls", params.wall_density_scale, paper.wall_scale()),
            ("ε", params.regularization, 1e-3 * paper.squares),
            ("ω", params.relaxation, 0.7),
            ("k", params.artificial_pressure, 0.2 / paper.squares),
            ("correction", params.max_correction, 0.5 * d),
            ("contact", params.contact_distance, 0.25 * d),
            ("cap", params.max_displacement, 2.0 * 0.9 * d),
        ] {
            let what = format!("{name} at d = {d}, h = {ratio} d");
            close(f64::from(found), expected, 1.1e-6, &what);
        }
        // Weights of a solid's samples: proportional to the area of their faces, so that a sheet of
        // samples replaces the lattice beyond it.
        let n = boundary.samples.len();
        let values = solver
            .field(pbf::buffers::PREDICTED, particles.len() + n)
            .unwrap();
        let weights = values[particles.len()..].iter().map(|s| f64::from(s[3]));
        let area = 2.0 * (2.0 * 4.0 + 4.0 * 2.0 + 2.0 * 2.0);
        let plane = 315.0 / 256.0 * (1.0 - (0.5 / ratio).powi(2)).powi(4) / paper.h;
        let weight = paper.deficit * d * d / (paper.volume * plane);
        close(weights.sum(), area * weight, 1e-6, "weights");
        let model = Model::new(&scene.with_pbf().unwrap(), &boundary);
        close(
            model.sample_weights.iter().sum(),
            area * weight,
            1e-9,
            "f64",
        );
    }
}

fn boundary_of(mesh: &swell::domain::mesh::TriangleMesh, domain: &Bounds, d: f64) -> Boundary {
    let bounds = mesh.bounds().unwrap().grown(4.0 * d);
    Boundary {
        samples: boundary_samples(mesh, domain, d),
        distance: Some(SignedDistance::from_mesh(mesh, &bounds, d).unwrap()),
        ..Boundary::default()
    }
}

/// A blob far from walls, squeezed to `part` of its spacing, after one iteration: both devices give
/// the papers' sums over all pairs. The f64 reference only rounds positions near 1 m to f32, 2⁻²⁵ m
/// per axis. The GPU's error is as pbf.rs derives, 2e-5 d where corrections are up to 0.1 d,
/// and proportional to them.
#[test]
fn one_iteration_of_pbf_matches_the_papers_formulas() {
    let paper = Paper::new(D, 2.0);
    for (part, repulsion, relaxation, is_bounded) in [
        (0.98, 0.0, 1.0, false),
        (0.98, 0.1, 0.8, false),
        (0.6, 0.0, 1.0, true),
    ] {
        let mut scene = scene([2.0; 3]);
        scene.water.gravity = DVec3::ZERO;
        let pbf = pbf_of(&mut scene);
        (pbf.iteration, pbf.stop) = (Iteration::Jacobi, Stop::Iterations(1));
        (pbf.relaxation, pbf.artificial_pressure) = (relaxation, repulsion);
        pbf.cfl = 4.0;
        let mut particles = lattice([0.8; 3], [5, 6, 5], [part * D; 3]);
        jitter(&mut particles, 0.03 * D);
        let start: Vec<DVec3> = (0..particles.len())
            .map(|k| position(&particles, k))
            .collect();
        let moves = paper.corrections(&start, relaxation, repulsion);
        let largest = moves.iter().map(|m| m.length()).fold(0.0, f64::max);
        println!("{part}: moved by up to {:.4} d", largest / D);
        // The bound on corrections is active exactly where it should be.
        assert!(largest > 0.02 * D && largest < 0.5 * D + 1e-9);
        assert_eq!(largest > 0.4999 * D, is_bounded);
        let tolerances = [2e-4 * largest, 1e-7];
        for ((state, report), tolerance) in both(&scene, &particles, 1).into_iter().zip(tolerances)
        {
            assert_eq!((report.substeps, report.iterations), (1, 1));
            for (k, (start, moved)) in start.iter().zip(&moves).enumerate() {
                let off = (position(&state, k) - *start - *moved).length();
                assert!(off < tolerance, "{part}, particle {k}: {off} {tolerance}");
            }
        }
    }
}

/// Two isolated particles without pressure between them: XSPH changes the velocity of each by c V
/// W(r) of their difference.
#[test]
fn two_particles_are_slowed_by_xsph() {
    let paper = Paper::new(D, 2.0);
    let mut scene = scene([2.0; 3]);
    scene.water.gravity = DVec3::ZERO;
    scene.effects.viscosity = Some(effects::viscosity::Settings::xsph(0.3));
    let speeds = [[0.5f32, 0.0, -0.25], [-0.125, 0.25, 0.0]];
    let particles = Particles {
        position: vec![[1.0, 1.0, 1.0], [1.08, 1.03, 0.98]],
        velocity: speeds.to_vec(),
        id: vec![0, 1],
        ..Particles::default()
    };
    let before = speeds.map(|v| Vec3::from_array(v).as_dvec3());
    for (state, _) in both(&scene, &particles, 1) {
        let weight = paper.density(position(&state, 0) - position(&state, 1));
        let change = 0.3 * weight * (before[1] - before[0]);
        assert!(change.length() > 0.02, "{change}");
        for (k, sign) in [(0, 1.0), (1, -1.0)] {
            let off = velocity(&state, k) - before[k] - sign * change;
            // Positions near 1 m are off by 2⁻²⁴ m of 0.1 m, and the GPU's velocity of 0.5 m/s is
            // their difference over 10 ms: 2⁻²⁴ / 0.01.
            assert!(off.length() < 1.5e-5, "{off} of {change}");
        }
    }
}

/// Calls `test` with the passes' inputs, index and position of the middle particle of a lattice of
/// 9³ particles far from walls.
fn bulk(test: impl Fn(passes::Inputs<'_>, usize, DVec3)) {
    let scene = scene([2.0; 3]);
    let particles = lattice([0.5; 3], [9; 3], [D; 3]);
    let model = Model::new(&scene.with_pbf().unwrap(), &Boundary::default());
    let substep = Substep::new(&scene, &Default::default(), 0.01, 0.01);
    let places = local(&scene, &particles);
    let sorted = Sorted::new(&model, &places, &particles.id, &mut Timings::default());
    let middle = sorted
        .order
        .iter()
        .position(|&k| k == 4 + 9 * (4 + 9 * 4))
        .unwrap();
    test(
        sorted.inputs(&model, &substep),
        middle,
        sorted.points[middle],
    );
}

/// Rigidly rotating water has the curl 2 κ Ω by sums over the lattice, and confinement pushes by ε
/// h (N × ω) where |ω| increases along x. Positions are rounded to f32, 1e-6 of a spacing.
#[test]
fn vorticity_and_its_confinement_are_the_papers() {
    let paper = Paper::new(D, 2.0);
    bulk(|inputs, middle, center| {
        let spin = DVec3::new(0.5, -1.0, 2.0);
        let turning: Vec<DVec3> = inputs
            .points
            .iter()
            .map(|x| spin.cross(*x - center))
            .collect();
        let curl = twins::vorticity_confinement::vorticity_curl(inputs, &turning)[middle];
        let off = curl - 2.0 * paper.linear * spin;
        assert!(off.length() < 1e-5 * spin.length(), "{curl}");

        let along = |x: &DVec3| DVec3::new(0.0, 0.0, 3.0 + 4.0 * (x.x - center.x));
        let vorticity: Vec<DVec3> = inputs.points.iter().map(along).collect();
        let pushed =
            twins::vorticity_confinement::vorticity_force(inputs, 0.7, &vorticity, &turning);
        let push = pushed[middle] - turning[middle];
        // x × z = −y; Δt ε h |ω|.
        let expected = -0.01 * 0.7 * paper.h * 3.0 * DVec3::Y;
        assert!(
            (push - expected).length() < 1e-5 * expected.length(),
            "{push}"
        );
        // In the bulk, water has its rest density; the sum has 32 terms that a position's rounding
        // changes by up to 1e-6 each.
        let density = passes::measure_density(inputs)[middle];
        close(density, 1.0, 3e-5, "density");
    });
}

/// On FLIP's grid, curl and confinement (Fedkiw et al. 2001) are second-order differences, exact
/// for these fields.
#[test]
fn grid_vorticity_and_its_confinement_are_fedkiws() {
    let (scene, particles) = rig::tank([12; 3], 12);
    let trace = traced(&scene, &particles, 0.01);
    let reference = FlipReference::new(&scene.with_flip().unwrap(), &Boundary::default());
    let model = reference.model();
    let step = model.step(&step_of(0.01, 1.0), &Default::default(), &[]);
    let spin = DVec3::new(0.5, -1.0, 2.0);
    let center = DVec3::splat(0.6);
    let elements = trace.faces.velocity.len() as u32;
    let cell = |e: u32| DVec3::from_array(trace.bricks.cell(e).map(f64::from));
    // A component at the middle of the lower face along its own axis.
    let face = |e: u32, axis: usize| {
        let place = DX * (cell(e) + 0.5 - 0.5 * DVec3::AXES[axis]);
        spin.cross(place - center)[axis]
    };
    let turning: Vec<DVec3> = (0..elements)
        .map(|e| DVec3::new(face(e, 0), face(e, 1), face(e, 2)))
        .collect();
    let curl = grid_curl(model, &trace.bricks, &trace.space, &turning);
    let at = |x: i64, y: i64, z: i64| trace.bricks.element([x, y, z]) as usize;
    for place in [at(5, 5, 5), at(1, 8, 6), at(6, 6, 1)] {
        assert!(
            (curl[place] - 2.0 * spin).length() < 1e-12,
            "{}",
            curl[place]
        );
    }
    // |ω| = 3 + 4 x along z: faces across y are pushed by −Δt ε Δx |ω|, those across x and z not at
    // all.
    let rising: Vec<DVec3> = (0..elements)
        .map(|e| DVec3::new(0.0, 0.0, 3.0 + 4.0 * DX * (cell(e).x + 0.5)))
        .collect();
    let pushed = grid_confinement(
        model,
        &step,
        &trace.bricks,
        &trace.space,
        0.7,
        &rising,
        &turning,
    );
    let place = at(5, 5, 5);
    let push = pushed[place] - turning[place];
    let expected = -0.01 * 0.7 * DX * rising[place].z * DVec3::Y;
    assert!((push - expected).length() < 1e-12, "{push} {expected}");
}

fn step_of(length: f64, displacement: f64) -> step::Substep {
    step::Substep {
        start: 0.0,
        length,
        kick: length,
        displacement,
    }
}

/// Runs one substep of the f64 reference.
fn traced(scene: &Scene, particles: &Particles, length: f64) -> swell::reference::flip::Trace {
    let mut reference = FlipReference::new(&scene.with_flip().unwrap(), &Boundary::default());
    reference.load(0, particles).unwrap();
    let cloud = reference.cloud();
    let found = survey(reference.model(), &cloud);
    let displacement = found.speed * length / DX;
    reference
        .substep(&cloud, &found.is_wet, &step_of(length, displacement))
        .unwrap()
}

/// By hand: full cells have density 1, also beside walls. The surface is half a cell above the
/// topmost centres of water and half a cell below the lowest centres of air. Water with twice as
/// many particles is corrected by half a cell's worth at most.
#[test]
fn a_tank_s_cells_are_full_up_to_its_surface() {
    let (scene, particles) = rig::tank([8, 10, 8], 6);
    let trace = traced(&scene, &particles, 0.01);
    // Beside the upper wall along z; y = 0 is beside the lower wall along y.
    let at = |y: i64| trace.bricks.element([3, y, 7]) as usize;
    let centers = &trace.centers;
    // The least weight of a hat, 2.4e-7, in each of 8 particles' 27 hats; positions are rounded to
    // f32.
    for y in 0..5 {
        close(centers.density[at(y)], 1.0, 1e-5, "density");
    }
    close(
        centers.density[at(5)],
        0.875,
        1e-5,
        "density of the topmost cell",
    );
    // Where the hats' sum is 7/8 or 1/8, the distance has slope 2: twice the error of the density.
    close(
        centers.distance[at(5)],
        -0.5 * DX,
        1e-4,
        "below the surface",
    );
    close(centers.distance[at(6)], 0.5 * DX, 1e-4, "above the surface");
    let mut double = particles.clone();
    double
        .position
        .extend(particles.position.iter().map(|x| [x[0], x[1], x[2] + 1e-3]));
    double.velocity.extend(&particles.velocity);
    double.id = (0..double.position.len() as u32).collect();
    let trace = traced(&scene, &double, 0.01);
    close(trace.centers.excess[at(2)], 0.5, 1e-12, "excess");
}

/// A substep moves particles by at most twice the CFL displacement; the excess is also removed from
/// the velocity.
#[test]
fn substeps_move_by_at_most_twice_the_cfl() {
    for cfl in [0.5, 1.0] {
        let mut scene = scene([2.0; 3]);
        scene.water.gravity = DVec3::ZERO;
        pbf_of(&mut scene).cfl = cfl;
        let model = Model::new(&scene.with_pbf().unwrap(), &Boundary::default());
        let substep = Substep::new(&scene, &Default::default(), 0.01, 0.01);
        let (start, fast) = (DVec3::splat(0.8), DVec3::new(30.0, 0.0, 0.0));
        let (x, v) = passes::predict(&model, &substep, start, fast);
        close((x - start).x, 2.0 * cfl * D, 1e-12, "predicted");
        close(v.x, 2.0 * cfl * D / 0.01, 1e-12, "its velocity");
        let far = start + 0.3 * DVec3::X;
        let updated = passes::update_velocity(&model, &substep, far, start, DVec3::ZERO);
        close((updated.0 - start).x, 2.0 * cfl * D, 1e-12, "updated");
        assert!(updated.2);

        let mut scene = rig::scene([24.0, 8.0, 8.0]);
        scene.water.gravity = DVec3::ZERO;
        flip(&mut scene).cfl = cfl;
        let mut particles = block([2, 2, 2], [4, 4, 4]);
        particles.velocity.fill([30.0, 0.0, 0.0]);
        let trace = traced(&scene, &particles, 0.01);
        assert_eq!(trace.capped, particles.len() as u64);
        // The GPU gets the same limit as a uniform; `passes_are_given_the_papers_constants` checks
        // PBF's.
        let gpu = rig::solver(&context(), &scene, &particles);
        let params = gpu.field(flip::buffers::PARAMS, 1).unwrap()[0];
        close(
            f64::from(params.max_displacement),
            2.0 * cfl * DX,
            1e-7,
            "cap",
        );
        for (x, &id) in trace.after.position.iter().zip(&trace.after.id) {
            let way = x.x - position(&particles, id as usize).x;
            close(way, 2.0 * cfl * DX, 1e-9, "advected");
        }
    }
}

/// A drop on the floor comes to rest a quarter of a spacing above it with PBF, and a tenth with
/// FLIP.
#[test]
fn a_drop_comes_to_rest_at_the_contact_distance() {
    for (mut scene, contact) in [
        (scene([1.0; 3]), 0.25 * D),
        (rig::scene([8.0; 3]), 0.1 * 0.5 * DX),
    ] {
        let mut particles = lattice([0.4, contact / 2.0, 0.4], [1; 3], [contact; 3]);
        // Without the density correction, which would push the drop off the wall.
        if let swell::scene::Solver::Flip(flip) = &mut scene.solver {
            flip.density_correction = false;
        }
        particles.velocity.fill([0.0, -0.5, 0.0]);
        for (state, _) in both(&scene, &particles, 1) {
            close(position(&state, 0).y, contact, 1e-6, "height");
            assert!(velocity(&state, 0).y.abs() < 1e-6);
        }
    }
}

/// A wall at u that hits a particle of 1 kg at rest transfers m u and does the work m u · u, half
/// of which remains as kinetic energy. Afterwards the particle moves with the wall, and no more
/// work is done. The wall's position of some 0.03 m and its displacement of 5 mm are rounded to
/// f32: 4e-7.
#[test]
fn a_wall_works_on_a_particle_by_its_momentum() {
    let mut scene = scene([1.0; 3]);
    scene.water.gravity = DVec3::ZERO;
    let speed = 0.5;
    scene.wave_makers = vec![wall(speed)];
    let particles = lattice([0.25 * D - 0.05, 0.4, 0.4], [1; 3], [0.1; 3]);
    for (frames, work) in [(1, speed * speed), (2, 0.0)] {
        for (_, report) in both(&scene, &particles, frames) {
            let off = (report.boundary_work - work).abs();
            assert!(
                off < 1e-5 * speed * speed,
                "{frames}: {}",
                report.boundary_work
            );
            close(report.kinetic_energy, 0.5 * speed * speed, 1e-5, "kinetic");
        }
    }
}

fn wall(velocity: f64) -> WaveMaker {
    WaveMaker {
        absorption: None,
        wall: Wall {
            axis: 0,
            is_max: false,
        },
        motion: Motion::ConstantVelocity {
            velocity,
            until: None,
        },
    }
}

/// A column of 8 × 4 × 4 cells that a wall sets in motion within a step: p falls from ρ u (L −
/// Δx/2) / Δt at the first centres to 0 at the free end, so the wall does the work ρ A u² (L −
/// Δx/2), and the water has ρ A L u² / 2. A tolerance of 1e-6 on the residual allows 29 times as
/// much on the pressure, for 8 cells.
#[test]
fn a_wall_works_on_a_column_by_its_pressure() {
    let mut scene = rig::scene([16.0, 4.0, 4.0]);
    scene.water.gravity = DVec3::ZERO;
    flip(&mut scene).pressure.tolerance = 1e-6;
    let speed = 0.5;
    scene.wave_makers = vec![wall(speed)];
    let particles = block([0; 3], [8, 4, 4]);
    let (area, length) = (0.16, 0.8);
    for (_, report) in both(&scene, &particles, 1) {
        assert_eq!(report.substeps, 1);
        let thrust = 1000.0 * area * speed * speed;
        close(
            report.boundary_work,
            thrust * (length - DX / 2.0),
            1e-4,
            "work",
        );
        close(
            report.kinetic_energy,
            0.5 * thrust * length,
            1e-4,
            "kinetic",
        );
    }
}
