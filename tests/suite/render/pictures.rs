//! Pictures of small synthetic waters, compared with optics and geometry.

use std::path::Path;

use glam::DVec3;
use swell::domain::bounds::Bounds;
use swell::domain::mesh::TriangleMesh;
use swell::domain::particles::Particles;
use swell::scene::look::Look;
use swell::{
    files::{load_look, parse_look},
    render::{
        Attributes, Image, RenderError, RenderScene, Renderer,
        image::{
            read_exr_attributes, read_png_attributes, write_exr, write_png,
            write_png_with_attributes,
        },
        view,
    },
};

use crate::support::context;

use super::{
    analytic::support::scene,
    scenes::{box_mesh, city_scene, city_water, slab},
};

fn look(text: &str) -> Look {
    parse_look(text, Path::new("test.toml")).unwrap()
}

pub(super) const TOP_DOWN: &str = "[camera]
focal_length_mm = 36.0
film_back_mm = [36.0, 27.0]
position = [2.0, 6.0, 1.5]
target = [2.0, 0.0, 1.5]
up = [0.0, 0.0, -1.0]
[image]
width = 96
height = 72
samples = 1
[ground]
variation = 0.0
haze_m = 1e7
[sky]
model = \"hosek_wilkie\"
[sun]
elevation_degrees = 40.0
azimuth_degrees = 0.0
";

pub(super) const ALL_AOVS: &str =
    "[output]\nformats = [\"exr\"]\naovs = [\"Z\", \"N\", \"P\", \"forward\", \"thickness\"]\n";

/// A tank of 8 × 4 × 6 m that extends beyond the camera's view on all sides.
pub(super) fn tank(spacing: f64) -> RenderScene {
    RenderScene {
        domain: Bounds {
            min: DVec3::new(-2.0, 0.0, -1.5),
            max: DVec3::new(6.0, 4.0, 4.5),
        },
        particle_spacing: spacing,
        ..scene(1.0, 1.0)
    }
}

const SPACING: f64 = 0.16;
const DEPTH: f64 = 0.64;

fn tank_water() -> Particles {
    let scene = tank(SPACING);
    slab(scene.domain.min, DVec3::new(8.0, DEPTH, 6.0), SPACING)
}

fn centre(width: u32, height: u32) -> impl Iterator<Item = usize> {
    let (w, h) = (width as usize, height as usize);
    (h / 3..2 * h / 3).flat_map(move |y| (w / 3..2 * w / 3).map(move |x| y * w + x))
}

fn render(look: &Look, scene: &RenderScene, water: &Particles) -> Image {
    Renderer::new(&context(), look, scene)
        .unwrap()
        .render(1, water)
        .unwrap()
}

#[test]
fn flat_water_has_flat_normals_and_its_own_thickness() {
    for filter in ["curvature_flow", "narrow_range"] {
        let look = look(&format!(
            "{TOP_DOWN}[surface]\nfilter = \"{filter}\"\n{ALL_AOVS}"
        ));
        let image = render(&look, &tank(SPACING), &tank_water());
        let normals = image.aovs.n.as_ref().unwrap();
        let least = centre(96, 72).map(|i| normals[i][1]).fold(1.0, f32::min);
        // Spheres of 0.87 d are 0.43 d higher than the valleys between them; a width of 1.6 d
        // reduces a wave of length d by exp(−½ (2π 1.6)²), so only rounding and cell shape are
        // left: 1° from upright.
        assert!(least > 1f32.to_radians().cos(), "{filter}: {least}");
        // Splats are scaled so that the contents of a column add up to its depth. Lines of sight
        // through the middle third lean by up to 9°, which makes them 1 % longer, and a pixel
        // samples the lattice unevenly by d/2.
        let thickness = image.aovs.thickness.as_ref().unwrap();
        let count = centre(96, 72).count() as f32;
        let mean = centre(96, 72).map(|i| thickness[i]).sum::<f32>() / count;
        assert!(
            (f64::from(mean) / DEPTH - 1.0).abs() < 0.04,
            "{filter}: {mean}"
        );
        // Still water under a still camera does not move.
        let forward = image.aovs.forward.as_ref().unwrap();
        assert!(centre(96, 72).all(|i| forward[i].iter().all(|v| v.abs() < 1e-2)));
    }
}

