//! `swell diff`: what differs is named, what does not passes, and every comparison fails when one side is
//! spoiled.
#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;
use swell::{
    cache::{CacheWriter, Clock, Manifest},
    domain::{particles::Particles, solver::StepReport},
    render::{
        Attributes, Image,
        image::{read_png, write_exr, write_png},
    },
    scene::{Scene, look::Look, physics_hash},
};
use tempfile::TempDir;

const SCENE: &str = r#"
[shot]
name = "small"
frames = 4
frames_per_second = 60

[domain]
min = [-1.0, 0.5, 0.25]
max = [1.0, 2.5, 1.25]

[[water.block]]
min = [-1.0, 0.5, 0.25]
max = [-0.2, 1.5, 1.25]

[solver]
method = "pbf"

[solver.pbf]
particle_spacing = 0.1
"#;

const LOOK: &str = r#"
[camera]
focal_length_mm = 35.0
film_back_mm = [36.0, 24.0]
position = [-2.0, 3.0, 2.5]
target = [0.0, 1.0, 0.75]

[image]
width = 48
height = 32
samples = 1

[sky]
model = "hosek_wilkie"

[sun]
azimuth_degrees = 120.0
elevation_degrees = 35.0

[output]
formats = ["png"]
"#;

struct Job {
    folder: TempDir,
}

/// What a made cache is, and what is spoiled of it.
struct Made<'a> {
    scene: &'a str,
    device: &'a str,
    last: u32,
    spoil: &'a dyn Fn(u32, &mut Particles),
}

impl Default for Made<'_> {
    fn default() -> Self {
        Self {
            scene: SCENE,
            device: "a device",
            last: 4,
            spoil: &|_, _| {},
        }
    }
}

/// A stand-in for a solver: a block of 8 × 10 × 10 particles that slides along x and sinks a little.
fn particles(frame: u32) -> Particles {
    let time = frame as f32 / 60.0;
    let place = |k: u32| {
        let [x, y, z] = [k % 8, k / 8 % 10, k / 80].map(|i| 0.1 * i as f32 + 0.05);
        [x - 1.0 + time, 0.5 + y - 0.1 * time * y, 0.25 + z]
    };
    Particles {
        position: (0..800).map(place).collect(),
        velocity: (0..800).map(|k| [1.0, -0.001 * k as f32, 0.0]).collect(),
        id: (0..800).collect(),
        ..Particles::default()
    }
}

fn report(frame: u32) -> Value {
    serde_json::to_value(StepReport {
        substeps: 1,
        iterations: 4,
        density_error_mean: 0.001 * f64::from(frame),
        density_error_p99: 0.01,
        density_error_max: 0.02,
        kinetic_energy: 1.0,
        potential_energy: 1.0,
        max_speed: 1.0,
        capped: 0,
        searched: 0,
        projection: None,
    })
    .unwrap()
}

impl Job {
    fn new() -> Self {
        Self {
            folder: TempDir::new().unwrap(),
        }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.path(name), text).unwrap();
    }

    /// Runs `swell diff`, expects an exit code, and gives both outputs.
    fn diff(&self, code: i32, words: &str) -> String {
        self.run(code, &format!("diff {words}"))
    }

    fn run(&self, code: i32, words: &str) -> String {
        let output = Command::new(env!("CARGO_BIN_EXE_swell"))
            .current_dir(self.folder.path())
            .args(words.split_whitespace())
            .output()
            .unwrap();
        let said = [output.stdout, output.stderr].concat();
        let said = String::from_utf8_lossy(&said).into_owned();
        assert_eq!(output.status.code(), Some(code), "swell {words}: {said}");
        said
    }

    fn json(&self, code: i32, words: &str) -> Value {
        serde_json::from_str(&self.diff(code, &format!("{words} --json"))).unwrap()
    }

    fn cache(&self, name: &str, made: &Made<'_>) {
        let scene = Scene::parse(made.scene, Path::new("s.toml"), Path::new(""), &[]).unwrap();
        let manifest = Manifest {
            format_version: Manifest::FORMAT_VERSION,
            program: "swell".to_owned(),
            program_version: "0.1.0".to_owned(),
            shot: scene.shot.name.clone(),
            scene_hash: physics_hash(&scene),
            solver: "pbf".to_owned(),
            device: made.device.to_owned(),
            driver: "its driver 1.2".to_owned(),
            backend: "Vulkan".to_owned(),
            frames_per_second: 60.0,
            particle_spacing: 0.1,
            rest_density: 1000.0,
            grids: None,
            probes: Vec::new(),
            attributes: Vec::new(),
            start_particles: 0,
            files: Vec::new(),
        };
        let of = |frame| {
            let mut particles = particles(frame);
            (made.spoil)(frame, &mut particles);
            particles
        };
        let toml = scene.to_toml(&|_, hash| hash.to_owned());
        let path = self.path(name);
        let mut writer =
            CacheWriter::create(&path, manifest, &toml, &[], &of(0), &Vec::new()).unwrap();
        for frame in 1..=made.last {
            let clock = Clock {
                frame,
                time: f64::from(frame) / 60.0,
                substeps: 1,
                steps: frame.into(),
            };
            writer
                .submit(clock, of(frame), Vec::new(), report(frame), Value::Null)
                .unwrap();
        }
        writer.finish().unwrap();
    }
}

