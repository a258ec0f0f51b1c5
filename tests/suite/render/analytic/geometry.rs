//! Positions and motion of things in the picture: the AOVs.

use std::collections::BTreeMap;

use glam::DVec3;
use swell::domain::bounds::Bounds;
use swell::domain::mesh::TriangleMesh;
use swell::gpu::adapter::Context;
use swell::render::image::{Aovs, write_exr};
use swell::render::{Attributes, Image, RenderScene};

use super::support::{Eye, Setup, ball, context, draw, scene, spoiled, uniform_sky, wide};

/// A box of twelve triangles, counter-clockwise from outside.
pub(crate) fn box_mesh(bounds: Bounds) -> TriangleMesh {
    let corner = |i: usize| {
        let pick = |axis: usize| match i >> axis & 1 {
            0 => bounds.min[axis],
            _ => bounds.max[axis],
        };
        DVec3::new(pick(0), pick(1), pick(2))
    };
    let quads = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let halves = |[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]];
    TriangleMesh {
        vertices: (0..8).map(corner).collect(),
        triangles: quads.into_iter().flat_map(halves).collect(),
    }
}

/// Distance along a ray to a box, and the normal of the face through which it enters.
pub(crate) fn enter(from: DVec3, along: DVec3, bounds: Bounds) -> Option<(f64, DVec3)> {
    let (mut near, mut far, mut face) = (f64::NEG_INFINITY, f64::INFINITY, DVec3::ZERO);
    for axis in 0..3 {
        let mut sides =
            [bounds.min[axis], bounds.max[axis]].map(|x| (x - from[axis]) / along[axis]);
        sides.sort_by(f64::total_cmp);
        if sides[0] > near {
            near = sides[0];
            face = DVec3::ZERO;
            face[axis] = -along[axis].signum();
        }
        far = far.min(sides[1]);
    }
    (near < far && near > 0.0).then_some((near, face))
}

/// Distance along a ray to a ball.
fn meet(from: DVec3, along: DVec3, centre: DVec3, radius: f64) -> Option<f64> {
    let off = from - centre;
    let half = off.dot(along);
    let under = half * half - off.length_squared() + radius * radius;
    (under > 0.0).then(|| -half - under.sqrt())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Water,
    Ground,
    Solid,
    Sky,
}

const ORIGIN: DVec3 = DVec3::new(100.0, 20.0, -40.0);
const FLOOR: f64 = -2.0;
const CENTRE: DVec3 = DVec3::new(6.5, 0.5, 9.5);
const RADIUS: f64 = 1.5;
const VELOCITY: DVec3 = DVec3::new(3.0, 7.0, -5.0);
const BLOCK: Bounds = Bounds {
    min: DVec3::new(9.0, FLOOR, 8.5),
    max: DVec3::new(11.0, 1.5, 11.0),
};

/// What the ray hits first, relative to the scene's origin: kind, distance, normal.
fn first(from: DVec3, along: DVec3) -> (Kind, f64, DVec3) {
    let mut found = (Kind::Sky, f64::INFINITY, DVec3::ZERO);
    if along.y < 0.0 {
        found = (Kind::Ground, (FLOOR - from.y) / along.y, DVec3::Y);
    }
    if let Some((far, face)) = enter(from, along, BLOCK).filter(|hit| hit.0 < found.1) {
        found = (Kind::Solid, far, face);
    }
    if let Some(far) = meet(from, along, CENTRE, RADIUS).filter(|&far| far < found.1) {
        let normal = (from + along * far - CENTRE) / RADIUS;
        found = (Kind::Water, far, normal);
    }
    found
}

