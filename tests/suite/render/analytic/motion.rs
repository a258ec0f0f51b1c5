//! Motion between frames: the path of motion blur, and motion vectors.

use glam::DVec3;
use swell::domain::particles::Particles;
use swell::render::{FrameInputs, Image, WaterParticles};

use super::support::{Eye, Setup, ball, context, draw_inputs, scene, uniform_sky};

/// Acceleration along z, m/s²: 2.4 m of displacement a frame before and after, at 24 frames a
/// second.
const PUSH: f64 = 2765.0;
/// Pixels by which a ball may lag because a level set moves it straight and evenly: a third of the
/// twentieth of a spacing, 0.645 m, up to which a frame has few of them.
const BENT: f64 = 0.05 / 3.0 * 0.645 * 34.0;
const SECONDS: f64 = 1.0 / 24.0;

fn eye() -> Eye {
    Eye {
        size: 96,
        ..Eye::new([3.0, 2.0, 5.0], [8.0, 7.0, 5.0], 240.0)
    }
}

/// The ball a number of frames later: thrown towards −z, at rest at the frame, then returning.
fn thrown(frames: f64) -> Particles {
    let t = frames * SECONDS;
    let away = DVec3::Z * (0.5 * PUSH * t * t);
    ball(eye().target + away, DVec3::Z * (PUSH * t))
}

/// Centroid of a picture's alpha, pixels to the right.
fn middle(image: &Image) -> f64 {
    let side = image.width as usize;
    let sums = (image.beauty.iter().enumerate()).fold([0.0; 2], |[sum, first], (i, value)| {
        let alpha = f64::from(value[3]);
        [sum + alpha, first + alpha * (i % side) as f64]
    });
    sums[1] / sums[0]
}

/// Shift of the ball to the right, pixels: by splats in the mean of instants a quarter of a frame
/// before and after, by rays in that of all instants up to half a frame from it.
fn shift(method: &'static str, around: [Option<&WaterParticles>; 4]) -> f64 {
    let shot = |shutter: f64| {
        let setup = Setup {
            samples: if method == "ray" { 16 } else { 2 },
            shutter,
            method,
            surface: "radius_m = 0.4\nsmoothing_width_m = 0.0\n".to_owned(),
            background: false,
            ..Setup::new(eye())
        };
        let (water, white) = (WaterParticles::new(thrown(0.0)), Particles::default());
        let inputs = FrameInputs {
            around,
            ..FrameInputs::alone(&water, &white)
        };
        let drawn = draw_inputs(
            &context(),
            &setup,
            &uniform_sky,
            &scene(0.4, 1.0),
            &inputs,
            1,
        );
        middle(&drawn.unwrap())
    };
    shot(1.0) - shot(0.0)
}

#[test]
fn blur_follows_the_curve_through_the_frames_around() {
    let (before, after) = (
        WaterParticles::new(thrown(-1.0)),
        WaterParticles::new(thrown(1.0)),
    );
    for (method, mean_square, within) in [("ssfr", 0.0625, 0.4), ("ray", 1.0 / 12.0, 0.4 + BENT)] {
        // A parabola is its own Hermite curve.
        let away = 0.5 * PUSH * mean_square * SECONDS.powi(2);
        let expected = away * 240.0 / 50f64.sqrt();
        let found = shift(method, [None, Some(&before), Some(&after), None]);
        // The centroid of a disc with a radius of 14 pixels is known to a few hundredths of a
        // pixel. Its surface by rays is known to one or two hundredths of a voxel, which is 0.32 m
        // and 11 pixels.
        assert!(
            (found - expected).abs() < within,
            "{method}: {found} {expected}"
        );
        // Controls: with its velocity only it does not move, and with one neighbouring frame it
        // moves by half on average.
        let straight = shift(method, [None; 4]);
        assert!(straight.abs() < 0.4, "{method}: {straight}");
        let half = shift(method, [None, None, Some(&after), None]);
        assert!((half - 0.5 * expected).abs() < within, "{method}: {half}");
    }
}

/// Motion of the middle of the ball to the next frame, pixels to the right.
fn motion(method: &'static str, after: Option<&WaterParticles>) -> f64 {
    let setup = Setup {
        method,
        surface: "radius_m = 0.4\nsmoothing_width_m = 0.0\n".to_owned(),
        ..Setup::new(eye())
    };
    let water = WaterParticles::new(ball(eye().target, DVec3::Z * 3.0));
    let white = Particles::default();
    let inputs = FrameInputs {
        around: [None, None, after, None],
        ..FrameInputs::alone(&water, &white)
    };
    let drawn = draw_inputs(
        &context(),
        &setup,
        &uniform_sky,
        &scene(0.4, 1.0),
        &inputs,
        1,
    );
    let forward = drawn.unwrap().aovs.forward.unwrap();
    f64::from(forward[48 * 96 + 48][0])
}

#[test]
fn motion_vectors_lead_to_the_next_frame() {
    let after = WaterParticles::new(ball(eye().target + DVec3::Z * 0.3, DVec3::Z * 8.0));
    // The front of the ball is 0.4 m nearer than its centre.
    let scale = 240.0 / (50f64.sqrt() - 0.4);
    for method in ["ssfr", "ray"] {
        let found = motion(method, Some(&after));
        assert!((found - 0.3 * scale).abs() < 0.3, "{method}: {found}");
        // Control: by its velocity it would move 0.125 m.
        let found = motion(method, None);
        assert!(
            (found - 3.0 * SECONDS * scale).abs() < 0.3,
            "{method}: {found}"
        );
    }
}
