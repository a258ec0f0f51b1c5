//! Water in front of a wave-making wall has the wave's depth, whatever fraction of a cell the wall
//! moves in a step.

use std::{f64::consts::TAU, fs};

use swell::{
    cache::CacheReader,
    domain::motion::{Motion, piston_height_ratio, wave_number},
    files::load_scene,
};

use crate::support::job::Job;

/// A flume from whose end nothing comes back within 4 s: neither waves nor the rise of the level by
/// what the wall displaces.
const SCENE: &str = r#"
[shot]
name = "wall"
frames = 24
frames_per_second = 6
[domain]
min = [0.0, 0.0, 0.0]
max = [3.2, 0.4, 0.075]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [3.2, 0.25, 0.075]
[[wave_maker]]
wall = "-x"
[wave_maker.motion]
MOTION
[solver]
method = "flip"
[solver.flip]
cell_size = 0.025
[solver.pbf]
particle_spacing = 0.025
"#;
const GRAVITY: f64 = 9.81;
const DEPTH: f64 = 0.25;
const WIDTH: f64 = 0.075;

/// Distance from the wall at which the depth is taken by volume, and to where water counts to
/// either side: two cells, metres. What is nearer to the wall than a cell hardly counts.
const FROM_WALL: f64 = 0.05;

/// Relative tolerance of the depth against theory, 0.15 cells. Theory is of the first order,
/// and waves are low enough for the second to be within 1 % of the depth.
const TOLERANCE: f64 = 0.015;

/// Tolerance of the topmost particle beside the wall, spacings: it locates the surface to half of
/// one.
const TOP: f64 = 0.5;

/// Depth of the water at [`FROM_WALL`] from the wall: volumes of particles, each spread over the
/// distance as a hat.
fn depth(positions: &[[f32; 3]], spacing: f64, wall: f64) -> f64 {
    let part = |x: &[f32; 3]| {
        let off = (f64::from(x[0]) - wall) / FROM_WALL - 1.0;
        (1.0 - off.abs()).max(0.0)
    };
    positions.iter().map(part).sum::<f64>() * spacing.powi(3) / (WIDTH * FROM_WALL)
}

/// Height of the topmost particle within a spacing of the wall, plus half a spacing; 0 without one.
/// A sliver of water between the wall and the next face that falls is seen here.
fn top(positions: &[[f32; 3]], spacing: f64, wall: f64) -> f64 {
    let near = positions
        .iter()
        .filter(|x| f64::from(x[0]) < wall + spacing);
    let highest = near
        .map(|x| f64::from(x[1]))
        .fold(f64::NEG_INFINITY, f64::max);
    (highest + 0.5 * spacing).max(0.0)
}

/// Elevation at a distance from a vertical wall that moves as a whole, over its displacement, at an
/// angular frequency: real and imaginary part (Dean and Dalrymple 1991, §6.2). The progressive
/// wave is in phase with the wall's velocity, the evanescent modes with its displacement.
fn transfer(omega: f64, distance: f64) -> [f64; 2] {
    let k = wave_number(omega, DEPTH, GRAVITY);
    let ratio = piston_height_ratio(k, DEPTH);
    let evanescent = |index: u32| {
        let deep = omega * omega * DEPTH / GRAVITY;
        // q tan q = −deep, q in the second half of each turn of the tangent.
        let (mut low, mut high) = (
            (f64::from(index) - 0.5) * TAU / 2.0,
            f64::from(index) * TAU / 2.0,
        );
        for _ in 0..60 {
            let q = 0.5 * (low + high);
            if deep + q * q.tan() < 0.0 {
                low = q;
            } else {
                high = q;
            }
        }
        let q = low;
        let size = 2.0 * (1.0 - (2.0 * q).cos()) / ((2.0 * q).sin() + 2.0 * q);
        size * (-q * distance / DEPTH).exp()
    };
    let modes: f64 = (1..20).map(evanescent).sum();
    let phase = k * distance;
    [ratio * phase.sin() + modes, ratio * phase.cos()]
}

/// Elevations by linear theory of the waves of a wall at a distance from it, at multiples of `step`
/// until `end`.
///
/// The displacement is Fourier transformed over four times that time; it is taken back to 0 after
/// `end`, which water at an earlier time cannot know.
fn linear_theory(motion: &Motion, distance: f64, step: f64, end: f64) -> Vec<f64> {
    let count = (4.0 * end / step).ceil() as usize;
    let displacement: Vec<f64> = (0..count)
        .map(|k| {
            let t = step * k as f64;
            let after = ((t - end) / end).clamp(0.0, 1.0);
            motion.displacement(t) * 0.5 * (1.0 + (0.5 * TAU * after).cos())
        })
        .collect();
    let turn = TAU / count as f64;
    let mut elevations = vec![0.0; (end / step).floor() as usize + 1];
    // Up to a quarter of the sampling rate, 24 Hz; these walls have no motion above 3 Hz.
    for line in 1..count / 4 {
        let (mut re, mut im) = (0.0, 0.0);
        for (k, x) in displacement.iter().enumerate() {
            let (sin, cos) = (turn * (line * k % count) as f64).sin_cos();
            re += x * cos;
            im -= x * sin;
        }
        let [a, b] = transfer(turn * line as f64 / step, distance);
        let (re, im) = (re * a - im * b, re * b + im * a);
        for (k, elevation) in elevations.iter_mut().enumerate() {
            let (sin, cos) = (turn * (line * k % count) as f64).sin_cos();
            *elevation += 2.0 * (re * cos - im * sin) / count as f64;
        }
    }
    elevations
}

