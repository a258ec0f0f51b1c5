//! Light at and in water: Fresnel, Snell, Beer–Lambert, microfacets.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use swell::domain::bounds::Bounds;
use swell::gpu::adapter::Context;
use swell::render::{Image, RenderScene};

use super::geometry::box_mesh;
use super::rays;
use super::support::{
    Eye, RAMP_ERROR, Setup, ball, context, draw, kernel, luminance, ramp_sky, scene, sky_place,
    spoiled, uniform_sky, wide,
};

/// Radius of the ball of water, m; its top is the pool.
pub(crate) const RADIUS: f64 = 20.0;
pub(crate) const INDEX: f64 = 1.333;
/// Absorbs all light that enters the water.
pub(crate) const BLACK: &str = "absorption_per_metre = [1e4, 1e4, 1e4]\n";

fn black_sky(_: DVec3, _: DVec2) -> [f64; 3] {
    [0.0; 3]
}

/// A camera 30 m from the pool's middle, `theta` degrees from the vertical, looking along +x.
pub(crate) fn eye_at(theta: f64, depth: f64, focal: f64) -> Eye {
    let (sin, cos) = theta.to_radians().sin_cos();
    let target = DVec3::new(5.0, depth, 5.0);
    Eye {
        up: DVec3::Z,
        ..Eye::new(
            (target + 30.0 * DVec3::new(-sin, cos, 0.0)).to_array(),
            target.to_array(),
            focal,
        )
    }
}

pub(crate) fn setup_at(theta: f64, depth: f64, water: String) -> Setup {
    Setup {
        surface: format!("smoothing_width_m = 0.0\nradius_m = {RADIUS:?}\nsplat = \"sphere\"\n"),
        water,
        ..Setup::new(eye_at(theta, depth, 3200.0))
    }
}

pub(crate) fn pool(
    context: &Context,
    setup: &Setup,
    sky: &dyn Fn(DVec3, DVec2) -> [f64; 3],
    scene: &RenderScene,
    depth: f64,
    frame: u32,
) -> Image {
    let water = ball(DVec3::new(5.0, depth - RADIUS, 5.0), DVec3::ZERO);
    draw(context, setup, sky, scene, &water, frame)
}

/// A ray that meets the water's surface.
pub(crate) struct Meeting {
    pub(crate) position: DVec3,
    /// Surface normal, towards the eye.
    pub(crate) normal: DVec3,
    /// Direction of the ray, away from the eye.
    pub(crate) along: DVec3,
}

impl Meeting {
    fn cosine(&self) -> f64 {
        -self.normal.dot(self.along)
    }

    pub(crate) fn reflected(&self) -> DVec3 {
        self.along + 2.0 * self.cosine() * self.normal
    }

    /// Refracted direction (Snell): the component along the surface shrinks by the index.
    fn refracted(&self, index: f64) -> DVec3 {
        let tangent = (self.along + self.cosine() * self.normal) / index;
        tangent - self.normal * (1.0 - tangent.length_squared()).sqrt()
    }

    /// Fresnel reflectance, by the angles of both rays.
    pub(crate) fn reflectance(&self, index: f64) -> f64 {
        fresnel(self.cosine(), index)
    }
}

fn fresnel(cosine: f64, index: f64) -> f64 {
    let outside = cosine.min(1.0).acos();
    let inside = (outside.sin() / index).asin();
    if outside < 1e-4 {
        return ((index - 1.0) / (index + 1.0)).powi(2);
    }
    let s = (outside - inside).sin() / (outside + inside).sin();
    let p = (outside - inside).tan() / (outside + inside).tan();
    0.5 * (s * s + p * p)
}

/// Intersections from the picture's own position and normal AOVs, which `geometry.rs` tests.
pub(crate) fn meetings(image: &Image, eye: &Eye) -> Vec<Meeting> {
    let (p, n) = (
        image.aovs.p.as_ref().unwrap(),
        image.aovs.n.as_ref().unwrap(),
    );
    (0..p.len())
        .map(|i| Meeting {
            position: wide(p[i]),
            normal: wide(n[i]),
            along: eye.direction(i),
        })
        .collect()
}

