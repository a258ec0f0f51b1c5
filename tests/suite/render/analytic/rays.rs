//! Rays through water: a flat pool, a white furnace, Snell's window.

use glam::{DVec2, DVec3};
use swell::domain::bounds::Bounds;
use swell::domain::particles::Particles;
use swell::gpu::adapter::Context;
use swell::render::RenderScene;
use swell::scene::look::LightSpec;

use super::geometry::box_mesh;
use super::support::{Eye, Setup, context, draw, scene, spoiled, uniform_sky};

pub(super) const INDEX: f64 = 1.333;
pub(super) const ABSORPTION: [f64; 3] = [0.02, 0.15, 0.4];
const CLEAR: [f64; 3] = [0.0; 3];
/// Spacing of particles, m.
pub(super) const SPACING: f64 = 0.25;
/// Level of the pool, m.
pub(crate) const LEVEL: f64 = 2.0;
pub(super) const SIDE: f64 = 10.0;

/// A pool that fills a box of 10 m up to [`LEVEL`].
pub(crate) fn water() -> Particles {
    let [n, layers] = [SIDE / SPACING, LEVEL / SPACING].map(|n| n as usize);
    let place = |k: usize| (k as f32 + 0.5) * SPACING as f32;
    let position: Vec<[f32; 3]> = (0..n * n * layers)
        .map(|k| [place(k % n), place(k / n % layers), place(k / n / layers)])
        .collect();
    Particles {
        velocity: vec![[0.0; 3]; position.len()],
        id: (0..position.len() as u32).collect(),
        position,
        ..Particles::default()
    }
}

pub(crate) fn pool_scene() -> RenderScene {
    RenderScene {
        particle_spacing: SPACING,
        ..scene(1.0, 1.0)
    }
}

fn by_rays(eye: Eye) -> Setup {
    Setup {
        method: "ray",
        ground: [1.0; 3],
        ..Setup::new(eye)
    }
}

/// Refracts a direction at a level surface: the horizontal part of a unit direction shrinks by the
/// index (Snell).
pub(super) fn refracted(along: DVec3, index: f64) -> DVec3 {
    let level = DVec3::new(along.x, 0.0, along.z) / index;
    level - DVec3::Y * (1.0 - level.length_squared()).sqrt()
}

pub(super) fn reflectance(cosine: f64, index: f64) -> f64 {
    let inside = (1.0 - (1.0 - cosine * cosine) / (index * index)).sqrt();
    let s = (cosine - index * inside) / (cosine + index * inside);
    let p = (index * cosine - inside) / (index * cosine + inside);
    0.5 * (s * s + p * p)
}

/// Largest relative error of a picture of a flat pool over a white floor, under a sky of radiance
/// 1, compared with Snell, Fresnel, Beer–Lambert and light that is scattered once on its way
/// straight down, as the body of deep water returns it.
fn pool_error(context: &Context, theta: f64, scattering: [f64; 3]) -> f64 {
    let (sin, cos) = f64::to_radians(theta).sin_cos();
    let target = DVec3::new(5.0, LEVEL, 5.0);
    let eye = Eye {
        up: DVec3::Z,
        ..Eye::new(
            (target + 6.0 * DVec3::new(-sin, cos, 0.0)).to_array(),
            target.to_array(),
            600.0,
        )
    };
    let setup = Setup {
        water: format!(
            "index = {INDEX:?}\nabsorption_per_metre = {ABSORPTION:?}\n\
             scattering_per_metre = {scattering:?}\n"
        ),
        sun: [0.0, 90.0, 0.0],
        ..by_rays(eye)
    };
    let image = draw(context, &setup, &uniform_sky, &pool_scene(), &water(), 1);
    let mut worst = 0.0f64;
    for (i, pixel) in image.beauty.iter().enumerate() {
        let along = eye.direction(i);
        let mirrored = reflectance(-along.y, INDEX);
        let cosine = -refracted(along, INDEX).y;
        let way = LEVEL / cosine;
        for c in 0..3 {
            // Daylight comes straight down: the sun, which is too dim to be seen, is at the zenith.
            let extinction = ABSORPTION[c] + scattering[c];
            let floor = (-extinction * (way + LEVEL)).exp();
            // Hapke 1981, equation 38, times ∫ 2 σ exp(−σ (t + t cos θ)) dt, which is 1 for deep
            // water seen from straight above.
            let gamma = (ABSORPTION[c] / extinction).sqrt();
            let whole = 1.0 - (-extinction * way * (1.0 + cosine)).exp();
            let body = (1.0 - gamma) / (1.0 + gamma) * 2.0 / (1.0 + cosine) * whole;
            // Light from the floor reaches the eye; what is reflected below the surface returns to
            // the floor and is not counted.
            let expected = mirrored + (1.0 - mirrored) * (floor + body);
            worst = worst.max((f64::from(pixel[c]) / expected - 1.0).abs());
        }
    }
    worst
}

