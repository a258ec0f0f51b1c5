//! Roughness of the water's silhouette with splats, compared with rays in f64.

use std::path::Path;
use swell::files::parse_look;

use glam::DVec3;
use swell::{
    check::render::{Summary, Surfaces},
    domain::{level_set::kernels::Kernels, particles::Particles},
    gpu::adapter::Context,
    reference::rays::cast,
    render::{RenderScene, Renderer, eye, opaque},
    scene::look::{Look, MethodSpec},
};

use super::{
    analytic::{context, spoiled},
    scenes::city_scene,
};

/// A crest against the sky, from a low viewpoint in front of it.
fn look(surface: &str) -> Look {
    let text = format!(
        "[camera]\nfocal_length_mm = 27.0\nfilm_back_mm = [36.0, 20.25]\n\
         position = [17.5, 1.7, 7.3]\ntarget = [10.0, 2.0, 7.3]\n\
         [image]\nwidth = 480\nheight = 270\n[surface]\n{surface}\
         [sky]\nmodel = \"hosek_wilkie\"\n"
    );
    parse_look(&text, Path::new("low.toml")).unwrap()
}

/// A crest 2.4 m high across the domain, in layers along its surface whose particles are displaced
/// by up to a tenth of a spacing along each axis, as a solver leaves them.
fn crest(scene: &RenderScene) -> Particles {
    let spacing = scene.particle_spacing;
    let mut seed = 1u32;
    let mut off = || {
        seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        0.2 * spacing * (f64::from(seed >> 8) / 16_777_216.0 - 0.5)
    };
    let mut water = Particles::default();
    let along =
        |length: f64| (0..(length / spacing) as u32).map(move |k| (f64::from(k) + 0.5) * spacing);
    for (x, z) in along(14.0).flat_map(|x| along(15.0).map(move |z| (x, z))) {
        let surface = 1.0 + 1.4 / (0.7 * (x - 10.0)).cosh().powi(2) + 0.1 * (0.9 * z).sin();
        let layers = along(surface).map(|depth| surface - depth);
        for y in layers.filter(|y| *y > 0.3 * spacing) {
            let place = [x + off(), y + off(), z + off()];
            water.position.push(place.map(|v| v as f32));
            water.velocity.push([0.0; 3]);
            water.id.push(water.id.len() as u32);
        }
    }
    water
}

/// Summary of that crest against the sky, without the city.
fn summary(context: &Context, surface: &str) -> Summary {
    let mut scene = city_scene();
    scene.solids.clear();
    let water = crest(&scene);
    let look = look(surface);
    let eye = eye(&look, DVec3::ZERO, 1.0, 24.0);
    let places: Vec<DVec3> = (water.position.iter())
        .map(|p| DVec3::from(p.map(f64::from)))
        .collect();
    let kernels = Kernels::fit(&places, scene.domain.size(), scene.particle_spacing);
    let box_of = (scene.domain.size(), scene.particle_spacing);
    let truth = cast(&eye, &kernels, box_of, &opaque(&look, &scene).unwrap());
    let look = look.of_surface(MethodSpec::Ssfr);
    let mut renderer = Renderer::new(context, &look, &scene).unwrap();
    let image = renderer.render(1, &water).unwrap();
    let mut surfaces = Surfaces::default();
    surfaces.add(&image, &truth, &eye, scene.particle_spacing);
    surfaces.summary().unwrap()
}

/// In spacings, from a low viewpoint: slightly more than the prototype with rays had.
const ROUGH: f64 = 0.08;

/// Ellipsoids are smooth, and nearer to the water's true surface than balls. Control: particles
/// displaced by up to 0.6 spacings.
#[test]
fn ellipsoids_leave_a_smooth_silhouette() {
    let of = |context: &Context, surface: &str| {
        let summary = summary(context, surface);
        summary.silhouette.expect("a crest before the sky")
    };
    let ellipsoids = of(&context(), "");
    assert!(ellipsoids.points > 300, "{ellipsoids:?}");
    assert!(ellipsoids.roughness < ROUGH, "{ellipsoids:?}");
    let balls = of(&context(), "splat = \"sphere\"\n");
    assert!(
        balls.offset > ellipsoids.offset + 0.1,
        "{balls:?} {ellipsoids:?}"
    );
    let strewn = spoiled(
        "ssfr/splat_depth",
        "place - camera.position,",
        "place - camera.position + 0.1 * sin(vec3f(12.9, 78.2, 37.7) * f32(index)),",
    );
    let strewn = of(&strewn, "");
    assert!(strewn.roughness > ROUGH, "{strewn:?}");
}
