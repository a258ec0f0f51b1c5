//! Tiles with water and those without are rendered by separate passes, and the light of spray is
//! added only where there is some; this does not change the picture.

use std::path::Path;
use swell::files::parse_look;

use swell::{domain::particles::Particles, gpu::adapter::Context, render::Renderer};

use super::{
    analytic::{context, spoiled},
    scenes::{city_scene, city_water},
};

const LOOK: &str = "[camera]
focal_length_mm = 27.0
film_back_mm = [36.0, 19.92]
position = [7.2, 5.6, -1.7]
target = [17.6, 1.7, 8.4]
[image]
width = 150
height = 83
samples = 2
[water]
spray = { density_per_metre = 9.0, speed_m_per_s = 2.0 }
[sun]
azimuth_degrees = 112.0
elevation_degrees = 34.0
[sky]
model = \"hosek_wilkie\"
";

/// Renders several waters with one renderer and returns the last picture.
fn last(context: &Context, waters: &[&Particles]) -> Vec<[f32; 4]> {
    let look = parse_look(LOOK, Path::new("listed.toml")).unwrap();
    let mut renderer = Renderer::new(context, &look, &city_scene()).unwrap();
    let pictures = waters
        .iter()
        .map(|water| renderer.render(9, water).unwrap());
    pictures.last().unwrap().beauty
}

/// Fraction of pixels of which a channel differs by more than rounding: both passes have one
/// formula, but compilers may order the steps of two programs differently. A few hundred steps,
/// each off by half of 2⁻²⁴.
fn apart(a: &[[f32; 4]], b: &[[f32; 4]]) -> f64 {
    const ROUNDING: f32 = 200.0 * 6e-8;
    let differs = |(a, b): &(&[f32; 4], &[f32; 4])| {
        let mut channels = a.iter().zip(*b);
        channels.any(|(a, b)| (a - b).abs() > ROUNDING * (1.0 + a.abs()))
    };
    a.iter().zip(b).filter(differs).count() as f64 / a.len() as f64
}

/// Passes that list tiles, and the statement that says that a tile has something.
const LISTS: [(&str, &str); 4] = [
    ("ssfr/list_tiles", "return nearest < FAR;"),
    ("ssfr/list_picture", "return nearest < FAR;"),
    ("ssfr/list_picture", "return solid < FAR;"),
    ("ssfr/list_spray", "return all > 0u;"),
];

#[test]
fn lists_of_tiles_do_not_change_the_picture() {
    let water = city_water();
    let picture = last(&context(), &[&water]);
    for (pass, says) in LISTS {
        let everywhere = spoiled(pass, says, "return true;");
        let found = apart(&picture, &last(&everywhere, &[&water]));
        assert_eq!(found, 0.0, "{pass}");
        // Control: without lists nothing is drawn where a quarter of the picture has something.
        let nowhere = spoiled(pass, says, "return false;");
        let found = apart(&picture, &last(&nowhere, &[&water]));
        assert!(found > 0.1, "{pass}: {found}");
    }
}

/// Faces of closed meshes that face away from the eye are hidden by the others. At an edge both
/// have the same depth, and either may be kept: fewer than a thousandth of the pixels.
#[test]
fn far_sides_of_closed_bodies_are_in_no_pixel() {
    let water = city_water();
    let picture = last(&context(), &[&water]);
    let (asks, cull) = ("index / 6u < camera.closed", "dot(normal, a) > 0.0");
    let all = last(&spoiled("ssfr/solid", asks, "index / 6u < 0u"), &[&water]);
    let found = apart(&picture, &all);
    assert!(found < 1e-3, "{found}");
    // Control: without the front faces the houses' insides are visible.
    let opened = last(
        &spoiled("ssfr/solid", cull, "dot(normal, a) < 0.0"),
        &[&water],
    );
    assert!(apart(&opened, &all) > 0.05);
}

/// A tile that has no water any more shows nothing of an earlier frame.
#[test]
fn a_frame_leaves_nothing_to_the_next() {
    let water = city_water();
    let mut less = water.clone();
    let kept: Vec<bool> = water.position.iter().map(|p| p[2] < 5.0).collect();
    let keeps = |index: usize| kept[index];
    let filtered = |all: &[[f32; 3]]| -> Vec<[f32; 3]> {
        let of = |(index, value): (usize, &[f32; 3])| keeps(index).then_some(*value);
        all.iter().enumerate().filter_map(of).collect()
    };
    less.position = filtered(&water.position);
    less.velocity = filtered(&water.velocity);
    less.id = (0..less.position.len() as u32).collect();
    let alone = last(&context(), &[&less]);
    assert_eq!(last(&context(), &[&water, &less]), alone);
    // Controls: the first frame is a different picture, and a tile that is not cleared is visible.
    assert!(apart(&last(&context(), &[&water]), &alone) > 0.05);
    let uncleared = spoiled(
        "ssfr/fill",
        "words[at] = params.word;",
        "words[at] = select(params.word, words[at], words[at] != 0u);",
    );
    assert_ne!(last(&uncleared, &[&water, &less]), alone);
}
