//! Narrow-band FLIP against water whose motion is known, and against FLIP with particles
//! everywhere.

use std::f64::consts::PI;

use crate::support::{context, flip::*};
use glam::{DVec3, Vec3};
use swell::{
    domain::{particles::Particles, solver::StepReport},
    gpu::adapter::{Context, InjectedFault},
    scene::{
        Scene,
        probe::{Probe, ProbeKind},
    },
    stage::{
        device::Opened,
        drive::{ComputedFrame, Drive},
        prepare::Start,
    },
};

/// A box of `cells` with water `deep` cells deep, with a band or with particles everywhere.
fn tank_with(cells: [usize; 3], deep: usize, band: Option<u32>) -> (Scene, Particles) {
    let (mut scene, mut particles) = tank(cells, deep);
    flip(&mut scene).band = band;
    if let Some(band) = scene.band() {
        band.enter(&mut particles);
    }
    (scene, particles)
}

/// Runs `frames` frames and calls `look` with each.
fn follow(
    context: &Context,
    scene: &Scene,
    particles: &Particles,
    frames: u32,
    mut look: impl FnMut(&mut Drive<'_>, ComputedFrame),
) {
    let opened = Opened::Gpu(Box::new(context.clone()));
    let start = Start::with(scene, particles.clone()).unwrap();
    let mut drive = Drive::new(&opened, scene, &start, false)
        .unwrap()
        .with_pressures();
    for _ in 0..frames {
        let frame = drive.advance().unwrap();
        look(&mut drive, frame);
    }
}

/// p = ρ g depth down to the floor, 40 cells deep, and nothing moves: neither the particles of the
/// band nor the water below it, whose cells stay the same.
#[test]
fn still_water_under_a_band_rests_and_weighs_what_it_weighs() {
    let (mut scene, particles) = tank_with([8, 48, 9], 40, Some(4));
    let points: Vec<DVec3> = (0..8)
        .map(|k| DVec3::new(0.43, 0.5 * f64::from(k) + 0.05, 0.35))
        .collect();
    for at in &points {
        scene.probes.push(Probe {
            name: "p".to_owned(),
            kind: ProbeKind::Pressure { at: *at },
            rate: swell::domain::probe::Rate::Frame,
            window: None,
        });
    }
    assert_eq!(particles.len(), 5 * 8 * 72);
    assert_eq!(particles.amount(), 40 * 8 * 72);
    let surface = 40.0 * DX;
    let off = |pressures: &[Option<f64>], surface: f64| {
        let both = points.iter().zip(pressures);
        both.map(|(at, p)| (p.unwrap() / (9810.0 * (surface - at.y)) - 1.0).abs())
            .fold(0.0, f64::max)
    };
    follow(&context(), &scene, &particles, 10, |_, frame| {
        let (state, report) = (&frame.particles, &frame.report);
        // As for water with particles everywhere (analytic_water.rs), four times as deep.
        assert!(report.max_speed < 8e-5, "frame {}: {report:?}", frame.frame);
        assert!(
            off(&frame.pressures, surface) < 1e-3,
            "{:?}",
            frame.pressures
        );
        assert!(off(&frame.pressures, surface + 0.5 * DX) > 5e-3);
        assert_eq!(state.id, particles.id);
        assert_eq!(state.deep.cell, particles.deep.cell);
        let fastest = swell::domain::particles::max_speed(&state.deep.velocity);
        assert!(fastest < 8e-5, "{fastest}");
    });
}

/// A standing wave between walls `length` apart, when the surface is flat.
struct Wave {
    length: f64,
    depth: f64,
    amplitude: f64,
}

impl Wave {
    fn frequency(&self) -> f64 {
        let k = 2.0 * PI / self.length;
        (9.81 * k * (k * self.depth).tanh()).sqrt()
    }

    fn add_to(&self, particles: &mut Particles) {
        let (k, speed) = (2.0 * PI / self.length, self.amplitude * self.frequency());
        for (x, v) in particles.position.iter().zip(&mut particles.velocity) {
            let x = Vec3::from_array(*x).as_dvec3();
            let depth = (k * self.depth).sinh();
            v[0] -= (speed * (k * x.y).cosh() / depth * (k * x.x).sin()) as f32;
            v[1] += (speed * (k * x.y).sinh() / depth * (k * x.x).cos()) as f32;
        }
    }
}

/// Kinetic energy of each frame, J.
fn energies(context: &Context, band: Option<u32>, periods: f64, fault: Fault) -> Vec<f64> {
    let (length, deep) = (24, 20);
    let (mut scene, mut particles) = tank([length, 28, 4], deep);
    scene.shot.frames_per_second = RATE;
    flip(&mut scene).band = band;
    let wave = Wave {
        length: length as f64 * DX,
        depth: deep as f64 * DX,
        amplitude: DX,
    };
    wave.add_to(&mut particles);
    if let Some(band) = scene.band() {
        band.enter(&mut particles);
    }
    let mut context = context.clone();
    context.spoil = fault;
    let energy = |report: &StepReport| report.kinetic_energy;
    let frames = (periods * 2.0 * PI / wave.frequency() * RATE) as u32;
    let mut found = vec![energy(&scene.report(&particles, [].into_iter()))];
    follow(&context, &scene, &particles, frames, |_, frame| {
        found.push(energy(&frame.report));
    });
    found
}

/// What is wrong with a pass, if anything is.
type Fault = Option<InjectedFault>;

/// Energies of a state that the solver returns count the depth as before.
#[test]
fn the_energy_of_deep_water_is_that_of_its_particles() {
    let context = context();
    let [full, band] = [None, Some(4)].map(|band| energies(&context, band, 0.05, None));
    for (full, band) in full.iter().zip(&band) {
        // Velocities at centres of cells, and not at eight points: (k Δx)² / 96 of the energy.
        assert!((band / full - 1.0).abs() < 0.01, "{full} {band}");
    }
}

/// Frames per second: 31 in a period.
const RATE: f64 = 25.0;

/// Largest value of the last period.
fn late(energies: &[f64]) -> f64 {
    let last = &energies[energies.len() - 31..];
    last.iter().copied().fold(0.0, f64::max)
}

/// A wave of 24 cells over 20 cells of depth, of which 15 have no particles, keeps its energy as
/// well as where particles are everywhere, and at most what it loses there below the third cell,
/// from which on velocities are those of the depth: exp(−2 k 3 Δx) of it. Controls: 1 % of the
/// velocity in the depth is lost, or gained, in each substep.
#[test]
fn a_standing_wave_over_a_band_keeps_its_energy() {
    let context = context();
    let full = energies(&context, None, 3.0, None);
    let band = energies(&context, Some(4), 3.0, None);
    let damped = energies(&context, Some(4), 3.0, Some(DAMPED));
    let at = |energies: &[f64]| late(energies) / energies[0];
    let driven = energies(&context, Some(4), 3.0, Some(DRIVEN));
    let [full, band, damped, driven] = [&full, &band, &damped, &driven].map(|it| at(it));
    println!(
        "in the third period: {full:.4}, band {band:.4}, damped {damped:.4}, driven {driven:.4}"
    );
    let most = full + (1.0 - full) * (-2.0 * 3.0 * 2.0 * PI / 24.0).exp();
    let lost = full - band;
    assert!(lost < MARK && band < most, "{full} {band} {most}");
    assert!(damped < full - 2.0 * MARK, "{full} {damped}");
    assert!(driven > most, "{driven} {most}");
}

/// Part of the energy that the band may lose in three periods beyond what particles everywhere lose.
const MARK: f64 = 0.02;

/// A gain in the depth.
const DRIVEN: InjectedFault = InjectedFault {
    to: "return 1.01 * clamp(sum, least, most);",
    ..DAMPED
};

/// A loss in the depth.
const DAMPED: InjectedFault = InjectedFault {
    pass: "flip/carry_deep",
    from: "return clamp(sum, least, most);",
    to: "return 0.99 * clamp(sum, least, most);",
};

/// The energies of a frame's report are those of the state that it stores, and not of the water
/// before its band is laid anew.
#[test]
fn a_frame_reports_the_energy_of_the_state_that_it_stores() {
    let (mut scene, mut particles) = tank([24, 28, 4], 20);
    scene.shot.frames_per_second = RATE;
    let wave = Wave {
        length: 24.0 * DX,
        depth: 20.0 * DX,
        amplitude: DX,
    };
    wave.add_to(&mut particles);
    flip(&mut scene).band = Some(4);
    scene.band().unwrap().enter(&mut particles);
    follow(&context(), &scene, &particles, 10, |_, frame| {
        let stored = scene.report(&frame.particles, [].into_iter());
        let both = |report: &StepReport| [report.kinetic_energy, report.potential_energy];
        assert_eq!(both(&frame.report), both(&stored), "frame {}", frame.frame);
        assert_eq!(frame.particles.amount(), 20 * 24 * 4 * 8);
    });
}
