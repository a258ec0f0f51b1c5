//! Surface tension: a drop at rest has the Laplace pressure and stays at rest, and a deformed drop
//! oscillates with Lamb's period.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, Vec3};
use swell::{
    domain::{
        boundary::Boundary,
        particles::Particles,
        probe::Rate,
        solver::{Solver, StepReport},
    },
    gpu::adapter::Context,
    reference,
    scene::{
        Method, Scene,
        effects::{surface_tension::Settings, viscosity},
        flip::Transfer,
        probe::{Probe, ProbeKind},
    },
    solve::SolveError,
};

use crate::support::{self, choose, context, flip as of_flip, pbf_of};
use of_flip::DX;

const METHODS: [Method; 2] = [Method::Flip, Method::Pbf];

/// Surface tension, N/m.
const SIGMA: f64 = 100.0;
/// Density, kg/m³.
const RHO: f64 = 1000.0;

/// A drop in the middle of a box of `cells` cells, with frames of four of the longest substeps.
fn scene(method: Method, cells: f64) -> Scene {
    let mut scene = of_flip::scene([cells; 3]);
    let pbf = pbf_of(&mut scene);
    pbf.particle_spacing = DX / 2.0;
    pbf.grid_projection = true;
    choose(&mut scene, method);
    scene.water.gravity = DVec3::ZERO;
    scene.effects.surface_tension = Some(Settings { coefficient: SIGMA });
    scene.shot.frames_per_second = 0.2501 / longest(SIGMA);
    scene.probes.push(Probe {
        name: "inside".to_owned(),
        kind: ProbeKind::Pressure { at: middle(cells) },
        rate: Rate::Frame,
        window: None,
    });
    scene
}

/// Capillary limit of a substep, s.
fn longest(sigma: f64) -> f64 {
    (RHO * DX.powi(3) / (TAU * sigma)).sqrt()
}

/// Centre of the drop, away from every symmetry of the cells, m.
fn middle(cells: f64) -> DVec3 {
    DX * (DVec3::splat(0.5 * cells) + DVec3::new(0.13, -0.21, 0.34))
}

/// Particles of a disturbed lattice in r < R (1 + a P₂(cos θ)) about the middle, R in cells.
fn drop(cells: f64, radius: f64, amplitude: f64) -> Particles {
    let all = 2 * cells as usize;
    let mut particles = support::lattice([0.0; 3], [all; 3], [DX / 2.0; 3]);
    support::jitter(&mut particles, 0.125 * DX / 2.0);
    let middle = middle(cells);
    let is_in = |x: &[f32; 3]| {
        let d = (Vec3::from_array(*x).as_dvec3() - middle) / DX;
        let legendre = 1.5 * (d.z / d.length()).powi(2) - 0.5;
        d.length() < radius * (1.0 + amplitude * legendre)
    };
    let position: Vec<[f32; 3]> = (particles.position.iter().copied()).filter(is_in).collect();
    Particles {
        velocity: vec![[0.0; 3]; position.len()],
        id: (0..position.len() as u32).collect(),
        position,
        ..Particles::default()
    }
}

/// Radius of the sphere of the same volume, m.
fn radius(particles: &Particles) -> f64 {
    let volume = particles.len() as f64 * (DX / 2.0).powi(3);
    (3.0 * volume / (4.0 * PI)).cbrt()
}

fn solver(
    context: &Context,
    scene: &Scene,
    particles: &Particles,
) -> Box<dyn Solver<Error = SolveError>> {
    match scene.solver.method() {
        Method::Pbf => {
            let none = Boundary::default();
            Box::new(support::solver(context, scene, particles, &none))
        }
        Method::Flip => Box::new(of_flip::solver(context, scene, particles)),
    }
}

/// Largest and rms speed of the particles, m/s.
fn speeds(particles: &Particles) -> [f64; 2] {
    let squares =
        (particles.velocity.iter()).map(|v| Vec3::from_array(*v).as_dvec3().length_squared());
    let (most, sum) = squares.fold((0.0f64, 0.0), |(most, sum), s| (most.max(s), sum + s));
    [most.sqrt(), (sum / particles.len() as f64).sqrt()]
}

