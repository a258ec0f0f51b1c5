//! Illumination of the set: sky, sun, shadows and haze.

use std::f64::consts::{PI, TAU};
use swell::files::parse_look;

use glam::{DMat3, DVec2, DVec3};
use swell::domain::bounds::Bounds;
use swell::domain::mesh::TriangleMesh;
use swell::domain::particles::Particles;
use swell::gpu::adapter::Context;
use swell::render::{Image, RenderError, RenderScene, Renderer};

use super::geometry::{box_mesh, enter};
use super::support::{
    Eye, PANORAMA, RAMP_ERROR, Setup, context, draw, luminance, ramp_sky, scene, sky_place,
    spoiled, uniform_sky, wide,
};

fn dry() -> Particles {
    Particles::default()
}

fn black_sky(_: DVec3, _: DVec2) -> [f64; 3] {
    [0.0; 3]
}

#[test]
fn the_sky_is_where_its_panorama_says() {
    let eye = Eye::new([5.0, 2.0, 5.0], [7.0, 4.5, 8.0], 60.0);
    let setup = Setup {
        sky: format!("{PANORAMA}rotate_degrees = 22.5\nintensity = 0.5\n"),
        ..Setup::new(eye)
    };
    let image = draw(&context(), &setup, &ramp_sky, &scene(1.0, 1.0), &dry(), 1);
    let worst = |turned: f64| {
        (0..64 * 64)
            .map(|i| {
                let place = sky_place(eye.direction(i));
                let u = (place.x - turned / 360.0).rem_euclid(1.0);
                let [r, g, b, _] = image.beauty[i].map(f64::from);
                let off = [r - 0.5 * u, g - 0.5 * place.y, b - 0.5];
                off.map(f64::abs).into_iter().fold(0.0, f64::max)
            })
            .fold(0.0, f64::max)
    };
    // A sixteenth of a turn is 16 of its 256 texels.
    assert!(worst(22.5) < RAMP_ERROR, "{}", worst(22.5));
    for turned in [-22.5, 22.5 - 360.0 / 256.0] {
        let control = worst(turned);
        assert!(control > 2.0 * RAMP_ERROR, "{turned}: {control}");
    }
}

/// A sky of 64 × 31 or of 64 × 64 pixels is not a latitude-longitude picture; one of 64 × 32, the
/// control, is.
#[test]
fn a_panorama_that_is_not_twice_as_wide_as_high_is_refused() {
    let setup = Setup::new(Eye::new([5.0, 2.0, 5.0], [7.0, 4.5, 8.0], 60.0));
    let fault = |height: usize| {
        let folder = tempfile::tempdir().unwrap();
        let white = (1.0f32, 1.0f32, 1.0f32);
        let file = folder.path().join("sky.exr");
        exr::prelude::write_rgb_file(file, 64, height, |_, _| white).unwrap();
        let look = parse_look(&setup.text(), &folder.path().join("look.toml")).unwrap();
        Renderer::new(&context(), &look, &scene(1.0, 1.0)).err()
    };
    for height in [31, 64] {
        let fault = fault(height);
        let told = format!("is 64 × {height} pixels");
        assert!(
            matches!(&fault, Some(RenderError::Panorama(why)) if why.contains(&told)),
            "{fault:?}"
        );
    }
    assert!(fault(32).is_none());
}

const CENTRE: DVec3 = DVec3::new(5.0, 5.0, 5.0);

/// A ball of flat faces on which only the normal determines the illumination: it is too high to be
/// darkened by its surroundings.
fn faceted() -> TriangleMesh {
    let (columns, rows) = (24u32, 12u32);
    let at = |column: u32, row: u32| {
        let azimuth = f64::from(column % columns) / f64::from(columns) * TAU;
        let polar = f64::from(row) / f64::from(rows) * PI;
        CENTRE
            + DVec3::new(
                polar.sin() * azimuth.cos(),
                polar.cos(),
                polar.sin() * azimuth.sin(),
            )
    };
    let mut mesh = TriangleMesh {
        vertices: Vec::new(),
        triangles: Vec::new(),
    };
    for row in 0..rows {
        for column in 0..columns {
            let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[c, r]| at(column + c, row + r));
            let first = mesh.vertices.len() as u32;
            mesh.vertices.extend(corners);
            mesh.triangles
                .extend([[0, 1, 2], [0, 2, 3]].map(|t| t.map(|k| first + k)));
        }
    }
    mesh
}

