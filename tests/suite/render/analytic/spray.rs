//! Spray as a volume: its light, depth and motion; and eyes in the water.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};
use swell::domain::bounds::Bounds;
use swell::domain::particles::Particles;
use swell::domain::whitewater::RADIUS;
use swell::gpu::adapter::Context;
use swell::render::{FrameInputs, Image, RenderError, RenderScene, WaterParticles};

use super::geometry::box_mesh;
use super::rays;
use super::support::{
    Eye, Setup, ball, context, draw, draw_inputs, kernel, scene, spoiled, uniform_sky,
};

fn black_sky(_: DVec3, _: DVec2) -> [f64; 3] {
    [0.0; 3]
}

/// Distance from the eye to the cloud, m, and its radius, m.
const AWAY: f64 = 5.0;
const SIZE: f64 = 0.5;
const SPEED: DVec3 = DVec3::new(-6.0, 3.0, 4.0);

/// Looks up, where nothing is behind the cloud.
fn eye() -> Eye {
    Eye::new([5.0, 2.0, 1.0], [5.0, 6.0, 8.0], 300.0)
}

/// One ball of whitewater, alone or in front of solids.
struct Cloud {
    eye: Eye,
    method: &'static str,
    /// Particle spacing, m: the rays' grid of drops has two voxels in it, and their lattice of
    /// shade one node.
    spacing: f64,
    density: f64,
    sun: [f64; 3],
    background: bool,
    solids: Vec<Bounds>,
}

impl Cloud {
    fn draw(&self, context: &Context, sky: &dyn Fn(DVec3, DVec2) -> [f64; 3]) -> Image {
        let setup = Setup {
            method: self.method,
            water: format!("[whitewater]\ndensity_per_metre = {:?}\n", self.density),
            sun: self.sun,
            ground: [1.0; 3],
            solids: [0.0; 3],
            background: self.background,
            ..Setup::new(self.eye)
        };
        let mut white = ball(self.eye.position + AWAY * self.eye.forward(), SPEED);
        white
            .attributes
            .insert(RADIUS.to_owned(), vec![SIZE as f32]);
        let water = WaterParticles::new(Particles::default());
        let scene = RenderScene {
            solids: self.solids.iter().map(|&it| box_mesh(it)).collect(),
            particle_spacing: self.spacing,
            ..scene(1.0, 1.0)
        };
        let inputs = FrameInputs::alone(&water, &white);
        draw_inputs(context, &setup, sky, &scene, &inputs, 1).unwrap()
    }
}

fn cloud(method: &'static str, density: f64) -> Cloud {
    Cloud {
        eye: eye(),
        method,
        spacing: 0.25,
        density,
        sun: [0.0, 45.0, 0.0],
        background: false,
        solids: Vec::new(),
    }
}

/// The pixel right of and below the middle of the picture.
const MIDDLE: usize = 32 * 64 + 32;

/// Largest error of a cloud in a white furnace, from thin to thick.
fn furnace_error(context: &Context, method: &'static str) -> f64 {
    let mut worst = 0.0f64;
    for density in [0.2, 2.0, 50.0] {
        let shot = Cloud {
            background: true,
            ..cloud(method, density)
        };
        let image = shot.draw(context, &uniform_sky);
        for pixel in &image.beauty {
            worst = pixel[..3]
                .iter()
                .fold(worst, |w, &x| w.max((f64::from(x) - 1.0).abs()));
        }
    }
    worst
}

#[test]
fn spray_in_a_white_furnace_is_not_seen() {
    for (method, pass) in [("ssfr", "ssfr/shade_spray"), ("ray", "rays/cast")] {
        // The sky's harmonics are summed over texels of half precision.
        let error = furnace_error(&context(), method);
        assert!(error < 1e-3, "{method}: {error}");
        let (from, to) = (
            "1.0 - exp(-optical_depth)) / PI",
            "1.0 - exp(-optical_depth)) / (1.01 * PI)",
        );
        let control = furnace_error(&spoiled(pass, from, to), method);
        assert!(control > 5e-3, "{method}: {control}");
    }
}

fn lobe(g: f64, cosine: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
}