/// White ground behind a pool, on the side away from the sun: far away all of its light comes over
/// the water, and one metre from the pool it has left the pool a metre below its surface.
#[test]
fn the_pools_shadow_ends_where_light_comes_over_it() {
    let depth_at = |context: &Context, x: f64| {
        let eye = Eye::new([x + 3.0, 3.0, 5.0], [x, 0.0, 5.0], 3000.0);
        let setup = Setup {
            water: format!(
                "index = {INDEX:?}\nabsorption_per_metre = {ABSORPTION:?}\n\
                 scattering_per_metre = {CLEAR:?}\n"
            ),
            sun: [180.0, 45.0, 0.0],
            ..by_rays(eye)
        };
        let image = draw(context, &setup, &uniform_sky, &pool_scene(), &water(), 1);
        // Beer: of the sky's light, from straight above, `depth` metres of water leave exp(−σ
        // depth).
        -f64::from(image.beauty[32 * 64 + 32][2]).ln() / ABSORPTION[2]
    };
    // 1 % of the light, and the spacing to which the lattice of sunlight resolves a path
    // (`light_goes_straight_down_through_a_pool`).
    let (far, near) = (depth_at(&context(), 34.0), depth_at(&context(), SIDE + 1.0));
    assert!(
        far.abs() < 0.01 / ABSORPTION[2] && (near - 1.0).abs() < SPACING,
        "{far}, {near}"
    );
    // Control: every point outside the box uses the nearest point of the box, at the pool's floor.
    let clamped = spoiled("rays/cast", "<= 0.5 * rays.voxel", "<= 1e9 * rays.voxel");
    for x in [34.0, SIDE + 1.0] {
        let control = depth_at(&clamped, x);
        assert!(control > 1.0 + 2.0 * SPACING, "{x}: {control}");
    }
}

/// Absorption and refraction within 1 %.
#[test]
fn a_pool_over_a_white_floor_is_as_snell_fresnel_and_beer_say() {
    for theta in [0.0, 40.0, 70.0] {
        let error = pool_error(&context(), theta, CLEAR);
        assert!(error < 0.01, "{theta}°: {error}");
    }
    for (from, to) in [
        (
            "exp(-(shading.absorption + shading.scattering) * far)",
            "exp(-1.05 * (shading.absorption + shading.scattering) * far)",
        ),
        (
            "refract(-view, normal, 1.0 / index)",
            "refract(-view, normal, 1.0)",
        ),
        (
            "select(fresnel(facing, index), 1.0,",
            "select(1.5 * fresnel(facing, index), 1.0,",
        ),
    ] {
        let error = pool_error(&spoiled("rays/cast", from, to), 70.0, CLEAR);
        assert!(error > 0.01, "{to}: {error}");
    }
}