const ABSORPTION: DVec3 = DVec3::new(0.02, 0.15, 0.4);

/// A pool over a white floor under a sky of radiance 1.
struct Pool {
    depth: f64,
    scattering: DVec3,
    eye: Eye,
    image: Image,
}

/// Elevation of the sun, degrees: it is too dim to be seen, but daylight comes down along its
/// refracted direction.
const ELEVATION: f64 = 35.0;

fn drawn_pool(context: &Context, theta: f64, depth: f64, scattering: DVec3) -> Pool {
    let setup = Setup {
        ground: [1.0; 3],
        sun: [0.0, ELEVATION, 0.0],
        ..setup_at(
            theta,
            depth,
            format!(
                "index = {INDEX:?}\nabsorption_per_metre = {:?}\nscattering_per_metre = {:?}\n",
                ABSORPTION.to_array(),
                scattering.to_array()
            ),
        )
    };
    // So full of water that the pool reaches the floor at any depth.
    let scene = scene(RADIUS, 4.0);
    Pool {
        depth,
        scattering,
        eye: setup.eye,
        image: pool(context, &setup, &uniform_sky, &scene, depth, 1),
    }
}

/// Largest relative error compared with optics of this index.
fn pool_error(pool: &Pool, index: f64) -> f64 {
    let sun_sine = ELEVATION.to_radians().cos() / index;
    let sun_path = 1.0 / (1.0 - sun_sine * sun_sine).sqrt();
    let mut worst = 0.0f64;
    for (i, at) in meetings(&pool.image, &pool.eye).iter().enumerate() {
        assert!((at.position.y - pool.depth).abs() < 0.1);
        let way = at.position.y / -at.refracted(index).y;
        let reflectance = at.reflectance(index);
        for c in 0..3 {
            let scattering = pool.scattering[c];
            let extinction = ABSORPTION[c] + scattering;
            let clear = (-extinction * way).exp();
            let floor = (-extinction * at.position.y * sun_path).exp();
            // Hapke 1981, equation 38, of the single-scattering albedo.
            let gamma = (1.0 - scattering / extinction).sqrt();
            let body = (1.0 - gamma) / (1.0 + gamma);
            let inside = floor * clear + body * (1.0 - clear);
            let expected = reflectance + (1.0 - reflectance) * inside;
            worst = worst.max((f64::from(pool.image.beauty[i][c]) / expected - 1.0).abs());
        }
    }
    worst
}

/// The light of the sky is that of its harmonics to 3e-5; exponentials of up to 5, and a depth of 2
/// m rounded at 30 m, add as much.
const POOL: f64 = 1.5e-4;

#[test]
fn a_pool_shows_sky_floor_and_body_as_optics_say() {
    let clear = DVec3::ZERO;
    let milky = DVec3::new(0.3, 0.2, 0.05);
    for (theta, depth, scattering) in [
        (0.0, 2.0, clear),
        (70.0, 2.0, clear),
        (40.0, 1.0, milky),
        // So deep that only the body is left.
        (20.0, 120.0, milky),
    ] {
        let pool = drawn_pool(&context(), theta, depth, scattering);
        let error = pool_error(&pool, INDEX);
        assert!(error < POOL, "{theta}° {depth} m: {error}");
        let control = pool_error(&pool, 1.01 * INDEX);
        assert!(control > 5.0 * POOL, "{theta}° {depth} m: {control}");
    }
    for (theta, depth, scattering, from, to) in [
        (
            70.0,
            2.0,
            clear,
            "water.normal, 1.0 / n)",
            "water.normal, 1.0 / (1.01 * n))",
        ),
        (
            0.0,
            2.0,
            clear,
            "mirror + (1.0 - reflectance)",
            "mirror + 0.99 * (1.0 - reflectance)",
        ),
        (
            20.0,
            120.0,
            milky,
            "(1.0 - g) / (1.0 + g)",
            "(1.0 - g) / (1.01 + g)",
        ),
    ] {
        let spoiled = spoiled("ssfr/shade", from, to);
        let control = pool_error(&drawn_pool(&spoiled, theta, depth, scattering), INDEX);
        assert!(control > 5.0 * POOL, "{to}: {control}");
    }
}

