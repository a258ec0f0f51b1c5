//! Wetness of solids: where water touches them, how they dry, streams that are stopped and resumed.

use std::fs;

use glam::{DVec3, Vec3};
use swell::{
    cache::CacheReader,
    domain::{mesh::TriangleMesh, particles::Particles, wet::WETNESS},
    render::image::read_png,
};

use crate::support::job::{Job, LOOK, assert_has};

/// Still water 0.5 m deep, a box that stands in it, and one that leaves it at 6 m/s.
const POOL: &str = r#"
[shot]
name = "pool"
frames = 8
frames_per_second = 60

[domain]
min = [0.0, 0.0, 0.0]
max = [2.0, 2.0, 1.0]

[[water.block]]
min = [0.0, 0.0, 0.0]
max = [2.0, 0.5, 1.0]

[[solid]]
mesh = "cube.obj"
scale = [0.4, 0.8, 0.4]
translate = [0.3, 0.1, 0.3]

[[solid]]
mesh = "cube.obj"
scale = 0.4
translate = [1.2, 0.3, 0.3]
direction = [0.0, 1.0, 0.0]
motion = { kind = "constant_velocity", velocity = 6.0 }

[solver]
method = "pbf"

[solver.pbf]
particle_spacing = 0.1
"#;

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n";

const SPACING: f64 = 0.1;
const SECONDS: f64 = 1.0 / 60.0;
const MAKE: &str = "wet cache/pool/pbf --dry 0.2";
const STREAM: &str = "cache/pool/pbf/wet/default";

fn baked() -> Job {
    let job = Job::of(&[("pool.toml", POOL), ("cube.obj", CUBE)]);
    job.expect(0, "bake pool.toml");
    job
}

fn points(job: &Job, stream: &str) -> Vec<Particles> {
    let reader = CacheReader::open(&job.path(stream)).unwrap();
    let frames = reader.first_frame()..=reader.last_frame();
    frames.map(|frame| reader.read(frame).unwrap()).collect()
}

fn wide(p: [f32; 3]) -> DVec3 {
    Vec3::from(p).as_dvec3()
}

/// Number of vertices of the first solid's surface.
fn first_surface(job: &Job) -> usize {
    let settings = fs::read(job.path(STREAM).join("assets/wet.json")).unwrap();
    let settings: serde_json::Value = serde_json::from_slice(&settings).unwrap();
    let surfaces = settings["surfaces"].as_array().unwrap();
    for (surface, file) in surfaces.iter().zip(["000-cube.ply", "001-cube.ply"]) {
        // Each file is a mesh that any program reads, and its vertices are the frame's.
        let path = job.path(STREAM).join("assets/wet").join(file);
        assert_eq!(surface["file"], format!("wet/{file}"));
        let mesh = TriangleMesh::load(&path).unwrap();
        assert_eq!(mesh.vertices.len() as u64, surface["vertices"]);
    }
    surfaces[0]["vertices"].as_u64().unwrap() as usize
}

/// At the start the water is a lattice up to 0.5 m, its highest particles at 0.45 m.
#[test]
fn a_box_in_still_water_is_wet_up_to_the_level() {
    let job = baked();
    job.expect(0, MAKE);
    let start = &points(&job, STREAM)[0];
    let count = first_surface(&job);
    let mut seen = [0; 2];
    for (p, &wetness) in start
        .position
        .iter()
        .zip(&start.attributes[WETNESS])
        .take(count)
    {
        // From the highest particles contact reaches √(1 − ½² − ½²) spacings up at least, and
        // √(1 − ½²) at most. The top face lies in the air.
        let above = (f64::from(p[1]) - 0.45) / SPACING;
        if above <= 0.5f64.sqrt() {
            assert_eq!(wetness, 1.0, "{p:?}");
            seen[0] += 1;
        } else if above > 0.75f64.sqrt() {
            assert_eq!(wetness, 0.0, "{p:?}");
            seen[1] += 1;
        }
    }
    assert!(seen[0] > 50 && seen[1] > 50, "{seen:?}");
    assert_eq!(start.velocity, vec![[0.0; 3]; start.len()]);
}

