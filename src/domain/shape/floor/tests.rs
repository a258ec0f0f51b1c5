use glam::{DVec2, DVec3};

use super::*;
use crate::{motion::RegularWaves, shape::ShapeField};

const SPACING: f64 = 0.05;

/// Still water lies this high above the domain's floor, metres; the water is five times as deep.
const LEVEL: f64 = 1.2;

fn domain() -> Bounds {
    Bounds {
        min: DVec3::new(-3.0, 2.0, 1.0),
        max: DVec3::new(5.0, 4.0, 2.0),
    }
}

/// Waves of a tenth of a metre that go towards +x and a little +z.
fn waves() -> OpenWaves {
    let asked = RegularWaves {
        height: 0.1,
        period: 1.41851,
        depth: 5.0,
        gravity: 9.81,
        ramp: 0.0,
    };
    OpenWaves::regular(&asked, DVec2::from_angle(0.3)).above(LEVEL)
}

fn floor() -> WaveFloor {
    WaveFloor::new(&[waves()], &domain(), SPACING)
}

/// The floor rises as fast as the water at its mean height, and is lowest two cells above the
/// domain's.
#[test]
fn a_floor_moves_as_the_water_does() {
    let (waves, floor) = (waves(), floor());
    let [mean, most] = floor.heights();
    assert!((mean - most - LAYERS * SPACING).abs() < NOTHING * SPACING);
    // exp(−k d) of an amplitude of 0.05 m, where k = 2 / m.
    let expected = 0.05 * (-2.0 * (LEVEL - mean)).exp();
    assert!((most / expected - 1.0).abs() < 0.01, "{most} {expected}");
    let (d, least) = (1e-4, domain().min);
    let mut sums = [0.0; 2];
    for i in 0..40 {
        let (at, t) = (DVec2::new(0.17 * f64::from(i) - 3.0, 1.5), 0.9);
        let height = |t: f64| floor.height(at, t).0;
        let rate = (height(t + d) - height(t - d)) / (2.0 * d);
        let place = DVec3::new(at.x - least.x, mean, at.y - least.z);
        let rise = waves.velocity(place, t).y;
        assert!((rate - rise).abs() < 1e-6, "{rate} {rise}");
        let later = waves.velocity(place, t + 0.1).y;
        sums = [sums[0] + rate.abs(), sums[1] + (rate - later).abs()];
        let slope = |way: DVec2| {
            let off = d * way;
            (floor.height(at + off, t).0 - floor.height(at - off, t).0) / (2.0 * d)
        };
        let found = floor.height(at, t).1;
        assert!((found - DVec2::new(slope(DVec2::X), slope(DVec2::Y))).length() < 1e-6);
    }
    // Negative control: a fourteenth of a period later the water there moves otherwise.
    assert!(sums[1] > 0.2 * sums[0], "{sums:?}");
}

/// Distances at nodes vanish at the floor and have its velocity; between keys the floor is off by
/// at most an eighth of the square of the angle between two.
#[test]
fn distances_are_those_to_the_floor_at_any_time() {
    let floor = floor();
    let field = ShapeField::of_floor(&floor, 3.0 * SPACING, SPACING).expect("small enough");
    let [_, most] = floor.heights();
    let between_keys = most * (TAU / KEYS_PER_PERIOD).powi(2) / 8.0;
    // Linear between nodes: an eighth of the curvature times the square of their spacing.
    let between_nodes = most * 4.0 * SPACING * SPACING / 8.0;
    let tolerance = between_keys + 2.0 * between_nodes + 1e-6;
    for (start, length) in [(0.0, 0.01), (0.731, 0.02), (7.3, 0.005)] {
        let step = field.step(start, length);
        for i in 0..30 {
            let at = DVec2::new(0.26 * f64::from(i) - 2.9, 1.4);
            for share in [0.0, 0.5, 1.0] {
                let height = floor.height(at, start + share * length).0;
                let place = DVec3::new(at.x, height, at.y);
                let distance = step.sample(place, share);
                assert!(distance.abs() < tolerance, "{distance} {tolerance}");
                assert!(step.sample(place + 0.1 * DVec3::Y, share) > 0.09);
                assert!(step.sample(place - 0.1 * DVec3::Y, share) < -0.09);
            }
            let [a, b] = [0.0, length].map(|off| floor.height(at, start + off).0);
            let place = DVec3::new(at.x, a, at.y);
            let velocity = step.velocity_at(place);
            // Mean over the keys' part: half a key's change of it, ω² a / 2 of a key's duration.
            let change = floor.peak_speed() * TAU / KEYS_PER_PERIOD;
            assert!((velocity.y - (b - a) / length).abs() < change, "{velocity}");
            assert!(velocity.x == 0.0 && velocity.z == 0.0);
            assert!(velocity.y.abs() <= floor.peak_speed());
        }
    }
    // Negative control: the floor of another time is farther off than the tolerance.
    let (early, late) = (field.at(0.0), field.at(0.35));
    let moved = (early.values.iter().zip(&late.values)).map(|(a, b)| (a - b).abs());
    assert!(f64::from(moved.fold(0.0, f32::max)) > 10.0 * tolerance);
}