/// The velocity of particle 123 from frame 3 on, the other way.
fn flipped(frame: u32, particles: &mut Particles) {
    if frame >= 3 {
        particles.velocity[123][0] *= -1.0;
    }
}

fn assert_has(said: &str, words: &[&str]) {
    for word in words {
        assert!(said.contains(word), "no {word:?} in: {said}");
    }
}

#[test]
fn equal_caches_are_equal_and_a_flipped_velocity_is_found() {
    let job = Job::new();
    job.cache("a", &Made::default());
    job.cache("b", &Made::default());
    let said = job.diff(0, "a b");
    assert_has(
        &said,
        &["the same physics", "frames 0-4", "the same, bit for bit"],
    );

    let spoiled = Made {
        spoil: &flipped,
        ..Made::default()
    };
    job.cache("spoiled", &spoiled);
    let said = job.diff(1, "spoiled b");
    assert_has(
        &said,
        &[
            "first other bit: frame 3, velocity of particle 123: A [-1.0",
            "OUT OF TOLERANCE",
        ],
    );
    let found = job.json(1, "spoiled b");
    assert_eq!(found["is_within"], false);
    let frames = found["diff"]["frames"].as_array().unwrap();
    assert_eq!(frames[2]["faults"].as_array().unwrap().len(), 0);
    let fault = &frames[3]["faults"][0];
    assert_eq!(
        (&fault["what"], &fault["measure"]),
        (&"velocity".into(), &"bits".into())
    );
    assert_eq!(fault["parting"]["particle"], 123);
    // The error of a velocity of 1 m/s turned round is 2 m/s; RMS over 800: 2/√800.
    let deviation = &frames[3]["fields"][1]["deviation"];
    assert_eq!(deviation["max"], 2.0);
    let rms = deviation["rms"].as_f64().unwrap();
    assert!((rms - 2.0 / 800f64.sqrt()).abs() < 1e-12, "{rms}");
    // Turned round is as fast: the kinetic energy does not see it, which is why particles are compared.
    let energies = &frames[3]["aggregates"];
    assert_eq!(energies[0]["kinetic_energy"], energies[1]["kinetic_energy"]);
    // The frames before are the same.
    job.diff(0, "spoiled b --frames 0-2");
}

