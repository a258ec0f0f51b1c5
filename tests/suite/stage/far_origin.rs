//! Hard case 25: a scene ten kilometres from the world's origin behaves like the same
//! scene at the origin.

use std::fs;

use crate::support::job::{Job, assert_has};
use glam::DVec3;
use swell::{cache::CacheReader, render::image::read_png};

/// Displacement of the far scene, m; multiples of the spacing of 32-bit floats there, so that both
/// scenes have the same decimal numbers, moved.
const WAY: DVec3 = DVec3::new(10_000.0, 300.0, -20_000.0);
const SPACING: f64 = 0.1;
const CELL: f64 = 0.2;

/// Writes the shot of `Job` near the origin and moved by [`WAY`]: scene, look and probes.
fn job() -> Job {
    let job = Job::new();
    let file = |name: &str| fs::read_to_string(job.path(name)).unwrap();
    let [x, y, z] = WAY.to_array();
    let corner = |p: [f64; 3]| format!("[{:?}, {:?}, {:?}]", p[0] + x, p[1] + y, p[2] + z);
    let probes = |at: [f64; 3]| {
        let [px, py, pz] = at;
        format!(
            "\n[[probe]]\nkind = \"elevation\"\nname = \"gauge\"\nat = [{px:?}, {pz:?}]\n\
             \n[[probe]]\nkind = \"pressure\"\nname = \"floor\"\nat = [{px:?}, {py:?}, {pz:?}]\n\
             \n[grids]\nsurface = true\n"
        )
    };
    let at = [-0.7, 0.8, 0.75];
    let mut scene = file("small.toml");
    let moved = DVec3::from_array(at) + WAY;
    let mut far = scene.clone() + &probes(moved.to_array());
    scene += &probes(at);
    for p in [[-1.0, 0.5, 0.25], [1.0, 2.5, 1.25], [-0.2, 1.5, 1.25]] {
        far = far.replace(&format!("{p:?}"), &corner(p));
    }
    far = far.replace(
        "mesh = \"box.obj\"",
        &format!("mesh = \"box.obj\"\ntranslate = {:?}", WAY.to_array()),
    );
    job.write("near.toml", &scene);
    job.write("far.toml", &far);
    let look = file("look.toml")
        .replace("[\"png\", \"exr\"]", "[\"png\"]")
        .replace("[\"Z\"]", "[]");
    job.write("near-look.toml", &look);
    let mut there = look;
    for p in [[-2.0, 3.0, 2.5], [0.0, 1.0, 0.75]] {
        there = there.replace(&format!("{p:?}"), &corner(p));
    }
    job.write("far-look.toml", &there);
    job
}

/// Largest distance between the frames of both caches, with the far one moved back, in metres; and
/// the same if the far one had stored its positions in 32 bits.
fn apart(job: &Job, frame: u32) -> [f64; 2] {
    let open = |name: &str| CacheReader::open(&job.path(name)).unwrap();
    let (near, far) = (open("near"), open("far"));
    let origin = DVec3::from_array(far.manifest().origin);
    assert_eq!(near.manifest().origin, [0.0; 3]);
    let (a, b) = (near.read(frame).unwrap(), far.read(frame).unwrap());
    assert_eq!(a.id, b.id);
    let wide = |p: &[f32; 3]| DVec3::from_array(p.map(f64::from));
    let mut worst = [0.0f64; 2];
    for (p, q) in a.position.iter().zip(&b.position) {
        let world = origin + wide(q);
        let narrow = world.as_vec3().as_dvec3();
        for (worst, there) in worst.iter_mut().zip([world, narrow]) {
            *worst = worst.max((there - WAY).distance(wide(p)));
        }
    }
    worst
}

fn column(job: &Job, file: &str) -> Vec<f64> {
    let text = fs::read_to_string(job.path(file)).unwrap();
    let rows = text.lines().skip(2);
    rows.map(|row| row.rsplit(',').next().unwrap().parse().unwrap())
        .collect()
}

fn is_the_scene_moved(solver: &str, unit: f64) {
    let job = job();
    for name in ["near", "far"] {
        job.expect(0, &format!("bake {name}.toml --solver {solver} -o {name}"));
        job.expect(0, &format!("verify {name}"));
    }
    let frames = CacheReader::open(&job.path("near")).unwrap().last_frame();
    for frame in 0..=frames {
        let [wide, narrow] = apart(&job, frame);
        println!(
            "{solver}, frame {frame}: {:.1e} of d or Δx, in 32 bits {:.1e}",
            wide / unit,
            narrow / unit
        );
        // The pass mark of the case.
        assert!(wide < 1e-3 * unit, "frame {frame}: {wide} m");
        // Negative control: positions in 32 bits miss it before anything is solved.
        assert!(narrow > 2e-3 * unit, "frame {frame}: {narrow} m");
    }
    let (near, far) = (
        column(&job, "near/probes/gauge.csv"),
        column(&job, "far/probes/gauge.csv"),
    );
    assert_eq!(near.len(), frames as usize);
    for (a, b) in near.iter().zip(&far) {
        assert!((a + WAY.y - b).abs() < 1e-3 * unit, "{a} {b}");
    }

    // A stopped and resumed bake ends with the same bytes.
    job.expect(
        0,
        &format!("bake far.toml --solver {solver} -o stopped --frames 1-3"),
    );
    job.expect(
        0,
        &format!("bake far.toml --solver {solver} -o stopped --resume"),
    );
    assert_eq!(job.hash("stopped"), job.hash("far"));
    // The reference pass agrees with the step after it as well.
    job.expect(0, "check far --frames 0,4");
    // `diff` compares in world coordinates, in which the caches are that displacement apart.
    let found = job.json(1, "diff far near --frames 4");
    let most = found["diff"]["frames"][0]["fields"][0]["deviation"]["max"]
        .as_f64()
        .unwrap();
    assert!((most / WAY.length() - 1.0).abs() < 1e-3, "{found}");

    // Pictures are taken at each place.
    for (cache, look) in [
        ("near", "near-look"),
        ("far", "far-look"),
        ("far", "near-look"),
    ] {
        job.expect(
            0,
            &format!("render {cache} --look {look}.toml --frames 6 -o {cache}-{look}"),
        );
    }
    let picture = |folder: &str| {
        read_png(&job.path(folder).join("small.0006.png"))
            .unwrap()
            .2
    };
    let difference = |a: &str, b: &str| {
        let (a, b) = (picture(a), picture(b));
        let all = a.iter().flatten().zip(b.iter().flatten());
        all.map(|(x, y)| f64::from((x - y).abs())).sum::<f64>() / (3 * a.len()) as f64
    };
    let same = difference("near-near-look", "far-far-look");
    let other = difference("near-near-look", "far-near-look");
    println!("{solver}: pictures differ by {same:.1e}, from elsewhere by {other:.1e}");
    // Half a step of eight bits, and far from a picture of another place.
    assert!(same < 0.5 / 255.0 && other > 20.0 * same, "{same} {other}");
    assert_has(&job.expect(0, "inspect far"), &["origin"]);
}

#[test]
fn pbf_far_off_is_pbf_moved() {
    is_the_scene_moved("pbf", SPACING);
}

#[test]
fn flip_far_off_is_flip_moved() {
    is_the_scene_moved("flip", CELL);
}
