//! Both solvers compared with water at rest and with linear waves, observed through probes.

use std::f64::consts::PI;

use crate::support::flip::*;
use crate::support::{self, D, context, lattice, pbf_of};
use glam::{DVec2, DVec3, Vec3};
use swell::{
    domain::{
        boundary::Boundary,
        particles::Particles,
        probe::{Rate, elevation},
        solver::Solver,
    },
    gpu::adapter::Context,
    scene::{
        Method, Scene, Stop, effects,
        probe::{Probe, ProbeKind},
    },
    solve::SolveError,
};

/// Builds the scene's solver and loads `particles`.
fn built(
    context: &Context,
    scene: &Scene,
    particles: &Particles,
) -> Box<dyn Solver<Error = SolveError>> {
    match scene.solver.method() {
        Method::Pbf => Box::new(support::solver(
            context,
            scene,
            particles,
            &Boundary::default(),
        )),
        Method::Flip => Box::new(solver(context, scene, particles)),
    }
}

fn ask_for_pressure(scene: &mut Scene) {
    scene.probes.push(Probe {
        name: "p".to_owned(),
        kind: ProbeKind::Pressure { at: DVec3::ZERO },
        rate: Rate::Frame,
        window: None,
    });
}

/// p = ρ g depth from the floor to the centre of the topmost cell, also between cell centres, and
/// nothing moves.
#[test]
fn flip_still_water_stays_and_weighs_what_it_weighs() {
    let (mut scene, particles) = tank([16, 20, 12], 11);
    ask_for_pressure(&mut scene);
    let mut solver = built(&context(), &scene, &particles);
    let points: Vec<DVec3> = (0..=21)
        .map(|k| DVec3::new(0.73, 0.05 * f64::from(k), 0.55))
        .collect();
    let off = |pressures: &[Option<f64>], surface: f64| {
        let ratios = points
            .iter()
            .zip(pressures)
            .map(|(at, p)| (p.unwrap() / (9810.0 * (surface - at.y)) - 1.0).abs());
        ratios.fold(0.0, f64::max)
    };
    let mut most = (0.0f64, 0.0f64);
    for frame in 0..20 {
        let (state, report) = solver.advance().unwrap();
        let pressures = solver.pressures(&points).unwrap();
        most = (
            most.0.max(off(&pressures, 1.1)),
            most.1.max(report.max_speed),
        );
        // The solve's tolerance leaves 1e-5 of what gravity adds in 10 ms, 0.1 m/s, in each frame.
        // The surface of the lattice lies on a face, up to rounding.
        assert!(report.max_speed < 2e-5, "frame {frame}: {report:?}");
        assert!(off(&pressures, 1.1) < 1e-3, "frame {frame}: {pressures:?}");
        // Negative control: a surface a twentieth of a cell off changes the top cell's pressure by
        // 5 %.
        assert!(off(&pressures, 1.105) > 1e-2);
        assert_eq!(state.id, particles.id);
        let top = elevation(&state, DX / 2.0, &scene.domain, DVec2::splat(0.6)).unwrap();
        // A twentieth of a spacing, the error of the level set on a lattice.
        assert!((top - 1.1).abs() < 0.05 * DX / 2.0, "frame {frame}: {top}");
    }
    println!(
        "FLIP: pressure off by {:.1e}, speeds to {:.1e} m/s",
        most.0, most.1
    );
    let air = DVec3::new(0.73, 1.35, 0.55);
    assert_eq!(solver.pressures(&[air]).unwrap(), [None]);
}

