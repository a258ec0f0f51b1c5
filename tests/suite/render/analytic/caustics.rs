//! Sunlight that waves focus on the floor: a flat pool, a corrugated pool compared with Snell's law
//! in f64, a pool at rest, and shadows.

use glam::{DVec2, DVec3};
use swell::domain::bounds::Bounds;
use swell::domain::particles::Particles;
use swell::files::parse_look;
use swell::gpu::adapter::Context;
use swell::gpu::adapter::GpuError;
use swell::render::{RenderError, RenderScene, Renderer};
use swell::scene::look::Look;

use super::geometry::box_mesh;
use super::rays::{INDEX, LEVEL, pool_scene, reflectance, refracted, water};
use super::support::{Eye, Setup, context, draw, scene, spoiled};

/// Spacing of particles, m.
const SPACING: f64 = 0.125;
/// Size of the tank, m: long, deep and narrow.
const TANK: DVec3 = DVec3::new(8.0, 5.0, 0.75);
/// Depth of still water, m.
const DEPTH: f64 = 4.0;
/// Wavelength in the tank, m: eight particles, which the level set resolves.
const WAVELENGTH: f64 = 1.0;
const NUMBER: f64 = std::f64::consts::TAU / WAVELENGTH;

fn tank() -> RenderScene {
    RenderScene {
        particle_spacing: SPACING,
        domain: Bounds {
            min: DVec3::ZERO,
            max: TANK,
        },
        ..scene(1.0, 1.0)
    }
}

/// Water up to `depth` in a box of this size, with particles displaced by `wave`, in m.
fn filled(size: DVec3, depth: f64, spacing: f64, wave: &dyn Fn(DVec3) -> DVec3) -> Particles {
    let [nx, ny, nz] = [size.x, depth, size.z].map(|length| (length / spacing).round() as usize);
    let mut particles = Particles::default();
    for k in 0..nx * ny * nz {
        let at = DVec3::new((k % nx) as f64, (k / nx % ny) as f64, (k / nx / ny) as f64);
        let at = (at + 0.5) * spacing;
        let moved = at + wave(at);
        particles.position.push(moved.as_vec3().to_array());
        particles.velocity.push([0.0; 3]);
        particles.id.push(k as u32);
    }
    particles
}

/// A tank whose surface is at `DEPTH + amplitude * cos(NUMBER * x)`.
fn corrugated(amplitude: f64) -> Particles {
    filled(TANK, DEPTH, SPACING, &|at| {
        DVec3::Y * (amplitude * (NUMBER * at.x).cos() * at.y / DEPTH)
    })
}

fn black_sky(_: DVec3, _: DVec2) -> [f64; 3] {
    [0.0; 3]
}

/// An eye under water that looks straight down at the floor.
fn diver(at: DVec3, focal: f64) -> Eye {
    Eye {
        up: DVec3::Z,
        ..Eye::new(at.to_array(), [at.x, 0.0, at.z], focal)
    }
}

/// Light on the floor under each pixel relative to that without caustics; `sun` is its azimuth and
/// elevation, degrees.
fn light(
    context: &Context,
    eye: Eye,
    sun: [f64; 2],
    caustics: &str,
    scene: &RenderScene,
    water: &Particles,
) -> Vec<f64> {
    light_beside(context, eye, sun, [caustics, ""], scene, water)
}

