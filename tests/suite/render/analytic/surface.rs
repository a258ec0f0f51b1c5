//! From splats to a surface: radius, smoothing, spray and motion blur.

use glam::{DVec2, DVec3};
use swell::domain::particles::Particles;
use swell::gpu::adapter::Context;
use swell::render::Image;

use super::support::{Eye, Setup, ball, context, draw, scene, spoiled, uniform_sky};

/// Looks straight down at (5, 1, 5) from `distance` metres.
fn above(distance: f64, focal: f64) -> Eye {
    Eye {
        up: DVec3::Z,
        ..Eye::new([5.0, 1.0 + distance, 5.0], [5.0, 1.0, 5.0], focal)
    }
}

/// Depth of the picture's middle, m.
fn middle(image: &Image) -> f64 {
    let z = image.aovs.z.as_ref().unwrap();
    let at = |i: usize| f64::from(z[i]);
    0.25 * (at(31 * 64 + 31) + at(31 * 64 + 32) + at(32 * 64 + 31) + at(32 * 64 + 32))
}

/// Amount by which smoothing with `surface` lowers the top of a ball with a radius of 10 m, m. The
/// top is 1 m above the floor.
fn lowered(context: &Context, surface: &str, distance: f64) -> f64 {
    let setup = Setup {
        surface: format!("radius_m = 10.0\nsplat = \"sphere\"\n{surface}"),
        ..Setup::new(above(distance, 256.0))
    };
    let water = ball(DVec3::new(5.0, -9.0, 5.0), DVec3::ZERO);
    let mut scene = scene(10.0, 1.0);
    scene.particle_spacing = 0.3125;
    let depth = middle(&draw(context, &setup, &uniform_sky, &scene, &water, 1));
    // Half a pixel from the axis in both directions, a ball is slightly deeper than at its top.
    let off = 0.5 * (distance / 256.0).powi(2);
    depth - distance - off / 20.0
}

/// Standard deviation of the smoothing, m.
const SIGMA: f64 = 0.5;

/// Error relative to flow by mean curvature, which takes a ball's radius from R to √(R² − 2σ²):
/// with ∇²z = 2/R a Gaussian of variance σ² lowers its top by σ²/R, and curvature grows as the ball
/// shrinks.
fn flow_error(lowered: f64, sigma: f64) -> f64 {
    lowered / (10.0 - (100.0 - 2.0 * sigma * sigma).sqrt()) - 1.0
}

/// The width is 16 to 5 pixels, and three widths fit between the middle and the padded picture's
/// edge. The remaining error is the ball's fourth order, (σ/R)² = 0.25 %, and that of the explicit
/// step; 1 % of the width is 2 %.
const FLOW: f64 = 0.006;
const WIDTH: &str = "smoothing_width_m = 0.5\n";

#[test]
fn the_flow_smooths_by_the_looks_width_at_any_distance() {
    for distance in [8.0, 12.0, 24.0] {
        let found = lowered(&context(), WIDTH, distance);
        let error = flow_error(found, SIGMA);
        assert!(error.abs() < FLOW, "{distance} m: {error}");
        for sigma in [0.99 * SIGMA, 1.01 * SIGMA] {
            let control = flow_error(found, sigma);
            assert!(control.abs() > FLOW, "{distance} m: {control}");
        }
    }
    // The default width is 1.6 spacings: 1.6 × 0.3125 m.
    let error = flow_error(lowered(&context(), "", 12.0), SIGMA);
    assert!(error.abs() < FLOW, "{error}");
    let spoiled = spoiled(
        "ssfr/curvature_flow",
        "z / focal, params.world",
        "1.01 * z / focal, params.world",
    );
    let control = flow_error(lowered(&spoiled, WIDTH, 12.0), SIGMA);
    assert!(control.abs() > FLOW, "{control}");
}

/// Relative error of the amount by which the narrow-range filter lowers the ball, compared with a
/// Gaussian that is cut at 2.5 σ, along x and along y.
fn narrow_error(lowered: f64, distance: f64, sigma: f64) -> f64 {
    let pixel = distance / 256.0;
    let cells = sigma / pixel;
    // The last pass has weights of 1.5 pixels that end 3 from the centre, whose variance is 0.881
    // of a whole Gaussian's; those along the axes have the rest.
    let last = (0.5 * cells).min(1.5);
    let axis = (cells * cells - 0.881 * last * last).sqrt();
    let variance = |sigma: f64, reach: i32| {
        let weight = |k: i32| (-0.5 * (f64::from(k) / sigma).powi(2)).exp();
        let total: f64 = (-reach..=reach).map(weight).sum();
        let square: f64 = (-reach..=reach).map(|k| f64::from(k * k) * weight(k)).sum();
        square / total
    };
    let variance = variance(axis, (2.5 * axis).ceil() as i32) + variance(last, 3);
    lowered / (variance * pixel * pixel / 10.0) - 1.0
}