#[test]
fn a_sheet_absorbs_along_the_bent_way_through_it() {
    // Thin, and high over a white floor; the thickness along the line of sight is an AOV.
    let setup = Setup {
        ground: [1.0; 3],
        ..setup_at(
            50.0,
            120.0,
            format!("absorption_per_metre = {:?}\n", ABSORPTION.to_array()),
        )
    };
    let scene = scene(RADIUS, 0.05);
    let image = pool(&context(), &setup, &uniform_sky, &scene, 120.0, 1);
    let thickness = image.aovs.thickness.as_ref().unwrap();
    let worst = |bent: &dyn Fn(&Meeting) -> f64| {
        let mut worst = 0.0f64;
        for (i, at) in meetings(&image, &setup.eye).iter().enumerate() {
            // The sides are parallel: the refracted ray crosses the same height.
            let way = f64::from(thickness[i]) * at.cosine() / bent(at);
            let reflectance = at.reflectance(INDEX);
            for c in 0..3 {
                let expected = reflectance + (1.0 - reflectance) * (-ABSORPTION[c] * way).exp();
                worst = worst.max((f64::from(image.beauty[i][c]) / expected - 1.0).abs());
            }
        }
        worst
    };
    // For a floor 200 m away the haze takes 200/1e7; the rest as in a pool.
    let cosine = |at: &Meeting| -at.refracted(INDEX).dot(at.normal);
    let error = worst(&cosine);
    assert!(error < POOL, "{error}");
    // Controls: 1 % longer, and not refracted.
    let control = worst(&|at| cosine(at) / 1.01);
    assert!(control > 5.0 * POOL, "{control}");
    let control = worst(&|at| at.cosine());
    assert!(control > 5.0 * POOL, "{control}");
}

/// Black water under a sky and a sun of this intensity, seen at several angles.
fn black_pools(
    context: &Context,
    angles: &[f64],
    (lines, sun): (&str, f64),
    sky: &dyn Fn(DVec3, DVec2) -> [f64; 3],
) -> Vec<(Image, Eye)> {
    let shot = |&theta: &f64| {
        let mut setup = setup_at(theta, 2.0, BLACK.to_owned());
        setup.sun = [0.0, 45.0, sun];
        setup.surface += lines;
        let image = pool(context, &setup, sky, &scene(RADIUS, 1.0), 2.0, 1);
        (image, setup.eye)
    };
    angles.iter().map(shot).collect()
}

/// Largest error of reflections in black water of a sky whose colour tells its direction.
fn mirror_error(pools: &[(Image, Eye)], index: f64) -> f64 {
    let mut worst = 0.0f64;
    for (image, eye) in pools {
        for (i, at) in meetings(image, eye).iter().enumerate() {
            let place = sky_place(at.reflected());
            for (c, expected) in [place.x, place.y, 1.0].into_iter().enumerate() {
                let found = f64::from(image.beauty[i][c]) / at.reflectance(index);
                worst = worst.max((found - expected).abs());
            }
        }
    }
    worst
}

#[test]
fn water_mirrors_the_sky_by_the_law_of_reflection() {
    let pools = black_pools(&context(), &[15.0, 45.0, 70.0], ("", 0.0), &ramp_sky);
    let error = mirror_error(&pools, INDEX);
    assert!(error < RAMP_ERROR, "{error}");
    let control = mirror_error(&pools, 1.01 * INDEX);
    assert!(control > 10.0 * RAMP_ERROR, "{control}");
    let flipped = spoiled(
        "ssfr/shade",
        "-water.view, water.normal);",
        "water.view, water.normal);",
    );
    let control = mirror_error(&black_pools(&flipped, &[45.0], ("", 0.0), &ramp_sky), INDEX);
    assert!(control > 10.0 * RAMP_ERROR, "{control}");
}