/// Length of the ray through the cloud, m, as the sums at half resolution have it at a position in
/// pixels from the upper left corner.
fn way_through(place: DVec2) -> f64 {
    let eye = eye();
    let [right, up, forward] = eye.axes();
    let half = 0.5 * f64::from(eye.size);
    let chord = |cell: DVec2| {
        let at = 2.0 * cell + 1.0 - half;
        let along = (forward * eye.focal + right * at.x - up * at.y).normalize();
        let off = (AWAY * forward).cross(along).length_squared();
        2.0 * (SIZE * SIZE - off).max(0.0).sqrt()
    };
    let at = 0.5 * place - 0.5;
    let (cell, part) = (at.floor(), at - at.floor());
    let row = |y: f64| {
        let left = chord(cell + DVec2::new(0.0, y));
        left + part.x * (chord(cell + DVec2::new(1.0, y)) - left)
    };
    row(0.0) + part.y * (row(1.0) - row(0.0))
}

/// Normal of the cloud's near side at pixel `i`, towards the viewer: half the length through it is
/// in front of its middle. Averaged over two pixels to each side, which are more than two spacings
/// of [`FINE`].
fn near_side(i: usize) -> DVec3 {
    let eye = eye();
    let [right, up, forward] = eye.axes();
    let side = eye.size as usize;
    let middle = DVec2::new((i % side) as f64, (i / side) as f64) + 0.5;
    let depth = |x: f64, y: f64| -0.5 * way_through(middle + DVec2::new(x, y));
    let [a, b, c, d] = [
        depth(2.0, 2.0),
        depth(2.0, -2.0),
        depth(-2.0, 2.0),
        depth(-2.0, -2.0),
    ];
    let slope = DVec2::new(a + b - c - d, a + c - b - d) * eye.focal / (8.0 * AWAY);
    (right * slope.x - up * slope.y - forward).normalize()
}

/// Radiance over irradiance of the body of a ball that, shaded by Lommel–Seeliger, reflects all
/// light: 4π · 2/3 (1 − ln 2) times it is 1.
const WHITE_BODY: f64 = 3.0 / (8.0 * PI * (1.0 - std::f64::consts::LN_2));

/// Fraction of sunlight that reaches drops through others, averaged over the drops that the eye
/// sees in a direction. The cloud is a ball with the same mean square distance, whose density is (1
/// − q²)², integrated in steps of a fiftieth of its radius.
fn lit(along: DVec3, sun: DVec3, density: f64) -> f64 {
    let reach = 1.8f64.sqrt() * SIZE;
    // ∫ (1 − q²)² over the unit ball is 4π (1/3 − 2/5 + 1/7).
    let peak = density * SIZE.powi(3) / 3.0 / (reach.powi(3) * (1.0 / 3.0 - 0.4 + 1.0 / 7.0));
    let centre = AWAY * eye().forward();
    let at = |p: DVec3| {
        let q = (p - centre).length_squared() / (reach * reach);
        peak * (1.0 - q).max(0.0).powi(2)
    };
    let step = reach / 50.0;
    let [mut depth, mut seen, mut all] = [0.0, 0.0, 0.0];
    for k in 0..100 {
        let p = along * (AWAY - reach + step * (f64::from(k) + 0.5));
        let own = at(p) * step;
        let towards = |k: u32| at(p + sun * step * (f64::from(k) + 0.5)) * step;
        let before: f64 = (0..100).map(towards).sum();
        let hides = f64::exp(-depth) * (1.0 - (-own).exp());
        seen += hides * (-before).exp();
        all += hides;
        depth += own;
    }
    if all > 0.0 { seen / all } else { 1.0 }
}

