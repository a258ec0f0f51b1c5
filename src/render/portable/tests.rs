#![allow(clippy::unwrap_used, reason = "a failed unwrap is a failed test")]

use std::path::Path;

use exr::prelude::{ReadChannels, ReadLayers};
use glam::DQuat;

use super::*;
use crate::{SolidParts, image::write_rgb_png};
use swell_domain::{
    bounds::Bounds,
    mesh::TriangleMesh,
    mesh_file::{MeshFormat, parts::MeshParts},
    pose::Pose,
};
use swell_files::parse_look;

fn look(folder: &Path, extra: &str) -> Look {
    let text = format!(
        "[camera]\nfocal_length_mm = 35.0\nposition = [0, 1, 0]\ntarget = [1, 1, 0]\n{extra}"
    );
    parse_look(&text, &folder.join("look.toml")).unwrap()
}

const SKY: &str = "[sky]\nmodel = \"hosek_wilkie\"\nturbidity = 3.0\nalbedo = [0.15, 0.15, 0.15]\n";

/// Directions and radiances of a sky's texels by the OpenEXR specification of latitude-longitude
/// pictures, turned by a quarter about y as the export turns them; and their solid angles.
fn texels(sky: &[u8], turned: f64) -> Vec<(DVec3, Vec3, f64)> {
    let read = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .rgb_channels(
            |size: exr::math::Vec2<usize>, _: &_| (size.0, vec![Vec3::ZERO; size.0 * size.1]),
            |(width, all): &mut (usize, Vec<Vec3>), at: exr::math::Vec2<usize>, (r, g, b)| {
                all[at.1 * *width + at.0] = Vec3::new(r, g, b);
            },
        )
        .first_valid_layer()
        .all_attributes()
        .from_buffered(std::io::Cursor::new(sky))
        .unwrap();
    let (width, all) = read.layer_data.channel_data.pixels;
    let height = all.len() / width;
    let texel = |(k, &radiance): (usize, &Vec3)| {
        let part = |at: usize, count: usize| (at as f64 + 0.5) / count as f64;
        let longitude = PI - 2.0 * PI * part(k % width, width);
        let latitude = PI / 2.0 - PI * part(k / width, height);
        let ahead = DVec3::new(longitude.sin(), 0.0, longitude.cos()) * latitude.cos();
        let way = DQuat::from_rotation_y(turned) * (ahead + latitude.sin() * DVec3::Y);
        let angle = 2.0 * PI / width as f64 * PI / height as f64 * latitude.cos();
        (way, radiance, angle)
    };
    all.iter().enumerate().map(texel).collect()
}

/// Luminance of the irradiance of sun and sky on level ground, over π: 1 under the reference sky,
/// 0.82 of it from the sun. At the sun's height the sky is brightest around the sun.
#[test]
fn light_is_in_the_renderers_unit_and_comes_from_where_it_should() {
    let sun = "[sun]\nazimuth_degrees = 25.0\nelevation_degrees = 45.0\n";
    let light = daylight(&look(Path::new("."), &format!("{SKY}{sun}"))).unwrap();
    let weights = Vec3::new(0.2126, 0.7152, 0.0722);
    let from_sun = f64::from(light.sun_irradiance.dot(weights)) * light.to_sun.y / PI;
    assert!((from_sun - 0.82).abs() < 1e-3, "{from_sun}");
    // The angular diameter of the sun from the earth: 0.527 to 0.545 degrees.
    assert!(
        (0.527..0.545).contains(&light.sun_degrees),
        "{}",
        light.sun_degrees
    );
    let from_sky = |turned| {
        let of = |(way, radiance, angle): &(DVec3, Vec3, f64)| {
            f64::from(radiance.dot(weights)) * way.y.max(0.0) * angle
        };
        texels(&light.sky, turned).iter().map(of).sum::<f64>() / PI
    };
    let found = from_sky(PI / 2.0);
    // Half floats; and the reference's quadrature on 64 rows.
    assert!((found - 0.18).abs() < 1e-3, "{found}");
    let brightest = |turned| {
        let mut all = texels(&light.sky, turned);
        all.retain(|(way, ..)| (way.y - light.to_sun.y).abs() < 0.05);
        let most = all.iter().max_by(|a, b| a.1.y.total_cmp(&b.1.y)).unwrap();
        let azimuth = |way: DVec3| way.z.atan2(way.x);
        (azimuth(most.0) - azimuth(light.to_sun)).abs().to_degrees()
    };
    // Texels are 0.7 degrees wide.
    assert!(brightest(PI / 2.0) < 1.0, "{}", brightest(PI / 2.0));
    // Controls: other turns of the picture.
    for turned in [0.0, -PI / 2.0] {
        assert!(brightest(turned) > 30.0, "{turned}: {}", brightest(turned));
    }
}

