//! Cryptomatte: the object that each pixel sees.

use std::collections::BTreeMap;

use swell::{
    gpu::adapter::Context,
    render::{Image, cryptomatte::id_of, image::write_exr},
};

use super::super::analytic::support::{context, spoiled};
use super::super::pictures::attributes;
use super::{METHODS, Setup};

fn picture(context: &Context, method: &str, image: &str) -> Image {
    let setup = Setup {
        method,
        image,
        surface: "",
        output: "cryptomatte = true\naovs = [\"Z\", \"P\", \"N\"]",
    };
    setup.draw(context)
}

/// Objects of a pixel with their coverage.
fn objects(image: &Image, i: usize) -> Vec<[f32; 2]> {
    let ranks = image.matte.as_ref().unwrap().ranks.iter();
    ranks
        .map(|rank| rank[i])
        .filter(|pair| pair[1] > 0.0)
        .collect()
}

/// Object at a position in the harbour, by its boxes.
fn name_at(p: [f32; 3]) -> &'static str {
    let within = |low: [f32; 3], high: [f32; 3]| {
        (0..3).all(|a| p[a] > low[a] - 1e-3 && p[a] < high[a] + 1e-3)
    };
    if within([3.0, 0.0, 0.5], [4.0, 1.8, 1.6]) {
        "tower"
    } else if within([3.5, 0.0, 2.4], [4.5, 1.1, 3.6]) {
        "shed"
    } else if p[2] < -1.5 || p[2] > 4.5 {
        "walls"
    } else {
        "water or ground"
    }
}

/// Number of pixels whose matte is not that of the object at their position, and numbers of pixels
/// by object.
fn wrong(context: &Context, method: &str) -> (usize, BTreeMap<&'static str, usize>) {
    let image = picture(context, method, "");
    let (p, z) = (
        image.aovs.p.as_ref().unwrap(),
        image.aovs.z.as_ref().unwrap(),
    );
    let spray = id_of("spray");
    let (mut off, mut seen) = (0, BTreeMap::new());
    for i in 0..p.len() {
        let Some(first) = objects(&image, i).into_iter().find(|pair| pair[0] != spray) else {
            continue;
        };
        // The ground outside the domain is also below the outer faces of the walls: position
        // identifies only things above it.
        if z[i] > 1e29 || p[i][1] < 1e-3 {
            continue;
        }
        let name = name_at(p[i]);
        *seen.entry(name).or_insert(0) += 1;
        let is_right = match name {
            "water or ground" => first[0] == id_of("water") || first[0] == id_of("ground"),
            name => first[0] == id_of(name),
        };
        off += usize::from(!is_right);
    }
    (off, seen)
}

#[test]
fn cryptomattes_cover_the_objects_seen_at_each_pixel() {
    for (method, pass) in [("ssfr", "ssfr/shade_objects"), ("ray", "rays/objects")] {
        let (off, seen) = wrong(&context(), method);
        assert!(
            seen.len() == 4 && seen.values().all(|&count| count > 50),
            "{method}: {seen:?}"
        );
        // Two samples of a pixel and its centre may see different things at edges: a line of pixels
        // around each of few outlines.
        let all: usize = seen.values().sum();
        assert!(20 * off < all, "{method}: {off} of {all}");
        let control = match method {
            "ssfr" => spoiled(pass, "object = solid_code(at);", "object = 4u;"),
            _ => spoiled(pass, "var object = found.material;", "var object = 4u;"),
        };
        let (off, _) = wrong(&control, method);
        assert!(20 * off > all, "{method}, the control: {off} of {all}");
    }
}

#[test]
fn coverages_add_up_to_one_where_no_sky_is() {
    for method in METHODS {
        let image = picture(&context(), method, "");
        let z = image.aovs.z.as_ref().unwrap();
        let width = image.width as usize;
        let mut asked = 0;
        for i in width + 1..z.len() - width - 1 {
            // Nor next to it.
            let around = [
                i - width - 1,
                i - width,
                i - width + 1,
                i - 1,
                i,
                i + 1,
                i + width - 1,
                i + width,
                i + width + 1,
            ];
            let sum: f32 = objects(&image, i).iter().map(|pair| pair[1]).sum();
            assert!(sum < 1.0 + 1e-6, "{method}: {sum}");
            if around.iter().all(|&k| z[k] < 1e29) {
                asked += 1;
                assert!((sum - 1.0).abs() < 1e-6, "{method}, pixel {i}: {sum}");
            } else if around.iter().all(|&k| z[k] > 1e29) {
                let [.., alpha] = image.beauty[i];
                assert!(sum < 1.0 && alpha == 1.0, "the sky is no object: {sum}");
            }
        }
        assert!(asked > 5000, "{method}: {asked}");
        // Spray covers a part of some pixels.
        let parts = (0..z.len())
            .filter(|&i| objects(&image, i).len() > 1)
            .count();
        assert!(parts > 100, "{method}: {parts}");
    }
}

#[test]
fn a_file_has_the_layer_its_manifest_and_its_key() {
    use exr::prelude::{MetaData, Text};
    let image = picture(&context(), "ssfr", "");
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("a.exr");
    write_exr(&file, &image, &attributes()).unwrap();
    let header = MetaData::read_from_file(&file, true)
        .unwrap()
        .headers
        .remove(0);
    let names: Vec<String> = header
        .channels
        .list
        .iter()
        .map(|it| it.name.to_string())
        .collect();
    // Six objects: six ranks in three layers.
    for k in 0..3 {
        for suffix in ["R", "G", "B", "A"] {
            let name = format!("CryptoObject0{k}.{suffix}");
            assert!(names.contains(&name), "{name}: {names:?}");
        }
    }
    assert!(!names.contains(&"CryptoObject03.R".to_owned()));
    let attribute = |name: &str| {
        let key = Text::from(format!("cryptomatte/3ae39a5/{name}").as_str());
        let all = [
            &header.shared_attributes.other,
            &header.own_attributes.other,
        ];
        let found = all.iter().find_map(|attributes| attributes.get(&key));
        found
            .and_then(|value| value.to_text().ok())
            .unwrap()
            .to_string()
    };
    assert_eq!(attribute("name"), "CryptoObject");
    assert_eq!(attribute("hash"), "MurmurHash3_32");
    assert_eq!(attribute("conversion"), "uint32_to_float32");
    let manifest: BTreeMap<String, String> = serde_json::from_str(&attribute("manifest")).unwrap();
    let found: Vec<&str> = manifest.keys().map(String::as_str).collect();
    assert_eq!(
        found,
        ["ground", "shed", "spray", "tower", "walls", "water"]
    );
    for (name, hex) in &manifest {
        assert_eq!(u32::from_str_radix(hex, 16).unwrap(), id_of(name).to_bits());
    }
}