#[test]
fn tolerances_come_from_a_file_and_judge_what_they_name() {
    let job = Job::new();
    job.cache("b", &Made::default());
    job.cache(
        "a",
        &Made {
            spoil: &flipped,
            ..Made::default()
        },
    );
    job.write(
        "loose.toml",
        "[velocity]\nmax = 2.0\n[aggregates]\nkinetic_energy = { relative = 0 }\n",
    );
    assert_has(
        &job.diff(0, "a b --tolerance loose.toml"),
        &["within tolerance"],
    );
    job.write("tight.toml", "[velocity]\nmax = 1.9\n");
    let said = job.diff(1, "a b --tolerance tight.toml");
    assert_has(
        &said,
        &["frame 3, velocity: max 2, allowed 1.900; particle 123"],
    );
    job.write("other.toml", "[position]\nmax = 0\nrms = 0\np99 = 0\n");
    job.diff(0, "a b --tolerance other.toml");

    // An aggregate on its own: a layer lifted raises the potential energy.
    let lift = |frame: u32, particles: &mut Particles| {
        if frame == 2 {
            particles.position[700][1] += 1.0;
        }
    };
    job.cache(
        "lifted",
        &Made {
            spoil: &lift,
            ..Made::default()
        },
    );
    // One particle of 1 kg by 1 m: m g h = 9.81 J, of about 800 · 9.81 · 0.5 J.
    job.write(
        "energy.toml",
        "[aggregates]\npotential_energy = { absolute = 9.7 }\n",
    );
    let said = job.diff(1, "lifted b --tolerance energy.toml");
    assert_has(
        &said,
        &["frame 2, potential_energy: difference 9.810, allowed 9.7"],
    );
    job.write(
        "energy.toml",
        "[aggregates]\npotential_energy = { relative = 0.003 }\n",
    );
    job.diff(0, "lifted b --tolerance energy.toml");

    for (text, words) in [
        (
            "[velocty]\nmax = 1\n",
            &["t.toml:1", "nearest is \"velocity\""][..],
        ),
        (
            "[velocity]\nmax = -1\n",
            &["t.toml:2: velocity.max", "from 0"],
        ),
        (
            "[attributes.foam]\nmax = 1\n",
            &["limits foam", "position, velocity"],
        ),
        (
            "[pictures]\nmax = 1\n",
            &["[pictures] alone", "[aggregates]"],
        ),
    ] {
        job.write("t.toml", text);
        assert_has(&job.diff(2, "a b --tolerance t.toml"), words);
    }
    assert_has(
        &job.diff(2, "a b --tolerance none.toml"),
        &["cannot read none.toml"],
    );
}

#[test]
fn ids_frames_and_settings_that_differ_are_told() {
    let job = Job::new();
    job.cache("b", &Made::default());
    let lose = |frame: u32, particles: &mut Particles| {
        if frame > 0 {
            for values in [&mut particles.position, &mut particles.velocity] {
                values.remove(40);
            }
            particles.id.remove(40);
        }
    };
    let other = SCENE.replace(
        "particle_spacing = 0.1",
        "particle_spacing = 0.1\niterations = 7",
    );
    let made = Made {
        scene: &other,
        spoil: &lose,
        last: 3,
        ..Made::default()
    };
    job.cache("a", &made);
    let said = job.diff(1, "a b");
    assert_has(
        &said,
        &[
            "solver.pbf.iterations was 4.0, is now 7.0",
            "frames in B alone: 4",
            "frame 1: 799 in both, 0 in A alone, 1 in B alone (first id 40)",
            "no other bit in what both have",
            "frame 1, particles: 1 on one side alone",
        ],
    );
    // Another setting alone is no fault.
    let made = Made {
        scene: &other,
        ..Made::default()
    };
    job.cache("setting", &made);
    assert_has(
        &job.diff(0, "setting b"),
        &["solver.pbf.iterations was 4.0"],
    );
    assert_has(
        &job.diff(4, "a b --frames 4"),
        &["has frames 0 to 3, not 4"],
    );
}