/// 2 σ / R inside a drop with a radius of six cells, within 5 %. Where the water is as viscous as
/// in the usual test (Popinet 2009: a Laplace number σ D ρ / μ² of 120), no particle is faster than
/// a hundredth of √(σ / (ρ R)) with FLIP. PBF's viscosity is the effect of that name; FLIP's is α
/// Δx² / (6 Δt) (Zhu and Bridson 2005).
#[test]
fn a_drop_at_rest_has_laplaces_pressure_and_keeps_still() {
    let context = context();
    let (cells, size) = (22.0, 6.0);
    let particles = drop(cells, size, 0.0);
    let r = radius(&particles);
    let capillary = (SIGMA / (RHO * r)).sqrt();
    for method in METHODS {
        let frames = 30;
        let mut scene = scene(method, cells);
        let step = scene.shot.frame_seconds() / 4.0;
        let viscosity = (SIGMA * 2.0 * r / (RHO * 120.0)).sqrt();
        match method {
            Method::Flip => {
                let blend = 6.0 * viscosity * step / DX.powi(2);
                of_flip::flip(&mut scene).pic_blend = 1.0 - (1.0 - blend).powi(4);
            }
            Method::Pbf => {
                scene.effects.viscosity = Some(viscosity::Settings {
                    coefficient: Some(RHO * viscosity),
                    tolerance: Some(1e-3),
                    xsph: None,
                });
            }
        }
        let run = |scene: &Scene, frames: u32| -> (f64, [f64; 2], StepReport) {
            let mut solver = solver(&context, scene, &particles);
            let mut last = None;
            for _ in 0..frames {
                last = Some(solver.advance().unwrap());
            }
            let (state, report) = last.unwrap();
            let inside = solver.pressures(&scene.pressure_points()).unwrap()[0];
            (inside.unwrap(), speeds(&state), report)
        };
        let (inside, [most, mean], report) = run(&scene, frames);
        let expected = 2.0 * SIGMA / r;
        println!(
            "{method:?}: {:.4} of 2 σ / R, and of the capillary velocity {:.4} at most, \
             {:.4} in the mean; {} substeps",
            inside / expected,
            most / capillary,
            mean / capillary,
            report.substeps
        );
        assert!(
            (inside / expected - 1.0).abs() < 0.05,
            "{inside} {expected}"
        );
        let least = match method {
            Method::Flip => 0.01,
            // Misses FLIP's bound by a factor of two: particles of the lattice keep pushing each
            // other, as fast after 90 frames as after 30.
            Method::Pbf => 0.03,
        };
        assert!(most / capillary < least, "{}", most / capillary);
        assert_eq!(report.substeps, 4);
        // Negative control: half of the tension gives half of the pressure, and none gives none.
        scene.effects.surface_tension = Some(Settings {
            coefficient: 0.5 * SIGMA,
        });
        let (inside, ..) = run(&scene, 1);
        assert!(
            (inside / expected - 0.5).abs() < 0.025,
            "{inside} {expected}"
        );
        scene.effects.surface_tension = None;
        let (inside, ..) = run(&scene, 1);
        assert!(inside.abs() < 1e-3 * expected, "{inside}");
    }
}

/// The f64 reference, whole frames of both solvers.
#[test]
fn the_reference_has_laplaces_pressure() {
    let (cells, size) = (18.0, 5.0);
    let particles = drop(cells, size, 0.0);
    let expected = 2.0 * SIGMA / radius(&particles);
    let none = Boundary::default();
    for method in METHODS {
        let scene = scene(method, cells);
        let inside = |solver: &mut dyn Solver<Error = reference::ReferenceError>| {
            solver.load(0, &particles).unwrap();
            solver.advance().unwrap();
            let inside = solver.pressures(&scene.pressure_points()).unwrap()[0];
            inside.unwrap()
        };
        let inside = match method {
            Method::Flip => inside(&mut reference::flip::Flip::new(
                &scene.with_flip().unwrap(),
                &none,
            )),
            Method::Pbf => inside(&mut reference::pbf::Pbf::new(
                &scene.with_pbf().unwrap(),
                &none,
            )),
        };
        println!("{method:?}: {:.4} of 2 σ / R", inside / expected);
        assert!(
            (inside / expected - 1.0).abs() < 0.05,
            "{inside} {expected}"
        );
    }
}