/// PBF supports a column by multipliers that a few iterations leave inexact, over particles that
/// are closer to each other at the surface than in the bulk. It does not come within 1 % of ρ g
/// depth. This test states its accuracy: away from floor and surface the pressure rises with depth
/// by ρ g to 5 %, and it lies between the pressures of the water below the observed surface and of
/// all the mass that rest density places above.
#[test]
fn pbf_still_water_weighs_about_what_it_weighs() {
    let mut scene = support::scene([0.8, 1.6, 0.8]);
    ask_for_pressure(&mut scene);
    scene.effects.viscosity = Some(effects::viscosity::Settings::xsph(0.05));
    let particles = lattice([0.0; 3], [8, 10, 8], [D; 3]);
    let mut solver = built(&context(), &scene, &particles);
    let frames = 150;
    for _ in 0..frames {
        solver.advance().unwrap();
    }
    let points: Vec<DVec3> = (0..10)
        .map(|k| DVec3::new(0.4, D * f64::from(k), 0.4))
        .collect();
    let (mut mean, mut top) = (vec![0.0; points.len()], 0.0);
    for _ in 0..frames {
        let (state, _) = solver.advance().unwrap();
        top += elevation(&state, D, &scene.domain, DVec2::splat(0.4)).unwrap() / f64::from(frames);
        for (mean, p) in mean.iter_mut().zip(solver.pressures(&points).unwrap()) {
            *mean += p.unwrap() / f64::from(frames);
        }
    }
    println!("surface at {top:.3} m of 1 m that the lattice had");
    for (at, p) in points.iter().zip(&mean) {
        let ratio = p / (9810.0 * (top - at.y));
        println!("PBF at {:.1} m: {p:.0} Pa, {ratio:.3} of ρ g depth", at.y);
    }
    // κ is that of the lattice, 5 % off 1. Settled water is not a lattice and may be off by as
    // much.
    let slope = (mean[3] - mean[8]) / (5.0 * D) / 9810.0;
    println!("PBF rises by {slope:.4} ρ g between 0.3 and 0.8 m");
    assert!((slope - 1.0).abs() < 0.05, "{slope}");
    let is_between = |scale: f64| {
        (3..=8).all(|k| {
            let (y, p) = (points[k].y, scale * mean[k]);
            (9810.0 * (top - y)..9810.0 * (1.0 - y)).contains(&p)
        })
    };
    assert!(is_between(1.0), "{mean:?}");
    // Negative control: half or twice the pressure, as a wrong factor on λ would give.
    assert!(!is_between(0.5) && !is_between(2.0));
}

/// A standing wave in water of depth `depth` between walls `length` apart, at the moment when the
/// surface is flat: k = 2π / L, ω² = g k tanh kh. Lengths in metres.
struct Wave {
    length: f64,
    depth: f64,
    amplitude: f64,
}

impl Wave {
    fn number(&self) -> f64 {
        2.0 * PI / self.length
    }

    fn frequency(&self) -> f64 {
        let k = self.number();
        (9.81 * k * (k * self.depth).tanh()).sqrt()
    }

    /// η = a sin ωt cos kx, u = −aω cosh ky / sinh kh cos ωt sin kx, v = aω sinh ky / sinh kh cos
    /// ωt cos kx.
    fn add_to(&self, particles: &mut Particles) {
        let (k, speed) = (self.number(), self.amplitude * self.frequency());
        for (x, v) in particles.position.iter().zip(&mut particles.velocity) {
            let x = Vec3::from_array(*x).as_dvec3();
            let depth = (k * self.depth).sinh();
            let u = -speed * (k * x.y).cosh() / depth * (k * x.x).sin();
            let w = speed * (k * x.y).sinh() / depth * (k * x.x).cos();
            v[0] += u as f32;
            v[1] += w as f32;
        }
    }

    /// Amplitude of the wave as seen by an array of n gauges: 2/n Σ η cos kx, metres.
    fn seen(&self, scene: &Scene, state: &Particles, z: f64) -> f64 {
        let gauges = 16;
        let sum: f64 = (0..gauges)
            .map(|g| {
                let x = self.length * (f64::from(g) + 0.5) / f64::from(gauges);
                let height = elevation(
                    state,
                    scene.particle_spacing(),
                    &scene.domain,
                    DVec2::new(x, z),
                )
                .unwrap();
                height * (self.number() * x).cos()
            })
            .sum();
        2.0 * sum / f64::from(gauges)
    }
}

