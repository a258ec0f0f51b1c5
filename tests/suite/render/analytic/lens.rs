//! Depth of field: the disc that a small thing off the focus is drawn as, and cameras from files.

use glam::DVec3;
use swell::render::Image;

use super::support::{Eye, Setup, ball, context, draw, scene, uniform_sky};

/// Focal length, pixels, and the aperture's diameter, metres.
const FOCAL: f64 = 600.0;
const APERTURE: f64 = 0.1;
const SAMPLES: u32 = 64;

/// Mean place of a picture's alpha, and the mean of its variances along both axes, pixels.
fn spread(image: &Image) -> (f64, f64) {
    let side = image.width as usize;
    let (mut sum, mut first, mut second) = (0.0, [0.0; 2], [0.0; 2]);
    for (i, value) in image.beauty.iter().enumerate() {
        let place = [(i % side) as f64, (i / side) as f64];
        let alpha = f64::from(value[3]);
        sum += alpha;
        for axis in 0..2 {
            first[axis] += alpha * place[axis];
            second[axis] += alpha * place[axis] * place[axis];
        }
    }
    let variance = |axis: usize| second[axis] / sum - (first[axis] / sum).powi(2);
    (first[0] / sum, 0.5 * (variance(0) + variance(1)))
}

/// Pixels across the disc that a small ball of water at `depth` metres is drawn as, by how much wider its picture is than by a
/// pinhole: points spread evenly over a disc c across have a variance of c²/16 along an axis.
fn circle(method: &'static str, depth: f64, focus: f64) -> f64 {
    let eye = Eye {
        size: 96,
        ..Eye::new([5.0, 1.0, 1.0], [5.0, 6.0, 8.0], FOCAL)
    };
    let shot = |lens: bool| {
        let f_stop = eye.focal_length_mm() * 1e-3 / APERTURE;
        let setup = Setup {
            camera: match lens {
                true => format!("lens = {{ f_stop = {f_stop:?}, focus_distance_m = {focus:?} }}\n"),
                false => String::new(),
            },
            samples: SAMPLES,
            method,
            surface: "smoothing_width_m = 0.0\n".to_owned(),
            background: false,
            ..Setup::new(eye)
        };
        let radius = 0.005 * depth;
        let mut scene = scene(radius, 1.0);
        scene.particle_spacing = radius / 0.87;
        let water = ball(eye.position + depth * eye.forward(), DVec3::ZERO);
        spread(&draw(&context(), &setup, &uniform_sky, &scene, &water, 1))
    };
    let (blurred, sharp) = (shot(true), shot(false));
    assert!((blurred.0 - sharp.0).abs() < 0.1, "{blurred:?} {sharp:?}");
    4.0 * (blurred.1 - sharp.1).max(0.0).sqrt()
}

/// c = A f |1/d_f − 1/d|: of the film at f behind a lens that is A across. A thin lens has d_f − f for d_f in the first term, since
/// its film moves back to focus.
fn expected(depth: f64, focus: f64) -> f64 {
    FOCAL * APERTURE * (1.0 / focus - 1.0 / depth).abs()
}

#[test]
fn a_thing_off_the_focus_is_a_disc_of_the_lens() {
    for method in ["ssfr", "ray"] {
        for (depth, focus) in [(6.0, 3.0), (3.0, 6.0)] {
            let found = circle(method, depth, focus);
            let error = |focus: f64| found / expected(depth, focus) - 1.0;
            // 64 points are 0.5 / 64 off the variance of a disc; a ball of three pixels' radius is counted to a hundredth.
            assert!(
                error(focus).abs() < 0.02,
                "{method} {depth} {focus}: {found}"
            );
            // The controls: focused a twentieth nearer or farther.
            for other in [0.95 * focus, 1.05 * focus] {
                assert!(
                    error(other).abs() > 0.03,
                    "{method} {depth} {other}: {found}"
                );
            }
        }
        // On the plane: less than a tenth of a pixel squared more than a pinhole's, which is a disc of 1.2 pixels.
        let found = circle(method, 4.0, 4.0);
        assert!(found < 1.2, "{method}: {found}");
    }
}
