//! Solids under a film of water: darker by the light that the film traps, and as bright as it
//! mirrors, by both methods.

use std::{path::Path, sync::Arc};

use glam::DVec3;
use swell::{
    domain::{
        mesh::TriangleMesh,
        mesh_file::{MeshFormat, parts::MeshParts},
        particles::Particles,
        pose::Pose,
        wet::RefinedSurface,
    },
    gpu::adapter::Context,
    render::{Image, RenderScene, SolidParts, WetSolids},
};

use super::{
    rays::{pool_scene, reflectance, water},
    support::{Eye, Setup, context, draw, scene, spoiled, uniform_sky},
};

/// Methods, and the pass of each that shades solids where there is no water.
const METHODS: [(&str, &str); 2] = [("ssfr", "ssfr/shade_dry"), ("ray", "rays/cast")];

const INDEX: f64 = 1.333;
/// Reflectance of the dry material.
const ALBEDO: f64 = 0.4;
/// Relative error of radiances: sums of some tens of terms in single precision, irradiance from
/// spherical harmonics of half-precision texels, and positions within a pixel at single precision.
const ERROR: f64 = 1e-3;
/// Largest error of a wetness, which is stored in a byte.
const BYTE: f64 = 0.5 / 255.0;

/// Centre of the face, half its width, and the distance of the eye, m.
const MIDDLE: DVec3 = DVec3::new(5.0, 5.0, 5.0);
const HALF: f64 = 4.0;
const AWAY: f64 = 4.0;

/// Diffuse reflectance from air (Duntley 1942), in closed form.
fn diffuse_reflectance(n: f64) -> f64 {
    let (n2, n4) = (n * n, n.powi(4));
    0.5 + (n - 1.0) * (3.0 * n + 1.0) / (6.0 * (n + 1.0).powi(2))
        + n2 * (n2 - 1.0).powi(2) / (n2 + 1.0).powi(3) * ((n - 1.0) / (n + 1.0)).ln()
        - 2.0 * n.powi(3) * (n2 + 2.0 * n - 1.0) / ((n2 + 1.0) * (n4 - 1.0))
        + 8.0 * n4 * (n4 + 1.0) / ((n2 + 1.0) * (n4 - 1.0).powi(2)) * n.ln()
}

/// Reflectance below the film's surface per n², with the light that it traps.
fn trapped(albedo: f64) -> f64 {
    let n2 = INDEX * INDEX;
    let from_below = 1.0 - (1.0 - diffuse_reflectance(INDEX)) / n2;
    albedo / (n2 * (1.0 - from_below * albedo))
}

/// Radiance under a sky of radiance 1 of the wet material, seen at a cosine.
fn wet_radiance(cosine: f64) -> f64 {
    rough_radiance(cosine, 0.0)
}

/// The same under a film of this root mean square slope.
fn rough_radiance(cosine: f64, slope: f64) -> f64 {
    let square = cosine * cosine;
    let facets = (square + 0.5 * slope * slope * (1.0 - square)).sqrt();
    let mirrored = reflectance(facets, INDEX);
    trapped(ALBEDO) * (1.0 - diffuse_reflectance(INDEX)) * (1.0 - mirrored) + mirrored
}

/// A square that faces +z, of triangles refined to edges of `edge` m, with the wetness `of` its
/// vertices.
fn wall(edge: f64, of: &dyn Fn(DVec3) -> f32) -> RenderScene {
    let mut text = String::from("o face\n");
    for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
        let p = MIDDLE + HALF * DVec3::new(x, y, 0.0);
        text += &format!(
            "v {} {} {}\nvt {} {}\n",
            p.x,
            p.y,
            p.z,
            0.5 + 0.5 * x,
            0.5 + 0.5 * y
        );
    }
    text += "g left\nusemtl one\nf 1/1 2/2 3/3 4/4\n";
    let (bytes, file) = (text.as_bytes(), Path::new("face.obj"));
    let mesh = TriangleMesh::from_bytes(bytes, MeshFormat::Obj, file).unwrap();
    RenderScene {
        wet: Some(wet_of(&mesh, edge, of)),
        solids: vec![mesh],
        parts: vec![SolidParts {
            name: "face".to_owned(),
            parts: MeshParts::from_bytes(bytes, MeshFormat::Obj, file).unwrap(),
            pose: Pose::START,
        }],
        ..scene(1.0, 1.0)
    }
}

fn wet_of(mesh: &TriangleMesh, edge: f64, of: &dyn Fn(DVec3) -> f32) -> WetSolids {
    let surface = RefinedSurface::of(mesh, edge, 1 << 20).unwrap();
    let vertices = surface.vertices(&mesh.vertices);
    WetSolids {
        wetness: vertices.into_iter().map(of).collect(),
        surfaces: Arc::new(vec![surface]),
    }
}

fn eye() -> Eye {
    Eye::new(
        (MIDDLE + AWAY * DVec3::Z).to_array(),
        MIDDLE.to_array(),
        40.0,
    )
}