fn lit_ball(context: &Context, setup: &Setup, sky: &dyn Fn(DVec3, DVec2) -> [f64; 3]) -> Image {
    let scene = RenderScene {
        solids: vec![faceted()],
        ..scene(1.0, 1.0)
    };
    draw(context, setup, sky, &scene, &dry(), 1)
}

/// Pixels of the ball, with the normal there.
fn faces(image: &Image) -> impl Iterator<Item = (usize, DVec3)> + '_ {
    let (p, n) = (
        image.aovs.p.as_ref().unwrap(),
        image.aovs.n.as_ref().unwrap(),
    );
    (0..p.len())
        .filter(|&i| (wide(p[i]) - CENTRE).length() < 1.01)
        .map(|i| (i, wide(n[i])))
}

/// Coefficients of the radiance 1 + b·d + d·Q d, one set per channel; nowhere negative.
const LINEAR: [DVec3; 3] = [
    DVec3::new(0.8, 0.1, -0.1),
    DVec3::new(0.0, 0.5, 0.1),
    DVec3::new(0.1, -0.1, 0.5),
];
const SQUARE: [DMat3; 3] = [
    DMat3::ZERO,
    DMat3::from_cols_array(&[0.4, 0.5, 0.0, 0.5, -0.3, 0.4, 0.0, 0.4, 0.1]),
    DMat3::from_cols_array(&[-0.3, 0.0, -0.5, 0.0, 0.2, 0.1, -0.5, 0.1, 0.6]),
];

fn lobed_sky(d: DVec3, _: DVec2) -> [f64; 3] {
    [0, 1, 2].map(|c: usize| 1.0 + LINEAR[c].dot(d) + d.dot(SQUARE[c] * d))
}

/// Largest error of the irradiance over π on a ball's faces. The integral of (n·d)⁺ times 1, d and
/// d dᵀ − 1/3 over all directions is π, 2π/3 n and π/4 (n nᵀ − 1/3).
fn irradiance_error(context: &Context) -> f64 {
    let mut worst = 0.0f64;
    // From above and from below, so that every side is seen.
    for (position, up) in [([8.0, 7.0, 9.0], 1.0), ([1.5, 3.0, 2.0], -1.0)] {
        let eye = Eye {
            up: DVec3::Y * up,
            ..Eye::new(position, CENTRE.to_array(), 110.0)
        };
        let image = lit_ball(context, &Setup::new(eye), &lobed_sky);
        let mut count = 0;
        for (i, n) in faces(&image) {
            count += 1;
            for c in 0..3 {
                let (b, q) = (LINEAR[c], SQUARE[c]);
                let trace = q.x_axis.x + q.y_axis.y + q.z_axis.z;
                let expected =
                    1.0 + 2.0 / 3.0 * b.dot(n) + trace / 3.0 + (n.dot(q * n) - trace / 3.0) / 4.0;
                worst = worst.max((f64::from(image.beauty[i][c]) - expected).abs());
            }
        }
        assert!(count > 500, "{count}");
    }
    worst
}

#[test]
fn a_face_is_lit_by_the_side_of_the_sky_that_it_looks_at() {
    // The midpoint rule over 128 rows is off by (π/128)²/24 of the sum, and the constants of the
    // harmonics have six digits: 1e-4 covers both.
    let error = irradiance_error(&context());
    assert!(error < 1e-4, "{error}");
    // Controls: swapped axes, and 1 % of one term.
    for (from, to) in [
        (
            "(*c)[1].rgb * n.y + (*c)[2].rgb * n.z",
            "(*c)[1].rgb * n.z + (*c)[2].rgb * n.y",
        ),
        ("(*c)[3].rgb * n.x", "(*c)[3].rgb * n.x * 1.01"),
        ("(3.0 * n.z * n.z - 1.0)", "(3.0 * n.z * n.z - 1.0) * 1.01"),
        ("(n.x * n.z)", "(n.x * n.z) * 1.01"),
    ] {
        let control = irradiance_error(&spoiled("ssfr/shade", from, to));
        assert!(control > 2e-4, "{to}: {control}");
    }
}

