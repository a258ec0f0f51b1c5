//! Parts of the light add up to the picture.

use half::f16;
use swell::{
    gpu::adapter::Context,
    render::{Image, Renderer},
    scene::look::LightSpec,
};

use super::super::analytic::support::{context, spoiled};
use super::{METHODS, Setup, harbour};

const ALL: &str = "lights = [\"solids\", \"reflection\", \"refraction\", \"scattering\", \"sun\", \"sky\", \"spray\", \"caustics\"]";

fn setup<'a>(method: &'a str, output: &'a str) -> Setup<'a> {
    Setup {
        method,
        image: "",
        surface: "",
        output,
    }
}

/// What a file has of a value.
fn halved(value: f32) -> f64 {
    f16::from_f32(value.min(65504.0)).to_f64()
}

/// Largest difference between a file's beauty and the sum of its layers, over what rounding to half allows of each of them.
fn off(image: &Image) -> f64 {
    // Half a step of eleven bits, and half of the smallest number.
    let rounding = |value: f64| value.abs() / 2048.0 + 2f64.powi(-25);
    // Sums in f32, of two samples with some ten lights each, are far finer than that.
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

#[test]
fn all_lights_add_up_to_the_picture() {
    let drawn = |context: &Context, method| setup(method, ALL).draw(context);
    for (method, pass) in [("ssfr", "ssfr/shade"), ("ray", "rays/cast")] {
        let image = drawn(&context(), method);
        let names: Vec<LightSpec> = image.lights.iter().map(|(light, _)| *light).collect();
        assert_eq!(names, LightSpec::NAMED.map(|(_, light)| light));
        assert!(off(&image) <= 1.0, "{method}: {}", off(&image));
        // There is some of each in this picture.
        for (light, part) in &image.lights {
            // Splats know of no caustics.
            if (method, *light) == ("ssfr", LightSpec::Caustics) {
                assert!(part.iter().flatten().all(|&x| x == 0.0));
                continue;
            }
            let most = part.iter().flatten().fold(0.0f32, |most, &x| most.max(x));
            assert!(most > 1e-3, "{method}: no {light:?}");
            let least = part.iter().flatten().fold(0.0f32, |least, &x| least.min(x));
            assert!(least > -1e-6, "{method}: {light:?} takes {least}");
        }
        // Nothing of the picture depends on them.
        let plain = setup(method, "").draw(&context());
        assert!(
            plain.beauty == image.beauty,
            "{method}: other pictures with layers"
        );
        // Controls: each light that is left out, or dimmed alone, is missed.
        let edits = match method {
            "ssfr" => [
                ("light_part(SUN, sun);", ""),
                ("dim_parts(1.0 - mist.cover);", ""),
                ("light_part(SOLIDS, colour - air);", ""),
            ],
            _ => [
                ("light_part(CAUSTICS, weight * opaque_one.caustics);", ""),
                ("dim_parts(1.0 - mist.cover);", ""),
                ("light_part(part_of(ray, SOLIDS), seen);", ""),
            ],
        };
        for (from, to) in edits {
            let control = off(&drawn(&spoiled(pass, from, to), method));
            assert!(control > 1.0, "{method}: {from}: {control}");
        }
    }
}

#[test]
fn a_layer_is_the_same_whatever_others_there_are() {
    for method in METHODS {
        let all = setup(method, ALL).draw(&context());
        let some = setup(method, "lights = [\"spray\", \"reflection\"]").draw(&context());
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