/// Within 1 % from thin water to water so deep that only its body is visible: optical depths of 0.6
/// to 20. The surface is located to 0.002 spacings, half a millimetre here, which at 10/m changes
/// the light by 0.5 %; at 120/m the error is 7 %.
#[test]
fn a_milky_pool_has_the_light_that_its_body_scatters() {
    let milky = [0.3, 3.0, 10.0];
    for theta in [0.0, 40.0, 70.0] {
        let error = pool_error(&context(), theta, milky);
        assert!(error < 0.01, "{theta}°: {error}");
    }
    for (from, to) in [
        ("sky_irradiance(up) * 2.0", "sky_irradiance(up) * 1.9"),
        ("(start + before)", "start"),
        ("(end - start + after - before)", "(end - start)"),
        ("after / shading.sun_path", "before / shading.sun_path"),
    ] {
        let error = pool_error(&spoiled("rays/cast", from, to), 40.0, milky);
        assert!(error > 0.01, "{to}: {error}");
    }
}

/// Largest error of the parts of a milky pool's light, compared with the same optics part by part,
/// relative to the total.
fn parts_error(context: &Context) -> f64 {
    const THETA: f64 = 40.0;
    let milky = [0.3, 3.0, 10.0];
    let (sin, cos) = THETA.to_radians().sin_cos();
    let target = DVec3::new(5.0, LEVEL, 5.0);
    let eye = Eye {
        up: DVec3::Z,
        ..Eye::new(
            (target + 6.0 * DVec3::new(-sin, cos, 0.0)).to_array(),
            target.to_array(),
            600.0,
        )
    };
    let setup = Setup {
        water: format!(
            "index = {INDEX:?}\nabsorption_per_metre = {ABSORPTION:?}\n\
             scattering_per_metre = {milky:?}\n"
        ),
        sun: [0.0, 90.0, 0.0],
        output: "lights = [\"scattering\", \"reflection\", \"refraction\"]\n".to_owned(),
        ..by_rays(eye)
    };
    let image = draw(context, &setup, &uniform_sky, &pool_scene(), &water(), 1);
    let names: Vec<LightSpec> = image.lights.iter().map(|(light, _)| *light).collect();
    let order = [
        LightSpec::Reflection,
        LightSpec::Refraction,
        LightSpec::Scattering,
    ];
    assert_eq!(names, order);
    let mut worst = 0.0f64;
    for i in 0..image.beauty.len() {
        let along = eye.direction(i);
        let mirrored = reflectance(-along.y, INDEX);
        let cosine = -refracted(along, INDEX).y;
        let way = LEVEL / cosine;
        for c in 0..3 {
            let extinction = ABSORPTION[c] + milky[c];
            let floor = (-extinction * (way + LEVEL)).exp();
            let gamma = (ABSORPTION[c] / extinction).sqrt();
            let whole = 1.0 - (-extinction * way * (1.0 + cosine)).exp();
            let body = (1.0 - gamma) / (1.0 + gamma) * 2.0 / (1.0 + cosine) * whole;
            let parts = [mirrored, (1.0 - mirrored) * floor, (1.0 - mirrored) * body];
            let all: f64 = parts.iter().sum();
            for ((_, found), part) in image.lights.iter().zip(parts) {
                worst = worst.max((f64::from(found[i][c]) - part).abs() / all);
            }
        }
    }
    worst
}

/// Within 1 % of the total.
#[test]
fn parts_of_a_pools_light_are_what_it_mirrors_lets_through_and_scatters() {
    let error = parts_error(&context());
    assert!(error < 0.01, "{error}");
    for (from, to) in [
        ("own == SCATTERING)", "own == SKYLIGHT)"),
        ("part_of(ray, REFLECTION);", "part_of(ray, REFRACTION);"),
    ] {
        let error = parts_error(&spoiled("rays/cast", from, to));
        assert!(error > 0.01, "{to}: {error}");
    }
}