/// Direction to the sun by azimuth and elevation, degrees: azimuth 0° is +x, 90° is +z.
fn to_sun([azimuth, elevation]: [f64; 2]) -> DVec3 {
    let [azimuth, elevation] = [azimuth, elevation].map(f64::to_radians);
    DVec3::new(
        elevation.cos() * azimuth.cos(),
        elevation.sin(),
        elevation.cos() * azimuth.sin(),
    )
}

/// White paint that faces a sun at 45° through the reference air: 0.82 of the unit of light is the
/// sun's on a horizontal face.
const FACING_SUN: f64 = 0.82 * std::f64::consts::SQRT_2;

/// Largest relative error of sunlight on a ball's faces, for a sun at the azimuth and elevation
/// `law`.
fn sun_error(image: &Image, law: [f64; 2]) -> f64 {
    let mut worst = 0.0f64;
    let mut lit = 0;
    for (i, n) in faces(image) {
        let cosine = n.dot(to_sun(law));
        // Faces near the terminator may be in the shadow of their neighbours.
        if cosine > 0.3 {
            lit += 1;
            let expected = FACING_SUN * cosine;
            worst = worst.max((luminance(image.beauty[i]) / expected - 1.0).abs());
        } else if cosine < 0.0 {
            worst = worst.max(luminance(image.beauty[i]));
        }
    }
    assert!(lit > 200, "{lit}");
    worst
}

#[test]
fn sunlight_falls_from_its_azimuth_and_elevation_with_the_unit_of_light() {
    let eye = Eye::new([1.0, 7.0, 9.0], CENTRE.to_array(), 110.0);
    let setup = Setup {
        sun: [130.0, 45.0, 1.0],
        ..Setup::new(eye)
    };
    let image = lit_ball(&context(), &setup, &black_sky);
    // A few roundings of f32.
    let error = sun_error(&image, [130.0, 45.0]);
    assert!(error < 2e-5, "{error}");
    for other in [[-130.0, 45.0], [130.0, 45.45], [131.3, 45.0]] {
        let control = sun_error(&image, other);
        assert!(control > 1e-3, "{other:?}: {control}");
    }
}

/// Number of ground pixels that are lit where a block's shadow must be, or dark where none may be,
/// and the numbers of pixels that must be in shadow and in the light.
fn shadow_faults(context: &Context) -> (usize, [usize; 2]) {
    let sun = [30.0, 45.0];
    let block = Bounds {
        min: DVec3::new(5.0, 0.0, 4.0),
        max: DVec3::new(6.0, 2.0, 6.0),
    };
    let eye = Eye {
        up: DVec3::Z,
        ..Eye::new([4.5, 14.0, 5.0], [4.5, 0.0, 5.0], 112.0)
    };
    let setup = Setup {
        sun: [sun[0], sun[1], 1.0],
        ground: [1.0; 3],
        ..Setup::new(eye)
    };
    let scene = RenderScene {
        solids: vec![box_mesh(block)],
        ..scene(1.0, 1.0)
    };
    let image = draw(context, &setup, &black_sky, &scene, &dry(), 1);
    let towards = to_sun(sun);
    // The shadow is looked up 4 cm above the ground, over four texels of less than a centimetre.
    let margin = DVec3::splat(0.06);
    let grown = Bounds {
        min: block.min - margin,
        max: block.max + margin,
    };
    let shrunk = Bounds {
        min: block.min + margin,
        max: block.max - margin,
    };
    let (mut faults, mut seen) = (0, [0; 2]);
    for (i, &p) in image.aovs.p.as_ref().unwrap().iter().enumerate() {
        let p = wide(p);
        if p.y.abs() > 1e-3 {
            continue;
        }
        let value = luminance(image.beauty[i]) / 0.82;
        if enter(p, towards, shrunk).is_some() {
            seen[0] += 1;
            faults += usize::from(value > 1e-4);
        } else if enter(p, towards, grown).is_none() {
            seen[1] += 1;
            faults += usize::from((value - 1.0).abs() > 1e-4);
        }
    }
    (faults, seen)
}

