//! The colour space of an EXR.

use std::path::Path;

use exr::prelude::{Levels, MetaData, Vec2};
use glam::{DMat3, DVec3};
use swell::{
    render::{
        Image,
        image::{CameraAttributes, read_exr, write_exr},
    },
    scene::look::{ColourSpaceSpec, LightSpec},
};

use super::super::pictures::attributes;

/// From Rec. 709 to ACEScg with Bradford adaptation, row by row, as published (OpenColorIO's
/// built-in ACES configurations).
const TO_ACES_CG: [[f64; 3]; 3] = [
    [0.613_097, 0.339_523, 0.047_379],
    [0.070_194, 0.916_354, 0.013_452],
    [0.020_616, 0.109_570, 0.869_815],
];

const COLOURS: [[f32; 4]; 4] = [
    [0.18, 0.18, 0.18, 1.0],
    [3.0, 0.25, 0.01, 1.0],
    [0.02, 0.3, 0.1, 0.5],
    [0.0, 0.0, 900.0, 1.0],
];

fn written(file: &Path, space: ColourSpaceSpec) -> Vec<[f32; 4]> {
    let image = Image {
        beauty: COLOURS.to_vec(),
        lights: vec![(
            LightSpec::Sun,
            COLOURS.map(|[r, g, b, _]| [r, g, b]).to_vec(),
        )],
        exr_space: space,
        view: Some(CameraAttributes {
            world_to_camera: [0.0; 16],
            world_to_ndc: [0.0; 16],
            frames_per_second: 24.0,
        }),
        ..Image::new(2, 2)
    };
    write_exr(file, &image, &attributes()).unwrap();
    read_exr(file).unwrap().0.2
}

/// Largest error, in units of half-float rounding of the largest channel.
fn off(found: &[[f32; 4]], matrix: DMat3) -> f64 {
    let mut worst = 0.0f64;
    for (found, [r, g, b, a]) in found.iter().zip(COLOURS) {
        let expected = matrix * DVec3::new(r.into(), g.into(), b.into());
        let error = DVec3::new(found[0].into(), found[1].into(), found[2].into()) - expected;
        worst = worst.max(error.abs().max_element() / expected.max_element() / HALF);
        assert_eq!(found[3], a);
    }
    worst
}

/// Half a step of eleven bits.
const HALF: f64 = 1.0 / 2048.0;

#[test]
fn an_exr_in_acescg_has_the_light_of_acescg_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("frame.exr");
    let matrix = DMat3::from_cols_array_2d(&TO_ACES_CG).transpose();
    // The published matrix has six digits, a thousandth of that rounding.
    let found = written(&file, ColourSpaceSpec::AcesCg);
    assert!(off(&found, matrix) < 1.01, "{}", off(&found, matrix));
    assert!(off(&found, DMat3::IDENTITY) > 100.0, "the control");
    let header = MetaData::read_from_file(&file, true)
        .unwrap()
        .headers
        .remove(0);
    // AP1 with the ACES white point, of Academy S-2014-004.
    let named = header.shared_attributes.chromaticities.unwrap();
    assert_eq!(
        (named.red, named.green),
        (Vec2(0.713, 0.293), Vec2(0.165, 0.830))
    );
    assert_eq!(
        (named.blue, named.white),
        (Vec2(0.128, 0.044), Vec2(0.32168, 0.33767))
    );
    // Daylight on white paint.
    let nits = header.own_attributes.white_luminance.unwrap();
    assert!((20e3..27e3).contains(&nits), "{nits} cd/m²");

    // A light layer is converted in the same way: its red equals the picture's.
    let read = exr::prelude::read_all_data_from_file(&file).unwrap();
    let list = &read.layer_data[0].channel_data.list;
    let samples = |name: &str| -> Vec<f32> {
        let channel = list.iter().find(|it| it.name.to_string() == name);
        match &channel.unwrap().sample_data {
            Levels::Singular(samples) => samples.values_as_f32().collect(),
            _ => panic!("one level"),
        }
    };
    assert_eq!(samples("sun.R"), samples("R"));

    let plain = written(&file, ColourSpaceSpec::Rec709);
    assert!(off(&plain, DMat3::IDENTITY) < 1.01);
    let header = MetaData::read_from_file(&file, true)
        .unwrap()
        .headers
        .remove(0);
    let named = header.shared_attributes.chromaticities.unwrap();
    assert_eq!(
        (named.red, named.white),
        (Vec2(0.64, 0.33), Vec2(0.3127, 0.3290))
    );
}