/// The filter reaches 1.25 m over a ball of 10 m, whose fourth order there is ½ 0.125² = 0.8 %.
const NARROW: f64 = 0.01;

#[test]
fn the_narrow_range_filter_smooths_by_the_looks_width_at_any_distance() {
    for distance in [8.0, 12.0, 24.0] {
        let found = lowered(
            &context(),
            &format!("filter = \"narrow_range\"\n{WIDTH}"),
            distance,
        );
        let error = narrow_error(found, distance, SIGMA);
        assert!(error.abs() < NARROW, "{distance} m: {error}");
        for sigma in [0.985 * SIGMA, 1.015 * SIGMA] {
            let control = narrow_error(found, distance, sigma);
            assert!(control.abs() > NARROW, "{distance} m: {control}");
        }
    }
}

#[test]
fn a_splat_has_the_radius_that_its_kind_has_where_the_look_leaves_it_out() {
    // The default radius of balls is 0.87 spacings; an isolated ellipsoid is a ball of volume d³.
    let own = (3.0 / (4.0 * std::f64::consts::PI)).cbrt();
    for (splat, radius) in [("sphere", 0.87), ("ellipsoid", own)] {
        splat_radius(splat, 2.0 * radius);
    }
}

fn splat_radius(splat: &str, radius: f64) {
    let setup = Setup {
        surface: format!("smoothing_width_m = 0.0\nsplat = \"{splat}\"\n"),
        ..Setup::new(above(10.0, 256.0))
    };
    let mut scene = scene(1.0, 1.0);
    scene.particle_spacing = 2.0;
    let water = ball(DVec3::new(5.0, 1.0, 5.0), DVec3::ZERO);
    let image = draw(&context(), &setup, &uniform_sky, &scene, &water, 1);
    // Half a pixel from the axis, 8.26/256 m apart, a ball of 1.74 m is 3e-4 m deeper than at its
    // top.
    let found = middle(&image);
    let off = 2.0 * (0.5 * (10.0 - radius) / 256.0).powi(2);
    let expected = 10.0 - radius + off / (2.0 * radius);
    assert!(
        (found - expected).abs() < 1e-5,
        "{splat}: {found} {expected}"
    );
}

/// Distance between the eye and the drop, m.
const AWAY: f64 = 50.0;

/// Particles of spray at one position in front of an empty sky, with an optical density per metre.
fn spray(context: &Context, density: f64, id: &[u32]) -> (Image, Eye) {
    // 75 cm around the drop: few threads are longer than 50.
    let eye = Eye {
        size: 320,
        ..Eye::new(
            [5.0, 2.0, 5.0],
            [5.0 + 0.8 * AWAY, 2.0 + 0.6 * AWAY, 5.0],
            128.0 / 0.3 * AWAY,
        )
    };
    let setup = Setup {
        water: format!("spray = {{ density_per_metre = {density:?}, speed_m_per_s = 3.0 }}\n"),
        surface: "radius_m = 0.1\nsplat = \"sphere\"\nsmoothing_width_m = 0.0\n".to_owned(),
        background: false,
        ..Setup::new(eye)
    };
    let mut scene = scene(0.1, 1.0);
    scene.particle_spacing = 0.115;
    let lone = ball(eye.target, DVec3::ZERO);
    let water = Particles {
        position: vec![lone.position[0]; id.len()],
        velocity: vec![lone.velocity[0]; id.len()],
        id: id.to_vec(),
        ..Particles::default()
    };
    (draw(context, &setup, &uniform_sky, &scene, &water, 1), eye)
}

/// Density of an isolated particle, 1/m; several at one position share it.
const DENSITY: f64 = 6.0;

/// Number of spray particles that are rendered.
const CLOUDS: u32 = 10;

/// Optical depth times area of the spray of `CLOUDS` particles, in groups of `together` at one
/// position, m², and the largest relative error of its radiance.
fn spray_sums(context: &Context, together: u32) -> (f64, f64) {
    let (mut area, mut grey) = (0.0, 0.0f64);
    for first in (0..CLOUDS).step_by(together as usize) {
        let id: Vec<u32> = (first..first + together).collect();
        let (image, eye) = spray(context, DENSITY / f64::from(together), &id);
        for &[r, _, _, cover] in &image.beauty {
            let cover = f64::from(cover);
            // Cover is 1 − exp(−τ).
            area -= (1.0 - cover).ln() * (AWAY / eye.focal).powi(2);
            if cover > 0.01 {
                // A white furnace: drops without absorption under a sky of radiance 1.
                grey = grey.max((f64::from(r) / cover - 1.0).abs());
            }
        }
    }
    (area, grey)
}