#[test]
fn rough_water_without_smoothing_is_not_flat() {
    let text =
        format!("{TOP_DOWN}[surface]\nsplat = \"sphere\"\nsmoothing_width_m = 0.0\n{ALL_AOVS}");
    let image = render(&look(&text), &tank(SPACING), &tank_water());
    let normals = image.aovs.n.as_ref().unwrap();
    let least = centre(96, 72).map(|i| normals[i][1]).fold(1.0, f32::min);
    assert!(
        least < 10f32.to_radians().cos(),
        "the control is flat: {least}"
    );
}

#[test]
fn water_absorbs_as_beer_and_lambert_say() {
    // Three waters: clear, black (which leaves only the reflection), and the one in question.
    let beauty = |absorption: f64| {
        let water = format!(
            "[water]\nabsorption_per_metre = [{absorption:.1}, {absorption:.1}, {absorption:.1}]\n"
        );
        render(
            &look(&format!("{TOP_DOWN}{water}{ALL_AOVS}")),
            &tank(SPACING),
            &tank_water(),
        )
    };
    let (clear, black, asked) = (beauty(0.0), beauty(1000.0), beauty(0.5));
    let position = asked.aovs.p.as_ref().unwrap();
    let index = 1.333f64;
    let sun = 1.0 / (1.0 - 40f64.to_radians().cos().powi(2) / (index * index)).sqrt();
    for i in centre(96, 72) {
        let channel = |image: &Image| f64::from(image.beauty[i][1]);
        let found = (channel(&asked) - channel(&black)) / (channel(&clear) - channel(&black));
        let [x, y, z] = position[i].map(f64::from);
        let view = (DVec3::new(2.0, 6.0, 1.5) - DVec3::new(x, y, z)).normalize();
        let bent = 1.0 / (1.0 - (1.0 - view.y * view.y) / (index * index)).sqrt();
        // Down along the sun's refracted direction, up along the viewer's.
        let expected = (-0.5 * y * (sun + bent)).exp();
        // Normals up to 1° off upright lengthen the path by 0.2 % and shift it; f32 adds 1e-6.
        assert!(
            (found / expected - 1.0).abs() < 0.01,
            "{found} for {expected}"
        );
        // Control: half of the absorption is distinguishable.
        assert!((found / expected.sqrt() - 1.0).abs() > 0.05);
    }
}

pub(super) const OBLIQUE: &str = "[camera]
focal_length_mm = 24.0
film_back_mm = [36.0, 20.25]
position = [-1.5, 2.0, 0.2]
target = [4.0, 0.2, 2.4]
[image]
width = 160
height = 90
samples = 2
shutter = 0.5
[surface]
ripple = { wavelength_m = 0.5, slope = 0.05 }
[water]
spray = { density_per_metre = 8.0, speed_m_per_s = 3.0 }
[sky]
model = \"hosek_wilkie\"
[basin]
height_m = 1.0
[solids]
windows = { storey_m = 0.4, bay_m = 0.3, lit = 0.3 }
";

pub(super) fn harbour() -> (RenderScene, Particles) {
    let mut scene = tank(SPACING);
    scene.solids = vec![
        box_mesh(DVec3::new(3.0, 0.0, 0.5), DVec3::new(4.0, 1.8, 1.6)),
        box_mesh(DVec3::new(3.5, 0.0, 2.4), DVec3::new(4.5, 1.1, 3.6)),
    ];
    let mut water = tank_water();
    // A few drops in flight, and a current.
    for i in 0..20u16 {
        let t = f32::from(i);
        water
            .position
            .push([1.0 + 0.1 * t, 1.2 + 0.02 * t, 0.1 * t]);
        water.velocity.push([2.0, 1.0, 0.0]);
        water.id.push(water.id.len() as u32);
    }
    for velocity in &mut water.velocity {
        velocity[0] += 1.5;
    }
    (scene, water)
}

