//! Newtonian viscosity in Pa s: flows between plates and vortices decay as in theory, no
//! coefficient is unstable, and water at rest keeps its pressure.

use std::f64::consts::{PI, TAU};

use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary,
        particles::Particles,
        solver::{Solver, StepReport},
    },
    gpu::adapter::Context,
    scene::{Method, Scene, Wall, effects::viscosity::Settings},
};

use crate::support::{self, choose, context, flip as of_flip, flip::DX, pbf_of};

const METHODS: [Method; 2] = [Method::Flip, Method::Pbf];

/// Cells between the plates.
const GAP: usize = 16;

/// A box full of water between no-slip plates below and above, periodic along x and z.
fn plates(method: Method, coefficient: f64, frames_per_second: f64) -> Scene {
    let mut scene = of_flip::scene([8.0, GAP as f64, 8.0]);
    choose(&mut scene, method);
    let pbf = pbf_of(&mut scene);
    pbf.particle_spacing = DX / 2.0;
    pbf.grid_projection = true;
    of_flip::flip(&mut scene).pic_blend = 0.0;
    scene.periodic = [true, false, true];
    scene.no_slip = [2, 3].map(|k| Wall::NAMED[k].1).to_vec();
    scene.water.gravity = DVec3::ZERO;
    scene.shot.frames_per_second = frames_per_second;
    scene.effects.viscosity = Some(Settings::newtonian(coefficient));
    scene
}

fn solver(context: &Context, scene: &Scene, start: &Particles) -> Box<dyn Advance> {
    match scene.solver.method() {
        Method::Flip => Box::new(of_flip::solver(context, scene, start)),
        Method::Pbf => Box::new(support::solver(context, scene, start, &Boundary::default())),
    }
}

/// A solver whose error type is erased.
trait Advance {
    fn frame(&mut self) -> (Particles, StepReport);
}

impl<S: Solver> Advance for S
where
    S::Error: std::fmt::Debug,
{
    fn frame(&mut self) -> (Particles, StepReport) {
        self.advance().unwrap()
    }
}

fn run(context: &Context, scene: &Scene, start: &Particles, frames: u32) -> Particles {
    let mut solver = solver(context, scene, start);
    let states = (0..frames).map(|_| solver.frame().0);
    states.last().unwrap()
}

/// Particles that fill the box, with velocities along x as a function of height.
fn sheared(speed: impl Fn(f64) -> f64) -> Particles {
    let mut particles = of_flip::block([0; 3], [8, GAP, 8]);
    for k in 0..particles.len() {
        let y = of_flip::position(&particles, k).y;
        particles.velocity[k] = [speed(y) as f32, 0.0, 0.0];
    }
    particles
}

/// Amplitude of `shape` in the velocities along x, by least squares, and the largest residual of
/// the mean of a row of cells, m/s.
fn fitted(state: &Particles, shape: impl Fn(f64) -> f64) -> (f64, f64) {
    let all = (0..state.len()).map(|k| {
        let y = of_flip::position(state, k).y;
        (y, of_flip::velocity(state, k).x)
    });
    let all: Vec<(f64, f64)> = all.collect();
    let products: f64 = all.iter().map(|&(y, v)| v * shape(y)).sum();
    let squares: f64 = all.iter().map(|&(y, _)| shape(y).powi(2)).sum();
    let part = products / squares;
    let left = (0..GAP).map(|row| {
        let inside = all.iter().filter(|(y, _)| (y / DX) as usize == row);
        let off: Vec<f64> = inside.map(|&(y, v)| v - part * shape(y)).collect();
        (off.iter().sum::<f64>() / off.len() as f64).abs()
    });
    (part, left.fold(0.0, f64::max))
}