/// Largest relative error of the sun's glitter on black water under a black sky, compared with a
/// microfacet surface of that rms slope (Walter et al. 2007: GGX of width α² = 2 σ², Smith masking,
/// Fresnel at the facet).
fn glitter_error(pools: &[(Image, Eye)], roughness: f64) -> f64 {
    let square = 2.0 * roughness * roughness;
    let sun = DVec3::new(0.5f64.sqrt(), 0.5f64.sqrt(), 0.0);
    let mut worst = 0.0f64;
    for (image, eye) in pools {
        for (i, at) in meetings(image, eye).iter().enumerate() {
            let half = (sun - at.along).normalize();
            let tan2 = |d: DVec3| 1.0 / at.normal.dot(d).powi(2) - 1.0;
            let facets =
                square / (PI * at.normal.dot(half).powi(4) * (square + tan2(half)).powi(2));
            let mask = |d: DVec3| 2.0 / (1.0 + (1.0 + square * tan2(d)).sqrt());
            let (to_eye, to_sun) = (at.cosine(), at.normal.dot(sun));
            let brdf = facets * mask(sun) * mask(-at.along) * fresnel(sun.dot(half), INDEX)
                / (4.0 * to_eye * to_sun);
            // 0.82 of the unit of light falls on a horizontal face from a sun at 45°, as radiance
            // of white paint.
            let irradiance = 0.82 * PI * 2f64.sqrt();
            let expected = brdf * to_sun * irradiance;
            worst = worst.max((luminance(image.beauty[i]) / expected - 1.0).abs());
        }
    }
    worst
}

#[test]
fn glitter_is_that_of_facets_with_the_looks_slope() {
    // The mirror direction, and 7° to either side of it, where the density falls by slopes of 0.07
    // to 0.12.
    let lines = ("roughness = 0.1\n", 1.0);
    let pools = black_pools(&context(), &[30.0, 45.0, 58.0], lines, &black_sky);
    // Near the mirror direction the density is one over 0.02 plus the square of a difference of
    // numbers near 1.
    let error = glitter_error(&pools, 0.1);
    assert!(error < 1e-4, "{error}");
    let control = glitter_error(&pools, 0.101);
    assert!(control > 5e-3, "{control}");
    for (from, to) in [
        (
            "fresnel(clamp(dot(v, h), 0.0, 1.0), index)",
            "fresnel(clamp(dot(v, h), 0.0, 1.0), 1.01 * index)",
        ),
        ("nl / (mask_l * mask_v)", "nl / (mask_l * mask_v * 1.01)"),
    ] {
        let pools = black_pools(&spoiled("ssfr/shade", from, to), &[45.0], lines, &black_sky);
        let control = glitter_error(&pools, 0.1);
        assert!(control > 5e-3, "{to}: {control}");
    }
}

#[test]
fn a_plate_under_water_is_seen_where_snell_puts_it() {
    let (depth, start) = (4.0, 7.3);
    let mut setup = setup_at(
        45.0,
        depth,
        "absorption_per_metre = [0.0, 0.0, 0.0]\n".to_owned(),
    );
    setup.eye = eye_at(45.0, depth, 256.0);
    setup.ground = [1.0; 3];
    setup.solids = [0.0; 3];
    let plate = Bounds {
        min: DVec3::new(start, 0.0, -5.0),
        max: DVec3::new(20.0, 1.0, 15.0),
    };
    let scene = RenderScene {
        solids: vec![box_mesh(plate)],
        ..scene(RADIUS, 1.0)
    };
    let image = pool(&context(), &setup, &uniform_sky, &scene, depth, 1);
    // Numbers of pixels that show the floor where the plate must be seen, or the plate where the
    // floor must be, and of pixels of each kind.
    let faults = |index: f64| {
        let (mut faults, mut seen) = (0, [0; 2]);
        for (i, at) in meetings(&image, &setup.eye).iter().enumerate() {
            let bent = at.refracted(index);
            let foot = at.position.x - bent.x * at.position.y / bent.y;
            // A pixel and a half, 30/256 m across and seen at 45°: the renderer marches over the
            // picture of the plate.
            if (foot - start).abs() < 0.25 {
                continue;
            }
            let hidden = foot > start;
            let reflectance = at.reflectance(INDEX);
            let dark = f64::from(image.beauty[i][1]) < reflectance + 0.5 * (1.0 - reflectance);
            seen[usize::from(hidden)] += 1;
            faults += usize::from(dark != hidden);
        }
        (faults, seen)
    };
    let (wrong, seen) = faults(INDEX);
    assert!(seen[0] > 500 && seen[1] > 500, "{seen:?}");
    assert_eq!(wrong, 0, "{seen:?}");
    // Straight through, or bent 25 % too much.
    for index in [1.0, 1.25 * INDEX] {
        assert!(faults(index).0 > 60, "{index}: {}", faults(index).0);
    }
}