/// Error of drops in sunlight, relative to the brightest light: radiance over cover is the sun's
/// irradiance times a mix of phase functions, of light scattered once, of light scattered in all
/// directions, and of a white wall at its near side; with rays, of a white body shaded by the
/// length through it. `density` is that of the cloud with rays.
fn sun_error(image: &Image, azimuth: f64, density: Option<f64>) -> f64 {
    let (sin, cos) = azimuth.to_radians().sin_cos();
    let half = 0.5f64.sqrt();
    let sun = DVec3::new(half * cos, half, half * sin);
    // 0.82 of the unit of light falls on a horizontal face from a sun at 45°, as radiance of white
    // paint.
    let irradiance = 0.82 * PI * 2f64.sqrt();
    let [mut worst, mut most] = [0.0f64; 2];
    for (i, pixel) in image.beauty.iter().enumerate() {
        let cover = f64::from(pixel[3]);
        if cover < 0.05 {
            continue;
        }
        let depth = -(1.0 - cover).max(1e-7).ln();
        let cosine = (-eye().direction(i)).dot(sun);
        let drops = 0.93 * lobe(0.85, -cosine) + 0.07 * lobe(-0.3, -cosine);
        let (white, lit) = match density {
            None => (near_side(i).dot(sun).max(0.0) / PI, 1.0),
            Some(density) => (WHITE_BODY, lit(eye().direction(i), sun, density)),
        };
        let unmet = |x: f64| (1.0 - (-x).exp()) / x;
        let thin = unmet((1.0 - (0.93 * 0.85 - 0.07 * 0.3)) * depth);
        let often = thin / (4.0 * PI) + (1.0 - thin) * white;
        let once = unmet(8.0 * depth);
        let expected = irradiance * lit * (once * drops + (1.0 - once) * often);
        let [r, g, b, _] = pixel.map(f64::from);
        let found = (0.2126 * r + 0.7152 * g + 0.0722 * b) / cover;
        // Shade by rays is exp of minus a depth that a lattice blurs, and a slope is a difference
        // of rounded depths: dark parts have their error relative to bright ones.
        most = most.max(expected);
        worst = worst.max((found - expected).abs());
    }
    worst / most
}

/// Particle spacing, m, with which the lattice of shade has 43 nodes across a cloud. Between nodes
/// its error is pitch² / 8 of the depth's second derivative, which over the middle of such a cloud
/// is 5 depths / reach²: for an optical depth of ten, 0.014 along each of two axes.
const FINE: f64 = 0.03125;

#[test]
fn the_sun_shines_through_thin_spray_and_upon_thick() {
    for method in ["ssfr", "ray"] {
        for (azimuth, density) in [(90.0, 0.5), (270.0, 0.5), (90.0, 8.0), (270.0, 8.0)] {
            let shot = Cloud {
                spacing: FINE,
                sun: [azimuth, 45.0, 1.0],
                ..cloud(method, density)
            };
            let image = shot.draw(&context(), &black_sky);
            // The error of an adapter's exp, 1e-4 here, is a thousandth or two of a cover of 0.05.
            let by_rays = (method == "ray").then_some(density);
            let error = sun_error(&image, azimuth, by_rays);
            assert!(error < 0.01, "{method} {azimuth} {density}: {error}");
            // Control: the sun 60° farther. With the sun behind the viewer, 20° change the light by
            // only 0.7 %.
            let control = sun_error(&image, azimuth + 60.0, by_rays);
            assert!(control > 0.01, "{method} {azimuth} {density}: {control}");
        }
    }
    // A cloud that is flat to the sun and faces the viewer.
    let shot = Cloud {
        spacing: FINE,
        sun: [270.0, 45.0, 1.0],
        ..cloud("ssfr", 8.0)
    };
    let flat = spoiled(
        "ssfr/shade_spray",
        "normalize(vec3f(slope.x, -slope.y, -1.0))",
        "vec3f(0.0 * slope.x, 0.0, -1.0)",
    );
    let control = sun_error(&shot.draw(&flat, &black_sky), 270.0, None);
    assert!(control > 0.1, "{control}");
}

/// Integrals over all directions of a phase function and of its cosine, by the midpoint rule over
/// 4000 parts of the cosine.
fn integrals(body: &str) -> [f64; 2] {
    const PARTS: usize = 4000;
    let step = 2.0 / PARTS as f64;
    let cosines: Vec<f64> = (0..PARTS).map(|k| -1.0 + step * (k as f64 + 0.5)).collect();
    let input: Vec<[f32; 4]> = cosines.iter().map(|&c| [c as f32, 0.0, 0.0, 0.0]).collect();
    let found = kernel(&context(), "shared/ssfr_optics", body, &input);
    let values = || {
        cosines
            .iter()
            .zip(&found)
            .map(|(c, v)| (c, f64::from(v[0])))
    };
    let all: f64 = values().map(|(_, v)| v).sum();
    let mean: f64 = values().map(|(c, v)| c * v).sum();
    [2.0 * PI * step * all, 2.0 * PI * step * mean]
}