/// Largest error of a white furnace: a splash of clear water in front of white things under a white
/// sky is invisible.
fn furnace_error(context: &Context) -> f64 {
    let mut splash = water();
    for p in &mut splash.position {
        let [x, y, z] = p.map(f64::from);
        let wave = 0.6 * (1.7 * x).sin() * (1.3 * z).cos() * y / LEVEL;
        p[1] = (y + wave) as f32;
        // Drops above it.
        if (37.0 * x + 11.0 * z).sin() > 0.97 && y > LEVEL - SPACING {
            p[1] += 1.5;
        }
    }
    let eye = Eye::new([-1.0, 3.5, 5.2], [5.0, 2.3, 5.0], 60.0);
    let setup = Setup {
        water: format!("index = {INDEX:?}\nabsorption_per_metre = [0.0, 0.0, 0.0]\n"),
        ..by_rays(eye)
    };
    let image = draw(context, &setup, &uniform_sky, &pool_scene(), &splash, 1);
    let off = image.beauty.iter().flat_map(|p| [p[0], p[1], p[2]]);
    off.fold(0.0, |worst, x| (f64::from(x) - 1.0).abs().max(worst))
}

#[test]
fn clear_water_in_a_white_furnace_is_not_seen() {
    let error = furnace_error(&context());
    assert!(error < 0.01, "{error}");
    let (from, to) = (
        "weight * (1.0 - mirror), travelled",
        "weight * (0.98 - mirror), travelled",
    );
    let control = furnace_error(&spoiled("rays/cast", from, to));
    assert!(control > 0.01, "{control}");
}

/// Half the angle of the part of the surface through which an eye half a metre below it sees the
/// sky, degrees.
fn window(context: &Context) -> f64 {
    let eye = Eye {
        up: DVec3::Z,
        ..Eye::new([5.0, LEVEL - 0.5, 5.0], [5.0, LEVEL, 5.0], 20.0)
    };
    let setup = Setup {
        water: format!("index = {INDEX:?}\nabsorption_per_metre = [0.0, 0.0, 0.0]\n"),
        ground: [0.0; 3],
        ..by_rays(eye)
    };
    let image = draw(context, &setup, &uniform_sky, &pool_scene(), &water(), 1);
    // Solid angle of everything brighter than half: a cone's is 2π (1 − cos θ).
    let mut seen = 0.0;
    for (i, pixel) in image.beauty.iter().enumerate() {
        if pixel[0] > 0.5 {
            seen += eye.direction(i).y.powi(3) / (eye.focal * eye.focal);
        }
    }
    (1.0 - seen / std::f64::consts::TAU).acos().to_degrees()
}

/// Within 1° of 48.6°, arcsin of 1 / 1.333.
#[test]
fn an_eye_under_water_sees_snells_window() {
    let angle = window(&context());
    assert!((angle - 48.6).abs() < 1.0, "{angle}°");
    let (from, to) = (
        "1.0 / shading.index, ray.inside",
        "1.0 / (1.05 * shading.index), ray.inside",
    );
    let control = window(&spoiled("rays/cast", from, to));
    assert!((control - 48.6).abs() > 1.0, "{control}°");
}

/// Distance of the foot of a black step under water from where Snell's law puts it, pixels.
fn edge_error(context: &Context) -> f64 {
    const FOOT: f64 = 5.0;
    let eye = Eye::new([1.0, 6.0, 5.0], [4.0, LEVEL, 5.0], 120.0);
    let step = box_mesh(Bounds {
        min: DVec3::new(FOOT, -1.0, -20.0),
        max: DVec3::new(30.0, 0.5, 30.0),
    });
    let setup = Setup {
        water: format!("index = {INDEX:?}\nabsorption_per_metre = [0.0, 0.0, 0.0]\n"),
        solids: [0.0; 3],
        samples: 16,
        ..by_rays(eye)
    };
    let scene = RenderScene {
        solids: vec![step],
        ..pool_scene()
    };
    let image = draw(context, &setup, &uniform_sky, &scene, &water(), 1);
    let side = eye.size as usize;
    // The floor is as bright as the sky, so a pixel of it is 1 whatever the surface reflects; the
    // step is black.
    let lit: f64 = (0..side)
        .map(|row| {
            let i = row * side + side / 2;
            let mirrored = reflectance(-eye.direction(i).y, INDEX);
            (f64::from(image.beauty[i][1]) - mirrored) / (1.0 - mirrored)
        })
        .sum();
    // Point where the ray to the foot enters the surface, by bisection.
    let (mut low, mut high) = (eye.position.x, FOOT);
    for _ in 0..60 {
        let x = 0.5 * (low + high);
        let below = refracted(
            (DVec3::new(x, LEVEL, 5.0) - eye.position).normalize(),
            INDEX,
        );
        match x + below.x / -below.y * LEVEL < FOOT {
            true => low = x,
            false => high = x,
        }
    }
    let place = eye.place(DVec3::new(low, LEVEL, 5.0) - eye.position);
    (lit - (0.5 * side as f64 + place.y)).abs()
}