/// A moving ball of water, a block and the ground under a sky, far from the world's origin, seen by
/// a camera that moves, turns and zooms.
fn picture(context: &Context) -> (Image, [Eye; 2]) {
    let eyes = [
        Eye {
            up: DVec3::new(0.1, 1.0, 0.0),
            ..Eye::new([101.0, 23.0, -36.0], [109.0, 20.0, -29.5], 40.0)
        },
        Eye {
            up: DVec3::new(0.1, 1.0, 0.0),
            ..Eye::new([101.4, 23.3, -36.2], [109.3, 20.3, -30.5], 42.0)
        },
    ];
    let setup = Setup {
        next: Some(eyes[1]),
        surface: format!("smoothing_width_m = 0.0\nradius_m = {RADIUS:?}\nsplat = \"sphere\"\n"),
        ..Setup::new(eyes[0])
    };
    let scene = RenderScene {
        origin: ORIGIN,
        domain: Bounds {
            min: DVec3::new(3.0, FLOOR, 5.0),
            max: DVec3::new(13.0, 8.0, 15.0),
        },
        solids: vec![box_mesh(BLOCK)],
        ..scene(RADIUS, 1.0)
    };
    let water = ball(CENTRE, VELOCITY);
    (draw(context, &setup, &uniform_sky, &scene, &water, 1), eyes)
}

/// The largest error of each AOV for each kind of thing, in units of what rounding explains, and
/// the number of pixels.
fn errors(context: &Context) -> BTreeMap<(Kind, &'static str), (f64, usize)> {
    let (image, [eye, next]) = picture(context);
    let aovs = &image.aovs;
    let z = aovs.z.as_ref().unwrap();
    let n = aovs.n.as_ref().unwrap();
    let p = aovs.p.as_ref().unwrap();
    let motion = aovs.forward.as_ref().unwrap();
    let at = |i: usize| first(eye.position - ORIGIN, eye.direction(i));
    let side = eye.size as usize;
    let mut worst = BTreeMap::new();
    for i in (0..side * side).filter(|i| (1..side - 1).contains(&(i % side))) {
        if !(1..side - 1).contains(&(i / side)) {
            continue;
        }
        let along = eye.direction(i);
        let (kind, far, normal) = at(i);
        // A pixel whose neighbours see something else may round to either. On a ball's rim a
        // rounding of the ray is a large difference in depth.
        let near = [i - 1, i + 1, i - side, i + side];
        let flat = near.iter().all(|&j| {
            let other = at(j);
            other.0 == kind && (kind == Kind::Water || other.2 == normal)
        });
        if !flat
            || (kind == Kind::Water && normal.dot(along) > -0.3)
            || far > 100.0 && far.is_finite()
        {
            continue;
        }
        let place = eye.position - ORIGIN + along * far;
        // A dozen roundings of f32 at this distance, and of the world's coordinates.
        let rounding = 2e-5 * far + 1e-5;
        let mut add = |channel, error: f64| {
            let entry = worst.entry((kind, channel)).or_insert((0.0, 0));
            *entry = (f64::max(entry.0, error), entry.1 + 1);
        };
        let moved = match kind {
            Kind::Water => place + VELOCITY / 24.0,
            _ => place,
        };
        let next_place = match kind {
            Kind::Sky => next.place(along),
            _ => next.place(moved + ORIGIN - next.position),
        };
        let shift = next_place - eye.place(along);
        let [u, v] = motion[i].map(f64::from);
        // 2e-5 of the distance is 2e-5 of the focal length, some 40 pixels, in the picture; times a
        // secant.
        add("u", (u - shift.x).abs() / 3e-3);
        add("v", (v - shift.y).abs() / 3e-3);
        assert!(
            shift.x.abs() > 1.0 || shift.y.abs() > 1.0,
            "moves too little: {shift}"
        );
        if kind == Kind::Sky {
            add("z", if z[i] == 1e30 { 0.0 } else { 2.0 });
            add("n", wide(n[i]).length());
            add("p", wide(p[i]).length());
            continue;
        }
        add(
            "z",
            (f64::from(z[i]) - far * along.dot(eye.forward())).abs() / rounding,
        );
        add("p", (wide(p[i]) - ORIGIN - place).length() / rounding);
        if kind != Kind::Water {
            // The six axis directions are packed exactly.
            add("n", (wide(n[i]) - normal).length() / 1e-6);
        }
    }
    worst
}