#[test]
fn spray_hides_one_less_exp_of_its_optical_depth() {
    // A particle of spray represents 15 % of a particle's water.
    let volume = f64::from(CLOUDS) * 0.15 * 0.115f64.powi(3);
    // An isolated particle is 4096 drops here, one of five is four puffs and some 1200 drops: up to
    // 6 cm nearer or farther than 50 m, which counts twice in an area and has either sign: 4e-4 for
    // all puffs. Drops are distributed completely.
    for together in [1, 5] {
        let (area, grey) = spray_sums(&context(), together);
        let error = |density: f64| area / (density * volume / f64::from(together)) - 1.0;
        assert!(
            error(DENSITY).abs() < 1e-3,
            "{together}: {}",
            error(DENSITY)
        );
        assert!(grey < 1e-4, "{together}: {grey}");
        for density in [0.99 * DENSITY, 1.01 * DENSITY] {
            let control = error(density).abs();
            assert!(control > 5e-3, "{together}: {control}");
        }
    }
    let (area, _) = spray_sums(&context(), 1);
    let linear = spoiled(
        "ssfr/shade_spray",
        "Spray(optical_depth, 1.0 - exp(-optical_depth), depth)",
        "Spray(optical_depth, clamp(optical_depth, 0.0, 0.99), depth)",
    );
    let (more, _) = spray_sums(&linear, 1);
    assert!(more / area > 1.01, "{more} {area}");
    let dimmer = spoiled(
        "ssfr/shade_spray",
        "mix(around, sky_irradiance(facing), 1.0 - exp(-optical_depth)) / PI",
        "mix(around, 1.01 * sky_irradiance(facing), 1.0 - exp(-optical_depth)) / PI",
    );
    let (_, control) = spray_sums(&dimmer, 1);
    assert!(control > 1e-3, "{control}");
}

/// Sum, centroid and variance of a picture's alpha, pixels, right and up.
fn moments(image: &Image) -> (f64, DVec2, DVec2) {
    let side = image.width as usize;
    let (mut sum, mut first, mut second) = (0.0, DVec2::ZERO, DVec2::ZERO);
    for (i, value) in image.beauty.iter().enumerate() {
        let place = DVec2::new((i % side) as f64, -((i / side) as f64));
        let alpha = f64::from(value[3]);
        sum += alpha;
        first += alpha * place;
        second += alpha * place * place;
    }
    let mean = first / sum;
    (sum, mean, second / sum - mean * mean)
}

/// Pixels that a ball moves while the shutter is open, from the increase in width of its picture
/// relative to a ball at rest: a stroke of length L at n evenly spaced instants has the variance
/// L²/12 (1 − 1/n²).
fn stroke(shutter: f64) -> f64 {
    let eye = Eye {
        size: 96,
        ..Eye::new([5.0, 2.0, 5.0], [15.0, 12.0, 5.0], 240.0)
    };
    let samples = 24;
    let shot = |shutter: f64| {
        let setup = Setup {
            samples,
            shutter,
            surface: "radius_m = 0.4\nsplat = \"sphere\"\nsmoothing_width_m = 0.0\n".to_owned(),
            background: false,
            ..Setup::new(eye)
        };
        // Across the picture, which looks along (1, 1, 0): right is +z.
        let water = ball(eye.target, DVec3::new(0.0, 0.0, 80.0));
        moments(&draw(
            &context(),
            &setup,
            &uniform_sky,
            &scene(0.4, 1.0),
            &water,
            1,
        ))
    };
    let (still, blurred) = (shot(0.0), shot(shutter));
    assert!(
        (blurred.0 / still.0 - 1.0).abs() < 2e-3,
        "{still:?} {blurred:?}"
    );
    // Centred on the frame's instant.
    assert!(
        (blurred.1 - still.1).length() < 0.05,
        "{still:?} {blurred:?}"
    );
    assert!(
        (blurred.2.y - still.2.y).abs() < 0.1,
        "{still:?} {blurred:?}"
    );
    let spaced = 1.0 - 1.0 / f64::from(samples * samples);
    (12.0 * (blurred.2.x - still.2.x) / spaced).sqrt()
}

#[test]
fn motion_is_blurred_over_the_shutters_part_of_a_frame() {
    let expected = |shutter: f64| 80.0 / 24.0 * shutter * 240.0 / 200f64.sqrt();
    let length = stroke(0.5);
    let error = |shutter: f64| length / expected(shutter) - 1.0;
    // A disc with a radius of 7 pixels, at 24 instants between which it moves by 1.2 pixels, is
    // measured to a few tenths of a percent.
    assert!(error(0.5).abs() < 4e-3, "{length} for {}", expected(0.5));
    for shutter in [0.495, 0.505] {
        assert!(error(shutter).abs() > 6e-3, "{length}");
    }
}