/// Against every pair of point and particle, and the closed form since the last contact.
#[test]
fn what_leaves_the_water_dries_exponentially() {
    let job = baked();
    job.expect(0, MAKE);
    let stream = points(&job, STREAM);
    let water = points(&job, "cache/pool/pbf");
    let count = first_surface(&job);
    let many = stream[0].len();
    let mut last: Vec<Option<usize>> = vec![None; many];
    let mut longest = 0;
    for (frame, (now, water)) in stream.iter().zip(&water).enumerate() {
        for (k, last) in last.iter_mut().enumerate() {
            let is_moving = k >= count;
            let way = match is_moving {
                true => 6.0 * SECONDS * frame as f64 * DVec3::Y,
                false => DVec3::ZERO,
            };
            let point = wide(now.position[k]);
            // Positions are rounded to f32.
            assert!(point.distance(wide(stream[0].position[k]) + way) < 1e-6);
            if frame > 0 {
                let speed = wide(now.velocity[k]).distance(way / (SECONDS * frame as f64));
                assert!(speed < 1e-4, "{speed}");
            }
            let mut near = water.position.iter();
            if near.any(|q| wide(*q).distance(point) <= SPACING) {
                *last = Some(frame);
            }
            let expected = last.map_or(0.0, |last| {
                longest = longest.max(if is_moving { frame - last } else { 0 });
                (-((frame - last) as f64) * SECONDS / 0.2).exp()
            });
            let found = f64::from(now.attributes[WETNESS][k]);
            // A rounding to f32 a frame, and of the frames' times.
            let allowed = f64::from(f32::EPSILON) * (frame as f64 + 1.0);
            assert!(
                (found - expected).abs() <= allowed,
                "{frame} {k}: {found} {expected}"
            );
        }
    }
    // The moving box has dried for at least four frames somewhere, after it was wet.
    assert!(longest >= 4, "{longest}");
}

/// A floating body is wet in its own frame: its points keep their distances while it moves.
#[test]
fn bodies_carry_their_wetness() {
    let job = baked();
    let body = "[[body]]\nmesh = \"cube.obj\"\nscale = 0.3\ntranslate = [1.3, 0.42, 0.3]\n\
                density = 500.0\nvelocity = [-1.0, 0.0, 0.0]\n[solver]\nmethod = \"flip\"\n\
                [solver.flip]\ncell_size = 0.2\n";
    let (before, _) = POOL.split_once("[[solid]]").unwrap();
    job.write(
        "raft.toml",
        &format!("{}{body}", before.replace("pool", "raft")),
    );
    job.expect(0, "bake raft.toml --frames 1-4");
    job.expect(0, "wet cache/raft/flip --dry 1000");
    let all = points(&job, "cache/raft/flip/wet/default");
    let [first, last] = [&all[0], &all[4]];
    let apart =
        |points: &Particles, k: usize| wide(points.position[k]).distance(wide(points.position[0]));
    for k in 0..first.len() {
        assert!((apart(first, k) - apart(last, k)).abs() < 1e-6);
        // Wet at the start stays wet within the shot.
        let [before, now] = [first, last].map(|it| it.attributes[WETNESS][k]);
        assert!(now >= before * (-4.0f32 / 60.0 / 1000.0).exp() - 1e-6);
    }
    let moved = wide(last.position[0]).distance(wide(first.position[0]));
    assert!(moved > 0.02, "{moved}");
    let wet = first.attributes[WETNESS]
        .iter()
        .filter(|it| **it == 1.0)
        .count();
    assert!(wet > 10 && wet < first.len(), "{wet}");
}

