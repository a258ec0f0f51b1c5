//! A shot and its look, both scaled by a hundred, give the same picture: no shader has a fixed
//! length.

use std::path::Path;
use swell::files::parse_look;

use glam::DVec3;
use swell::{
    domain::{bounds::Bounds, particles::Particles},
    gpu::adapter::Context,
    render::{RenderScene, Renderer},
    scene::look::Look,
};

use super::{
    analytic::{context, spoiled},
    scenes::{city_scene, city_water},
};

/// A look whose lengths are scaled by `scale`; gravity is unchanged, so times are scaled by √scale.
fn look(method: &str, filter: &str, scale: f64) -> Look {
    let place = |p: [f64; 3]| p.map(|x| scale * x);
    let per = |p: [f64; 3]| p.map(|x| x / scale);
    let text = format!(
        "[camera]\nfocal_length_mm = 27.0\nfilm_back_mm = [36.0, 20.25]\n\
         position = {:?}\ntarget = {:?}\n\
         [image]\nwidth = 192\nheight = 108\nsamples = 1\n[renderer]\nmethod = \"{method}\"\n\
         [surface]\nfilter = \"{filter}\"\nripple = {{ wavelength_m = {:?}, slope = 0.05 }}\n\
         [water]\nabsorption_per_metre = {:?}\nscattering_per_metre = {:?}\n\
         spray = {{ density_per_metre = {:?}, speed_m_per_s = {:?} }}\n\
         [sun]\nazimuth_degrees = 112.0\nelevation_degrees = 34.0\n\
         [sky]\nmodel = \"hosek_wilkie\"\n\
         [ground]\nvariation = 1.0\nhaze_m = {:?}\n[basin]\nheight_m = {:?}\nthickness_m = {:?}\n\
         [solids.windows]\nstorey_m = {:?}\nbay_m = {:?}\n",
        place([7.2, 5.6, -1.7]),
        place([17.6, 1.7, 8.4]),
        0.9 * scale,
        per([1.5, 0.62, 0.55]),
        per([0.06, 0.22, 0.24]),
        9.0 / scale,
        2.0 * scale.sqrt(),
        500.0 * scale,
        2.6 * scale,
        0.6 * scale,
        0.5 * scale,
        0.42 * scale,
    );
    parse_look(&text, Path::new("scaled.toml")).unwrap()
}

fn scaled(scale: f64) -> (RenderScene, Particles) {
    let mut scene = city_scene();
    scene.domain = Bounds {
        min: DVec3::ZERO,
        max: scene.domain.max * scale,
    };
    for solid in &mut scene.solids {
        for vertex in &mut solid.vertices {
            *vertex *= scale;
        }
    }
    scene.particle_spacing *= scale;
    scene.frames_per_second /= scale.sqrt();
    let mut water = city_water();
    for (p, v) in water.position.iter_mut().zip(&mut water.velocity) {
        *p = p.map(|x| (scale * f64::from(x)) as f32);
        *v = v.map(|x| (scale.sqrt() * f64::from(x)) as f32);
    }
    (scene, water)
}

fn picture(context: &Context, method: &str, filter: &str, scale: f64) -> Vec<[f32; 4]> {
    let (scene, water) = scaled(scale);
    let look = look(method, filter, scale);
    let mut renderer = Renderer::new(context, &look, &scene).unwrap();
    renderer.render(9, &water).unwrap().beauty
}

/// Fraction of pixels of which a channel differs by more than 1 % and a thousandth of white.
fn apart(context: &Context, method: &str, filter: &str) -> f64 {
    let near = picture(context, method, filter, 1.0);
    let far = picture(context, method, filter, 100.0);
    let differs = |(a, b): &(&[f32; 4], &[f32; 4])| {
        let mut channels = a.iter().zip(*b);
        channels.any(|(a, b)| (a - b).abs() > 0.01 * a.abs() + 1e-3)
    };
    let pixels = near.len() as f64;
    near.iter().zip(&far).filter(differs).count() as f64 / pixels
}

/// Rounding decides on which side of an edge a pixel is, of the sun's shadow, a window or a splat:
/// one in a hundred at most.
const EDGES: f64 = 0.01;

#[test]
fn a_shot_a_hundred_times_as_large_is_the_same_picture() {
    for (method, filter) in [
        ("ssfr", "curvature_flow"),
        ("ssfr", "narrow_range"),
        ("ray", "curvature_flow"),
    ] {
        let found = apart(&context(), method, filter);
        assert!(found < EDGES, "{method} {filter}: {found}");
    }
}

/// Control: a length in metres in a shader.
#[test]
fn a_length_in_metres_is_seen() {
    for (from, to) in [
        ("at.position.xz / shading.extent", "at.position.xz / 25.0"),
        ("0.1 * shading.extent", "2.5"),
    ] {
        let found = apart(&spoiled("ssfr/shade", from, to), "ssfr", "curvature_flow");
        assert!(found > EDGES, "{to}: {found}");
    }
}