#[test]
fn deep_water_reflects_what_it_does_not_absorb() {
    let folder = Path::new(".");
    let of = |absorption: &str, scattering: &str| {
        let water = format!(
            "[water]\nabsorption_per_metre = {absorption}\nscattering_per_metre = {scattering}\n"
        );
        deep_reflectance(&look(folder, &format!("{water}{SKY}")).spec().water)
    };
    // √(a / (a + s)) is 1/2, 1/3 and 1.
    let found = of("[1.0, 0.5, 2.0]", "[3.0, 4.0, 0.0]");
    for (found, expected) in found.into_iter().zip([1.0 / 3.0, 0.5, 0.0]) {
        assert!((found - expected).abs() < 1e-12, "{found} {expected}");
    }
    assert_eq!(of("[0.0, 0.0, 0.0]", "[0.0, 1.0, 0.0]"), [0.0, 1.0, 0.0]);
}

/// A box of two groups: `top` with the face at the high end of y, `rest` with texture coordinates.
const BOX: &str = "\
v 1 0 1\nv 3 0 1\nv 3 2 1\nv 1 2 1\nv 1 0 4\nv 3 0 4\nv 3 2 4\nv 1 2 4
vt 0.0 0.0\nvt 2.0 0.0\nvt 2.0 0.7\nvt 0.0 0.7
g rest
f 1/1 4/4 3/3 2/2\nf 5/1 6/2 7/3 8/4\nf 1/1 2/2 6/3 5/4\nf 1/1 5/2 8/3 4/4\nf 2/1 3/2 7/3 6/4
g top
f 4 8 7 3
";

const MATERIALS: &str = "
[[solids.material]]
name = \"top\"
colour = [0.5, 0.25, 1.0]
texture = { file = \"wide.png\", metres = 0.7 }
[[solids.material]]
name = \"rest\"
texture = { file = \"wide.png\" }
";

/// Textures lie where the documentation says, with the solid in its pose.
#[test]
fn textures_lie_as_documented() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("wide.png");
    write_rgb_png(&file, [4, 2], &[[10, 20, 30]; 8], "").unwrap();
    let look = look(folder.path(), &format!("{SKY}{MATERIALS}"));
    let parts = MeshParts::from_bytes(BOX.as_bytes(), MeshFormat::Obj, Path::new("b.obj")).unwrap();
    let given =
        TriangleMesh::from_bytes(BOX.as_bytes(), MeshFormat::Obj, Path::new("b.obj")).unwrap();
    let turned = Pose {
        rest: DVec3::ONE,
        centre: DVec3::new(1.5, 0.5, 2.0),
        turn: DQuat::from_rotation_y(0.4),
    };
    for pose in [Pose::START, turned] {
        let vertices = given.vertices.iter().map(|&p| pose.place(p)).collect();
        let scene = RenderScene {
            origin: DVec3::ZERO,
            domain: Bounds {
                min: DVec3::new(-1.0, 0.0, 0.5),
                max: DVec3::splat(9.0),
            },
            solids: vec![TriangleMesh {
                vertices,
                triangles: given.triangles.clone(),
            }],
            wet: None,
            parts: vec![SolidParts {
                name: "b".to_owned(),
                parts: parts.clone(),
                pose,
            }],
            particle_spacing: 0.1,
            frames_per_second: 24.0,
            gravity: DVec3::NEG_Y,
            wave_makers: Vec::new(),
            moving: Vec::new(),
            waves: None,
        };
        let paint = &painted(&look, &scene).unwrap()[0];
        assert_eq!(paint.materials.len(), 12);
        let mut worst: f64 = 0.0;
        let [mut mirrored, mut upside_down] = [0.0f64; 2];
        for (k, triangle) in given.triangles.iter().enumerate() {
            let is_top = parts.of[k] == parts.of[11];
            assert_eq!(paint.materials[k], Some(usize::from(!is_top)), "{k}");
            for (corner, &at) in triangle.iter().enumerate() {
                let at = at as usize;
                let found = paint.place(k, scene.solids[0].vertices[at]).unwrap();
                let expected = match is_top {
                    // Along x and -z; twice as wide as high.
                    true => [given.vertices[at].x / 0.7, -given.vertices[at].z / 0.35],
                    false => parts.places[k].unwrap()[corner].map(f64::from),
                };
                let off = |expected: [f64; 2]| {
                    let gaps = [0, 1].map(|axis| found[axis] - expected[axis]);
                    gaps.map(|gap| (gap - gap.round()).abs())
                        .into_iter()
                        .fold(0.0, f64::max)
                };
                worst = worst.max(off(expected));
                mirrored = mirrored.max(off([-expected[0], expected[1]]));
                upside_down = upside_down.max(off([expected[0], -expected[1]]));
            }
        }
        // Single precision of some ten repetitions.
        assert!(worst < 1e-5, "{worst}");
        // Controls: mirrored either way.
        assert!(
            mirrored > 0.1 && upside_down > 0.1,
            "{mirrored} {upside_down}"
        );
    }
}
