//! The sea outside the box: optics of still water, a level that continues without a seam, waves as
//! in theory.

use glam::{DVec2, DVec3};
use swell::domain::motion::Spectrum;
use swell::domain::open_waves::{Meeting, OpenSea, OpenWaves};
use swell::domain::particles::Particles;
use swell::gpu::adapter::Context;
use swell::render::{Image, RenderScene};

use super::rays::{
    ABSORPTION, INDEX, LEVEL, SIDE, SPACING, pool_scene, reflectance, refracted, water,
};
use super::support::{Eye, Setup, context, draw, spoiled, uniform_sky, wide};

const METHODS: [&str; 2] = ["ssfr", "ray"];
const STILL: &str = "[sea]\nlevel_m = 2.0\n";

fn setup(method: &'static str, eye: Eye, sea: &str) -> Setup {
    Setup {
        method,
        ground: [1.0; 3],
        water: format!("index = {INDEX:?}\nabsorption_per_metre = {ABSORPTION:?}\n"),
        sun: [0.0, 90.0, 0.0],
        more: sea.to_owned(),
        ..Setup::new(eye)
    }
}

/// An eye that looks at a point of the surface from `theta` degrees off the vertical, along +x and
/// down.
fn above(target: DVec3, theta: f64, distance: f64, focal: f64) -> Eye {
    let (sin, cos) = theta.to_radians().sin_cos();
    let from = target + distance * DVec3::new(-sin, cos, 0.0);
    Eye {
        up: DVec3::Z,
        ..Eye::new(from.to_array(), target.to_array(), focal)
    }
}

/// Largest relative error of a picture of flat water over a white floor under a sky of radiance 1,
/// compared with Snell, Fresnel and Beer–Lambert.
fn flat_error(image: &Image, eye: &Eye) -> f64 {
    let mut worst = 0.0f64;
    for (i, pixel) in image.beauty.iter().enumerate() {
        let along = eye.direction(i);
        let mirrored = reflectance(-along.y, INDEX);
        let way = LEVEL / -refracted(along, INDEX).y;
        for c in 0..3 {
            let expected = mirrored + (1.0 - mirrored) * (-ABSORPTION[c] * (way + LEVEL)).exp();
            worst = worst.max((f64::from(pixel[c]) / expected - 1.0).abs());
        }
    }
    worst
}

/// A picture of the pool and the sea around it.
fn picture(context: &Context, setup: &Setup) -> Image {
    draw(context, setup, &uniform_sky, &pool_scene(), &water(), 1)
}

/// Within 1 %, like the pool itself, well away from the box.
#[test]
fn a_still_sea_is_as_snell_fresnel_and_beer_say() {
    let error = |context: &Context, method, theta, sea| {
        let eye = above(DVec3::new(-20.0, LEVEL, 5.0), theta, 6.0, 600.0);
        flat_error(&picture(context, &setup(method, eye, sea)), &eye)
    };
    for method in METHODS {
        for theta in [0.0, 40.0, 70.0] {
            let found = error(&context(), method, theta, STILL);
            assert!(found < 0.01, "{method} {theta}°: {found}");
        }
        let lower = error(&context(), method, 40.0, "[sea]\nlevel_m = 1.9\n");
        assert!(lower > 0.01, "{method}, a level of 1.9 m: {lower}");
    }
}

/// With rays no pixel across the box's side is off by more than 1 %, as in the pool; a seam one
/// pixel wide would be.
#[test]
fn the_sea_goes_on_from_the_box_without_a_seam() {
    let error = |context: &Context, theta| {
        let eye = above(DVec3::new(0.0, LEVEL, 5.0), theta, 6.0, 300.0);
        flat_error(&picture(context, &setup("ray", eye, STILL)), &eye)
    };
    for theta in [0.0, 40.0, 70.0] {
        let found = error(&context(), theta);
        assert!(found < 0.01, "{theta}°: {found}");
    }
    let from = "return open + part * edge_height(at);";
    let spoiled = spoiled(
        "rays/cast",
        from,
        "return open + part * (edge_height(at) - 0.1);",
    );
    let found = error(&spoiled, 40.0);
    assert!(found > 0.01, "an edge 0.1 m too low: {found}");
}

/// A pool whose level rises by a tenth of the distance along x.
fn sloping() -> Particles {
    let mut water = water();
    for p in &mut water.position {
        let part = f64::from(p[1]) / LEVEL;
        let level = LEVEL + 0.1 * (f64::from(p[0]) - 0.5 * SIDE);
        p[1] = (part * level) as f32;
    }
    water
}