#[test]
fn a_frame_in_tiles_is_the_frame_drawn_whole() {
    let (scene, water) = harbour();
    let look = look(&format!("{OBLIQUE}{ALL_AOVS}"));
    let context = context();
    let whole = Renderer::new(&context, &look, &scene)
        .unwrap()
        .render(3, &water)
        .unwrap();
    for limit in [64, 32] {
        let tiled = Renderer::with_tile_limit(&context, &look, &scene, limit)
            .unwrap()
            .render(3, &water)
            .unwrap();
        let same = whole
            .beauty
            .iter()
            .zip(&tiled.beauty)
            .filter(|(a, b)| a == b);
        let differ = whole.beauty.len() - same.count();
        assert!(tiled == whole, "tiles of {limit}: {differ} pixels differ");
    }
    let other = Renderer::with_tile_limit(&context, &look, &scene, 64)
        .unwrap()
        .render(9, &water)
        .unwrap();
    assert!(
        other.beauty != whole.beauty,
        "the control: another frame's ripples differ"
    );
}

#[test]
fn the_same_frame_twice_is_the_same_bytes() {
    let (scene, water) = harbour();
    let look = look(&format!("{OBLIQUE}{ALL_AOVS}"));
    let bits = |image: &Image| -> Vec<u32> {
        image.beauty.iter().flatten().map(|x| x.to_bits()).collect()
    };
    let mut renderer = Renderer::new(&context(), &look, &scene).unwrap();
    let first = renderer.render(2, &water).unwrap();
    renderer.render(5, &Particles::default()).unwrap();
    let again = renderer.render(2, &water).unwrap();
    let fresh = render_at(&look, &scene, &water, 2);
    assert!(
        bits(&first) == bits(&again),
        "a renderer remembers its last frame"
    );
    assert!(bits(&first) == bits(&fresh), "two renderers differ");
    assert!(first.beauty.iter().flatten().all(|x| x.is_finite()));
}

fn render_at(look: &Look, scene: &RenderScene, water: &Particles, frame: u32) -> Image {
    Renderer::new(&context(), look, scene)
        .unwrap()
        .render(frame, water)
        .unwrap()
}

#[test]
fn what_ran_is_what_the_look_calls_for() {
    let (mut scene, water) = harbour();
    let names = |look: &Look, scene: &RenderScene| {
        let mut renderer = Renderer::new(&context(), look, scene).unwrap();
        renderer.time_passes();
        renderer.render(1, &water).unwrap();
        let samples = look.spec().image.samples as usize;
        let planned: Vec<_> = renderer
            .plan()
            .passes()
            .into_iter()
            .map(|(name, runs)| (name, runs.once + samples * runs.sample + runs.aovs))
            .collect();
        let times = renderer.times().into_iter();
        let timed: Vec<_> = times
            .map(|time| {
                assert!(time.seconds > 0.0, "{}", time.pass);
                (time.pass, time.runs as usize)
            })
            .collect();
        assert_eq!(timed, planned);
        let ran: Vec<_> = timed.into_iter().map(|(name, _)| name).collect();
        ran
    };
    let full = names(&look(&format!("{OBLIQUE}{ALL_AOVS}")), &scene);
    for pass in [
        "ssfr/splat_spray",
        "ssfr/splat_owner",
        "ssfr/shade_aovs",
        "ssfr/solid",
    ] {
        assert!(full.contains(&pass), "{pass}");
    }
    scene.solids.clear();
    let plain = names(&look(TOP_DOWN), &scene);
    for pass in [
        "ssfr/splat_spray",
        "ssfr/splat_owner",
        "ssfr/shade_aovs",
        "ssfr/solid",
        "ssfr/shadow",
    ] {
        assert!(
            !plain.contains(&pass),
            "{pass} runs though nothing asks for it"
        );
    }
}