/// Within half a pixel.
#[test]
fn an_edge_under_water_is_seen_where_snell_puts_it() {
    let error = edge_error(&context());
    assert!(error < 0.5, "{error} pixels");
    let (from, to) = (
        "refract(-view, normal, 1.0 / index)",
        "refract(-view, normal, 1.0 / (1.1 * index))",
    );
    let control = edge_error(&spoiled("rays/cast", from, to));
    assert!(control > 0.5, "{control} pixels");
}

/// Particles end 0.4 spacings in front of a wall in the pool, as they do at solids: an eye under
/// water sees the wall and not a reflecting layer of air.
#[test]
fn water_lies_against_a_wall_that_its_particles_keep_off() {
    let wall = 6.1;
    let (min, max) = (DVec3::new(wall, 0.0, 0.0), DVec3::new(7.0, 4.0, SIDE));
    let scene = RenderScene {
        solids: vec![box_mesh(Bounds { min, max })],
        ..pool_scene()
    };
    let all = water();
    let kept: Vec<[f32; 3]> = (all.position.into_iter()).filter(|p| p[0] < 6.0).collect();
    let before = Particles {
        velocity: vec![[0.0; 3]; kept.len()],
        id: (0..kept.len() as u32).collect(),
        position: kept,
        ..Particles::default()
    };
    // 60° from the wall's normal: beyond 48.6° the surface between water and air reflects totally.
    let eye = Eye::new(
        [4.0, 1.0, 3.0],
        [wall, 1.0, 3.0 + 2.1 * 3.0f64.sqrt()],
        300.0,
    );
    let off = |context: &Context| {
        let image = draw(context, &by_rays(eye), &uniform_sky, &scene, &before, 1);
        let p = image.aovs.p.as_ref().unwrap();
        (p.iter()).fold(0.0f64, |most, p| most.max((f64::from(p[0]) - wall).abs()))
    };
    // The plane of the wall in f32, ten metres from the origin.
    assert!(off(&context()) < 1e-5, "{}", off(&context()));
    // The surface is half a spacing beyond the last particles' centres, and the gap is 0.4 spacings
    // wide; halved for the rounding of the level set.
    let control = off(&spoiled("rays/aovs", "gap < rays.gap", "gap < 0.0"));
    assert!(control > 0.5 * 0.4 * SPACING, "{control}");
}