/// At the edge the sea is as high as the water in the box, within a tenth of a particle spacing:
/// half a voxel of the level set is a quarter, and the field there is nearly linear.
#[test]
fn the_sea_meets_the_edge_of_the_simulated_water_in_height() {
    let off = |context: &Context| {
        let eye = Eye {
            up: DVec3::Z,
            ..Eye::new([5.0, 9.0, 0.0], [5.0, 0.0, 0.0], 64.0)
        };
        let setup = setup("ray", eye, STILL);
        let image = draw(context, &setup, &uniform_sky, &pool_scene(), &sloping(), 1);
        let places: Vec<DVec3> = image.aovs.p.unwrap().into_iter().map(wide).collect();
        let side = eye.size as usize;
        let mut worst = 0.0f64;
        // Rows of the picture run along x; the box begins where z changes its sign.
        for (i, p) in places.iter().enumerate().take(side * (side - 1)) {
            let q = places[i + side];
            if (p.z < 0.0) != (q.z < 0.0) && (1.5..8.5).contains(&p.x) {
                worst = worst.max((p.y - q.y).abs() / SPACING);
            }
        }
        assert!(worst > 0.0, "no pixel is beside the edge");
        worst
    };
    let found = off(&context());
    assert!(found < 0.1, "{found}");
    let from = "return 1.0 - t * t * (3.0 - 2.0 * t);";
    let found = off(&spoiled("rays/aovs", from, "return 0.0;"));
    assert!(found > 0.3, "a sea that does not know the edge: {found}");
}

const WAVES: &str = "[sea]\nlevel_m = 2.0\n\
    [sea.waves]\nsignificant_height_m = 0.5\npeak_period_s = 4.0\n\
    shortest_period_s = 2.0\ndirection_degrees = 30.0\nspreading = 12.0\nseed = 5\n";

fn waves() -> OpenWaves {
    let asked = OpenSea {
        spectrum: Spectrum::Jonswap,
        meeting: Meeting::Random {
            significant_height: 0.5,
            seed: 5,
        },
        peak_period: 4.0,
        peak_enhancement: 3.3,
        shortest_period: 2.0,
        depth: 2.0,
        gravity: 9.81,
        ramp: 0.0,
        spreading: Some(12.0),
    };
    OpenWaves::sea(&asked, 30f64.to_radians())
}

/// Largest distance of the surface from linear theory at `time`, m, and the rms elevation of
/// theory, m.
fn wave_error(image: &Image, time: f64) -> [f64; 2] {
    let waves = waves();
    let (mut worst, mut sum, mut count) = (0.0f64, 0.0, 0.0);
    for p in image.aovs.p.as_ref().unwrap() {
        let p = wide(*p);
        let expected = waves.elevation(DVec2::new(p.x, p.z), time);
        worst = worst.max((p.y - LEVEL - expected).abs());
        sum += expected * expected;
        count += 1.0;
    }
    [worst, f64::sqrt(sum / count)]
}

/// Positions are f32 of numbers up to 60 m, 4e-6 m, and phases f32 of numbers up to 60 m × 1.1
/// rad/m; a pixel of 0.2 m takes 1 − exp(−(0.2 × 1.1)² / 8) = 0.6 % of the finest wave's height. A
/// centimetre of heights of 0.5 m is 2 %.
#[test]
fn waves_stand_where_linear_theory_has_them_and_go_as_its_water() {
    let scene = RenderScene {
        frames_per_second: 24.0,
        ..pool_scene()
    };
    let eye = Eye {
        up: DVec3::Z,
        ..Eye::new([-45.0, 32.0, 5.0], [-45.0, 0.0, 5.0], 150.0)
    };
    for method in METHODS {
        let image = draw(
            &context(),
            &setup(method, eye, WAVES),
            &uniform_sky,
            &scene,
            &water(),
            12,
        );
        let [worst, rms] = wave_error(&image, 0.5);
        assert!(rms > 0.06, "{method}: waves {rms} m high");
        assert!(worst < 0.01, "{method}: {worst}");
        let [late, _] = wave_error(&image, 0.75);
        assert!(late > 0.03, "{method}, a quarter of a second late: {late}");

        let waves = waves();
        let (places, motion) = (image.aovs.p.unwrap(), image.aovs.forward.unwrap());
        let mut off = 0.0f64;
        for (p, found) in places.into_iter().zip(motion) {
            let p = wide(p);
            let speed = waves.velocity(DVec3::new(p.x, LEVEL, p.z), 0.5);
            let moved = eye.place(p + speed / 24.0 - eye.position);
            let shift = moved - eye.place(p - eye.position);
            off = off.max((shift - DVec2::new(found[0].into(), found[1].into())).length());
        }
        // A pixel's position is f32 of numbers up to 100: 1e-5; the water's displacement in a frame
        // is 0.1 pixels or more.
        assert!(off < 0.002, "{method}: {off} pixels");
    }
}