/// ω² = 8 σ / (ρ R³) of the second mode (Lamb 1932, §275), within 5 %. Measured as the time between
/// the first and the third passage of the second moment through that of a sphere, for a drop with a
/// radius of ten cells, elongated by a tenth.
fn assert_lambs_period(method: Method) {
    let context = context();
    let (cells, size) = (28.0, 10.0);
    let particles = drop(cells, size, 0.1);
    let r = radius(&particles);
    let period = TAU / (8.0 * SIGMA / (RHO * r.powi(3))).sqrt();
    let mut scene = scene(method, cells);
    let flip = of_flip::flip(&mut scene);
    (flip.transfer, flip.pic_blend) = (Transfer::Flip, 0.02);
    let length = scene.shot.frame_seconds();
    let mut solver = solver(&context, &scene, &particles);
    let mut moments = vec![moment(&particles)];
    let mut passed = Vec::new();
    while passed.len() < 3 && (moments.len() as f64) * length < 1.6 * period {
        let (state, _) = solver.advance().unwrap();
        let (before, now) = (moments[moments.len() - 1], moment(&state));
        if before * now < 0.0 {
            let part = before / (before - now);
            passed.push((moments.len() as f64 - 1.0 + part) * length);
        }
        moments.push(now);
    }
    let [first, _, third] = passed[..] else {
        panic!("{passed:?} {moments:?}")
    };
    let found = (third - first) / period;
    println!("{method:?}: {found:.4} of Lamb's period");
    assert!((found - 1.0).abs() < 0.05, "{found}");
}

#[test]
fn an_ellipsoid_of_flip_oscillates_with_lambs_period() {
    assert_lambs_period(Method::Flip);
}

#[test]
fn an_ellipsoid_of_pbf_oscillates_with_lambs_period() {
    assert_lambs_period(Method::Pbf);
}

/// ⟨z² − (x² + y²)/2⟩ about the centre, m².
fn moment(particles: &Particles) -> f64 {
    let places = || {
        particles
            .position
            .iter()
            .map(|x| Vec3::from_array(*x).as_dvec3())
    };
    let n = particles.len() as f64;
    let middle = places().sum::<DVec3>() / n;
    let terms = places().map(|x| {
        let d = x - middle;
        d.z * d.z - 0.5 * (d.x * d.x + d.y * d.y)
    });
    terms.sum::<f64>() / n
}

/// Surface tension adds passes to scenes that name it, and none to others.
#[test]
fn a_scene_that_names_no_tension_pays_for_none() {
    let context = context();
    for method in METHODS {
        let mut scene = scene(method, 16.0);
        let plan = |scene: &Scene| support::plan(&context, scene, 1000, &Boundary::default());
        let names = |plan: &swell::solve::plan::Plan| -> Vec<&'static str> {
            let own = plan.passes.iter().map(|pass| pass.spec.name);
            let of_grid = plan.projection.iter().flat_map(|plan| &plan.passes);
            own.chain(of_grid.map(|pass| pass.spec.name)).collect()
        };
        let with = names(&plan(&scene));
        let tensions =
            |names: &[&str]| names.iter().filter(|name| name.contains("tension")).count();
        assert_eq!(tensions(&with), 5, "{with:?}");
        scene.effects.surface_tension = None;
        let bare = names(&plan(&scene));
        assert_eq!(tensions(&bare), 0, "{bare:?}");
        assert_eq!(with.len(), bare.len() + 5);
    }
}