/// Between plates H apart, water driven along them by g develops from rest to g y (H − y) / 2ν
/// (Poiseuille), as a Fourier series. The tolerance is 5 %. A difference of a parabola over 16
/// cells is off by 1/256 of it, a backward step of the slowest term by half of ν π² Δt / H², 2 %.
#[test]
fn water_between_plates_flows_as_poiseuille_has_it() {
    let context = context();
    let (viscosity, push, height) = (0.5, 0.5, GAP as f64 * DX);
    let frames = 30;
    let seconds = f64::from(frames) / 50.0;
    let shape = |y: f64| {
        let terms = (0..20).map(|k| {
            let n = PI * f64::from(2 * k + 1) / height;
            let left = (-viscosity * n * n * seconds).exp();
            4.0 * push / (height * viscosity * n.powi(3)) * (1.0 - left) * (n * y).sin()
        });
        terms.sum::<f64>()
    };
    for method in METHODS {
        let mut scene = plates(method, viscosity * 1000.0, 50.0);
        scene.water.gravity = DVec3::new(push, 0.0, 0.0);
        let state = run(&context, &scene, &sheared(|_| 0.0), frames);
        let (part, left) = fitted(&state, shape);
        let most = shape(0.5 * height);
        println!(
            "{method:?}: {part:.4} of Poiseuille's flow, rows off by {:.4} of its most",
            left / most
        );
        assert!((part - 1.0).abs() < 0.05, "{method:?} {part}");
        assert!(left < 0.05 * most, "{method:?} {left}");
        // Negative control: free-slip plates do not hold the water, and it accelerates freely.
        scene.no_slip.clear();
        let (part, _) = fitted(&run(&context, &scene, &sheared(|_| 0.0), frames), |_| 1.0);
        assert!(
            (part / (push * seconds) - 1.0).abs() < 1e-3,
            "{method:?} {part}"
        );
    }
}

/// Between plates at rest, sin(πy/H) decays as exp(−ν (π/H)² t), a term of the start-up of a
/// Couette flow.
#[test]
fn shear_between_plates_dies_as_couettes_flow_starts() {
    let context = context();
    let (viscosity, height) = (0.2, GAP as f64 * DX);
    let shape = |y: f64| (PI * y / height).sin();
    let rate = viscosity * (PI / height).powi(2);
    for method in METHODS {
        let mut scene = plates(method, viscosity * 1000.0, 50.0);
        let decay = |scene: &Scene| {
            let state = run(&context, scene, &sheared(shape), 25);
            -fitted(&state, shape).0.ln() / 0.5
        };
        let found = decay(&scene);
        println!("{method:?}: {found:.4} 1/s of {rate:.4}");
        assert!(
            (found / rate - 1.0).abs() < 0.05,
            "{method:?} {found} {rate}"
        );
        // Negative control: half of the coefficient gives another decay.
        scene.effects.viscosity = Some(Settings::newtonian(0.5 * viscosity * 1000.0));
        let half = decay(&scene);
        assert!((half / rate - 1.0).abs() > 0.3, "{method:?} {half}");
    }
}

/// u = cos kx sin ky, v = −sin kx cos ky decays as exp(−2νk² t) without any wall (Taylor and Green
/// 1937). A backward step takes 1 / (1 + s) for exp(−s), 0.7 % of the rate; differences over a cell
/// take (kΔx)²/12 of it, and the change that particles receive goes to the grid and back by hats,
/// (kΔx)²/12 per axis and direction: five times that in all, 2.9 % at 24 cells per wavelength.
#[test]
fn a_taylor_green_vortex_dies_at_the_viscosity_asked_for() {
    let context = context();
    let k = TAU / (24.0 * DX);
    let shape = |x: DVec3| {
        let ([sx, cx], [sy, cy]) = ((k * x.x).sin_cos().into(), (k * x.y).sin_cos().into());
        DVec3::new(cx * sy, -sx * cy, 0.0)
    };
    let vortex = || {
        let mut particles = of_flip::block([0; 3], [24, 24, 8]);
        for p in 0..particles.len() {
            let v = 0.1 * shape(of_flip::position(&particles, p));
            particles.velocity[p] = v.as_vec3().to_array();
        }
        particles
    };
    let decay = |method: Method, viscosity: f64| {
        let mut scene = plates(method, viscosity * 1000.0, 100.0);
        scene.domain.max = scene.domain.min + DVec3::new(24.0, 24.0, 8.0) * DX;
        scene.periodic = [true; 3];
        scene.no_slip.clear();
        let mut start = vortex();
        start.attributes.clear();
        let mut solver = solver(&context, &scene, &start);
        let part = |state: &Particles| {
            let of = |p: usize| shape(of_flip::position(state, p));
            let sums = (0..state.len()).map(|p| {
                let own = of(p);
                (own.dot(of_flip::velocity(state, p)), own.length_squared())
            });
            let (products, squares) = sums.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
            products / squares
        };
        // From the first frame on: the part of the initial velocity that the grid does not resolve
        // vanishes at once.
        let first = part(&solver.frame().0);
        let last = (0..15).map(|_| part(&solver.frame().0)).last().unwrap();
        (first / last).ln() / 0.15
    };
    for method in METHODS {
        let viscosity = 0.1;
        let rate = 2.0 * viscosity * k * k;
        let found = decay(method, viscosity);
        println!("{method:?}: {found:.4} 1/s of {rate:.4}");
        assert!(
            (found / rate - 1.0).abs() < 0.05,
            "{method:?} {found} {rate}"
        );
        // Negative control: half of the coefficient.
        let half = decay(method, 0.5 * viscosity);
        assert!((half / rate - 1.0).abs() > 0.3, "{method:?} {half}");
    }
}

