//! The light layers sum to the picture.

use half::f16;
use swell::{
    domain::{
        particles::Particles,
        whitewater::{ATTRIBUTES, KIND, WhitewaterKind},
    },
    gpu::adapter::Context,
    render::{Image, Renderer},
    scene::look::LightSpec,
};

use super::super::analytic::support::{context, spoiled};
use super::{METHODS, Setup, harbour, white};

const ALL: &str = "lights = [\"solids\", \"reflection\", \"refraction\", \"scattering\", \
                   \"sun\", \"sky\", \"spray\", \"caustics\", \"foam\"]\n\
                   [whitewater]\ndensity_per_metre = 6.0\n";

/// The part of [`ALL`] without the layers.
const WHITE: &str = "[whitewater]\ndensity_per_metre = 6.0\n";

fn setup<'a>(method: &'a str, output: &'a str) -> Setup<'a> {
    Setup {
        method,
        image: "",
        surface: "",
        output,
    }
}

/// Value after rounding to a half float, as a file stores it.
fn halved(value: f32) -> f64 {
    f16::from_f32(value.min(65504.0)).to_f64()
}

/// Largest difference between a file's beauty and the sum of its layers, relative to the half-float
/// rounding of all of them.
fn off(image: &Image) -> f64 {
    // Half a step of eleven bits, and half of the smallest number.
    let rounding = |value: f64| value.abs() / 2048.0 + 2f64.powi(-25);
    // Sums in f32, of two samples with some ten lights each, are much more accurate than that.
    let mut worst = 0.0f64;
    for (i, pixel) in image.beauty.iter().enumerate() {
        for (c, value) in pixel[..3].iter().enumerate() {
            let value = halved(*value);
            let parts = image.lights.iter().map(|(_, part)| halved(part[i][c]));
            let (mut sum, mut allowed) = (0.0, rounding(value));
            for part in parts {
                sum += part;
                allowed += rounding(part);
            }
            worst = worst.max((sum - value).abs() / allowed);
        }
    }
    worst
}

/// Largest difference between two pictures, in half steps of half floats.
fn apart(a: &Image, b: &Image) -> f64 {
    let pixels = a.beauty.iter().flatten().zip(b.beauty.iter().flatten());
    pixels
        .map(|(&a, &b)| {
            let (a, b) = (f64::from(a), f64::from(b));
            (a - b).abs() / (a.abs().max(b.abs()) / 2048.0 + 2f64.powi(-25))
        })
        .fold(0.0, f64::max)
}

#[test]
fn all_lights_add_up_to_the_picture() {
    let drawn = |context: &Context, method| setup(method, ALL).draw(context);
    for method in METHODS {
        let image = drawn(&context(), method);
        let names: Vec<LightSpec> = image.lights.iter().map(|(light, _)| *light).collect();
        assert_eq!(names, LightSpec::NAMED.map(|(_, light)| light));
        assert!(off(&image) <= 1.0, "{method}: {}", off(&image));
        // This picture has some light of each kind.
        for (light, part) in &image.lights {
            // Splats have no caustics.
            if (method, *light) == ("ssfr", LightSpec::Caustics) {
                assert!(part.iter().flatten().all(|&x| x == 0.0));
                continue;
            }
            let most = part.iter().flatten().fold(0.0f32, |most, &x| most.max(x));
            assert!(most > 1e-3, "{method}: no {light:?}");
            let least = part.iter().flatten().fold(0.0f32, |least, &x| least.min(x));
            assert!(least > -1e-6, "{method}: {light:?} takes {least}");
        }
        // Layers do not affect the picture, except for f32 roundings that a compiler orders
        // differently when it computes more: less than the rounding of the file's half floats.
        let plain = setup(method, WHITE).draw(&context());
        let changed = apart(&plain, &image);
        assert!(
            changed < 1.0,
            "{method}: other pictures with layers: {changed}"
        );
        let bare = setup(method, "").draw(&context());
        let control = apart(&bare, &image);
        assert!(control > 100.0, "{method}, the control: {control}");
        // Controls: each light that is left out, or dimmed only in the picture, is detected.
        let foam = "light_part(FOAM_LIGHT, light * (cover * foam));";
        let edits = match method {
            "ssfr" => [
                ("ssfr/shade_spray", foam),
                ("ssfr/shade", "light_part(SUN, sun);"),
                ("ssfr/shade", "dim_parts(kept);"),
                ("ssfr/shade", "light_part(SOLIDS, colour - air);"),
            ],
            _ => [
                "light_part(part_of(ray, FOAM_LIGHT), foam);",
                "light_part(CAUSTICS, weight * opaque_one.caustics);",
                "dim_parts(1.0 - mist.cover);",
                "light_part(part_of(ray, SOLIDS), seen);",
            ]
            .map(|part| ("rays/cast", part)),
        };
        for (pass, part) in edits {
            let control = off(&drawn(&spoiled(pass, part, ""), method));
            assert!(control > 1.0, "{method}: {part}: {control}");
        }
    }
}