#[test]
fn a_shadow_lies_where_the_block_hides_the_sun() {
    let (faults, seen) = shadow_faults(&context());
    assert!(seen[0] > 150 && seen[1] > 1500, "{seen:?}");
    assert_eq!(faults, 0);
    for (from, to) in [
        ("0.5 - 0.5 * p.y", "0.5 + 0.5 * p.y"),
        ("0.5 * p.x + 0.5", "0.5 * p.x + 0.51"),
    ] {
        let (faults, _) = shadow_faults(&spoiled("ssfr/shade", from, to));
        assert!(faults > 5, "{to}: {faults}");
    }
}

/// Radiance of the sun's disc and the solid angle that it covers in the picture.
fn disc(context: &Context) -> (f64, f64) {
    let towards = to_sun([20.0, 45.0]);
    let position = DVec3::new(5.0, 2.0, 5.0);
    let eye = Eye {
        size: 192,
        // 192 pixels over 0.72°.
        ..Eye::new(
            position.to_array(),
            (position + 10.0 * towards).to_array(),
            15279.0,
        )
    };
    let setup = Setup {
        sun: [20.0, 45.0, 0.1],
        sky: "model = \"hosek_wilkie\"\nturbidity = 3.0\n".to_owned(),
        ..Setup::new(eye)
    };
    let image = draw(context, &setup, &black_sky, &scene(1.0, 1.0), &dry(), 1);
    let values: Vec<f64> = image.beauty.iter().map(|&c| luminance(c)).collect();
    let most = values.iter().copied().fold(0.0, f64::max);
    let bright = values.iter().filter(|&&value| value > 0.5 * most).count();
    (most, bright as f64 / eye.focal.powi(2))
}

#[test]
fn the_suns_disc_holds_its_irradiance() {
    let (radiance, covered) = disc(&context());
    // The sun has an angular diameter of 0.5331° at mean distance.
    let angle = PI * (0.5 * 0.5331f64).to_radians().powi(2);
    // A circle with a radius of 71 pixels has its area's number of pixels to 0.3 %; 1 − cos of so
    // small an angle is known to 6e-8/1.08e-5 in f32.
    assert!(
        (covered / angle - 1.0).abs() < 9e-3,
        "{covered} for {angle}"
    );
    // The sky beside it adds a few 1e-3 to a sun that is dimmed to a tenth.
    let irradiance = 0.1 * FACING_SUN * PI;
    let error = radiance * angle / irradiance - 1.0;
    assert!((0.0..6e-3).contains(&error), "{error}");
}

#[test]
fn haze_grows_exponentially_with_the_distance() {
    let eye = Eye::new([5.0, 4.0, 5.0], [9.0, 1.0, 6.0], 48.0);
    let setup = Setup {
        haze: 8.0,
        ..Setup::new(eye)
    };
    let image = draw(
        &context(),
        &setup,
        &uniform_sky,
        &scene(1.0, 1.0),
        &dry(),
        1,
    );
    // Largest error of a black ground under a sky of radiance 1.
    let worst = |haze: f64| {
        (0..64 * 64)
            .filter(|&i| eye.direction(i).y < -0.05)
            .map(|i| {
                let far = -4.0 / eye.direction(i).y;
                // Haze of optical depth far/haze adds that fraction of the sky's radiance.
                let expected = 1.0 - (-far / haze).exp();
                (f64::from(image.beauty[i][1]) - expected).abs()
            })
            .fold(0.0, f64::max)
    };
    // The distance along a ray that meets the ground at 3° amplifies rounding twentyfold: 20 ×
    // 6e-8, times a few roundings.
    assert!(worst(8.0) < 1e-5, "{}", worst(8.0));
    assert!(worst(8.08) > 1e-3, "{}", worst(8.08));
}