/// Mean period of a signal, from its zero crossings between swings of at least `least` to either
/// side.
fn period(signal: &[f64], dt: f64, least: f64) -> f64 {
    let mut crossings: Vec<f64> = Vec::new();
    let (mut side, mut through) = (0.0, 0.0);
    for (k, w) in signal.windows(2).enumerate() {
        if (w[0] < 0.0) != (w[1] < 0.0) {
            through = dt * (k as f64 + w[0] / (w[0] - w[1]));
        }
        if w[1].abs() >= least && w[1].signum() != side {
            if side != 0.0 {
                crossings.push(through);
            }
            side = w[1].signum();
        }
    }
    2.0 * (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64
}

/// Measured period over 2π/ω, and the amplitude of the last swing as a fraction of the initial one.
fn swing(context: &Context, scene: &Scene, settled: &Particles, wave: &Wave, z: f64) -> (f64, f64) {
    let expected = 2.0 * PI / wave.frequency();
    let dt = scene.shot.frame_seconds();
    let mut particles = settled.clone();
    wave.add_to(&mut particles);
    let mut solver = built(context, scene, &particles);
    let frames = (3.05 * expected / dt) as u32;
    let mut signal = vec![wave.seen(scene, &particles, z)];
    for _ in 0..frames {
        let (state, _) = solver.advance().unwrap();
        signal.push(wave.seen(scene, &state, z));
    }
    let last = &signal[signal.len() * 2 / 3..];
    let most = last.iter().fold(0.0f64, |a, b| a.max(b.abs()));
    (
        period(&signal, dt, 0.1 * wave.amplitude) / expected,
        most / wave.amplitude,
    )
}

/// Asserts that the period relative to linear theory is within `bound`, and that the period of long
/// waves, ω² = g h k², which does not hold at kh = 2, is far off.
fn check_period(name: &str, wave: &Wave, ratio: f64, bound: f64) {
    assert!((ratio - 1.0).abs() < bound, "{name}: {ratio} {bound}");
    let depth = wave.number() * wave.depth;
    let long = ratio * (depth / depth.tanh()).sqrt();
    assert!((long - 1.0).abs() > 2.0 * bound, "{name}: {long} {bound}");
}

/// A grid locates the surface only to a part of a cell: in a cell with any water it is above the
/// centre, in one without water below. An eighth of a cell either way, on average over a swing of
/// amplitude a, changes the restoring force by Δx / (8 a) of itself, and the period by half of
/// that. Measured, with crests of 1/32 of the length: −6.4 % at 16 cells per length, 3.2 % at 32,
/// 0.4 % at 48, 1.2 % at 64.
#[test]
fn flip_standing_waves_have_their_period() {
    let context = context();
    let cells = [16usize, 48];
    let wave = |cells: usize| Wave {
        length: cells as f64 * DX,
        depth: (cells * 5 / 16) as f64 * DX,
        amplitude: cells as f64 * DX / 32.0,
    };
    let periods = cells.map(|cells| {
        let deep = cells * 5 / 16;
        let (mut scene, particles) = tank([cells, 2 * deep, 4], deep);
        // The same number of steps per period for both sizes.
        scene.shot.frames_per_second = 282.8 / (cells as f64).sqrt();
        let (ratio, left) = swing(&context, &scene, &particles, &wave(cells), 0.2);
        println!(
            "FLIP, {cells} cells: {ratio:.4} of the period, {left:.2} of the amplitude after three"
        );
        ratio
    });
    for (cells, ratio) in cells.into_iter().zip(periods) {
        let wave = wave(cells);
        let bound = DX / (16.0 * wave.amplitude);
        check_period("flip", &wave, ratio, bound);
    }
    let [coarse, fine] = periods.map(|ratio| (ratio - 1.0).abs());
    assert!(fine < 0.5 * coarse, "{periods:?}");
}

/// Density and its gradient are means over the support h, so that waves have an error of second
/// order in k h: half of (k h)² is allowed, 7.7 % at 32 spacings per length. Measured there: 3.5 %
/// short with 16 iterations, 1.2 % with 4; at 64 spacings 0.4 % at 100 steps a second and 2.4 % at
/// 71. Settled water is a twelfth less deep than its lattice, so the wave uses the observed depth.
/// Three quarters of the amplitude are lost after three periods.
#[test]
fn pbf_standing_waves_have_about_their_period() {
    let context = context();
    let spacings = 32;
    let length = spacings as f64 * D;
    let mut scene = support::scene([length, 0.6 * length, 0.4]);
    pbf_of(&mut scene).stop = Stop::Iterations(16);
    scene.effects.viscosity = Some(effects::viscosity::Settings::xsph(0.1));
    let particles = lattice([0.0; 3], [spacings, spacings * 10 / 32, 4], [D; 3]);
    let settled = support::run(&context, &scene, &particles, 150).0;
    scene.effects.viscosity = None;
    let middle = DVec2::new(length / 2.0, 0.2);
    let wave = Wave {
        length,
        depth: elevation(&settled, D, &scene.domain, middle).unwrap(),
        amplitude: length / 40.0,
    };
    let (ratio, left) = swing(&context, &scene, &settled, &wave, 0.2);
    println!(
        "PBF, {spacings} spacings: {ratio:.4} of the period, {left:.2} of the amplitude after three"
    );
    let support = scene.solver.pbf().unwrap().support_ratio * D;
    check_period("pbf", &wave, ratio, (wave.number() * support).powi(2) / 2.0);
}