/// Number of pixels of a pool half a metre deep over a white shelf that show what is below the
/// shelf, and number of pixels of the pool, seen from `elevation` degrees above its surface. Counts
/// the picture's upper half: lower pixels show parts that lie outside the picture.
fn dark_pixels(context: &Context, elevation: f64) -> [usize; 2] {
    let (sin, cos) = elevation.to_radians().sin_cos();
    let target = DVec3::new(5.0, rays::LEVEL, 5.0);
    let eye = Eye::new(
        (target + 6.0 * DVec3::new(-cos, sin, 0.0)).to_array(),
        target.to_array(),
        256.0,
    );
    let setup = Setup {
        water: "absorption_per_metre = [0.0, 0.0, 0.0]\n".to_owned(),
        ..Setup::new(eye)
    };
    let shelf = Bounds {
        min: DVec3::ZERO,
        max: DVec3::new(14.0, rays::LEVEL - 0.5, 10.0),
    };
    let scene = RenderScene {
        solids: vec![box_mesh(shelf)],
        ..rays::pool_scene()
    };
    let image = draw(context, &setup, &uniform_sky, &scene, &rays::water(), 1);
    let (place, thickness) = (
        image.aovs.p.as_ref().unwrap(),
        image.aovs.thickness.as_ref().unwrap(),
    );
    let is_wet = |i: &usize| f64::from(place[*i][0]) < rays::SIDE && thickness[*i] > 0.5;
    let wet = || (0..32 * 64).filter(is_wet);
    // In front of a white shelf and a white sky everything is white; the ground is black.
    let dark = wet().filter(|&i| image.beauty[i][1] < 0.8);
    [dark.count(), wet().count()]
}

/// Along a flat line of sight a downward step reaches far behind the shelf; it is not a gap between
/// the shelf and things in front of it.
#[test]
fn shallow_water_seen_flat_shows_its_floor() {
    for elevation in [6.0, 9.0, 14.0] {
        let [dark, wet] = dark_pixels(&context(), elevation);
        assert!(wet > 700 && dark == 0, "{elevation}: {dark} of {wet}");
    }
    let to = "let deep = 1.0;";
    let from = "let deep = max(t.y / min(-water.view.y, -0.02), 1.0);";
    let [dark, wet] = dark_pixels(&spoiled("ssfr/shade", from, to), 9.0);
    assert!(10 * dark > wet, "{dark} of {wet}");
}

#[test]
fn the_shader_reflects_as_fresnel_says() {
    let cosines: Vec<f64> = (1..=90)
        .map(|degrees| f64::from((f64::from(degrees) - 0.5).to_radians().sin() as f32))
        .collect();
    let input: Vec<[f32; 4]> = cosines
        .iter()
        .map(|&c| [c as f32, 1.333, 0.0, 0.0])
        .collect();
    let body = "return vec4f(fresnel(value.x, value.y));";
    let found = kernel(&context(), "shared/ssfr_optics", body, &input);
    let mut schlick_off = 0.0f64;
    for (&cosine, found) in cosines.iter().zip(&found) {
        let exact = fresnel(cosine, INDEX);
        // A dozen roundings of values up to 1, and that of the index.
        assert!(
            (f64::from(found[0]) - exact).abs() < 2e-6,
            "{cosine}: {found:?} {exact}"
        );
        let straight = ((INDEX - 1.0) / (INDEX + 1.0)).powi(2);
        let schlick = straight + (1.0 - straight) * (1.0 - cosine).powi(5);
        schlick_off = schlick_off.max((schlick - exact).abs());
    }
    assert!(
        schlick_off > 0.05,
        "the control, Schlick, is as good: {schlick_off}"
    );
}