#[test]
fn forward_is_the_motion_on_the_screen() {
    let mut water = tank_water();
    for velocity in &mut water.velocity {
        *velocity = [1.2, 0.0, 0.0];
    }
    let image = render(
        &look(&format!("{TOP_DOWN}{ALL_AOVS}")),
        &tank(SPACING),
        &water,
    );
    let forward = image.aovs.forward.as_ref().unwrap();
    let depth = image.aovs.z.as_ref().unwrap();
    for i in centre(96, 72) {
        // 1.2 m/s over 1/24 s at 96 pixels per unit slope; the camera's right is +x.
        let expected = 1.2 / 24.0 * 96.0 / depth[i];
        assert!(
            (forward[i][0] - expected).abs() < 0.01,
            "{} {expected}",
            forward[i][0]
        );
        assert!(forward[i][1].abs() < 0.01);
    }
}

#[test]
fn solids_stand_before_behind_and_in_the_water() {
    let mut scene = tank(SPACING);
    // One pillar through the surface, and one that ends 0.3 m above the floor, below the surface.
    scene.solids = vec![
        box_mesh(DVec3::new(0.6, 0.0, 1.0), DVec3::new(1.4, 1.5, 2.0)),
        box_mesh(DVec3::new(2.6, 0.0, 1.0), DVec3::new(3.4, 0.3, 2.0)),
    ];
    let image = render(
        &look(&format!("{TOP_DOWN}{ALL_AOVS}")),
        &scene,
        &tank_water(),
    );
    let height = |x: usize| image.aovs.p.as_ref().unwrap()[36 * 96 + x][1];
    // 16 pixels per metre at 6 m: the pillars' middles at x = 1 and x = 3 are 16 pixels to either
    // side of the centre, slightly farther for their height.
    assert!((height(28) - 1.5).abs() < 1e-3, "{}", height(28));
    assert!(
        height(65) > 0.6,
        "the sunken pillar is under water: {}",
        height(65)
    );
    // It is visible through the water: brighter or darker than the floor beside it.
    let green = |x: usize| image.beauty[36 * 96 + x][1];
    assert!(
        (green(65) / green(50) - 1.0).abs() > 0.1,
        "{} {}",
        green(65),
        green(50)
    );
}

pub(super) fn attributes() -> Attributes {
    Attributes {
        frame: 7,
        shot: "wave-city".into(),
        software: "swell 0.1.0".into(),
        scene_hash: "aa".into(),
        cache_hash: "bb".into(),
        look_hash: "cc".into(),
    }
}