/// A block that falls onto a floor: energy only decreases, whatever the coefficient. If a solve
/// would take more iterations than allowed, the frame reports it as missed.
#[test]
fn viscosity_of_any_coefficient_never_adds_energy() {
    let context = context();
    for method in METHODS {
        for (coefficient, is_short) in [(1e-3, false), (10.0, false), (1e4, false), (1e9, true)] {
            let mut scene = plates(method, coefficient, 50.0);
            scene.domain.max = scene.domain.min + DVec3::new(12.0, 10.0, 8.0) * DX;
            scene.periodic = [false; 3];
            scene.water.gravity = DVec3::new(0.0, -9.81, 0.0);
            let start = of_flip::block([0, 2, 0], [6, 5, 8]);
            let mut solver = solver(&context, &scene, &start);
            let energy = |report: &StepReport| report.kinetic_energy + report.potential_energy;
            let mut last = f64::INFINITY;
            let mut missed = 0;
            for _ in 0..if is_short { 1 } else { 12 } {
                let report = solver.frame().1;
                // Colliding water gains a few thousandths where particles are pushed apart.
                assert!(energy(&report) < 1.01 * last, "{method:?} {coefficient}");
                last = energy(&report);
                missed += report.projection.unwrap().missed;
            }
            println!("{method:?} {coefficient} Pa s: {last:.1} J, {missed} missed");
            assert_eq!(missed > 0, is_short, "{method:?} {coefficient}");
        }
    }
}

/// A viscous tank at rest stays at rest and keeps the hydrostatic pressure, the sum of both
/// projections.
#[test]
fn viscous_water_at_rest_keeps_its_pressure() {
    let context = context();
    let mut scene = plates(Method::Flip, 1e3, 50.0);
    scene.domain.max = scene.domain.min + DVec3::new(8.0, 16.0, 8.0) * DX;
    scene.periodic = [false; 3];
    scene.no_slip = (0..6).map(|k| Wall::NAMED[k].1).collect();
    scene.water.gravity = DVec3::new(0.0, -9.81, 0.0);
    let start = of_flip::block([0; 3], [8, 10, 8]);
    let mut solver = of_flip::solver(&context, &scene, &start);
    for _ in 0..5 {
        let (_, report) = solver.advance().unwrap();
        assert!(report.max_speed < 1e-3, "{}", report.max_speed);
    }
    for depth in [0.25, 0.5, 0.95] {
        let at = DVec3::new(0.41, 1.0 - depth, 0.37);
        let found = solver.pressures(&[at]).unwrap()[0].unwrap();
        let expected = 1000.0 * 9.81 * depth;
        println!("{depth} m deep: {found:.1} Pa of {expected:.1}");
        assert!((found / expected - 1.0).abs() < 5e-3, "{found} {expected}");
    }
}

/// A coefficient adds three passes; scenes without one, or with XSPH only, have none of them.
#[test]
fn a_scene_that_names_no_coefficient_pays_for_none() {
    let context = context();
    for method in METHODS {
        let mut scene = plates(method, 1.0, 50.0);
        let names = |scene: &Scene| -> Vec<&'static str> {
            let plan = support::plan(&context, scene, 1000, &Boundary::default());
            let of = |plan: &swell::solve::plan::Plan| -> Vec<&'static str> {
                plan.passes.iter().map(|pass| pass.spec.name).collect()
            };
            plan.parts().flat_map(of).collect()
        };
        let has =
            |names: &[&str], word: &str| names.iter().filter(|name| name.contains(word)).count();
        let with = names(&scene);
        assert_eq!(has(&with, "viscosity_"), 3);
        // No-slip walls are resolved, not modelled.
        assert_eq!(has(&with, "wall_friction"), 0);
        scene.effects.viscosity = None;
        if method == Method::Pbf {
            scene.no_slip.clear();
        }
        let bare = names(&scene);
        assert_eq!(has(&bare, "viscosity_"), 0);
        assert_eq!(
            has(&bare, "wall_friction"),
            usize::from(method == Method::Flip)
        );
        scene.effects.viscosity = Some(Settings::xsph(0.1));
        let of_xsph = if method == Method::Pbf { 2 } else { 0 };
        assert_eq!(has(&names(&scene), "viscosity_"), of_xsph);
    }
}
