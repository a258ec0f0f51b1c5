//! Flicker: a frame compared with the mean of its neighbours. Also, pictures do not depend on what
//! was rendered before.

use std::{fs, path::Path};

use swell::domain::particles::Particles;
use swell::render::image::{Pixels, read_png};

use crate::support::job::{Job, LOOK};
use crate::support::made_cache::{Made, write_cache};

/// A part of a picture: rows from the top and columns from the left, from and to, as fractions of
/// its height and width.
type Part = [[f64; 2]; 2];

/// Rms difference, over a part of the picture, between a frame and the mean of the frames before
/// and after it, in 1/255.
fn residual(frames: [&Pixels; 3], part: Part) -> f64 {
    let [before, at, after] = frames;
    let (width, height) = (at.0, at.1);
    let range =
        |[from, to]: [f64; 2], n: usize| (from * n as f64) as usize..(to * n as f64) as usize;
    let (mut sum, mut count) = (0.0, 0);
    for y in range(part[0], height) {
        for x in range(part[1], width) {
            for c in 0..3 {
                let value = |of: &Pixels| f64::from(of.2[y * width + x][c]);
                let off = value(at) - 0.5 * (value(before) + value(after));
                sum += off * off;
                count += 1;
            }
        }
    }
    255.0 * (sum / f64::from(count)).sqrt()
}

const WHOLE: Part = [[0.0, 1.0], [0.0, 1.0]];

#[test]
fn what_changes_evenly_does_not_flicker() {
    let grey = |value: f32| -> Pixels { (4, 2, vec![[value; 4]; 8]) };
    let [a, b, c, d] = [0.2, 0.3, 0.4, 0.5].map(grey);
    assert!(residual([&a, &b, &c], WHOLE) < 1e-4);
    assert!((residual([&a, &d, &c], WHOLE) - 255.0 * 0.2).abs() < 1e-3);
}

/// Not a test: prints the residual of three pictures. `SWELL_FLICKER` is their comma-separated
/// names; `SWELL_PART` is four numbers, the part of the picture: from and to, of its height and of
/// its width.
#[test]
#[ignore = "measures pictures that $SWELL_FLICKER names"]
fn flicker() {
    let names = std::env::var("SWELL_FLICKER").unwrap();
    let pictures: Vec<Pixels> = (names.split(','))
        .map(|name| read_png(Path::new(name)).unwrap())
        .collect();
    let part = std::env::var("SWELL_PART").map_or(WHOLE, |text| {
        let n: Vec<f64> = text.split(',').map(|n| n.parse().unwrap()).collect();
        [[n[0], n[1]], [n[2], n[3]]]
    });
    let [a, b, c] = [&pictures[0], &pictures[1], &pictures[2]];
    println!("{:.2} / 255", residual([a, b, c], part));
}

/// Shreds: every third particle, moving up and down about its position from frame to frame.
fn shredded(frame: u32, water: &mut Particles) {
    let keep: Vec<bool> = (0..water.len()).map(|k| k % 3 == 0).collect();
    water.retain(&keep);
    for (k, p) in water.position.iter_mut().enumerate() {
        let phase = (7 * k as u32 + 3 * frame) % 10;
        p[1] += 0.02 * phase as f32;
    }
}

/// A look with all features that use neighbouring frames.
fn look() -> String {
    LOOK.replace("samples = 1", "samples = 2\nshutter = 0.5")
        + "[water]\nspray = { density_per_metre = 9.0, speed_m_per_s = 0.5 }\n"
}

fn cache(job: &Job, name: &str, last: u32) {
    let made = Made {
        last,
        spoil: &shredded,
        ..Made::default()
    };
    write_cache(&job.path(name), &made);
}

#[test]
fn pictures_do_not_depend_on_what_was_rendered_before() {
    let job = Job::of(&[("look.toml", &look())]);
    cache(&job, "cache", 6);
    let render = |words: &str| job.expect(0, &format!("render {words} --look look.toml"));
    render("cache -o all");
    let picture = |folder: &str, frame: u32| {
        fs::read(job.path(&format!("{folder}/small.{frame:04}.exr"))).unwrap()
    };
    for (folder, frames) in [("one", "3"), ("back", "5,1")] {
        render(&format!("cache -o {folder} --frames {frames}"));
    }
    assert!(picture("one", 3) == picture("all", 3));
    assert!(picture("back", 5) == picture("all", 5) && picture("back", 1) == picture("all", 1));
    // Existing pictures are also identified by their neighbouring frames.
    assert!(render("cache -o all").contains("6 already existed"));
    // Control: a bake that ended at frame 3 has nothing after it.
    cache(&job, "short", 3);
    render("short -o short-pictures");
    assert!(picture("short-pictures", 3) != picture("all", 3));
    assert!(picture("short-pictures", 1) == picture("all", 1));
}

#[test]
fn a_camera_under_water_is_refused_by_splats() {
    let text = LOOK.replace("[-2.0, 3.0, 2.5]", "[-0.5, 1.0, 0.75]");
    let method = "[renderer]\nmethod = \"ssfr\"\n\n[sky]";
    let job = Job::of(&[
        ("under.toml", &text),
        ("named.toml", &text.replace("[sky]", method)),
        (
            "rays.toml",
            &text.replace("[sky]", &method.replace("ssfr", "ray")),
        ),
        ("look.toml", LOOK),
    ]);
    write_cache(&job.path("cache"), &Made::default());
    for name in ["under", "named"] {
        let said = job.expect(
            2,
            &format!("render cache --look {name}.toml --frames 2 -o {name}"),
        );
        assert!(
            said.contains("renderer.method") && said.contains("frame 2"),
            "{said}"
        );
        assert!(said.contains("method = \"ray\""), "{said}");
    }
    for name in ["rays", "look"] {
        job.expect(
            0,
            &format!("render cache --look {name}.toml --frames 2 -o {name}"),
        );
    }
}