#[test]
fn an_exr_holds_every_channel_and_where_it_comes_from() {
    use exr::prelude::*;
    let (scene, water) = harbour();
    let look = look(&format!("{OBLIQUE}{ALL_AOVS}"));
    let image = render(&look, &scene, &water);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frame.exr");
    write_exr(&file, &image, &attributes()).unwrap();
    let first = std::fs::read(&file).unwrap();
    write_exr(&file, &image, &attributes()).unwrap();
    assert!(
        first == std::fs::read(&file).unwrap(),
        "the same picture, other bytes"
    );
    assert_eq!(
        std::fs::read_dir(folder.path()).unwrap().count(),
        1,
        "nothing is left beside it"
    );

    let read = read_all_data_from_file(&file).unwrap();
    assert_eq!(read.layer_data.len(), 1);
    let layer = &read.layer_data[0];
    let kinds: Vec<(String, bool)> = layer
        .channel_data
        .list
        .iter()
        .map(|channel| {
            let samples = match &channel.sample_data {
                Levels::Singular(samples) => samples,
                _ => panic!("one level"),
            };
            (
                channel.name.to_string(),
                matches!(samples, FlatSamples::F16(_)),
            )
        })
        .collect();
    let expected = [
        ("A", true),
        ("B", true),
        ("G", true),
        ("N.X", false),
        ("N.Y", false),
        ("N.Z", false),
        ("P.X", false),
        ("P.Y", false),
        ("P.Z", false),
        ("R", true),
        ("Z", false),
        ("forward.u", false),
        ("forward.v", false),
        ("thickness.Y", false),
    ];
    assert_eq!(kinds, expected.map(|(name, half)| (name.to_owned(), half)));
    let z: Vec<f32> = match &layer.channel_data.list[10].sample_data {
        Levels::Singular(FlatSamples::F32(z)) => z.clone(),
        _ => panic!("Z is float"),
    };
    assert_eq!(&z, image.aovs.z.as_ref().unwrap());
    assert_eq!(
        read.attributes.chromaticities.unwrap().red,
        Vec2(0.64, 0.33)
    );
    assert_eq!(read_exr_attributes(&file).unwrap(), attributes());
}

#[test]
fn a_png_went_through_the_view_transform() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frame.png");
    let mut image = Image::new(2, 1);
    image.beauty = vec![[0.18, 0.18, 0.18, 1.0], [4.0, 4.0, 4.0, 1.0]];
    let look = look(TOP_DOWN);
    write_png_with_attributes(&file, &image, &look.spec().view, &attributes()).unwrap();
    assert_eq!(read_png_attributes(&file).unwrap(), attributes());
    let reader = std::io::BufReader::new(std::fs::File::open(&file).unwrap());
    let mut decoder = png::Decoder::new(reader).read_info().unwrap();
    let mut bytes = vec![0; decoder.output_buffer_size().unwrap()];
    decoder.next_frame(&mut bytes).unwrap();
    let through = |x: f32| (view::apply(&look.spec().view, [x; 3])[1] * 255.0).round() as u8;
    assert_eq!([bytes[1], bytes[4]], [through(0.18), through(4.0)]);
    // Plain gamma would show the second as pure white.
    assert!(bytes[4] < 250, "{}", bytes[4]);
    write_png(&file, &image, &look.spec().view).unwrap();
    assert_eq!(read_png_attributes(&file).unwrap(), Attributes::default());
}

#[test]
fn a_panorama_is_mirrored_and_a_damaged_one_refused() {
    let folder = tempfile::tempdir().unwrap();
    exr::prelude::write_rgb_file(folder.path().join("sky.exr"), 32, 16, |_, y| {
        (0.0f32, if y < 8 { 2.0f32 } else { 0.0 }, 0.0f32)
    })
    .unwrap();
    let text = TOP_DOWN
        .replace("\"hosek_wilkie\"", "\"panorama\"\nfile = \"sky.exr\"")
        .replace(
            "[sun]\n",
            "[water]\nabsorption_per_metre = [1000.0, 1000.0, 1000.0]\n[sun]\nintensity = 0.0\n",
        );
    let parse = || parse_look(&text, &folder.path().join("look.toml")).unwrap();
    let image = render(&parse(), &tank(SPACING), &tank_water());
    // Black water under a sky of radiance 2 shows its reflectance at normal incidence, 2.04 %.
    let reflectance = (0.333f32 / 2.333).powi(2);
    for i in centre(96, 72) {
        let [r, g, _, a] = image.beauty[i];
        assert!((g / (2.0 * reflectance) - 1.0).abs() < 0.03, "{g}");
        assert!(r < 1e-4 && a == 1.0);
    }
    std::fs::write(folder.path().join("sky.exr"), b"nonsense").unwrap();
    let fault = Renderer::new(&context(), &parse(), &tank(SPACING)).err();
    assert!(matches!(fault, Some(RenderError::Panorama(_))), "{fault:?}");
}