#[test]
fn a_layer_is_the_same_whatever_others_there_are() {
    for method in METHODS {
        let all = setup(method, ALL).draw(&context());
        let some = format!("lights = [\"spray\", \"reflection\"]\n{WHITE}");
        let some = setup(method, &some).draw(&context());
        let find = |image: &Image, light| {
            let found = image.lights.iter().find(|(it, _)| *it == light);
            found.map(|(_, part)| part.clone())
        };
        assert_eq!(some.lights.len(), 2);
        for light in [LightSpec::Spray, LightSpec::Reflection] {
            assert!(
                find(&some, light) == find(&all, light),
                "{method}: {light:?}"
            );
        }
        assert!(
            find(&some, LightSpec::Spray) != find(&all, LightSpec::Reflection),
            "the control"
        );
    }
}

#[test]
fn layers_of_a_frame_in_bands_are_those_of_one_drawn_whole() {
    let (scene, water) = harbour();
    let look = setup("ssfr", ALL).look();
    let context = context();
    let draw = |limit: u32| {
        let mut renderer = Renderer::with_tile_limit(&context, &look, &scene, limit).unwrap();
        renderer.render(3, &water).unwrap()
    };
    let (whole, bands) = (draw(8192), draw(32));
    assert!(whole == bands);
    assert!(whole.lights[0].1 != whole.lights[1].1, "the control");
}

/// For a stream of a single kind, that kind's layer has what the picture gained; the other has the
/// look's own spray.
#[test]
fn foam_and_bubbles_have_a_layer_of_their_own() {
    for method in METHODS {
        let (scene, water) = harbour();
        let look = setup(method, ALL).look();
        let draw = |kinds: &[WhitewaterKind]| {
            let all = white();
            let kept: Vec<usize> = (0..all.len())
                .filter(|&i| {
                    kinds
                        .iter()
                        .any(|kind| kind.number() == all.attributes[KIND][i])
                })
                .collect();
            let mut white = Particles::default();
            for &i in &kept {
                white.position.push(all.position[i]);
                white.velocity.push(all.velocity[i]);
                white.id.push(all.id[i]);
            }
            for name in ATTRIBUTES {
                let values = kept.iter().map(|&i| all.attributes[name][i]).collect();
                white.attributes.insert(name.to_owned(), values);
            }
            let mut renderer = Renderer::new(&context(), &look, &scene).unwrap();
            renderer.render_with(3, &water, &white).unwrap()
        };
        let layer = |image: &Image, light| {
            let found = image.lights.iter().find(|(it, _)| *it == light).unwrap();
            found.1.iter().flatten().map(|&x| f64::from(x)).sum::<f64>()
        };
        let none = draw(&[]);
        assert_eq!(layer(&none, LightSpec::Foam), 0.0, "{method}");
        let drops = draw(&[WhitewaterKind::Spray]);
        assert_eq!(layer(&drops, LightSpec::Foam), 0.0, "{method}");
        assert!(
            layer(&drops, LightSpec::Spray) > 1.1 * layer(&none, LightSpec::Spray),
            "{method}"
        );
        let foam = draw(&[WhitewaterKind::Foam]);
        let gained = layer(&foam, LightSpec::Foam);
        assert!(
            gained > 10.0 * (layer(&foam, LightSpec::Spray) - layer(&none, LightSpec::Spray)).abs(),
            "{method}: {gained}"
        );
        let bubbles = draw(&[WhitewaterKind::Bubble]);
        assert!(layer(&bubbles, LightSpec::Foam) > 0.0, "{method}");
    }
}
