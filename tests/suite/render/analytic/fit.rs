//! Film whose aspect ratio differs from the image's: position of a known point in the picture, with
//! either method and in an exported camera.

use glam::DVec3;
use swell::files::parse_look;
use swell::render::{FrameInputs, Image, Renderer, WaterParticles};

use super::support::{Eye, Setup, ball, context, scene, uniform_sky, write_sky};

const IMAGE: [f64; 2] = [96.0, 54.0];
const FOCAL_MM: f64 = 30.0;
const DEPTH: f64 = 4.0;
const RADIUS: f64 = 0.15;
/// Position of the ball: right of the axis, above it and along it, m.
const PLACE: [f64; 3] = [0.9, 0.4, DEPTH];

/// Centroid of a picture's alpha, pixels right of and above the picture's middle.
fn middle(image: &Image) -> [f64; 2] {
    let (mut sum, mut first) = (0.0, [0.0; 2]);
    for (i, value) in image.beauty.iter().enumerate() {
        let [column, row] = [i % image.width as usize, i / image.width as usize];
        let alpha = f64::from(value[3]);
        sum += alpha;
        first[0] += alpha * (column as f64 + 0.5 - 0.5 * IMAGE[0]);
        first[1] += alpha * (0.5 * IMAGE[1] - row as f64 - 0.5);
    }
    first.map(|of| of / sum)
}

/// Looks up, so that no ground is visible.
fn eye() -> Eye {
    Eye::new([5.0, 1.0, 1.0], [5.0, 6.0, 8.0], 1.0)
}

fn drawn(method: &'static str, film: [f64; 2], fit: &str) -> Image {
    let eye = eye();
    let setup = Setup {
        samples: 16,
        method,
        background: false,
        ..Setup::new(eye)
    };
    let mut set = scene(RADIUS, 1.0);
    set.particle_spacing = RADIUS / 0.87;
    let [right, up, forward] = eye.axes();
    let [x, y, z] = PLACE;
    let water = ball(eye.position + x * right + y * up + z * forward, DVec3::ZERO);
    let text = setup.text();
    let (_, rest) = text
        .split_once("[image]\nwidth = 64\nheight = 64\n")
        .unwrap();
    let text = format!(
        "[camera]\nfocal_length_mm = {FOCAL_MM:?}\nfilm_back_mm = {film:?}\n\
         {fit}position = {:?}\ntarget = {:?}\n\
         [image]\nwidth = {}\nheight = {}\n{rest}",
        eye.position.to_array(),
        eye.target.to_array(),
        IMAGE[0],
        IMAGE[1]
    );
    let folder = tempfile::tempdir().unwrap();
    write_sky(&folder.path().join("sky.exr"), &uniform_sky);
    let look = parse_look(&text, &folder.path().join("look.toml")).unwrap();
    let mut renderer = Renderer::new(&context(), &look, &set).unwrap();
    let (water, white) = (WaterParticles::new(water), Default::default());
    let inputs = FrameInputs::alone(&water, &white);
    renderer.render_inputs(1, &inputs).unwrap()
}

/// A millimetre of film is 96 / 36 pixels where the image uses the film's width and 54 / 24 where
/// it uses its height. A ball of radius r at a depth d is an ellipse whose middle is x d / (d² −
/// r²) off the axis if its centre is x off it: the film cuts the cone around it that starts at the
/// eye.
#[test]
fn a_point_is_where_the_fit_of_the_film_has_it() {
    let narrow = [36.0, 24.0];
    let wide = [36.0, 18.0];
    let (by_width, by_height) = (IMAGE[0] / 36.0, IMAGE[1] / 24.0);
    let rows = [
        (narrow, "", by_width),
        (narrow, "width", by_width),
        (narrow, "height", by_height),
        (narrow, "fill", by_width),
        (narrow, "overscan", by_height),
        (wide, "fill", IMAGE[1] / 18.0),
        (wide, "overscan", by_width),
    ];
    for method in ["ssfr", "ray"] {
        for (film, fit, pixels_per_mm) in rows {
            let key = match fit {
                "" => String::new(),
                fit => format!("fit = \"{fit}\"\n"),
            };
            let image = drawn(method, film, &key);
            let found = middle(&image);
            let focal = FOCAL_MM * pixels_per_mm;
            let [x, y, z] = PLACE;
            let spread = z / (z * z - RADIUS * RADIUS);
            for (found, off) in found.into_iter().zip([x, y]) {
                let expected = focal * off * spread;
                // 16 samples locate an edge within a quarter of a pixel, and a mean of some 19 of
                // them within 0.06.
                assert!(
                    (found - expected).abs() < 0.1,
                    "{method} {film:?} {fit}: {found} {expected}"
                );
                // Control: the other fit is far from it.
                let other = expected * by_height / by_width;
                assert!((found - other).abs() > 0.5, "{method} {fit}: {found}");
            }
            // The header's matrix puts the ball's centre at the same position.
            let [to_right, to_top, forward] = eye().axes();
            let point = eye().position + x * to_right + y * to_top + z * forward;
            let row = point.extend(1.0).to_array();
            let matrix = image.view.unwrap().world_to_ndc;
            let sum = |column: usize| -> f64 {
                (0..4)
                    .map(|k| row[k] * f64::from(matrix[4 * k + column]))
                    .sum()
            };
            let [right, up] = [
                (sum(0) / sum(3) - 0.5) * IMAGE[0],
                (0.5 - sum(1) / sum(3)) * IMAGE[1],
            ];
            for (found, off) in [(right, x), (up, y)] {
                let expected = focal * off / z;
                // The matrix has 32 bits: 2⁻²⁴ of a coordinate of some hundred pixels, in a sum of
                // four.
                assert!((found - expected).abs() < 1e-3, "{found} {expected}");
            }
        }
    }
}
