//! Overscan and crop: pixels inside are those of the plain picture.

use exr::prelude::{IntegerBounds, MetaData, Vec2};
use swell::render::{
    Image,
    image::{read_png, write_exr, write_png},
};
use swell::scene::look::ViewSpec;

use super::super::analytic::support::context;
use super::super::pictures::attributes;
use super::{METHODS, Setup};

const AOVS: &str = "aovs = [\"Z\", \"N\", \"P\", \"forward\", \"thickness\"]";

fn picture(method: &str, image: &str, surface: &str) -> Image {
    let setup = Setup {
        method,
        image,
        surface,
        output: AOVS,
    };
    setup.draw(&context())
}

/// All channels of a pixel, as bits.
fn pixel(image: &Image, i: usize) -> Vec<u32> {
    let aovs = &image.aovs;
    let values = image.beauty[i].into_iter();
    let values = values.chain([
        aovs.z.as_ref().unwrap()[i],
        aovs.thickness.as_ref().unwrap()[i],
    ]);
    let values = values.chain(aovs.n.as_ref().unwrap()[i]);
    let values = values.chain(aovs.p.as_ref().unwrap()[i]);
    let values = values.chain(aovs.forward.as_ref().unwrap()[i]);
    values.map(f32::to_bits).collect()
}

/// Number of pixels common to both, and of those that differ, with `a` shifted by `shift` pixels to
/// the right.
fn differing(a: &Image, b: &Image, shift: i32) -> (usize, usize) {
    let (mut common, mut off) = (0, 0);
    for i in 0..a.beauty.len() {
        let width = a.width as usize;
        let x = (i % width) as i32 + a.corner[0] + shift - b.corner[0];
        let y = (i / width) as i32 + a.corner[1] - b.corner[1];
        if (0..b.width as i32).contains(&x) && (0..b.height as i32).contains(&y) {
            common += 1;
            let at = y as usize * b.width as usize + x as usize;
            off += usize::from(pixel(a, i) != pixel(b, at));
        }
    }
    (common, off)
}

#[test]
fn pixels_of_a_crop_are_those_of_the_whole_picture() {
    for method in METHODS {
        let whole = picture(method, "", "");
        let part = picture(method, "crop = [31, 17, 122, 80]", "");
        assert_eq!((part.width, part.height, part.corner), (91, 63, [31, 17]));
        assert_eq!(differing(&part, &whole, 0), (91 * 63, 0), "{method}");
        // The camera is the same.
        assert_eq!(part.view, whole.view);
        let (common, off) = differing(&part, &whole, 1);
        assert!(2 * off > common, "{method}, the control: {off} of {common}");
    }
}

/// With rays every bit is the same; with splats, wherever neither smoothing, a reflected ray nor a
/// view through a sheet reaches past the frame's margin: here nothing is smoothed, nothing opaque
/// is reflected, and no sheet refracts that far.
#[test]
fn pixels_within_overscan_are_those_of_the_plain_picture() {
    for method in METHODS {
        let (scene, water) = super::harbour();
        let draw = |image: &str| {
            let setup = Setup {
                method,
                image,
                surface: "smoothing_width_m = 0.0",
                output: AOVS,
            };
            let mut text = setup.look();
            let mut scene = scene.clone();
            if method == "ssfr" {
                scene.solids.clear();
                let bare = super::OBLIQUE.replace("[basin]\nheight_m = 1.0\n", "");
                let bare = bare
                    .replace("[image]\n", &format!("[image]\n{image}\n"))
                    .replace("[surface]\n", "[surface]\nsmoothing_width_m = 0.0\n");
                let bare = format!("{bare}[output]\nformats = [\"exr\"]\n{AOVS}\n");
                text = swell::files::parse_look(&bare, std::path::Path::new("t.toml")).unwrap();
            }
            super::draw(&context(), &text, &scene, &water)
        };
        let plain = draw("");
        // Not a multiple of the frame's padding.
        let wide = draw("overscan = 13");
        assert_eq!(
            (wide.width, wide.height, wide.corner),
            (186, 116, [-13, -13])
        );
        assert_eq!(differing(&wide, &plain, 0), (160 * 90, 0), "{method}");
        assert_eq!(wide.view, plain.view);
        let (common, off) = differing(&wide, &plain, 1);
        assert!(2 * off > common, "{method}, the control: {off} of {common}");
        // The pixels outside are rendered too.
        let beyond = wide.beauty[..186].iter();
        assert!(beyond.clone().any(|p| p[0] > 0.0) && beyond.clone().all(|p| p[3] > 0.0));
    }
}

#[test]
fn files_have_both_windows_and_a_png_the_image_alone() {
    let folder = tempfile::tempdir().unwrap();
    let windows = |image: &Image| {
        let file = folder.path().join("a.exr");
        write_exr(&file, image, &attributes()).unwrap();
        let header = MetaData::read_from_file(&file, true)
            .unwrap()
            .headers
            .remove(0);
        let data = IntegerBounds::new(header.own_attributes.layer_position, header.layer_size);
        (header.shared_attributes.display_window, data)
    };
    let shown = |image: &Image| {
        let file = folder.path().join("a.png");
        write_png(&file, image, &ViewSpec::default()).unwrap();
        read_png(&file).unwrap()
    };
    let draw = |image: &str| picture("ssfr", image, "");
    let display = IntegerBounds::new(Vec2(0, 0), Vec2(160, 90));
    let (plain, wide) = (draw(""), draw("overscan = 13"));
    assert_eq!(windows(&plain), (display, display));
    let data = IntegerBounds::new(Vec2(-13, -13), Vec2(186, 116));
    assert_eq!(windows(&wide), (display, data));
    let part = draw("crop = [31, 17, 122, 80]");
    let data = IntegerBounds::new(Vec2(31, 17), Vec2(91, 63));
    assert_eq!(windows(&part), (display, data));

    let (width, height, whole) = shown(&plain);
    assert_eq!((width, height), (160, 90));
    assert_eq!(shown(&wide).2.len(), whole.len());
    let (width, height, pixels) = shown(&part);
    assert_eq!((width, height), (160, 90));
    for (i, pixel) in pixels.iter().enumerate() {
        let (x, y) = (i % 160, i / 160);
        let is_inside = (31..122).contains(&x) && (17..80).contains(&y);
        // Pixels that were not rendered are black and transparent.
        let expected = if is_inside { whole[i] } else { [0.0; 4] };
        assert_eq!(*pixel, expected, "{x}, {y}");
    }
}