const WET: &str = "[wet]\nroughness = 0.002\n";

fn setup(method: &'static str, more: &str) -> Setup {
    Setup {
        method,
        water: format!("index = {INDEX:?}\n"),
        solids: [ALBEDO; 3],
        more: more.to_owned(),
        ..Setup::new(eye())
    }
}

fn picture(context: &Context, setup: &Setup, scene: &RenderScene) -> Image {
    draw(
        context,
        setup,
        &uniform_sky,
        scene,
        &Particles::default(),
        1,
    )
}

/// Largest difference of a picture to the expected radiance of each pixel, given the cosine of its
/// line of sight and its position on the wall.
fn error(image: &Image, expected: &dyn Fn(f64, DVec3) -> f64) -> f64 {
    let eye = eye();
    let of = |(i, pixel): (usize, &[f32; 4])| {
        let along = eye.direction(i);
        let place = eye.position + along * (AWAY / -along.z);
        (f64::from(pixel[0]) - expected(-along.z, place)).abs()
    };
    image.beauty.iter().enumerate().map(of).fold(0.0, f64::max)
}

#[test]
fn a_wet_wall_is_darker_by_what_its_film_traps_and_mirrors_the_sky() {
    let mixed = |wetness: f64| {
        move |cosine: f64, _: DVec3| (1.0 - wetness) * ALBEDO + wetness * wet_radiance(cosine)
    };
    // Ångström's factor at normal incidence, as published for water: about 0.6 for this material.
    let factor = (wet_radiance(1.0) - reflectance(1.0, INDEX)) / ALBEDO;
    assert!((0.55..0.7).contains(&factor), "{factor}");
    for (method, pass) in METHODS {
        let draw = |context: &Context, wetness: f32| {
            picture(context, &setup(method, WET), &wall(1.0, &|_| wetness))
        };
        for wetness in [0.0f32, 0.2, 1.0] {
            let image = draw(&context(), wetness);
            let found = error(&image, &mixed(wetness.into()));
            assert!(found < ERROR, "{method} {wetness}: {found}");
            // Control: the same picture against a wetness that is off by a tenth.
            let off = error(&image, &mixed((f64::from(wetness) - 0.1).abs()));
            assert!(off > 10.0 * ERROR, "{method} {wetness}: {off}");
        }
        // Controls: without the light that is trapped, and without the mirror.
        for (from, to) in [
            ("1.0 - trapped * albedo", "1.0 - 0.0 * albedo"),
            ("mirror * sky_seen", "0.0 * sky_seen"),
            ("clamp(dot(corners,", "0.5 * clamp(dot(corners,"),
        ] {
            let image = draw(&spoiled(pass, from, to), 1.0);
            let found = error(&image, &mixed(1.0));
            assert!(found > 10.0 * ERROR, "{method} {from}: {found}");
        }
    }
}

/// A wetness that rises along the wall is linear between vertices.
#[test]
fn wetness_is_linear_between_vertices() {
    let share = |p: DVec3| (p.x - MIDDLE.x + HALF) / (2.0 * HALF);
    for (method, _) in METHODS {
        for edge in [100.0, 0.7] {
            let scene = wall(edge, &|p| share(p) as f32);
            let image = picture(&context(), &setup(method, WET), &scene);
            let expected = |cosine: f64, p: DVec3| {
                let wetness = share(p);
                (1.0 - wetness) * ALBEDO + wetness * wet_radiance(cosine)
            };
            let found = error(&image, &expected);
            assert!(found < ERROR + BYTE, "{method} {edge}: {found}");
            let mirrored = |cosine: f64, p: DVec3| expected(cosine, 2.0 * MIDDLE - p);
            assert!(error(&image, &mirrored) > 10.0 * ERROR, "control");
        }
    }
}

/// Sunlight that enters the film, with the sun's own reflection far outside of the picture.
#[test]
fn the_sun_enters_the_film_by_its_angle() {
    for (method, _) in METHODS {
        let of = |more: &str, wetness: f32| {
            let lit = Setup {
                // The sun is 60° above the horizon and in front of the wall.
                sun: [90.0, 60.0, 1.0],
                ..setup(method, more)
            };
            picture(&context(), &lit, &wall(1.0, &|_| wetness))
        };
        let dry = of("", 0.0);
        let wet = of(WET, 1.0);
        let cosine = 60f64.to_radians().cos();
        let entering = 1.0 - reflectance(cosine, INDEX);
        for (i, (dry, wet)) in dry.beauty.iter().zip(&wet.beauty).enumerate() {
            let seen = -eye().direction(i).z;
            // Dry paint measures the sun's irradiance over π.
            let sun = f64::from(dry[0]) / ALBEDO - 1.0;
            assert!(sun > 0.1, "{sun}");
            let own = trapped(ALBEDO) * (1.0 - reflectance(seen, INDEX)) * entering * sun;
            let expected = wet_radiance(seen) + own;
            assert!(
                (f64::from(wet[0]) - expected).abs() < ERROR,
                "{method} {i}: {wet:?} {expected}"
            );
            // Control: as if all sunlight entered.
            assert!(own * (1.0 / entering - 1.0) > ERROR);
        }
    }
}