#[test]
fn damaged_input_is_refused() {
    let look = look(TOP_DOWN);
    let mut water = tank_water();
    water.position[5][1] = f32::NAN;
    let mut renderer = Renderer::new(&context(), &look, &tank(SPACING)).unwrap();
    assert!(matches!(
        renderer.render(4, &water),
        Err(RenderError::NotFinite { index: 5, frame: 4 })
    ));
    let mut scene = tank(SPACING);
    scene.solids = vec![TriangleMesh {
        vertices: vec![DVec3::ZERO],
        triangles: vec![[0, 1, 2]],
    }];
    let fault = Renderer::new(&context(), &look, &scene).err();
    assert!(matches!(fault, Some(RenderError::Scene(_))), "{fault:?}");
}

#[test]
fn a_scene_far_from_the_origin_looks_the_same() {
    let (scene, water) = harbour();
    let text = format!("{OBLIQUE}{ALL_AOVS}");
    let near = render(&look(&text), &scene, &water);
    // A power of two keeps the lattice's f32 positions exact to 1/1024 m.
    let shift = DVec3::new(8192.0, 0.0, 0.0);
    let mut far_scene = scene.clone();
    far_scene.domain.min += shift;
    far_scene.domain.max += shift;
    for vertex in far_scene
        .solids
        .iter_mut()
        .flat_map(|mesh| &mut mesh.vertices)
    {
        *vertex += shift;
    }
    let mut far_water = water.clone();
    for position in &mut far_water.position {
        position[0] += 8192.0;
    }
    let moved = text
        .replace("[-1.5, 2.0, 0.2]", "[8190.5, 2.0, 0.2]")
        .replace("[4.0, 0.2, 2.4]", "[8196.0, 0.2, 2.4]");
    let far = render(&look(&moved), &far_scene, &far_water);
    let mut errors: Vec<f32> = near
        .beauty
        .iter()
        .zip(&far.beauty)
        .map(|(a, b)| (a[1] - b[1]).abs())
        .collect();
    errors.sort_by(f32::total_cmp);
    // Positions are coarser by 1 mm there; away from silhouettes that is a slope of a few tenths of
    // a percent.
    let percentile = errors[errors.len() * 9 / 10];
    assert!(percentile < 0.02, "{percentile}");
}

/// Not a test: writes pictures for inspection and prints times.
/// `cargo test --release --test suite render::pictures::pictures -- --ignored --nocapture`
#[test]
#[ignore = "writes pictures to look at into $SWELL_PICTURES"]
fn pictures() {
    let folder = std::env::var("SWELL_PICTURES").unwrap();
    let context = context();
    let scene = city_scene();
    let water = city_water();
    println!("{} particles on {}", water.len(), context.info.name);
    for name in std::env::var("SWELL_LOOKS").unwrap().split(',') {
        let look = load_look(Path::new(name)).unwrap();
        let stem = Path::new(name)
            .file_stem()
            .unwrap()
            .to_string_lossy()
            .into_owned();
        let started = std::time::Instant::now();
        let mut renderer = Renderer::new(&context, &look, &scene).unwrap();
        println!("{stem}: set up {:.2} s", started.elapsed().as_secs_f64());
        renderer.render(100, &water).unwrap();
        let started = std::time::Instant::now();
        let image = renderer.render(120, &water).unwrap();
        println!("{stem}: frame {:.3} s", started.elapsed().as_secs_f64());
        renderer.time_passes();
        renderer.render(120, &water).unwrap();
        for time in renderer.times() {
            println!(
                "  {:24} {:8.1} ms a frame",
                time.pass,
                1000.0 * time.seconds
            );
        }
        let file = Path::new(&folder).join(format!("{stem}.png"));
        write_png(&file, &image, &look.spec().view).unwrap();
        println!("  png {:.3} s in all", started.elapsed().as_secs_f64());
    }
}