/// The largest relative change between adjacent rows, a twentieth of a degree apart, from ground
/// lost in haze to the sky above it.
fn horizon_step(context: &Context) -> f64 {
    let eye = Eye::new([5.0, 5.0, 5.0], [6.0, 5.0, 5.0], 1146.0);
    let setup = Setup {
        sun: [90.0, 45.0, 1.0],
        sky: "model = \"hosek_wilkie\"\n".to_owned(),
        ground: [0.34, 0.31, 0.27],
        haze: 200.0,
        ..Setup::new(eye)
    };
    let image = draw(context, &setup, &uniform_sky, &scene(0.1, 1.0), &dry(), 1);
    let side = eye.size as usize;
    let column: Vec<f64> = (0..side)
        .map(|row| luminance(image.beauty[row * side + side / 2]))
        .collect();
    let changes = column
        .windows(2)
        .map(|pair| (pair[1] / pair[0] - 1.0).abs());
    changes.fold(0.0, f64::max)
}

/// No line and no band where ground and sky meet: haze converges to the sky's colour there.
#[test]
fn the_horizon_has_no_line() {
    let step = horizon_step(&context());
    // Slope of the haze itself: from a height of five metres the ground at 1.6° is 180 m away, and
    // one row changes that by 3 %.
    assert!(step < 0.02, "{step}");
    let (from, to) = (
        "vec3f(level.x, 0.0, level.z)",
        "vec3f(level.x, 0.1, level.z)",
    );
    let control = horizon_step(&spoiled("ssfr/shade", from, to));
    assert!(control > 0.02, "{control}");
}

/// Numbers of pixels of a wall that are dark where no glass should be or bright where some should,
/// and of pixels that should be glass. Pixels near an edge are left out.
fn window_faults(context: &Context, windows: &str) -> [usize; 2] {
    const WALL: Bounds = Bounds {
        min: DVec3::new(0.0, 0.0, 8.0),
        max: DVec3::new(10.0, 9.0, 9.0),
    };
    let (storey, bay) = (2.0, 1.6);
    let eye = Eye::new([5.0, 4.0, 4.0], [5.2, 4.3, 8.0], 40.0);
    let setup = Setup {
        more: windows.to_owned(),
        ..Setup::new(eye)
    };
    let scene = RenderScene {
        solids: vec![box_mesh(WALL)],
        ..scene(1.0, 1.0)
    };
    let image = draw(context, &setup, &uniform_sky, &scene, &dry(), 1);
    let mut counts = [0; 2];
    for i in 0..64 * 64 {
        let along = eye.direction(i);
        let Some((far, _)) = enter(eye.position, along, WALL) else {
            continue;
        };
        let p = eye.position + far * along;
        // Distance to the edge of the middle 0.55 of a bay and 0.6 of a storey, positive inside.
        let inside = |x: f64, part: f64| 0.5 * part - (x.rem_euclid(1.0) - 0.5).abs();
        let inside = [inside(p.x / bay, 0.55), inside(p.y / storey, 0.6)];
        // An edge is smoothed over half a pixel to each side; a pixel is 1 / focal of the distance
        // wide, and on a face seen at an angle of up to 40° half as much again.
        let blur = 0.5 * 1.5 * far / eye.focal / bay;
        // Below a tenth of the domain's height walls see less of the sky.
        if p.y < 1.0 || inside.iter().any(|edge| edge.abs() < blur) {
            continue;
        }
        let is_glass = inside.iter().all(|edge| *edge > 0.0);
        // The wall is white. Glass reflects 0.06 of the light diffusely and mirrors 0.04 to 0.1 of
        // the sky.
        counts[0] += usize::from((luminance(image.beauty[i]) < 0.5) != is_glass);
        counts[1] += usize::from(is_glass);
    }
    counts
}

#[test]
fn windows_stand_in_their_bays_and_storeys() {
    let windows = "[solids.windows]\nstorey_m = 2.0\nbay_m = 1.6\n";
    let [faults, glass] = window_faults(&context(), windows);
    assert!(glass > 400, "{glass}");
    assert_eq!(faults, 0);
    // Controls: wider bays, and no windows.
    let wider = windows.replace("1.6", "1.7");
    for other in [&wider[..], ""] {
        let [faults, _] = window_faults(&context(), other);
        assert!(faults > glass / 4, "{other}: {faults} of {glass}");
    }
}