#[test]
fn a_stream_is_verified_compared_and_resumed_to_the_same_bytes() {
    let job = baked();
    let bake = job.hash("cache/pool/pbf");
    let said = job.expect(0, &format!("{MAKE} --dry-run"));
    assert_has(&said, &["would make 8 frames (1 to 8)"]);
    assert!(!job.path("cache/pool/pbf/wet").exists());
    assert_eq!(job.hash("cache/pool/pbf"), bake);
    job.expect(0, MAKE);
    let whole = job.hash(STREAM);
    job.expect(0, &format!("verify {STREAM}"));
    job.expect(0, "verify cache/pool/pbf");
    job.expect(0, &format!("diff {STREAM} {STREAM}"));
    let told = job.json(0, &format!("inspect {STREAM}"));
    assert_eq!(told["kind"], "wet");
    let told = job.json(0, "inspect cache/pool/pbf");
    assert_eq!(
        (&told["wet"][0]["name"], &told["wet"][0]["last"]),
        (&"default".into(), &8.into())
    );
    job.expect(0, &format!("{MAKE} --overwrite --last 3"));
    assert_ne!(job.hash(STREAM), whole);
    assert_has(&job.expect(0, MAKE), &["frame    4", "5 frames"]);
    assert_eq!(job.hash(STREAM), whole);
    assert_has(&job.expect(0, MAKE), &["0 frames"]);
    // Other settings are another stream, with other bytes.
    let said = job.expect(4, "wet cache/pool/pbf --dry 0.3");
    assert_has(&said, &["other settings", "--name", "--overwrite"]);
    assert_eq!(job.hash(STREAM), whole);
    job.expect(0, "wet cache/pool/pbf --dry 0.3 --name slow");
    job.expect(1, &format!("diff {STREAM} cache/pool/pbf/wet/slow"));
    // Controls: damage is found, by verify and on resume.
    let frame = job.path(STREAM).join("frames/pool.0008.ply");
    let mut bytes = fs::read(&frame).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&frame, bytes).unwrap();
    assert_has(
        &job.expect(4, &format!("verify {STREAM}")),
        &["pool.0008.ply"],
    );
    assert_has(&job.expect(4, MAKE), &["pool.0008.ply"]);
}

#[test]
fn wetness_that_cannot_be_made_is_refused() {
    let job = baked();
    let refused = |words: &str, part: &str| {
        job.expect_clear(2, words, part);
        assert!(!job.path("cache/pool/pbf/wet").exists(), "{words}");
    };
    refused("wet cache/pool/pbf --dry 0", "drying time is 0");
    refused("wet cache/pool/pbf --dry -1", "-1");
    refused("wet cache/pool/pbf --within nan", "contact distance");
    refused("wet cache/pool/pbf --edge 0.00002", "--edge");
    refused("wet cache/pool/pbf --last 9", "0 to 8");
    refused("wet cache/pool/pbf --name a/b", "--name");
    job.expect_clear(4, "wet cache/nothing", "cache/nothing");
    job.expect(0, MAKE);
    job.expect_clear(2, &format!("wet {STREAM}"), "a stream of wetness");
    job.expect_clear(2, &format!("whitewater {STREAM}"), "a stream of wetness");
    job.expect_clear(2, &format!("check {STREAM}"), "a stream of wetness");
    // A scene of water and walls alone.
    let (before, _) = POOL.split_once("[[solid]]").unwrap();
    let solver = &POOL[POOL.find("[solver]").unwrap()..];
    let bare = format!("{}{solver}", before.replace("pool", "bare"));
    job.write("bare.toml", &bare);
    job.expect(0, "bake bare.toml --frames 1");
    job.expect_clear(2, "wet cache/bare/pbf", "has no solids");
    assert!(!job.path("cache/bare/pbf/wet").exists());
}

