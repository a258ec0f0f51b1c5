//! Held-out solids, in closed form: black and transparent except for spray in front of them.

use std::path::Path;
use swell::files::parse_look;

use swell::{
    domain::particles::Particles,
    gpu::adapter::Context,
    render::{Image, cryptomatte::id_of},
    scene::look::Look,
};

use super::super::analytic::support::{context, spoiled};
use super::{OBLIQUE, draw, harbour};

/// A sky of radiance 1 without a sun, water without absorption, and one sample at each pixel's
/// centre.
fn look(folder: &Path, method: &str, output: &str) -> Look {
    let text = OBLIQUE
        .replace("samples = 2\nshutter = 0.5", "samples = 1")
        .replace(
            "[water]\n",
            "[water]\nabsorption_per_metre = [0.0, 0.0, 0.0]\n",
        )
        .replace("\"hosek_wilkie\"", "\"panorama\"\nfile = \"sky.exr\"");
    let text = format!(
        "{text}[ground]\nhaze_m = 1e7\n[sun]\nintensity = 0.0\n[renderer]\nmethod = \"{method}\"\n\
         [output]\nformats = [\"exr\"]\ncryptomatte = true\n{output}\n"
    );
    parse_look(&text, &folder.join("look.toml")).unwrap()
}

/// Radiance of spray under a sky of radiance 1: drops do not absorb.
const WHITE: f32 = 1.0;
/// Rows of the sky's panorama.
const ROWS: usize = 64;
/// Relative error of the sky's irradiance by a quadrature of second order: the square of half a
/// row's angle.
const QUADRATURE: f32 = {
    let half = std::f32::consts::PI / (2 * ROWS) as f32;
    half * half
};
/// Some roundings of numbers up to 1.
const ROUNDING: f32 = 1e-6;

/// Fraction of a pixel that an object covers.
fn cover(image: &Image, i: usize, name: &str) -> f32 {
    let ranks = &image.matte.as_ref().unwrap().ranks;
    let own = ranks.iter().filter(|rank| rank[i][0] == id_of(name));
    own.map(|rank| rank[i][1]).sum()
}

/// Descriptions of pixels that are wrong, and numbers of pixels of three kinds: held out only,
/// behind spray, and not held out.
fn wrong(context: &Context, method: &str) -> (Vec<String>, [usize; 3]) {
    let folder = tempfile::tempdir().unwrap();
    exr::prelude::write_rgb_file(folder.path().join("sky.exr"), 2 * ROWS, ROWS, |_, _| {
        (1.0f32, 1.0f32, 1.0f32)
    })
    .unwrap();
    let (scene, water) = harbour();
    let render = |output: &str, water: &Particles| {
        draw(context, &look(folder.path(), method, output), &scene, water)
    };
    let held = render("solids = \"holdout\"", &water);
    let full = render("", &water);
    let plate = render("", &Particles::default());
    let (mut wrong, mut kinds) = (Vec::new(), [0; 3]);
    for (i, (&held_pixel, &full_pixel)) in held.beauty.iter().zip(&full.beauty).enumerate() {
        let spray = cover(&full, i, "spray");
        let solid: f32 = ["ground", "walls", "tower", "shed"]
            .map(|name| cover(&full, i, name))
            .iter()
            .sum();
        let mut check = |is_right: bool, what: &str| {
            if !is_right {
                wrong.push(format!("pixel {i}: {what}: {held_pixel:?}, spray {spray}"));
            }
        };
        if solid == 0.0 {
            kinds[2] += 1;
            check(held_pixel == full_pixel, "not held out, and another colour");
            continue;
        }
        kinds[usize::from(spray > 0.0)] += 1;
        let [.., alpha] = held_pixel;
        check(
            (alpha - spray).abs() <= ROUNDING,
            "coverage is not the spray's",
        );
        let white = WHITE * spray;
        let is_white = |c: usize| (held_pixel[c] - white).abs() <= QUADRATURE * white + ROUNDING;
        check((0..3).all(is_white), "colour is not the spray's");
        if spray == 0.0 {
            check(held_pixel == [0.0; 4], "held out, and not black");
        }
        let over = |c: usize| held_pixel[c] + (1.0 - alpha) * plate.beauty[i][c];
        let is_full = |c: usize| (over(c) - full_pixel[c]).abs() <= 4.0 * ROUNDING;
        check(
            (0..4).all(is_full),
            "over the plate it is not the full picture",
        );
    }
    (wrong, kinds)
}

#[test]
fn held_out_solids_leave_what_stands_before_them_and_nothing_else() {
    for (method, pass, edit) in [
        (
            "ssfr",
            "ssfr/shade",
            ("        alpha = 0.0;", "        alpha = 0.5;"),
        ),
        (
            "ray",
            "rays/cast",
            ("return vec4f(0.0);", "return vec4f(0.0, 0.0, 0.0, 0.5);"),
        ),
    ] {
        let (found, kinds) = wrong(&context(), method);
        assert!(
            found.is_empty(),
            "{method}: {} pixels, {}",
            found.len(),
            found[0]
        );
        assert!(kinds.iter().all(|&count| count > 50), "{method}: {kinds:?}");
        let (from, to) = edit;
        let (control, _) = wrong(&spoiled(pass, from, to), method);
        assert!(control.len() > kinds[0], "{method}: {}", control.len());
    }
}