/// Refined triangles keep the materials and textures of those that they are parts of.
#[test]
fn a_dry_solid_is_drawn_as_without_a_film() {
    let painted = "[[solids.material]]\nname = \"one\"\ncolour = [0.1, 0.5, 0.3]\n";
    for (method, _) in METHODS {
        for more in ["", painted] {
            let refined = wall(0.5, &|_| 0.0);
            let plain = RenderScene {
                wet: None,
                ..refined.clone()
            };
            let with =
                |more: &str, scene: &RenderScene| picture(&context(), &setup(method, more), scene);
            let before = with(more, &plain);
            let after = with(&format!("{more}{WET}"), &refined);
            for (a, b) in before.beauty.iter().zip(&after.beauty) {
                for (a, b) in a.iter().zip(b) {
                    // Hits on other triangles of one plane differ by rounding.
                    assert!((a - b).abs() <= 1e-5, "{method} {more}: {a} {b}");
                }
            }
            let wet = with(&format!("{more}{WET}"), &wall(0.5, &|_| 1.0));
            assert!(
                (wet.beauty[0][1] - before.beauty[0][1]).abs() > 0.02,
                "control"
            );
        }
    }
}

/// Below water the material traps light as well, and nothing is mirrored but by the water itself:
/// a wet floor looks like a dry one that is as dark as the wet one is below its film.
#[test]
fn a_wet_solid_under_water_has_no_film() {
    // So dark that what a film mirrors is more than what it keeps out.
    const DARK: f64 = 0.05;
    let floor = TriangleMesh {
        vertices: [[0.0, 0.0], [0.0, 10.0], [10.0, 10.0], [10.0, 0.0]]
            .map(|[x, z]| DVec3::new(x, 0.3, z))
            .to_vec(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let eye = Eye {
        up: DVec3::Z,
        ..Eye::new([3.0, 8.0, 5.0], [5.0, 0.3, 5.0], 600.0)
    };
    let setup = |albedo: f64, more: &str| Setup {
        method: "ray",
        water: format!("index = {INDEX:?}\nabsorption_per_metre = [0.0, 0.0, 0.0]\n"),
        solids: [albedo; 3],
        more: more.to_owned(),
        ..Setup::new(eye)
    };
    let scene = |is_wet: bool| RenderScene {
        wet: is_wet.then(|| wet_of(&floor, 2.0, &|_| 1.0)),
        solids: vec![floor.clone()],
        ..pool_scene()
    };
    let with = |context: &Context, setup: &Setup, is_wet: bool| {
        draw(context, setup, &uniform_sky, &scene(is_wet), &water(), 1)
    };
    let dark = with(&context(), &setup(trapped(DARK), ""), false);
    let apart = |image: &Image| {
        let pairs = dark.beauty.iter().zip(&image.beauty);
        pairs.map(|(a, b)| (a[1] - b[1]).abs()).fold(0.0, f32::max)
    };
    let wet = with(&context(), &setup(DARK, WET), true);
    assert!(f64::from(apart(&wet)) < ERROR, "{}", apart(&wet));
    // Controls: a film there, and a dry floor.
    let fault = spoiled("rays/cast", "in_air = !ray.inside", "in_air = ray.inside");
    assert!(f64::from(apart(&with(&fault, &setup(DARK, WET), true))) > 5.0 * ERROR);
    assert!(f64::from(apart(&with(&context(), &setup(DARK, ""), false))) > 10.0 * ERROR);
}

/// A rough film mirrors less at grazing incidence.
#[test]
fn a_rough_film_mirrors_by_its_facets() {
    // The eye looks along the wall, which the picture shows at 11° to 34°.
    let eye = Eye::new(
        (MIDDLE + DVec3::new(-3.9, 0.0, 1.0)).to_array(),
        (MIDDLE + DVec3::new(-1.5, 0.0, 0.0)).to_array(),
        160.0,
    );
    let expected = |slope: f64, i: usize| rough_radiance(-eye.direction(i).z, slope);
    for (method, _) in METHODS {
        let setup = Setup {
            eye,
            ..setup(method, "[wet]\nroughness = 0.5\n")
        };
        let image = picture(&context(), &setup, &wall(1.0, &|_| 1.0));
        let worst = |slope: f64| {
            let pixels = image.beauty.iter().enumerate();
            let off = pixels.map(|(i, it)| (f64::from(it[0]) - expected(slope, i)).abs());
            off.fold(0.0, f64::max)
        };
        assert!(worst(0.5) < ERROR, "{method}: {}", worst(0.5));
        assert!(
            worst(0.0) > 10.0 * ERROR,
            "control {method}: {}",
            worst(0.0)
        );
    }
}
