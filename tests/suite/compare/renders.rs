//! `swell diff` of renders, and what it refuses to compare.

use std::{fs, path::Path};
use swell::files::parse_look;

use crate::support::job::{Job, LOOK, assert_has};
use crate::support::made_cache::{Made, write_cache};
use swell::render::{
    Attributes, Image,
    image::{read_png, write_exr, write_png},
};

/// A shaded ball; `spot` is added to the pixel at (10, 5).
fn picture(width: u32, spot: f32) -> Image {
    let mut image = Image::new(width, 32);
    for (k, pixel) in image.beauty.iter_mut().enumerate() {
        let (x, y) = (
            k as f32 % width as f32 - 24.0,
            (k as f32 / width as f32).floor() - 16.0,
        );
        let ball = (1.0 - (x * x + y * y) / 200.0).max(0.0).sqrt();
        *pixel = [ball, 0.5 * ball + 0.1, 0.2, 1.0];
    }
    image.beauty[5 * width as usize + 10][1] += spot;
    image
}

#[test]
fn renders_are_compared_by_name_with_a_difference_image() {
    let job = Job::of(&[]);
    let look = parse_look(LOOK, Path::new("look.toml")).unwrap();
    let from = Attributes::default();
    for (folder, spot) in [("a", 0.25), ("b", 0.0)] {
        fs::create_dir(job.path(folder)).unwrap();
        let file = |name: &str| job.path(folder).join(name);
        for name in ["s.0001.png", "s.0002.png"] {
            let spot = if name.contains('2') { spot } else { 0.0 };
            write_png(&file(name), &picture(48, spot), &look.spec().view).unwrap();
        }
        write_exr(&file("s.0002.exr"), &picture(48, spot), &from).unwrap();
    }
    assert_has(
        &job.expect(0, "diff a b --frames 1"),
        &["100.000", "the same, bit for bit"],
    );
    let found = job.json(1, "diff a b -o out --gain 2");
    let pairs = found["diff"]["pairs"].as_array().unwrap();
    let names: Vec<_> = pairs
        .iter()
        .map(|pair| pair["name"].as_str().unwrap())
        .collect();
    assert_eq!(names, ["s.0001.png", "s.0002.exr", "s.0002.png"]);
    assert_eq!(pairs[0]["diff"]["perceptual"], 100.0);
    let exr = &pairs[1]["diff"];
    // Half floats near 0.5 are 2⁻¹¹ apart.
    assert!((exr["max"].as_f64().unwrap() - 0.25).abs() < 1e-3, "{exr}");
    assert_eq!(exr["max_at"], serde_json::json!([10, 5]));
    assert_eq!(exr["p99"], 0.0);
    assert!(exr["perceptual"].as_f64().unwrap() < 100.0);

    // The difference image is black except for the spot, which is 0.25 × 2 × 255.
    let (width, height, pixels) = read_png(&job.path("out/s.0002.exr.difference.png")).unwrap();
    assert_eq!((width, height), (48, 32));
    let lit: Vec<usize> = (0..pixels.len()).filter(|&k| pixels[k][1] > 0.0).collect();
    assert_eq!(lit, [5 * 48 + 10]);
    assert!((pixels[lit[0]][1] - 0.5).abs() < 2.5e-3);

    job.write("loose.toml", "[pictures]\nmean = 0.01\nperceptual = 20\n");
    job.expect(0, "diff a b --tolerance loose.toml");
    job.write("tight.toml", "[pictures]\nmax = 0.1\n");
    let said = job.expect(1, "diff a/s.0002.exr b/s.0002.exr --tolerance tight.toml");
    assert_has(&said, &["s.0002.exr: max 0.25", "allowed 0.1000"]);

    // Another size, a missing picture.
    write_png(
        &job.path("a/s.0001.png"),
        &picture(40, 0.0),
        &look.spec().view,
    )
    .unwrap();
    fs::remove_file(job.path("b/s.0002.exr")).unwrap();
    let said = job.expect(1, "diff a b --tolerance loose.toml");
    assert_has(
        &said,
        &[
            "A is 40 × 32, B is 48 × 32",
            "pictures only in A: s.0002.exr",
        ],
    );
    let said = job.expect(2, "diff a/s.0002.exr b/s.0002.png");
    assert_has(&said, &["view transform"]);
    assert_has(&job.expect(2, "diff a b -o b"), &["choose another"]);
    assert_has(
        &job.expect(2, "diff a/s.0002.png b/s.0002.png -o b/s.0002.png"),
        &["choose another"],
    );
    assert_has(
        &job.expect(2, "diff a b --frames 7"),
        &["no picture of frame 7"],
    );
    fs::write(job.path("b/s.0002.png"), b"\x89PNG\r\n\x1a\n torn").unwrap();
    assert_has(&job.expect(4, "diff a b"), &["s.0002.png"]);
}