#[test]
fn every_channel_is_where_the_camera_and_the_motion_say() {
    let found = errors(&context());
    for kind in [Kind::Water, Kind::Ground, Kind::Solid, Kind::Sky] {
        for channel in ["z", "n", "p", "u", "v"] {
            if (kind, channel) == (Kind::Water, "n") {
                continue;
            }
            let (error, count) = found[&(kind, channel)];
            assert!(count > 30, "{kind:?} {channel}: only {count} pixels");
            assert!(error < 1.0, "{kind:?} {channel}: {error}");
        }
    }
    // Controls: a sign, and the pixel's centre off by a hundredth of half a pixel.
    let shade = "ssfr/shade_aovs";
    for (pass, from, to, kind, channel) in [
        (
            shade,
            "vec2f(shift.x, -shift.y)",
            "vec2f(shift.x, shift.y)",
            Kind::Water,
            "v",
        ),
        (
            shade,
            "vec2f(shift.x, -shift.y)",
            "vec2f(-shift.x, -shift.y)",
            Kind::Solid,
            "u",
        ),
        (
            shade,
            "dot(direction, next_camera.right)",
            "-dot(direction, next_camera.right)",
            Kind::Sky,
            "u",
        ),
        (
            shade,
            "dot(n, view) < 0.0",
            "dot(n, view) > 0.0",
            Kind::Solid,
            "n",
        ),
        (
            shade,
            "eye_ray(camera, vec2f(pixel) + 0.5)",
            "eye_ray(camera, vec2f(pixel) + 0.505)",
            Kind::Ground,
            "p",
        ),
    ] {
        let error = errors(&spoiled(pass, from, to))[&(kind, channel)].0;
        assert!(error > 1.5, "{to}: {kind:?} {channel} {error}");
    }
}

/// A ball with a radius of 20 m, 30 m away, seen through a long lens.
fn close(context: &Context, filled: f64) -> (Image, Eye, DVec3) {
    let centre = DVec3::new(5.0, -16.0, 5.0);
    let eye = Eye::new([-10.0, 30.0, 5.0], [5.0, 4.0, 5.0], 3200.0);
    let setup = Setup {
        surface: "smoothing_width_m = 0.0\nradius_m = 20.0\nsplat = \"sphere\"\n".to_owned(),
        ..Setup::new(eye)
    };
    let water = ball(centre, DVec3::ZERO);
    let image = draw(
        context,
        &setup,
        &uniform_sky,
        &scene(20.0, filled),
        &water,
        1,
    );
    (image, eye, centre)
}

#[test]
fn a_ball_of_water_has_its_normals_and_its_chords() {
    let (image, eye, centre) = close(&context(), 0.25);
    for i in 0..64 * 64 {
        let along = eye.direction(i);
        let far = meet(eye.position, along, centre, 20.0).unwrap();
        let normal = (eye.position + along * far - centre) / 20.0;
        // A difference over a pixel of 30/3200 m, seen at 30° to the surface at worst, turns by
        // half of that over the radius; depths of 30 m are f32, which over the pixel is 4e-4.
        let n = wide(image.aovs.n.as_ref().unwrap()[i]);
        assert!((n - normal).length() < 1.5e-3, "{n} for {normal}");
        // Sums are in units of 1/65536 m.
        let chord = -2.0 * (eye.position - centre).dot(along) - 2.0 * far;
        let thickness = f64::from(image.aovs.thickness.as_ref().unwrap()[i]);
        let error = |filled: f64| (thickness / (filled * chord) - 1.0).abs();
        assert!(error(0.25) < 1e-4, "{thickness} for {}", 0.25 * chord);
        // Control: one percent more water.
        assert!(error(0.2525) > 5e-3);
    }
}