#[test]
fn a_baseline_knows_its_adapter_by_hashes_and_others_by_aggregates() {
    let job = Job::new();
    job.cache("b", &Made::default());
    let said = job.diff(0, "b --write-baseline base.json");
    assert_has(
        &said,
        &["base.json: 5 frames of a device (its driver 1.2, Vulkan)"],
    );
    assert_has(
        &job.diff(0, "b base.json"),
        &["by hashes", "within tolerance"],
    );

    // Another adapter: by aggregates, which a turned velocity does not change.
    let elsewhere = Made {
        device: "another device",
        spoil: &flipped,
        ..Made::default()
    };
    job.cache("elsewhere", &elsewhere);
    let said = job.diff(0, "elsewhere base.json");
    assert_has(
        &said,
        &[
            "by aggregates",
            "no hashes of this adapter, but of a device",
        ],
    );
    // On the adapter that it knows the same particles fail, by their hash.
    job.cache(
        "spoiled",
        &Made {
            spoil: &flipped,
            ..Made::default()
        },
    );
    let said = job.diff(1, "spoiled base.json");
    assert_has(
        &said,
        &[
            "frame 3, the particles' hash is another one",
            "much the same water",
        ],
    );
    job.diff(0, "spoiled base.json --frames 0-2");

    // Aggregates fail as well: the upper half of the water thrown up on another adapter.
    let thrown = |_: u32, particles: &mut Particles| {
        for position in &mut particles.position {
            position[1] += if position[1] > 1.0 { 0.5 } else { 0.0 };
        }
    };
    let thrown = Made {
        device: "another device",
        spoil: &thrown,
        ..Made::default()
    };
    job.cache("thrown", &thrown);
    let said = job.diff(1, "thrown base.json");
    assert_has(&said, &["by aggregates", "potential_energy: difference"]);

    // One digit of one hash.
    let text = fs::read_to_string(job.path("base.json")).unwrap();
    let base: Value = serde_json::from_str(&text).unwrap();
    let adapter = "a device (its driver 1.2, Vulkan)";
    let hash = base["hashes"][adapter][2].as_str().unwrap();
    let digit = if hash.starts_with('0') { "1" } else { "0" };
    job.write(
        "off.json",
        &text.replace(hash, &format!("{digit}{}", &hash[1..])),
    );
    assert_has(
        &job.diff(1, "b off.json"),
        &["frame 2, the particles' hash"],
    );

    // A second adapter is added beside the first, whose aggregates stay.
    let said = job.diff(0, "elsewhere --write-baseline base.json");
    assert_has(&said, &["hashes taken before and kept: a device"]);
    assert_has(
        &job.diff(0, "elsewhere base.json"),
        &["by hashes", "from a device"],
    );
    job.diff(0, "b base.json");
    // Written again it is the same file.
    let twice = fs::read(job.path("base.json")).unwrap();
    assert_has(&job.diff(0, "b --write-baseline base.json"), &["unchanged"]);
    assert_ne!(text.as_bytes(), twice);
    job.diff(0, "elsewhere --write-baseline base.json");
    // A bake of fewer frames lacks some.
    job.cache(
        "short",
        &Made {
            last: 2,
            ..Made::default()
        },
    );
    assert_has(&job.diff(1, "short base.json"), &["frames in B alone: 3-4"]);

    for (text, words) in [
        ("{}", &["no baseline", "format_version"][..]),
        ("not json", &["no baseline", "line 1"]),
        (
            &text.replace("\"volume\": {", "\"volum\": {"),
            &["no baseline"],
        ),
        (
            &text.replacen(&format!("\"{hash}\","), "", 1),
            &["has 4 of 5 frames"],
        ),
    ] {
        job.write("bad.json", text);
        assert_has(&job.diff(4, "b bad.json"), words);
        // What is no baseline is not written over.
        job.diff(4, "b --write-baseline bad.json");
        assert_eq!(fs::read_to_string(job.path("bad.json")).unwrap(), text);
    }
    job.write("t.toml", "[velocity]\nmax = 1\n");
    assert_has(
        &job.diff(2, "b base.json --tolerance t.toml"),
        &["its own tolerances"],
    );
}

