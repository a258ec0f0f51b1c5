//! Whitewater over water that the test lays out.
use glam::{DVec3, Vec3};
use swell::{
    domain::{
        boundary::Boundary,
        particles::Particles,
        whitewater::{
            AGE, CompleteSettings, KIND, LIFE, Potentials, RADIUS, Thresholds, WhitewaterKind, none,
        },
    },
    gpu::adapter::Context,
    reference,
    scene::Scene,
    solve,
};

pub fn settings() -> CompleteSettings {
    CompleteSettings {
        seed: 1,
        max_particles: 1_000_000,
        radius: [0.005, 0.02],
        trapped_air_rate: 2500.0,
        wave_crest_rate: 50_000.0,
        thresholds: Thresholds::default(),
        drop_radius: 1e-3,
        wind: [0.0; 3],
        lifetime: [0.5, 4.0],
        crowd: 6400.0,
        rise_speed: Some(0.25),
        response: 0.05,
        kills: Vec::new(),
    }
}

/// Whitewater particles with these positions, velocities and kinds.
pub fn white(all: &[(DVec3, DVec3, WhitewaterKind)]) -> Particles {
    let mut made = none();
    for (id, (x, v, kind)) in (0..).zip(all) {
        made.position.push(x.as_vec3().to_array());
        made.velocity.push(v.as_vec3().to_array());
        made.id.push(id);
        let values = [
            (AGE, 0.0),
            (KIND, kind.number()),
            (LIFE, 1.0),
            (RADIUS, 0.01),
        ];
        for (name, value) in values {
            made.attributes
                .entry(name.to_owned())
                .or_default()
                .push(value);
        }
    }
    made
}

pub fn place(white: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(white.position[k]).as_dvec3()
}

pub fn velocity(white: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(white.velocity[k]).as_dvec3()
}

pub fn kind(white: &Particles, k: usize) -> WhitewaterKind {
    WhitewaterKind::of_number(white.attributes[KIND][k]).unwrap()
}

/// Runs whitewater over water at rest for `frames` frames of `seconds` each, on the GPU or, without
/// a context, with the reference. Returns the potentials found in the water and the whitewater.
pub fn run(
    context: Option<&Context>,
    (scene, water): (&Scene, &Particles),
    settings: &CompleteSettings,
    white: &Particles,
    (frames, seconds): (u32, f64),
) -> (Vec<Potentials>, Particles) {
    let scene = &scene.of_whitewater();
    let boundary = Boundary::default();
    let mut white = white.clone();
    let mut found = Vec::new();
    match context {
        Some(context) => {
            let n = water.len();
            let mut engine =
                solve::whitewater::Whitewater::new(context, scene, &boundary, n, false).unwrap();
            engine.set(settings).unwrap();
            for frame in 1..=frames {
                found = engine
                    .survey(water, f64::from(frame) * seconds, seconds)
                    .unwrap();
                engine.advance(&mut white, frame).unwrap();
            }
        }
        None => {
            let mut engine = reference::whitewater::Whitewater::new(scene, &boundary);
            engine.set(settings);
            for frame in 1..=frames {
                found = engine.survey(water, f64::from(frame) * seconds, seconds);
                engine.advance(&mut white, frame).unwrap();
            }
        }
    }
    (found, white)
}