#[test]
fn phase_functions_give_back_all_light() {
    // The midpoint rule is off by step² / 24 times the rise of the slope, 500 at the lobe's peak:
    // 5e-6; f32 adds 1e-5.
    let [all, mean] = integrals("return vec4f(drop_phase(value.x));");
    assert!((all - 1.0).abs() < 1e-4, "{all}");
    // Water drops without diffraction: 2 · 0.885 − 1 (van de Hulst 1957).
    assert!((mean - 0.77).abs() < 1e-3, "{mean}");
    // Control: 1 % less than one.
    let [all, _] = integrals("return vec4f(0.99 * drop_phase(value.x));");
    assert!((all - 1.0).abs() > 5e-3, "{all}");
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Medians over the cloud of the errors of Z, m, P, m, and forward, pixels.
fn channel_errors(context: &Context, method: &'static str) -> [f64; 3] {
    let image = cloud(method, 20.0).draw(context, &uniform_sky);
    let aovs = &image.aovs;
    let (z, p) = (aovs.z.as_ref().unwrap(), aovs.p.as_ref().unwrap());
    let forward = aovs.forward.as_ref().unwrap();
    let mut errors = [const { Vec::new() }; 3];
    for (i, pixel) in image.beauty.iter().enumerate() {
        if pixel[3] < 0.6 {
            continue;
        }
        let along = eye().direction(i);
        // The mean position seen of a ball is the plane through its centre.
        let place = eye().position + along * (AWAY / along.dot(eye().forward()));
        let goes = eye().place(place + SPEED / 24.0 - eye().position) - eye().place(along);
        let found = DVec3::from(p[i].map(f64::from));
        errors[0].push((f64::from(z[i]) - AWAY).abs());
        errors[1].push((found - place).length());
        let motion = DVec2::from(forward[i].map(f64::from));
        errors[2].push((motion - goes).length());
    }
    assert!(errors[0].len() > 1000, "{}", errors[0].len());
    errors.map(median)
}

#[test]
fn channels_are_of_spray_where_it_hides_the_rest() {
    for (method, pass) in [("ssfr", "ssfr/shade_aovs"), ("ray", "rays/aovs")] {
        let [z, p, motion] = channel_errors(&context(), method);
        assert!(z < 0.01 && p < 0.02, "{method}: {z} {p}");
        assert!(motion < 0.3, "{method}: {motion}");
        // Where the cloud is thin, the AOVs are those of what is behind it: nothing.
        let thin = cloud(method, 0.5).draw(&context(), &uniform_sky);
        assert!(thin.aovs.z.unwrap()[MIDDLE] > 1e29, "{method}");
        // Controls: another speed, and a depth that is not normalized.
        let spoil = spoiled(pass, "* spray_params.speed", "* 0.9 * spray_params.speed");
        let [_, _, motion] = channel_errors(&spoil, method);
        assert!(motion > 0.3, "{method}: {motion}");
        let spoil = spoiled(
            pass,
            "/ length * spray_params.range",
            "* spray_params.range",
        );
        assert!(channel_errors(&spoil, method)[0] > 0.1, "{method}");
    }
}

/// Optical depth in the middle of a cloud with a black ceiling through its centre, relative to that
/// of the whole cloud, seen from straight below.
fn half(context: &Context) -> f64 {
    let from_below = || Cloud {
        eye: Eye {
            up: DVec3::Z,
            ..Eye::new([5.0, 1.0, 5.0], [5.0, 9.0, 5.0], 300.0)
        },
        ..cloud("ssfr", 1.0)
    };
    let whole = from_below().draw(context, &uniform_sky).beauty[MIDDLE][3];
    let shot = Cloud {
        solids: vec![Bounds {
            min: DVec3::new(0.0, 1.0 + AWAY, 0.0),
            max: DVec3::new(10.0, 2.0 + AWAY, 10.0),
        }],
        ..from_below()
    };
    // In front of black, radiance is cover.
    let front = shot.draw(context, &uniform_sky).beauty[MIDDLE][1];
    let depth = |cover: f32| -(1.0 - f64::from(cover)).ln();
    depth(front) / depth(whole)
}

#[test]
fn spray_dips_into_a_wall() {
    let found = half(&context());
    assert!((found - 0.5).abs() < 0.01, "{found}");
    let hard = spoiled(
        "ssfr/splat_whitewater",
        "(2.0 * radius) + 0.5, 0.0, 1.0)",
        "(2.0 * radius) + 1.0, 0.0, 1.0)",
    );
    assert!((half(&hard) - 0.5).abs() > 0.1);
}

/// Whether a picture of a pool from this height is refused.
fn is_refused(method: &'static str, height: f64) -> bool {
    let setup = Setup {
        method,
        ..Setup::new(Eye::new([5.0, height, 5.0], [9.0, height, 5.5], 60.0))
    };
    let (water, white) = (WaterParticles::new(rays::water()), Particles::default());
    let inputs = FrameInputs::alone(&water, &white);
    let scene = rays::pool_scene();
    match draw_inputs(&context(), &setup, &uniform_sky, &scene, &inputs, 7) {
        Ok(_) => false,
        Err(RenderError::UnderWater { frame: 7 }) => true,
        Err(other) => panic!("{other}"),
    }
}

#[test]
fn splats_refuse_an_eye_under_water() {
    // The surface is at most half a voxel from where the lattice says.
    assert!(is_refused("ssfr", rays::LEVEL - 0.5) && is_refused("ssfr", rays::LEVEL - 0.07));
    assert!(!is_refused("ssfr", rays::LEVEL + 0.07));
    assert!(!is_refused("ray", rays::LEVEL - 0.5));
}

/// Radius of a particle's splat, m, and the spacing: a particle has half of a splat's volume.
const SPLAT: f64 = 0.2;
const SPACING: f64 = 0.25;

/// For `count` fast particles at one position, averaged over twelve sets of ids: mean square
/// distance of their spray along an axis of the picture, m²; the integral of a particle's optical
/// depth over the area divided by the density, m³; and the mean square difference of a pixel's
/// depth from that two pixels away, relative to the mean square depth.
fn drops(context: &Context, count: u32) -> [f64; 3] {
    const DENSITY: f64 = 0.05;
    let eye = eye();
    let setup = Setup {
        surface: format!("smoothing_width_m = 0.0\nradius_m = {SPLAT:?}\n"),
        water: format!("spray = {{ density_per_metre = {DENSITY:?}, speed_m_per_s = 3.0 }}\n"),
        background: false,
        solids: [0.0; 3],
        ..Setup::new(eye)
    };
    let set = RenderScene {
        particle_spacing: SPACING,
        ..scene(1.0, 1.0)
    };
    let [mut all, mut squares, mut rough, mut depths] = [0.0; 4];
    for id in 0..12 {
        let lone = ball(eye.position + AWAY * eye.forward(), DVec3::ZERO);
        let water = Particles {
            position: vec![lone.position[0]; count as usize],
            velocity: vec![lone.velocity[0]; count as usize],
            id: (0..count).map(|k| 7 * (count * id + k)).collect(),
            ..Particles::default()
        };
        let image = draw(context, &setup, &black_sky, &set, &water, 1);
        // A cover of 1 − exp(−τ).
        let depth = |i: usize| -(1.0 - f64::from(image.beauty[i][3])).ln();
        for i in 0..64 * 64 {
            let [x, y] = [i % 64, i / 64].map(|at| at as f64 + 0.5 - 32.0);
            all += depth(i);
            squares += depth(i) * 0.5 * (x * x + y * y);
            if (2..62).contains(&(i % 64)) && (2..62).contains(&(i / 64)) {
                let beside = [i - 2, i + 2, i - 128, i + 128].map(depth);
                rough += (depth(i) - 0.25 * beside.iter().sum::<f64>()).powi(2);
                depths += depth(i).powi(2);
            }
        }
    }
    let pixel = AWAY / eye.focal;
    [
        squares / all * pixel * pixel,
        all / (12.0 * f64::from(count)) / DENSITY * pixel * pixel,
        rough / depths,
    ]
}

#[test]
fn spray_of_a_particle_is_as_wide_as_its_ball_by_rays_and_holds_its_air() {
    let pass = "ssfr/splat_spray";
    // An isolated particle has drops and no mist; of five, each of which has four neighbours, three
    // fifths are mist.
    for (count, of_drops, length) in [(1, 1.0, 1.5f64), (5, 0.4, 1.2)] {
        let [square, volume, _] = drops(&context(), count);
        // R² / 5 of a ball of 1.6 radii, as for rays. The tent over cells of two pixels by which a
        // drop is distributed adds a sixth of their square for its part of the volume, and linear
        // reads add as much for all of it.
        let pixel = AWAY / 300.0;
        let own = (of_drops + 1.0) * 2.0 * 2.0 / 6.0 * pixel * pixel;
        let wanted = (1.6 * SPLAT).powi(2) / 5.0 + own;
        // A thread adds to the mean over both axes of the picture in proportion to 1 − z², with z
        // uniform in −1..1: the standard deviation is 0.149 of its length's square. Its bend and
        // four puffs off it add a tenth. Three standard deviations of the mean of so many threads.
        let bound = 3.0 * 1.1 * length.powi(2) * 0.149 / (12.0 * f64::from(count)).sqrt();
        let off = square / wanted - 1.0;
        assert!(off.abs() < bound, "{count}: {square} {wanted}");
        // Three twentieths of a fast particle are spray; puffs are sampled by few cells.
        let air = 0.15 * SPACING.powi(3);
        assert!((volume / air - 1.0).abs() < 0.02, "{count}: {volume} {air}");
        // Controls: threads more than twice as long, and smaller drops without more opacity.
        let (from, to) = ("* s * thread.along", "* 2.2 * s * thread.along");
        let control = drops(&spoiled(pass, from, to), count)[0] / wanted - 1.0;
        assert!(control > 3.0 * bound, "{count}: {control}");
        let (from, to) = ("* finer * finer * finer;", "* finer * finer;");
        let control = drops(&spoiled(pass, from, to), count)[1] / air - 1.0;
        assert!(control < -0.1, "{count}: {control}");
    }
}

/// Drops are rough, mist is smooth. The control swaps them: mist for isolated particles and none in
/// company.
#[test]
fn spray_that_flies_alone_is_drops_and_spray_in_company_mist() {
    let (from, to) = (
        "const MIST: vec2f = vec2f(0.0, 0.6);",
        "const MIST: vec2f = vec2f(0.6, 0.0);",
    );
    let rough = |count: u32| {
        let [_, _, found] = drops(&context(), count);
        let [_, _, other] = drops(&spoiled("ssfr/splat_spray", from, to), count);
        found / other
    };
    // With three fifths smooth, two fifths are rough, and their square is less than a quarter.
    let (alone, together) = (rough(1), rough(5));
    assert!(alone > 2.0, "{alone}");
    assert!(together < 0.5, "{together}");
}

/// Extent of the spray of an isolated particle at a distance of `radii` of its radii, columns and
/// rows.
fn reach(context: &Context, radii: f64, id: u32) -> [usize; 2] {
    // Looks up, so that no ground is in the picture.
    let eye = Eye {
        size: 512,
        ..Eye::new([5.0, 1.0, 5.0], [5.3, 4.0, 5.2], 300.0)
    };
    let setup = Setup {
        surface: format!("smoothing_width_m = 0.0\nradius_m = {SPLAT:?}\n"),
        water: "spray = { density_per_metre = 1000.0, speed_m_per_s = 3.0 }\n".to_owned(),
        background: false,
        ..Setup::new(eye)
    };
    let set = RenderScene {
        particle_spacing: SPACING,
        ..scene(1.0, 1.0)
    };
    let lone = Particles {
        id: vec![id],
        ..ball(eye.position + radii * SPLAT * eye.forward(), DVec3::ZERO)
    };
    let image = draw(context, &setup, &black_sky, &set, &lone, 1);
    let seen = (0..512 * 512).filter(|&i| image.beauty[i][3] > 0.0);
    let places: Vec<[usize; 2]> = seen.map(|i| [i % 512, i / 512]).collect();
    [0, 1].map(|axis| {
        let along = || places.iter().map(|place| place[axis]);
        along()
            .max()
            .map_or(0, |last| last + 1 - along().min().unwrap())
    })
}

/// A drop covers four cells of two pixels, which are read linearly: six pixels at most, at any
/// distance from the eye.
#[test]
fn no_drop_is_wider_than_six_pixels() {
    // Only the largest drop.
    let alone = spoiled(
        "ssfr/splat_spray",
        "for (var j = thread.x; j < drops; j += LANES)",
        "for (var j = thread.x + drops - 1u; j < drops; j += LANES)",
    );
    for radii in [4.0, 6.0, 10.0, 40.0] {
        for id in 0..4 {
            let found = reach(&alone, radii, 7 * id + 1);
            assert!(
                found.iter().all(|n| (1..=6).contains(n)),
                "{radii}: {found:?}"
            );
        }
        // Control: all of its drops, over a ball of 1.6 radii.
        let ball = 2.0 * eye().focal / radii;
        let found = reach(&context(), radii, 1);
        assert!(
            found.iter().any(|n| *n > 6 && *n as f64 > 0.5 * ball),
            "{radii}: {found:?}"
        );
    }
}