#[test]
fn a_file_holds_each_channel_under_its_own_name() {
    use exr::prelude::{FlatSamples, Levels, read_all_data_from_file};
    let image = Image {
        width: 1,
        height: 1,
        beauty: vec![[0.125, 0.25, 0.5, 1.0]],
        aovs: Aovs {
            z: Some(vec![1.0]),
            n: Some(vec![[2.0, 3.0, 4.0]]),
            p: Some(vec![[5.0, 6.0, 7.0]]),
            forward: Some(vec![[8.0, 9.0]]),
            thickness: Some(vec![10.0]),
        },
        ..Image::new(1, 1)
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frame.exr");
    write_exr(&file, &image, &Attributes::default()).unwrap();
    let read = read_all_data_from_file(&file).unwrap();
    let found: BTreeMap<String, f32> = read.layer_data[0]
        .channel_data
        .list
        .iter()
        .map(|channel| {
            let value = match &channel.sample_data {
                Levels::Singular(FlatSamples::F16(v)) => v[0].to_f32(),
                Levels::Singular(FlatSamples::F32(v)) => v[0],
                other => panic!("{other:?}"),
            };
            (channel.name.to_string(), value)
        })
        .collect();
    let expected = [
        ("R", 0.125),
        ("G", 0.25),
        ("B", 0.5),
        ("A", 1.0),
        ("Z", 1.0),
        ("N.X", 2.0),
        ("N.Y", 3.0),
        ("N.Z", 4.0),
        ("P.X", 5.0),
        ("P.Y", 6.0),
        ("P.Z", 7.0),
        ("forward.u", 8.0),
        ("forward.v", 9.0),
        ("thickness.Y", 10.0),
    ];
    assert_eq!(found, expected.map(|(name, x)| (name.to_owned(), x)).into());
}

/// The header's matrices map each pixel's position to that pixel and to its Z.
#[test]
fn an_exr_says_where_its_camera_stood() {
    let eye = Eye::new([2.0, 3.0, 1.0], [5.0, 1.0, 6.0], 60.0);
    let scene = RenderScene {
        origin: DVec3::new(100.0, 20.0, -300.0),
        ..scene(1.0, 1.0)
    };
    let setup = Setup::new(Eye {
        position: eye.position + scene.origin,
        target: eye.target + scene.origin,
        ..eye
    });
    let water = ball(DVec3::new(5.0, 1.0, 6.0), DVec3::ZERO);
    let image = draw(&context(), &setup, &uniform_sky, &scene, &water, 1);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frame.exr");
    write_exr(&file, &image, &Attributes::default()).unwrap();
    let read = exr::prelude::read_all_data_from_file(&file).unwrap();
    let header = &read.layer_data[0].attributes;
    let (parts, whole) = header.frames_per_second.unwrap();
    assert!((f64::from(parts) / f64::from(whole) - scene.frames_per_second).abs() < 1e-6);
    let through = |matrix: [f32; 16], p: [f32; 3]| -> [f64; 4] {
        let [x, y, z] = p;
        let row = [x, y, z, 1.0];
        std::array::from_fn(|k| (0..4).map(|i| f64::from(row[i] * matrix[4 * i + k])).sum())
    };
    let ndc = header.world_to_normalized_device.unwrap();
    let camera = header.world_to_camera.unwrap();
    let (p, z) = (
        image.aovs.p.as_ref().unwrap(),
        image.aovs.z.as_ref().unwrap(),
    );
    let [width, height] = [image.width, image.height].map(f64::from);
    let mut worst = 0.0f64;
    for (i, (&p, &z)) in p.iter().zip(z).enumerate() {
        if z > 1e3 {
            continue;
        }
        let [x, y, _, w] = through(ndc, p);
        let (column, row) = (i % image.width as usize, i / image.width as usize);
        let off = [x / w * width - column as f64, y / w * height - row as f64];
        worst = off.into_iter().fold(worst, |a, x| a.max((x - 0.5).abs()));
        let [.., deep, _] = through(camera, p);
        assert!((-deep / f64::from(z) - 1.0).abs() < 1e-4, "{deep} {z}");
    }
    // Positions and the matrix's translation are rounded to f32 at 300 m, with a focal length of 60
    // pixels and at a distance of some metres.
    assert!(worst < 0.01, "{worst} pixels");
}