/// A shot's solids are refined, and have a value for each vertex in the layers of the frames.
#[test]
fn a_usd_shot_has_the_wetness_of_its_solids() {
    let job = baked();
    let said = job.expect(4, "export cache/pool/pbf --usd shot.usda --wet default");
    assert_has(&said, &["`swell wet cache/pool/pbf --name default`"]);
    assert!(!job.path("shot.usda").exists());
    job.expect(0, MAKE);
    let count = first_surface(&job);
    job.expect(
        0,
        "export cache/pool/pbf --usd shot.usda --wet default --frames 6-8",
    );
    let text = |name: &str| fs::read_to_string(job.path(name)).unwrap();
    let (root, frame) = (text("shot.usda"), text("shot.0008.usda"));
    assert_eq!(root.matches("float[] primvars:wetness").count(), 2);
    let stream = &points(&job, STREAM)[8];
    // The values after `8: [`, solid after solid.
    let solids = frame.split_once("over \"solids\"").unwrap().1;
    let values: Vec<Vec<f32>> = (solids.split("8: [").skip(1))
        .map(|rest| {
            let list = rest.split_once(']').unwrap().0;
            list.split(',').map(|x| x.trim().parse().unwrap()).collect()
        })
        .collect();
    let [first, second] = &values[..] else {
        panic!("{} lists", values.len())
    };
    assert_eq!(
        [first.len(), first.len() + second.len()],
        [count, stream.len()]
    );
    assert_eq!([&first[..], second].concat(), stream.attributes[WETNESS]);
    // The same again is complete; another stream is another shot; without it there is none.
    let said = job.expect(
        0,
        "export cache/pool/pbf --usd shot.usda --wet default --frames 6-8",
    );
    assert_has(&said, &["0 files made"]);
    job.expect(0, "wet cache/pool/pbf --dry 9 --name slow");
    job.expect(
        4,
        "export cache/pool/pbf --usd shot.usda --wet slow --frames 6-8",
    );
    job.expect(0, "export cache/pool/pbf --usd dry.usda --frames 8");
    assert!(!text("dry.usda").contains("wetness") && !text("dry.0008.usda").contains("solids"));
    job.expect(2, "export cache/pool/pbf --npy p.%04d.npy --wet default");
}

#[test]
fn a_look_draws_the_wetness_that_it_names() {
    let job = baked();
    job.write("look.toml", LOOK);
    job.write("wet.toml", &format!("{LOOK}\n[wet]\n"));
    let draw = |code: i32, look: &str| {
        let words = format!("render cache/pool/pbf --look {look}.toml -o {look} --frames 8");
        job.expect(code, &words)
    };
    let said = draw(4, "wet");
    assert_has(&said, &["`swell wet cache/pool/pbf --name default`"]);
    assert!(!job.path("wet").exists());
    job.expect(0, &format!("{MAKE} --last 7"));
    assert_has(&draw(4, "wet"), &["frame 8 is missing"]);
    job.expect(0, MAKE);
    draw(0, "wet");
    draw(0, "look");
    let sum = |folder: &str| {
        let (_, _, pixels) = read_png(&job.path(folder).join("pool.0008.png")).unwrap();
        let all = pixels.as_flattened().iter();
        all.map(|&x| f64::from(x)).sum::<f64>()
    };
    assert!(sum("wet") < sum("look"), "{} {}", sum("wet"), sum("look"));
    // The same frame again stands; of another stream it is drawn again.
    assert_has(&draw(0, "wet"), &["1 already existed"]);
    job.expect(0, "wet cache/pool/pbf --dry 0.01 --overwrite");
    assert_has(&draw(0, "wet"), &["1 frame rendered"]);
    // A damaged surface.
    let surface = job.path(STREAM).join("assets/wet/000-cube.ply");
    let mut bytes = fs::read(&surface).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&surface, bytes).unwrap();
    assert_has(&draw(4, "wet"), &["000-cube.ply is damaged"]);
    job.write("bad.toml", &format!("{LOOK}\n[wet]\nroughness = 2\n"));
    assert_has(&draw(2, "bad"), &["bad.toml", "wet.roughness"]);
}
