//! Whitewater's passes against their f64 reference passes, and a fault in each that
//! the check finds.

use glam::DVec3;
use swell::{
    check::CheckTable,
    check::whitewater::{Frame, check},
    domain::{
        boundary::Boundary,
        motion::Motion,
        particles::Particles,
        whitewater::{CompleteSettings, WhitewaterKind},
    },
    gpu::adapter::{Context, InjectedFault},
    scene::{PbfScene, Wall, WaveMaker},
};

use crate::support::{
    self, D, context, jitter, lattice, noise,
    whitewater::{settings, white},
};

/// Turbulent water in a box whose first wall has moved in.
fn splash(periodic: bool) -> (PbfScene<'static>, Particles) {
    let mut scene = support::scene([1.6, 1.6, 0.9]);
    scene.periodic = [false, false, periodic];
    scene.wave_makers.push(WaveMaker {
        absorption: None,
        wall: Wall::NAMED[0].1,
        motion: Motion::ConstantVelocity {
            velocity: 0.5,
            until: None,
        },
    });
    let mut water = lattice([0.1, 0.0, 0.0], [10, 8, 9], [D; 3]);
    jitter(&mut water, 0.04);
    for (k, v) in (0..).zip(&mut water.velocity) {
        *v = [0, 1, 2].map(|axis| 3.0 * noise(10_000 + 3 * k + axis) as f32);
    }
    (scene.of_whitewater(), water)
}

/// Whitewater particles of all kinds, everywhere.
fn clouds() -> Particles {
    let all: Vec<_> = (0..3000u64)
        .map(|k| {
            let number = |axis: u64| noise(50_000 + 7 * k + axis);
            let x = DVec3::new(
                0.9 + 0.6 * number(0),
                0.8 + 0.7 * number(1),
                0.45 + 0.4 * number(2),
            );
            let v = 4.0 * DVec3::new(number(3), number(4), number(5));
            (x, v, WhitewaterKind::ALL[k as usize % 3])
        })
        .collect();
    white(&all)
}

fn table(context: &Context, periodic: bool) -> CheckTable {
    let (scene, water) = splash(periodic);
    let settings = CompleteSettings {
        wind: [2.0, 0.0, -1.0],
        ..settings()
    };
    let frame = Frame {
        scene: &scene,
        boundary: &Boundary::default(),
        settings: &settings,
        water: &water,
        white: &clouds(),
        time: 0.2,
        seconds: 0.02,
    };
    check(context, frame).unwrap()
}

#[test]
fn whitewater_is_within_tolerance() {
    let context = context();
    for periodic in [false, true] {
        let table = table(&context, periodic);
        assert!(table.first_over().is_none(), "{table:?}");
        for field in [
            "share of water",
            "normal",
            "trapped air",
            "wave crest",
            "position",
            "kind",
        ] {
            let row = table
                .rows
                .iter()
                .find(|row| row.field.name == field)
                .unwrap();
            // Most values are compared rather than counted as ties.
            assert!(
                row.ties < row.values,
                "{field}: {} of {}",
                row.ties,
                row.values
            );
        }
    }
}

/// Changes by one to a few parts in a thousand, or of a rule.
const SPOILS: [(&str, &str, &str, &str); 14] = [
    (
        "survey",
        "kernel_sum += p * p * p;",
        "kernel_sum += 1.001 * p * p * p;",
        "share of water",
    ),
    (
        "survey",
        "1.0 - wall - params",
        "1.0 - 1.01 * wall - params",
        "share of water",
    ),
    (
        "survey",
        "mass * s * s * inverse_r",
        "mass * s * inverse_r",
        "normal",
    ),
    (
        "survey",
        "params.gradient_scale * gradient_sum - wall.gradient",
        "params.gradient_scale * gradient_sum",
        "normal",
    ),
    (
        "survey",
        "clamp(sure, 0.0, 1.0)",
        "clamp(1.01 * sure, 0.0, 1.0)",
        "surface",
    ),
    (
        "potentials",
        "inverse_r, 0.0) * w;",
        "inverse_r, 0.0) * 1.001 * w;",
        "trapped air",
    ),
    ("potentials", "clamp(4.0 *", "clamp(4.4 *", "wave crest"),
    (
        "potentials",
        "0.5 * speed * speed",
        "0.501 * speed * speed",
        "energy",
    ),
    (
        "advance",
        "0.5 * step * (before + flight.velocity)",
        "0.501 * step * (before + flight.velocity)",
        "position",
    ),
    (
        "advance",
        "pow(max(reynolds, 1e-12), 0.687)",
        "pow(max(reynolds, 1e-12), 0.69)",
        "velocity",
    ),
    (
        "advance",
        "select(0.0, rise,",
        "select(0.0, 1.01 * rise,",
        "velocity",
    ),
    (
        "advance",
        "exp(-step / RESPONSE)",
        "exp(-1.01 * step / RESPONSE)",
        "velocity",
    ),
    (
        "advance",
        "velocity = before + params.velocity_step;",
        "velocity = before;",
        "velocity",
    ),
    ("advance", "k < HALVINGS", "k < HALVINGS - 1u", "position"),
];

#[test]
fn each_fault_in_whitewater_is_found() {
    let context = context();
    for (pass, from, to, field) in SPOILS {
        let mut spoiled = context.clone();
        let pass: &'static str = match pass {
            "survey" => "whitewater/survey",
            "potentials" => "whitewater/potentials",
            _ => "whitewater/advance",
        };
        spoiled.spoil = Some(InjectedFault { pass, from, to });
        let table = table(&spoiled, true);
        let over: Vec<_> = table.rows.iter().filter(|row| !row.is_within()).collect();
        let found = over
            .iter()
            .any(|row| row.field.name == field && row.field.pass == pass);
        assert!(found, "{pass}, {to}: {over:?}");
    }
}
