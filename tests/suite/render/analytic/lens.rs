//! Depth of field: the blur disc of a small thing out of focus, and cameras from files.

use glam::DVec3;
use swell::files::parse_look;
use swell::render::{FrameInputs, Image, Renderer, WaterParticles};

use super::support::{Eye, FILM, Setup, ball, context, draw, scene, uniform_sky, write_sky};

/// Focal length, pixels, and diameter of the aperture, m.
const FOCAL: f64 = 600.0;
const APERTURE: f64 = 0.1;
const SAMPLES: u32 = 64;

/// Centroid of a picture's alpha, pixels right and down, and the mean of its variances along both
/// axes.
fn spread(image: &Image) -> ([f64; 2], f64) {
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
    let mean = first.map(|of| of / sum);
    (mean, 0.5 * (variance(0) + variance(1)))
}

/// Diameter in pixels of the blur disc of a small ball of water at `depth` metres, from the
/// increase in variance relative to a pinhole: points spread evenly over a disc of diameter c have
/// a variance of c²/16 along an axis.
fn circle(method: &'static str, depth: f64, focus: f64) -> f64 {
    let eye = Eye {
        size: 64,
        ..Eye::new([5.0, 1.0, 1.0], [5.0, 6.0, 8.0], FOCAL)
    };
    let shot = |lens: bool| {
        let f_stop = eye.focal_length_mm() * 1e-3 / APERTURE;
        let setup = Setup {
            camera: match lens {
                true => format!("lens = {{ f_stop = {f_stop:?}, focus_distance_m = {focus:?} }}\n"),
                false => String::new(),
            },
            samples: if lens { SAMPLES } else { SAMPLES / 4 },
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
    assert!(
        (blurred.0[0] - sharp.0[0]).abs() < 0.1,
        "{blurred:?} {sharp:?}"
    );
    4.0 * (blurred.1 - sharp.1).max(0.0).sqrt()
}

/// c = A f |1/d_f − 1/d| for film at distance f behind a lens of diameter A. A thin lens has d_f −
/// f for d_f in the first term, because its film moves back to focus.
fn expected(depth: f64, focus: f64) -> f64 {
    FOCAL * APERTURE * (1.0 / focus - 1.0 / depth).abs()
}

#[test]
fn a_thing_off_the_focus_is_a_disc_of_the_lens() {
    for method in ["ssfr", "ray"] {
        for (depth, focus) in [(6.0, 3.0), (3.0, 6.0)] {
            let found = circle(method, depth, focus);
            let error = |focus: f64| found / expected(depth, focus) - 1.0;
            // 64 points have a variance within 0.5 / 64 of a disc's; the area of a ball with a
            // radius of three pixels is known to one percent.
            assert!(
                error(focus).abs() < 0.02,
                "{method} {depth} {focus}: {found}"
            );
            // Controls: focused 5 % nearer or farther.
            for other in [0.95 * focus, 1.05 * focus] {
                assert!(
                    error(other).abs() > 0.03,
                    "{method} {depth} {other}: {found}"
                );
            }
        }
        // In focus: the variance is that of a pinhole to less than a tenth of a pixel squared,
        // which is a disc of 1.2 pixels.
        let found = circle(method, 4.0, 4.0);
        assert!(found < 1.2, "{method}: {found}");
    }
}

/// The camera as USD, with a lens, and with the picture's middle shifted by so many pixels right of
/// and above the optical axis.
fn as_usd(eye: &Eye, [f_stop, focus]: [f64; 2], shift: [f64; 2]) -> String {
    let [right, up, forward] = eye.axes();
    let row = |v: DVec3| format!("({:?}, {:?}, {:?}, ", v.x, v.y, v.z);
    // Film sizes are in tenths of the scene's unit, here of a metre.
    let film = FILM / 100.0;
    let pixel = film / f64::from(eye.size);
    format!(
        "#usda 1.0\n(\n    metersPerUnit = 1\n    upAxis = \"Y\"\n)\ndef Camera \"eye\"\n\
         {{\n    float focalLength = {:?}\n    float horizontalAperture = {film:?}\n    \
         float verticalAperture = {film:?}\n    float fStop = {f_stop:?}\n    \
         float focusDistance = {focus:?}\n    float horizontalApertureOffset = {:?}\n    \
         float verticalApertureOffset = {:?}\n    \
         matrix4d xformOp:transform = ( {}0), {}0), {}0), {}1) )\n    \
         uniform token[] xformOpOrder = [\"xformOp:transform\"]\n}}\n",
        eye.focal * pixel,
        shift[0] * pixel,
        shift[1] * pixel,
        row(right),
        row(up),
        row(-forward),
        row(eye.position),
    )
}

/// A USD camera renders like the look's own camera with the same lens, shifted on the film by the
/// offsets of its aperture.
#[test]
fn a_lens_and_a_shift_of_the_film_come_from_usd() {
    let eye = Eye {
        size: 96,
        ..Eye::new([5.0, 1.0, 1.0], [5.0, 6.0, 8.0], FOCAL)
    };
    let (depth, focus) = (4.0, 6.0);
    let f_stop = eye.focal_length_mm() * 1e-3 / APERTURE;
    let mut set = scene(0.005 * depth, 1.0);
    set.particle_spacing = 0.005 * depth / 0.87;
    let water = ball(eye.position + depth * eye.forward(), DVec3::ZERO);
    for method in ["ssfr", "ray"] {
        let setup = Setup {
            camera: format!("lens = {{ f_stop = {f_stop:?}, focus_distance_m = {focus:?} }}\n"),
            // The same samples in both, so few suffice.
            samples: 16,
            method,
            background: false,
            ..Setup::new(eye)
        };
        let (place, width) = spread(&draw(&context(), &setup, &uniform_sky, &set, &water, 1));
        let by_file = |usd: &str| {
            let folder = tempfile::tempdir().unwrap();
            write_sky(&folder.path().join("sky.exr"), &uniform_sky);
            std::fs::write(folder.path().join("eye.usda"), usd).unwrap();
            let text = setup.text();
            let (_, rest) = text.split_once("[image]").unwrap();
            let text = format!(
                "[camera]\nfile = \"eye.usda\"\nfilm_back_mm = [{FILM:?}, {FILM:?}]\n[image]{rest}"
            );
            let look = parse_look(&text, &folder.path().join("look.toml")).unwrap();
            let mut renderer = Renderer::new(&context(), &look, &set).unwrap();
            let (water, white) = (WaterParticles::new(water.clone()), Default::default());
            let inputs = FrameInputs::alone(&water, &white);
            renderer.render_inputs(1, &inputs).unwrap()
        };
        // If the window moves right and up, things move left and down; a shift by whole pixels
        // moves samples with them.
        let image = by_file(&as_usd(&eye, [f_stop, focus], [11.0, -7.0]));
        let (moved, same) = spread(&image);
        for (axis, way) in [-11.0, -7.0].into_iter().enumerate() {
            let off = moved[axis] - place[axis] - way;
            assert!(off.abs() < 0.01, "{method}: {moved:?} {place:?}");
        }
        assert!(
            (same / width - 1.0).abs() < 0.01,
            "{method}: {same} {width}"
        );
        // The header's matrix puts the ball at the same position; points are row vectors.
        let point = (eye.position + depth * eye.forward())
            .extend(1.0)
            .to_array();
        let matrix = image.view.unwrap().world_to_ndc;
        let sum = |column: usize| -> f64 {
            let rows = (0..4).map(|row| point[row] * f64::from(matrix[4 * row + column]));
            rows.sum()
        };
        for (axis, place) in moved.into_iter().enumerate() {
            let told = sum(axis) / sum(3) * 96.0 - 0.5;
            assert!((told - place).abs() < 0.1, "{method}: {told} {place}");
        }
        // Control: without its lens the file's camera renders the ball itself, much narrower.
        let (_, sharp) = spread(&by_file(&as_usd(&eye, [0.0, focus], [11.0, -7.0])));
        assert!(sharp < 0.5 * width, "{method}: {sharp} {width}");
    }
}