/// A slab over milky water, lit only by the sun: seen along its shadow, the water darkens gradually
/// from column to column, without steps at the points where the ray samples the light.
#[test]
fn a_shadow_in_water_has_no_edge_but_its_own() {
    let (min, max) = (DVec3::new(4.0, 4.0, 5.0), DVec3::new(8.0, 4.2, 10.0));
    let scene = RenderScene {
        solids: vec![box_mesh(Bounds { min, max })],
        ..pool_scene()
    };
    let eye = Eye::new([1.0, 1.0, 4.0], [9.0, 1.0, 6.0], 120.0);
    let setup = Setup {
        water: format!(
            "index = {INDEX:?}\nabsorption_per_metre = [0.02, 0.02, 0.02]\n\
             scattering_per_metre = [0.1, 0.1, 0.1]\n"
        ),
        sun: [0.0, 90.0, 1.0],
        samples: 4,
        ground: [0.0; 3],
        solids: [0.0; 3],
        ..by_rays(eye)
    };
    let steepest = |context: &Context| {
        let image = draw(context, &setup, &|_, _| [0.0; 3], &scene, &water(), 1);
        // The middle rows, whose rays meet neither the floor nor the surface before the pool's
        // side.
        let columns: Vec<f64> = (0..64)
            .map(|x| {
                (24..40)
                    .map(|y| f64::from(image.beauty[64 * y + x][0]))
                    .sum()
            })
            .collect();
        let steps = columns.windows(2).map(|w| (w[1] - w[0]).abs());
        let span = columns.iter().fold(0.0, |most: f64, c| most.max(*c))
            - columns.iter().fold(f64::MAX, |least, c| least.min(*c));
        steps.fold(0.0, f64::max) / span
    };
    let found = steepest(&context());
    let control = steepest(&spoiled(
        "rays/cast",
        "mix(start, end, own_place)",
        "0.5 * (start + end)",
    ));
    // The longest of the four segments is 7/16 of the ray, and one step where it is sampled at a
    // single point; 64 samples per column in each segment leave 1/8 of that, and the shadow's own
    // edge is as steep.
    assert!(found < 0.3 && control > 7.0 / 16.0, "{found}, {control}");
}

/// Largest relative error of the AOVs of a pool that flows at 3 m/s: depth, normal, position and
/// motion of its level surface, and thickness of the water straight down to the floor.
fn channel_error(context: &Context) -> f64 {
    let velocity = DVec3::new(1.0, 0.0, 3.0);
    let mut flowing = water();
    flowing.velocity.fill(velocity.as_vec3().to_array());
    let eye = Eye::new([1.0, 5.0, 4.0], [5.0, LEVEL, 5.0], 400.0);
    let image = draw(
        context,
        &by_rays(eye),
        &uniform_sky,
        &pool_scene(),
        &flowing,
        1,
    );
    let aovs = &image.aovs;
    let (z, n) = (aovs.z.as_ref().unwrap(), aovs.n.as_ref().unwrap());
    let (p, motion) = (aovs.p.as_ref().unwrap(), aovs.forward.as_ref().unwrap());
    let through = aovs.thickness.as_ref().unwrap();
    let mut worst = 0.0f64;
    for i in 0..z.len() {
        let along = eye.direction(i);
        let far = (LEVEL - eye.position.y) / along.y;
        let place = eye.position + far * along;
        let moved = eye.place(place + velocity / 24.0 - eye.position) - eye.place(along);
        let seen = DVec2::new(f64::from(motion[i][0]), f64::from(motion[i][1]));
        for (found, wanted) in [
            (f64::from(z[i]), far * along.dot(eye.forward())),
            (f64::from(n[i][1]), 1.0),
            (f64::from(p[i][0]), place.x),
            (f64::from(p[i][2]), place.z),
            (f64::from(through[i]), LEVEL / -along.y),
            (moved.length() + (seen - moved).length(), moved.length()),
        ] {
            worst = worst.max((found / wanted - 1.0).abs());
        }
    }
    worst
}

#[test]
fn channels_of_rays_are_those_of_a_flowing_pool() {
    // The surface is level to a thousandth of a spacing, seen from 5 m at a slope of one half.
    let error = channel_error(&context());
    assert!(error < 2e-3, "{error}");
    for (from, to) in [
        ("found.t / along, normal", "found.t, normal"),
        ("sum += found.t;", "sum += 1.01 * found.t;"),
        (
            "velocity * camera.frame_seconds",
            "velocity * 1.1 * camera.frame_seconds",
        ),
    ] {
        let control = channel_error(&spoiled("rays/aovs", from, to));
        assert!(control > 2e-3, "{to}: {control}");
    }
}