#[test]
fn a_baked_cache_is_its_own_baseline_and_another_setting_is_not() {
    let job = Job::new();
    job.write("small.toml", SCENE);
    job.run(0, "bake small.toml -o a");
    job.run(0, "bake small.toml -o b");
    job.diff(0, "a b");
    job.diff(0, "a --write-baseline base.json");
    job.diff(0, "b base.json");
    // A changed setting is named, and where it begins to show.
    job.run(0, "bake small.toml -o c --set solver.pbf.iterations=5");
    let said = job.diff(1, "c b");
    assert_has(
        &said,
        &[
            "solver.pbf.iterations was 4.0, is now 5.0",
            "first other bit: frame 1, position of particle",
        ],
    );
    let said = job.diff(1, "c base.json");
    assert_has(
        &said,
        &[
            "by hashes",
            "solver.pbf.iterations was 4.0, is now 5.0",
            "frame 1",
        ],
    );
}

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
    let job = Job::new();
    let look = Look::parse(LOOK, Path::new("look.toml")).unwrap();
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
        &job.diff(0, "a b --frames 1"),
        &["100.000", "the same, bit for bit"],
    );
    let found = job.json(1, "a b -o out --gain 2");
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

    // The difference image is black but for the spot, which is 0.25 × 2 × 255.
    let (width, height, pixels) = read_png(&job.path("out/s.0002.exr.difference.png")).unwrap();
    assert_eq!((width, height), (48, 32));
    let lit: Vec<usize> = (0..pixels.len()).filter(|&k| pixels[k][1] > 0.0).collect();
    assert_eq!(lit, [5 * 48 + 10]);
    assert!((pixels[lit[0]][1] - 0.5).abs() < 2.5e-3);

    job.write("loose.toml", "[pictures]\nmean = 0.01\nperceptual = 20\n");
    job.diff(0, "a b --tolerance loose.toml");
    job.write("tight.toml", "[pictures]\nmax = 0.1\n");
    let said = job.diff(1, "a/s.0002.exr b/s.0002.exr --tolerance tight.toml");
    assert_has(&said, &["s.0002.exr: max 0.25", "allowed 0.1000"]);

    // Another size, a missing picture.
    write_png(
        &job.path("a/s.0001.png"),
        &picture(40, 0.0),
        &look.spec().view,
    )
    .unwrap();
    fs::remove_file(job.path("b/s.0002.exr")).unwrap();
    let said = job.diff(1, "a b --tolerance loose.toml");
    assert_has(
        &said,
        &[
            "A is 40 × 32, B is 48 × 32",
            "pictures in A alone: s.0002.exr",
        ],
    );
    let said = job.diff(2, "a/s.0002.exr b/s.0002.png");
    assert_has(&said, &["view transform"]);
    assert_has(&job.diff(2, "a b -o b"), &["choose another"]);
    assert_has(
        &job.diff(2, "a/s.0002.png b/s.0002.png -o b/s.0002.png"),
        &["choose another"],
    );
    assert_has(&job.diff(2, "a b --frames 7"), &["no picture of frame 7"]);
    fs::write(job.path("b/s.0002.png"), b"\x89PNG\r\n\x1a\n torn").unwrap();
    assert_has(&job.diff(4, "a b"), &["s.0002.png"]);
}

#[test]
fn what_does_not_compare_is_refused_in_words() {
    let job = Job::new();
    job.cache(
        "cache",
        &Made {
            last: 1,
            ..Made::default()
        },
    );
    fs::create_dir(job.path("empty")).unwrap();
    fs::create_dir(job.path("renders")).unwrap();
    let look = Look::parse(LOOK, Path::new("look.toml")).unwrap();
    write_png(
        &job.path("renders/s.0001.png"),
        &picture(48, 0.0),
        &look.spec().view,
    )
    .unwrap();
    job.write("notes.txt", "");
    for (code, arguments, words) in [
        (4, "cache nowhere", "nowhere"),
        (4, "cache empty", "no cache (no manifest.json) and no PNG"),
        (
            2,
            "cache renders",
            "cache is a cache, and renders is a folder of pictures",
        ),
        (2, "renders renders/s.0001.png", "a folder of pictures, and"),
        (
            2,
            "cache notes.txt",
            "no cache folder, baseline (.json) or picture",
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
        (4, "renders --write-baseline x.json", "holds no cache"),
    ] {
        assert_has(&job.diff(code, arguments), &[words]);
    }
    assert!(!job.path("x.json").exists() && !job.path("out").exists());
    let frame = job.path("cache/frames/small.0001.ply");
    let mut bytes = fs::read(&frame).unwrap();
    *bytes.last_mut().unwrap() ^= 1;
    fs::write(&frame, bytes).unwrap();
    assert_has(&job.diff(4, "cache cache"), &["small.0001.ply", "BLAKE3"]);
    job.diff(0, "cache cache --frames 0");
}