/// Like [`light`], with further tables of the look.
fn light_beside(
    context: &Context,
    eye: Eye,
    sun: [f64; 2],
    [caustics, more]: [&str; 2],
    scene: &RenderScene,
    water: &Particles,
) -> Vec<f64> {
    let picture = |context: &Context, caustics: &str| {
        let clear = format!("index = {INDEX:?}\nabsorption_per_metre = [0.0, 0.0, 0.0]\n");
        let setup = Setup {
            method: "ray",
            ground: [1.0; 3],
            water: format!("{clear}{caustics}"),
            sun: [sun[0], sun[1], 1.0],
            more: more.to_owned(),
            ..Setup::new(eye)
        };
        draw(context, &setup, &black_sky, scene, water, 1).beauty
    };
    let (with, without) = (
        picture(context, &format!("caustics = {{ {caustics} }}\n")),
        // A fault is compared with a picture without it.
        picture(&super::context(), ""),
    );
    let pairs = with.iter().zip(&without);
    pairs
        .map(|(a, b)| f64::from(a[1]) / f64::from(b[1]))
        .collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn deviation(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: Vec<f64> = values.iter().map(|x| (x - mean).powi(2)).collect();
    mean_root(&squares)
}

fn mean_root(squares: &[f64]) -> f64 {
    mean(squares).sqrt()
}

/// Mean light of the `rows` middle rows of pixels, in bins of `width` columns.
fn bins(light: &[f64], side: usize, rows: usize, width: usize) -> Vec<f64> {
    let first = (side - rows) / 2;
    (0..side / width)
        .map(|bin| {
            let columns = bin * width..(bin + 1) * width;
            let values: Vec<f64> = (first..first + rows)
                .flat_map(|row| columns.clone().map(move |column| row * side + column))
                .map(|i| light[i])
                .collect();
            mean(&values)
        })
        .collect()
}

/// The same from Snell's and Fresnel's laws: light that lands between the positions `edges` on the
/// floor, of rays through a surface `DEPTH + amplitude * cos(NUMBER * x)` whose normals are those
/// of waves `slope` times as high.
fn bins_by_snell(edges: &[f64], elevation: f64, amplitude: f64, slope: f64) -> Vec<f64> {
    const RAYS: usize = 400_000;
    let (sin, cos) = elevation.to_radians().sin_cos();
    let sun = DVec3::new(cos, sin, 0.0);
    let mut sums = vec![0.0; edges.len() - 1];
    let step = (TANK.x + 8.0) / RAYS as f64;
    for k in 0..RAYS {
        let x = (k as f64 + 0.5) * step - 4.0;
        let height = DEPTH + amplitude * (NUMBER * x).cos();
        let rise = -slope * amplitude * NUMBER * (NUMBER * x).sin();
        let normal = DVec3::new(-rise, 1.0, 0.0).normalize();
        let cosine = normal.dot(sun);
        let inside = (1.0 - (1.0 - cosine * cosine) / (INDEX * INDEX)).sqrt();
        let bent = -sun / INDEX + normal * (cosine / INDEX - inside);
        let lands = x + bent.x / -bent.y * height;
        // A ray's share of the beam follows from the actual slope of the surface.
        let real = -amplitude * NUMBER * (NUMBER * x).sin();
        let part = (sun.y - sun.x * real) * (1.0 - reflectance(cosine, INDEX));
        let bin = edges.partition_point(|edge| *edge <= lands);
        if bin > 0 && bin < edges.len() {
            sums[bin - 1] += part * step / (edges[bin] - edges[bin - 1]);
        }
    }
    let flat = sun.y * (1.0 - reflectance(sin, INDEX));
    sums.iter().map(|sum| sum / flat).collect()
}

/// Amplitude of waves of a given strength, m. At strength 1, 1 / ((1 − 1/n) a k²) equals the depth:
/// crests focus an overhead sun on the floor below them.
fn amplitude(strength: f64) -> f64 {
    strength / ((1.0 - 1.0 / INDEX) * NUMBER * NUMBER * DEPTH)
}

/// Amplitudes of the surface as it is rendered, m: from the heights at which rays from above meet
/// it, and from its normals.
fn drawn_amplitudes(water: &Particles) -> [f64; 2] {
    let eye = Eye {
        size: 96,
        ..diver(DVec3::new(4.0, 10.0, 0.375), 300.0)
    };
    let setup = Setup {
        method: "ray",
        ..Setup::new(eye)
    };
    let image = draw(&context(), &setup, &black_sky, &tank(), water, 1);
    let (places, normals) = (image.aovs.p.unwrap(), image.aovs.n.unwrap());
    let side = eye.size as usize;
    let row = side / 2 * side..(side / 2 + 1) * side;
    let angles: Vec<f64> = places[row.clone()]
        .iter()
        .map(|p| NUMBER * f64::from(p[0]))
        .collect();
    let heights = places[row.clone()].iter().map(|p| f64::from(p[1]));
    let falls = normals[row]
        .iter()
        .map(|n| f64::from(n[0]) / f64::from(n[1]) / NUMBER);
    [
        fitted(heights, angles.iter().map(|a| a.cos())),
        fitted(falls, angles.iter().map(|a| a.sin())),
    ]
}

/// Factor by which `waves` fit `values` best, up to a constant.
fn fitted(values: impl Iterator<Item = f64>, waves: impl Iterator<Item = f64>) -> f64 {
    let (values, waves): (Vec<f64>, Vec<f64>) = values.zip(waves).unzip();
    let (value, wave) = (mean(&values), mean(&waves));
    let pairs = values.iter().zip(&waves);
    let [across, along] = pairs.fold([0.0; 2], |[across, along], (v, w)| {
        [
            across + (v - value) * (w - wave),
            along + (w - wave) * (w - wave),
        ]
    });
    across / along
}

/// Pixels along the side of a picture of the floor, and columns in a bin.
const SIDE: u32 = 96;
const BIN: usize = 4;
/// Texels along the tank: one for each pixel, so that texels between pixels do not affect a
/// comparison.
const RESOLUTION: u32 = 256;
/// Width of the smoothing of normals, m: half a particle spacing.
const WIDTH: f64 = 0.0625;

/// Light on the floor in bins of columns under waves of a strength, as rendered and by Snell's law.
fn under_waves(context: &Context, elevation: f64, strength: f64) -> [Vec<f64>; 2] {
    let water = corrugated(amplitude(strength));
    // Light of a sun at 45° arrives from 2.5 m to the side: looks at floor that it reaches through
    // the tank's own surface.
    let middle = if elevation < 90.0 { 3.0 } else { 4.0 };
    let eye = Eye {
        size: SIDE,
        ..diver(DVec3::new(middle, 3.0, 0.375), f64::from(SIDE))
    };
    let caustics = format!("resolution = {RESOLUTION}, smoothing_width_m = {WIDTH:?}");
    let found = light(context, eye, [0.0, elevation], &caustics, &tank(), &water);
    let found = bins(&found, SIDE as usize, 12, BIN);
    // The picture's x runs from right to left: its edges from the last to the first.
    let count = SIDE as usize / BIN;
    let edges: Vec<f64> = (0..=count)
        .map(|k| middle + 3.0 * (k as f64 / count as f64 - 0.5))
        .collect();
    // Factor by which the Gaussian reduces a wave.
    let kept = (-0.5 * (NUMBER * WIDTH).powi(2)).exp();
    let [height, slope] = drawn_amplitudes(&water);
    let mut wanted = bins_by_snell(&edges, elevation, height, kept * slope / height);
    wanted.reverse();
    [found, wanted]
}

/// Error of the light under a still pool, seen from the air, relative to that without caustics; in
/// units of its tolerance.
fn flat_error(context: &Context, elevation: f64, more: &str) -> f64 {
    let target = DVec3::new(4.0, LEVEL, 5.0);
    let eye = Eye::new(
        (target + DVec3::new(-5.0, 6.0, 0.5)).to_array(),
        target.to_array(),
        90.0,
    );
    let light = light_beside(
        context,
        eye,
        [30.0, elevation],
        ["", more],
        &pool_scene(),
        &water(),
    );
    let grain = deviation(&light) / mean(&light);
    ((mean(&light) - 1.0).abs() / MEAN).max(grain / GRAIN)
}

/// Tolerances of the mean light under still water and of its grain. A lattice of particles is level
/// to a thousandth of a spacing; over eight of them and at a grazing view its bumps focus about one
/// percent of the light.
const MEAN: f64 = 0.01;
const GRAIN: f64 = 0.015;

/// For several elevations of the sun, and with a still sea around the box.
#[test]
fn still_water_has_the_light_that_it_has_without_caustics() {
    const SEA: &str = "[sea]\nlevel_m = 2.0\nband_m = 3.0\n";
    for (elevation, more) in [(90.0, ""), (45.0, ""), (20.0, ""), (45.0, SEA)] {
        let error = flat_error(&context(), elevation, more);
        assert!(error < 1.0, "{elevation}° {more}: {error}");
    }
    for (pass, from, to) in [
        (
            "rays/caustics_follow",
            "bent.part / caustics.through",
            "bent.part",
        ),
        (
            "rays/caustics_splat",
            "mix(corners[0], corners[1], at.x)",
            "corners[0]",
        ),
        (
            "rays/cast",
            "max(dot(n, caustics.sun), 0.0) / caustics.sun.y",
            "max(dot(n, caustics.sun), 0.0)",
        ),
    ] {
        let error = flat_error(&spoiled(pass, from, to), 45.0, "");
        assert!(error > 1.0, "{to}: {error}");
    }
}

/// Largest difference of the binned light from Snell's law, in units of its tolerance.
fn worst(elevation: f64, strength: f64, context: &Context) -> f64 {
    let [found, wanted] = under_waves(context, elevation, strength);
    let last = found.len() - 1;
    let off = |k: usize| {
        let allowed =
            BASE + LEAK * ((wanted[k] - wanted[k - 1]).abs() + (wanted[k] - wanted[k + 1]).abs());
        (found[k] - wanted[k]).abs() / allowed
    };
    (1..last).map(off).fold(0.0, f64::max)
}

/// The surface of a lattice of particles is not a pure wave: effect of its other harmonics on the
/// light.
const BASE: f64 = 0.04;
/// The map spreads light over two tents of texels, and the eye reads it over another: their
/// variance is 1/6 + 1/6 + 1/12, and a step between bins of four texels leaks σ / √2π of its height
/// over four into the next.
const LEAK: f64 = 0.065;

/// Bins of the floor under waves that focus light above it, on it and below it, and under a sun at
/// 45°.
#[test]
fn waves_bundle_light_as_snells_law_says() {
    for (elevation, strength) in [(90.0, 0.5), (90.0, 1.0), (90.0, 2.0), (45.0, 0.3)] {
        let off = worst(elevation, strength, &context());
        assert!(off < 1.0, "{elevation}° {strength}: {off}");
    }
    for (pass, from, to) in [
        (
            "rays/caustics_follow",
            "refract(direction, n, 1.0 / index)",
            "refract(direction, n, 0.9 / index)",
        ),
        ("rays/caustics_follow", "exp(-0.5 * far * far)", "1.0"),
        (
            "rays/caustics_follow",
            "foot - caustics.corner",
            "foot - caustics.corner + 0.1",
        ),
    ] {
        let off = worst(45.0, 0.3, &spoiled(pass, from, to));
        assert!(off > 1.0, "{to}: {off}");
    }
}

/// Error of the mean light on the floor relative to the incoming light, under steep waves and with
/// a map so coarse that rays land far apart.
fn energy_error(context: &Context) -> f64 {
    const STRENGTH: f64 = 4.0;
    let eye = Eye {
        size: SIDE,
        ..diver(DVec3::new(4.0, 3.0, 0.375), f64::from(SIDE))
    };
    let water = corrugated(amplitude(STRENGTH));
    let caustics = "resolution = 64, smoothing_width_m = 0.0625";
    let found = light(context, eye, [0.0, 90.0], caustics, &tank(), &water);
    // Three waves, and the tank's width without its sides, where a map with texels of 0.125 m reads
    // values from beyond them.
    let found = mean(&bins(&found, SIDE as usize, 12, BIN));
    let [height, slope] = drawn_amplitudes(&water);
    let wanted = bins_by_snell(&[2.5, 5.5], 90.0, height, slope / height)[0];
    (found / wanted - 1.0).abs()
}

/// Energy is conserved within 1 %.
#[test]
fn caustics_conserve_energy() {
    let error = energy_error(&context());
    assert!(error < 0.01, "{error}");
    let (from, to) = ("light * share, layer", "1.02 * light * share, layer");
    let control = energy_error(&spoiled("rays/caustics_splat", from, to));
    assert!(control > 0.01, "{control}");
}

/// Brightness of the floor from a plate's shadow into the light, relative to the light, along the
/// middle row of the picture.
fn shadow(context: &Context, eye: Eye) -> Vec<f64> {
    let plate = box_mesh(Bounds {
        min: DVec3::new(EDGE, 1.4, -10.0),
        max: DVec3::new(20.0, 1.5, 10.0),
    });
    let scene = RenderScene {
        solids: vec![plate],
        ..tank()
    };
    let setup = Setup {
        method: "ray",
        ground: [1.0; 3],
        water: format!(
            "index = {INDEX:?}\nabsorption_per_metre = [0.0, 0.0, 0.0]\n\
             caustics = {{ resolution = 512 }}\n"
        ),
        sun: [0.0, 45.0, 1.0],
        ..Setup::new(eye)
    };
    let image = draw(context, &setup, &black_sky, &scene, &corrugated(0.0), 1);
    let side = eye.size as usize;
    let row = &image.beauty[side / 2 * side..][..side];
    // White in full sunlight.
    let lit = row.iter().fold(1e-6f32, |most, p| p[1].max(most));
    row.iter().map(|p| f64::from(p[1] / lit)).collect()
}

/// Relative to the brightest pixel: bumps of the still surface change the light by about one
/// percent.
const LIT: f64 = 0.97;
/// Edge of the plate, m along x.
const EDGE: f64 = 4.0;

/// Distance between the edge of the floor's shadow and where Snell's law puts it, m.
fn shadow_error(context: &Context) -> f64 {
    let eye = Eye {
        size: SIDE,
        ..diver(DVec3::new(3.0, 1.3, 0.375), f64::from(SIDE))
    };
    let seen = shadow(context, eye);
    let width = 1.3 / f64::from(SIDE);
    // x runs from right to left, and small x is in the light.
    let edge = 3.0 - 0.65 + seen.iter().sum::<f64>() * width;
    let sun = -refracted(DVec3::new(-1.0, -1.0, 0.0).normalize(), INDEX);
    (edge - (EDGE - sun.x / sun.y * 1.5)).abs()
}

/// Within a texel, 16 mm. The plate that casts the shadow is itself fully lit and does not shadow
/// itself.
#[test]
fn what_stands_under_water_throws_its_shadow_as_snell_says() {
    let error = shadow_error(&context());
    assert!(error < 0.016, "{error}");
    let above = Eye {
        size: SIDE,
        ..diver(DVec3::new(5.0, 3.0, 0.375), f64::from(SIDE))
    };
    let least = |context: &Context| {
        let seen = shadow(context, above);
        seen.iter().fold(1.0, |least, x| x.min(least))
    };
    assert!(least(&context()) > LIT, "{}", least(&context()));
    // Controls: light that falls on the plate appears on the floor below it, and a plate shadows
    // itself.
    let control = shadow_error(&spoiled(
        "rays/cast",
        "select(0u, 1u, opaque_along",
        "select(0u, 0u, opaque_along",
    ));
    assert!(control > 0.016, "{control}");
    let control = least(&spoiled("rays/cast", "p + 4e-3 *", "p - 4e-3 *"));
    assert!(control < LIT, "{control}");
}

/// Standard deviation over mean of the light under a pool at rest with randomly displaced
/// particles: false caustics of their bumps, ten spacings below. `width` sets the smoothing.
fn grain(width: &str) -> f64 {
    let size = DVec3::new(4.0, 2.0, 4.0);
    let rest = RenderScene {
        domain: Bounds {
            min: DVec3::ZERO,
            max: size,
        },
        ..tank()
    };
    let chance = |x: f64| (x.sin() * 43_758.545).rem_euclid(1.0) - 0.5;
    let water = filled(size, 10.0 * SPACING, SPACING, &|at| {
        let key = at.dot(DVec3::new(12.9898, 78.233, 37.719)) / SPACING;
        let by = DVec3::new(chance(key), chance(key + 1.0), chance(key + 2.0));
        by * DVec3::new(0.4, 0.1, 0.4) * SPACING
    });
    let eye = diver(DVec3::new(2.0, 1.0, 2.0), 64.0);
    let caustics = format!("resolution = 256{width}");
    let light = light(&context(), eye, [30.0, 60.0], &caustics, &rest, &water);
    deviation(&light) / mean(&light)
}

#[test]
fn bumps_of_particles_at_rest_hardly_bundle_light() {
    let (smooth, rough) = (grain(""), grain(", smoothing_width_m = 0.0"));
    assert!(smooth < 0.05, "{smooth}");
    assert!(rough > 0.1, "the control: {rough}");
}

fn look(water: &str, method: &str) -> Result<Look, String> {
    let text = format!(
        "[camera]\nfocal_length_mm = 35.0\nfilm_back_mm = [36.0, 36.0]\n\
         position = [0.0, 3.0, 0.0]\ntarget = [1.0, 0.0, 1.0]\n\
         [image]\nwidth = 64\nheight = 64\n[renderer]\nmethod = \"{method}\"\n[water]\n{water}\n\
         [sky]\nmodel = \"hosek_wilkie\"\n"
    );
    parse_look(&text, std::path::Path::new("look.toml")).map_err(|error| error.to_string())
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    for (water, method, words) in [
        ("caustics = {}", "ssfr", "water.caustics"),
        (
            "caustics = { resolution = 8 }",
            "ray",
            "water.caustics.resolution",
        ),
        (
            "caustics = { resolution = 100000 }",
            "ray",
            "water.caustics.resolution",
        ),
        (
            "caustics = { smoothing_width_m = -1.0 }",
            "ray",
            "water.caustics.smoothing_width_m",
        ),
        ("caustics = { photons = 3 }", "ray", "photons"),
        ("caustics = true", "ray", "water.caustics"),
    ] {
        let error = look(water, method).unwrap_err();
        assert!(error.contains(words), "{water}: {error}");
    }
    // A map that exceeds the adapter's binding limit.
    let large = look("caustics = { resolution = 8192 }", "ray").unwrap();
    let mut context = context();
    context.limits.max_storage_buffer_binding_size = 128 << 20;
    match Renderer::new(&context, &large, &pool_scene()).err() {
        Some(RenderError::Gpu(GpuError::TooLarge {
            needed, allowed, ..
        })) => {
            assert!(needed > allowed, "{needed} {allowed}");
        }
        other => panic!("{other:?}"),
    }
    let small = look("caustics = { resolution = 256 }", "ray").unwrap();
    assert!(Renderer::new(&context, &small, &pool_scene()).is_ok());
}

#[test]
fn only_a_look_with_caustics_has_their_passes_and_buffers() {
    let plan = |water: &str| {
        let look = look(water, "ray").unwrap();
        Renderer::new(&context(), &look, &pool_scene())
            .unwrap()
            .plan()
            .clone()
    };
    let (plain, lit) = (plan(""), plan("caustics = {}"));
    let new: Vec<&str> = lit
        .passes()
        .into_keys()
        .filter(|pass| !plain.passes().contains_key(pass))
        .collect();
    assert_eq!(
        new,
        [
            "rays/caustics_enter",
            "rays/caustics_follow",
            "rays/caustics_map",
            "rays/caustics_splat"
        ]
    );
    let named = |plan: &swell::render::Plan, name: &str| {
        let found = plan.buffers.iter().find(|buffer| buffer.name == name);
        found.map(|buffer| buffer.bytes)
    };
    for buffer in ["caustics", "sun_rays", "sun_hits", "light_sums"] {
        assert_eq!(named(&plain, buffer), None, "{buffer}");
        assert!(named(&lit, buffer).is_some(), "{buffer}");
    }
    assert!(named(&lit, "sun_paths") > named(&plain, "sun_paths"));
}