/// Elevation at `x` of a solitary wave that is `height` high (Goring 1978).
fn goring(height: f64, x: f64, t: f64) -> f64 {
    let k = (0.75 * height / DEPTH).sqrt();
    let celerity = (GRAVITY * (DEPTH + height)).sqrt();
    // The crest starts at χ = −6.
    let phase = k / DEPTH * (celerity * t - x) - 6.0;
    height / phase.cosh().powi(2)
}

/// Bakes the waves of a wall by both solvers, at each rate of frames a second, and compares the
/// depths before it with theory. Control: the depth of still water does not fit.
fn assert_depths_are_the_waves(device: &str, motion: &str, seconds: f64, rates: &[u32]) {
    let text = SCENE.replace("MOTION", motion);
    let job = Job::of(&[("wall.toml", &text)]);
    let moves = load_scene(&job.path("wall.toml"), &[]).unwrap().wave_makers[0]
        .motion
        .clone();
    let finest = 96.0;
    let elevations = [0.0, FROM_WALL].map(|distance| match moves {
        Motion::Solitary { .. } => Vec::new(),
        _ => linear_theory(&moves, distance, 1.0 / finest, seconds),
    });
    let mut missed = Vec::new();
    for rate in rates.iter().copied() {
        let frames = (seconds * f64::from(rate)).floor();
        for (solver, spacing) in [("flip", 0.0125), ("pbf", 0.025)] {
            job.expect(
                0,
                &format!(
                    "bake wall.toml --solver {solver} --device {device} -o {solver} \
                     --set shot.frames_per_second={rate} --set shot.frames={frames}"
                ),
            );
            let reader = CacheReader::open(&job.path(solver)).unwrap();
            let (mut off, mut still, mut beside) = (0.0f64, 0.0f64, 0.0f64);
            for frame in 1..=reader.last_frame() {
                let t = f64::from(frame) / f64::from(rate);
                let wall = moves.displacement(t);
                let theory = [0, 1].map(|k| {
                    let elevation = match moves {
                        Motion::Solitary { height, .. } => {
                            goring(height, wall + [0.0, FROM_WALL][k], t)
                        }
                        _ => elevations[k][(t * finest).round() as usize],
                    };
                    DEPTH + elevation
                });
                let water = reader.read(frame).unwrap().position;
                let found = depth(&water, spacing, wall);
                off = off.max((found / theory[1] - 1.0).abs());
                still = still.max((found / DEPTH - 1.0).abs());
                beside = beside.max((top(&water, spacing, wall) - theory[0]).abs() / spacing);
            }
            println!(
                "{motion:?}, {solver}, {rate} frames a second: {off:.4}, still {still:.4}, \
                beside {beside:.3}"
            );
            if beside > TOP {
                missed.push(format!("{solver} at {rate}, beside the wall: {beside}"));
            }
            if off > TOLERANCE {
                missed.push(format!("{solver} at {rate}: {off}"));
            }
            assert!(still > 1.5 * TOLERANCE, "{solver}: {still}");
            fs::remove_dir_all(job.path(solver)).unwrap();
        }
    }
    assert!(missed.is_empty(), "{motion:?}: {}", missed.join(", "));
}

macro_rules! motions {
    ($($test:ident: $motion:expr, $seconds:literal, $rates:expr;)*) => {
        $(#[test]
        fn $test() {
            assert_depths_are_the_waves("gpu", $motion, $seconds, &$rates);
        })*
    };
}

motions! {
    water_before_a_sine_has_the_waves_depth: SINE, 2.5, [6, 12, 24, 48, 96];
    // The crest needs 3.4 s to pass a wall that starts from rest.
    water_before_a_solitary_wave_has_its_depth:
        "kind = 'solitary'\nheight = 0.025\ndepth = 0.25", 3.8, [6, 24];
    water_before_stokes_waves_has_their_depth:
        "kind = 'stokes'\nheight = 0.02\nperiod = 1.15\ndepth = 0.25\nramp = 1.15", 2.5, [6, 24];
    water_before_cnoidal_waves_has_their_depth:
        "kind = 'cnoidal'\nheight = 0.0125\nperiod = 2.0\ndepth = 0.25\nramp = 1.0", 2.5, [6, 24];
    water_before_a_packet_has_its_depth:
        "kind = 'focused'\nheight = 0.0125\nat = 0.5\ntime = 3.0\npeak_period = 1.15\n\
         shortest_period = 0.5\ndepth = 0.25\nramp = 0.5", 3.2, [6, 24];
}

#[test]
fn water_before_a_sea_has_its_depth() {
    let motion = "kind = 'sea'\nsignificant_height = 0.03\npeak_period = 1.15\n\
        shortest_period = 0.5\ndepth = 0.25\nramp = 1.0";
    assert_depths_are_the_waves("gpu", motion, 4.0, &[6, 24]);
}

const SINE: &str = "kind = 'sine'\nstroke = 0.02\nperiod = 1.15";

/// As on the GPU, by the f64 reference.
#[test]
fn water_of_the_reference_before_a_wall_has_the_waves_depth() {
    assert_depths_are_the_waves("cpu", SINE, 1.7, &[6]);
}