#[test]
fn pictures_of_other_windows_do_not_compare() {
    let job = Job::of(&[]);
    let write = |name: &str, corner: [i32; 2]| {
        let image = Image {
            corner,
            display: [80, 64],
            ..picture(48, 0.0)
        };
        write_exr(&job.path(name), &image, &Attributes::default()).unwrap();
    };
    write("a.exr", [16, 16]);
    write("b.exr", [16, 16]);
    write("beside.exr", [17, 16]);
    write("before.exr", [-4, -4]);
    job.expect(0, "diff a.exr b.exr");
    job.expect(0, "diff before.exr before.exr");
    let said = job.expect(1, "diff a.exr beside.exr");
    assert_has(
        &said,
        &[
            "A is 48 × 32 from 16, 16, B is 48 × 32 from 17, 16",
            "not compared",
        ],
    );
    let said = job.expect(1, "diff before.exr a.exr");
    assert_has(&said, &["A is 48 × 32 from -4, -4"]);
}

#[test]
fn what_does_not_compare_is_refused_in_words() {
    let job = Job::of(&[]);
    write_cache(
        &job.path("cache"),
        &Made {
            last: 1,
            ..Made::default()
        },
    );
    fs::create_dir(job.path("empty")).unwrap();
    fs::create_dir(job.path("renders")).unwrap();
    let look = parse_look(LOOK, Path::new("look.toml")).unwrap();
    write_png(
        &job.path("renders/s.0001.png"),
        &picture(48, 0.0),
        &look.spec().view,
    )
    .unwrap();
    job.write("notes.txt", "");
    for (code, arguments, words) in [
        (4, "cache nowhere", "nowhere"),
        (
            4,
            "cache empty",
            "neither a cache (no manifest.json) nor a PNG",
        ),
        (
            2,
            "cache renders",
            "cache is a cache, and renders is a folder of pictures",
        ),
        (2, "renders renders/s.0001.png", "a folder of pictures, and"),
        (
            2,
            "cache notes.txt",
            "not a cache folder, a baseline (.json) or a picture",
        ),
        (2, "cache", "required"),
        (2, "cache cache -o out", "difference images"),
        (2, "cache cache --gain 3", "--output"),
        (2, "renders renders -o out --gain 0", "above 0"),
        (
            2,
            "cache cache --write-baseline x.json",
            "cannot be used with",
        ),
        (4, "renders --write-baseline x.json", "no manifest.json"),
    ] {
        assert_has(&job.expect(code, &format!("diff {arguments}")), &[words]);
    }
    assert!(!job.path("x.json").exists() && !job.path("out").exists());
    let frame = job.path("cache/frames/small.0001.ply");
    let mut bytes = fs::read(&frame).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&frame, bytes).unwrap();
    assert_has(
        &job.expect(4, "diff cache cache"),
        &["small.0001.ply", "BLAKE3"],
    );
    job.expect(0, "diff cache cache --frames 0");
}