/// Samples cover the domain's floor once, and the mesh holds what is below.
#[test]
fn samples_and_the_mesh_are_those_of_the_floor() {
    let floor = floor();
    let samples = floor.samples();
    let found = samples.at(0.4, 0.01);
    assert_eq!(found.len(), samples.count());
    assert_eq!(found.len(), 160 * 20);
    let area: f64 = found.iter().map(|it| it.area).sum();
    // The slope is k a = 0.013 at most: its square adds a ten-thousandth.
    assert!((area / 8.0 - 1.0).abs() < 2e-4, "{area}");
    for it in &found {
        let (at, [now, before]) = (
            DVec2::new(it.position.x, it.position.z),
            [0.4, 0.39].map(|t| floor.height(DVec2::new(it.position.x, it.position.z), t).0),
        );
        assert!((it.position.y - floor.height(at, 0.4).0).abs() < 1e-12);
        assert!((it.velocity.y - (now - before) / 0.01).abs() < 1e-9);
    }
    assert!(
        samples
            .at(0.4, 0.0)
            .iter()
            .all(|it| it.velocity == DVec3::ZERO)
    );
    let mesh = floor.mesh(0.0, 0.0);
    assert!(mesh.open_edges().is_empty());
    let (volume, asked) = (mesh.signed_volume(), floor.volume(&domain()));
    let [mean, _] = floor.heights();
    assert!((volume / asked - 1.0).abs() < 1e-3, "{volume} {asked}");
    assert!((asked / (8.0 * mean) - 1.0).abs() < 0.02, "{asked}");
}

/// What pictures show below the floor fills the space down to the domain's, up to the floor.
#[test]
fn the_water_below_is_what_the_floor_leaves_out() {
    let floor = floor();
    let points = floor.water_below(0.4);
    let [mean, _] = floor.heights();
    let volume = points.len() as f64 * SPACING.powi(3);
    // A column's height is rounded to layers, up or down: the mean of many is off by little.
    assert!((volume / (8.0 * mean) - 1.0).abs() < 0.05, "{volume}");
    for x in &points {
        let x = DVec3::from_array(x.map(f64::from));
        let height = floor.height(DVec2::new(x.x, x.z), 0.4).0;
        assert!(x.y < height - 0.49 * SPACING, "{x} {height}");
        assert!(x.y > domain().min.y - 0.5 * SPACING, "{x}");
    }
}

/// Of waves too short to reach it nothing is left, and the floor rests.
#[test]
fn a_floor_below_short_waves_rests() {
    let asked = RegularWaves {
        height: 0.02,
        period: 0.5,
        depth: 5.0,
        gravity: 9.81,
        ramp: 0.0,
    };
    let waves = OpenWaves::regular(&asked, DVec2::X).above(LEVEL);
    let floor = WaveFloor::new(&[waves], &domain(), SPACING);
    assert_eq!(floor.heights()[1], 0.0);
    assert_eq!(floor.peak_speed(), 0.0);
    let field = ShapeField::of_floor(&floor, SPACING, SPACING).expect("small enough");
    assert_eq!(field.at(0.0).values, field.at(3.0).values);
}
