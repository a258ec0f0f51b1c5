//! Whitewater streams: made, stopped, resumed, tuned, refused.

use std::fs;

use swell::{
    cache::CacheReader,
    domain::{
        particles::Particles,
        whitewater::{self, KIND},
    },
    render::image::read_png,
};

use crate::support::job::{Job, assert_has};

/// Thresholds low enough and rates high enough for the small splash of a job, and lifetimes as
/// short as the shot.
const SETTINGS: &str = "radius = [0.0025, 0.008]\n\
    [emission]\ntrapped_air = [0.001, 0.01]\nwave_crest = [0.02, 0.2]\nenergy = [0.001, 0.05]\n\
    trapped_air_rate = 3e5\nwave_crest_rate = 1e6\n\
    [foam]\nlifetime = [0.02, 0.1]\ncrowd = 6400\n";
const MAKE: &str = "whitewater cache/small/pbf --settings tuned.toml";
const STREAM: &str = "cache/small/pbf/whitewater/tuned";

fn baked() -> Job {
    let job = Job::new();
    job.write("tuned.toml", SETTINGS);
    job.expect(0, "bake small.toml");
    job
}

fn census(job: &Job, stream: &str) -> Vec<usize> {
    let reader = CacheReader::open(&job.path(stream)).unwrap();
    let frames = reader.first_frame()..=reader.last_frame();
    let count = |frame| {
        whitewater::census(&reader.read(frame).unwrap())
            .iter()
            .sum()
    };
    frames.map(count).collect()
}

#[test]
fn a_stream_is_made_beside_its_bake_and_leaves_it_as_it_was() {
    let job = baked();
    let bake = job.hash("cache/small/pbf");
    job.expect(0, MAKE);
    let counts = census(&job, STREAM);
    assert_eq!(counts.len(), 9);
    assert!(counts[0] == 0 && counts[8] > 100, "{counts:?}");
    let reader = CacheReader::open(&job.path(STREAM)).unwrap();
    let last = reader.read(8).unwrap();
    assert_eq!(
        last.attributes.keys().collect::<Vec<_>>(),
        whitewater::ATTRIBUTES
    );
    assert!(
        last.attributes[KIND]
            .iter()
            .all(|k| [0.0, 1.0, 2.0].contains(k))
    );
    // Ids are permanent: some particles died, and no id was reused.
    let told = |frame: u32, key: &str| reader.entry(frame).unwrap().report[key].as_u64().unwrap();
    let next = told(8, "next_id");
    assert_eq!(next, (1..=8).map(|frame| told(frame, "born")).sum::<u64>());
    assert!(last.id.windows(2).all(|w| w[0] < w[1]) && u64::from(*last.id.last().unwrap()) < next);
    assert!((last.id.len() as u64) < next);
    job.expect(0, &format!("verify {STREAM}"));
    job.expect(0, &format!("check {STREAM} --frames 3,8"));
    job.expect(0, &format!("diff {STREAM} {STREAM}"));
    // The bake can be verified and resumed despite the stream beside it.
    job.expect(0, "verify cache/small/pbf");
    let said = job.expect(0, "bake small.toml --resume --frames 1-9");
    assert_has(&said, &["frame 9 of 9"]);
    fs::remove_dir_all(job.path("cache/small/pbf/whitewater")).unwrap();
    let other = Job::new();
    other.expect(0, "bake small.toml");
    assert_eq!(other.hash("cache/small/pbf"), bake);
}

#[test]
fn a_stopped_stream_goes_on_to_the_same_bytes() {
    let job = baked();
    job.expect(0, MAKE);
    let whole = job.hash(STREAM);
    job.expect(0, &format!("{MAKE} --overwrite --last 3"));
    assert_ne!(job.hash(STREAM), whole);
    let said = job.expect(0, MAKE);
    assert_has(&said, &["frame    4", "5 frames"]);
    assert_eq!(job.hash(STREAM), whole);
    // Nothing is left to do.
    assert_has(&job.expect(0, MAKE), &["0 frames"]);
    // Negative control: another seed gives other bytes.
    job.write("tuned.toml", &format!("seed = 2\n{SETTINGS}"));
    job.expect(0, &format!("{MAKE} --overwrite"));
    assert_ne!(job.hash(STREAM), whole);
}

#[test]
fn other_settings_are_another_stream() {
    let job = baked();
    job.expect(0, MAKE);
    let first = job.hash(STREAM);
    job.write("tuned.toml", &SETTINGS.replace("0.1]", "0.2]"));
    let said = job.expect(4, MAKE);
    assert_has(&said, &["other settings", "--name", "--overwrite"]);
    assert_eq!(job.hash(STREAM), first);
    job.expect(0, &format!("{MAKE} --name longer"));
    assert_eq!(job.hash(STREAM), first);
    let longer = census(&job, "cache/small/pbf/whitewater/longer");
    assert!(longer[8] > census(&job, STREAM)[8], "{longer:?}");
    // The settings written out, with calibrated and default values, make the same stream.
    job.expect(0, "whitewater cache/small/pbf --name a");
    let written = "cache/small/pbf/whitewater/a/assets/whitewater.toml";
    job.expect(
        0,
        &format!("whitewater cache/small/pbf --name b --settings {written}"),
    );
    let frame = |name: &str| {
        fs::read(job.path(&format!(
            "cache/small/pbf/whitewater/{name}/frames/small.0008.ply"
        )))
        .unwrap()
    };
    assert_eq!(frame("a"), frame("b"));
}

/// With every second frame kept, the water between is interpolated by a cubic, and the stream has
/// the frames that the water has.
#[test]
fn frames_that_were_not_kept_are_bridged() {
    let job = baked();
    let small = fs::read_to_string(job.path("small.toml")).unwrap();
    let thin = small.replace("[effects]", "[keep]\nparticles = \"every 2\"\n[effects]");
    job.write("thin.toml", &thin.replace("\"small\"", "\"thin\""));
    job.expect(0, "bake thin.toml");
    job.expect(0, "whitewater cache/thin/pbf --settings tuned.toml");
    job.expect(0, MAKE);
    let thin = CacheReader::open(&job.path("cache/thin/pbf/whitewater/tuned")).unwrap();
    assert!(thin.has_particles(4) && !thin.has_particles(5));
    let total = |particles: &Particles| particles.len() as f64;
    let full = CacheReader::open(&job.path(STREAM)).unwrap();
    let (a, b) = (total(&thin.read(8).unwrap()), total(&full.read(8).unwrap()));
    // Two streams of one splash; births depend little on the water between kept frames.
    assert!((a / b - 1.0).abs() < 0.2, "{a} {b}");
}

#[test]
fn the_reference_makes_a_stream_without_a_device() {
    let job = baked();
    job.expect(0, MAKE);
    job.expect(0, &format!("{MAKE} --name cpu --device cpu"));
    let (gpu, cpu) = (
        census(&job, STREAM),
        census(&job, "cache/small/pbf/whitewater/cpu"),
    );
    // Births depend on potentials that agree up to rounding: a few random draws differ.
    assert!(
        (gpu[8] as f64 / cpu[8] as f64 - 1.0).abs() < 0.02,
        "{gpu:?} {cpu:?}"
    );
}

/// A warning predicts that the limit will be exceeded, before it is.
#[test]
fn a_limit_is_foretold_from_the_first_frames() {
    let job = baked();
    let warnings = |words: &str, code: i32| {
        let said = job.expect(code, &format!("{words} --progress json"));
        let events = said
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok());
        let events: Vec<serde_json::Value> = events.collect();
        let is_warning = |event: &&serde_json::Value| event["what"] == "max_particles";
        let at = events.iter().position(|event| is_warning(&event));
        let told = events.iter().filter(is_warning).cloned();
        let before = events[..at.unwrap_or(0)].iter();
        let frames = before.filter(|event| event["event"] == "frame").count();
        (told.collect::<Vec<_>>(), frames as u64)
    };
    // Negative control: the default allows every particle.
    assert_eq!(warnings(MAKE, 0).0, [] as [serde_json::Value; 0]);
    let counts = census(&job, STREAM);
    assert!(counts[2] > 0, "{counts:?}");
    // The count of frame 7, extrapolated from the growth up to frame 6.
    let allowed = counts[6] + (counts[6] - counts[2]) / 4 - 1;
    let met = counts.iter().position(|&count| count > allowed).unwrap() as u64;
    job.write(
        "few.toml",
        &format!("max_particles = {allowed}\n{SETTINGS}"),
    );
    let (told, after) = warnings("whitewater cache/small/pbf --settings few.toml", 5);
    let [only] = &told[..] else {
        panic!("{told:?}")
    };
    let foretold = only["frame"].as_u64().unwrap();
    assert!(foretold.abs_diff(met) <= 1, "{foretold}, {met}: {counts:?}");
    assert!(after < met, "told after {after} of {met} frames");
    assert!(only["at_end"].as_u64().unwrap() > allowed as u64);
}

#[test]
fn whitewater_with_impossible_settings_is_refused() {
    let job = baked();
    let said = job.expect(2, "whitewater cache/small/pbf --last 9");
    assert_has(&said, &["frame 9", "0 to 8"]);
    job.write("few.toml", &format!("max_particles = 50\n{SETTINGS}"));
    let said = job.expect(5, "whitewater cache/small/pbf --settings few.toml");
    assert_has(&said, &["max_particles", "50"]);
    // Its last good frame is kept.
    assert!(
        census(&job, "cache/small/pbf/whitewater/few")
            .iter()
            .all(|&count| count <= 50)
    );
    job.write("bad.toml", "[foam]\nlifetime = [4, 1]\n");
    let said = job.expect(2, "whitewater cache/small/pbf --settings bad.toml");
    assert_has(&said, &["bad.toml:2", "foam.lifetime"]);
    job.expect(2, "whitewater cache/small/pbf --name a/b");
    job.expect(0, MAKE);
    let said = job.expect(2, &format!("whitewater {STREAM}"));
    assert_has(&said, &["stream of whitewater"]);
    let said = job.expect(2, &format!("render {STREAM} --look look.toml"));
    assert_has(&said, &["stream of whitewater"]);
    // A damaged frame of water.
    let frame = job.path("cache/small/pbf/frames/small.0005.ply");
    let mut bytes = fs::read(&frame).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(&frame, bytes).unwrap();
    let said = job.expect(4, &format!("{MAKE} --name damaged"));
    assert_has(&said, &["small.0005.ply"]);
    assert_eq!(census(&job, "cache/small/pbf/whitewater/damaged").len(), 5);
}

#[test]
fn a_look_draws_the_stream_that_it_names() {
    let job = baked();
    job.expect(0, MAKE);
    let look = fs::read_to_string(job.path("look.toml")).unwrap();
    job.write(
        "white.toml",
        &format!("{look}\n[whitewater]\nstream = \"tuned\"\ndensity_per_metre = 400\n"),
    );
    job.expect(
        0,
        "render cache/small/pbf --look look.toml -o plain --frames 8",
    );
    job.expect(
        0,
        "render cache/small/pbf --look white.toml -o white --frames 8",
    );
    let mean = |folder: &str| {
        let (_, _, pixels) = read_png(&job.path(folder).join("small.0008.png")).unwrap();
        pixels
            .as_flattened()
            .iter()
            .map(|&x| f64::from(x))
            .sum::<f64>()
    };
    assert!(
        mean("white") > 1.005 * mean("plain"),
        "{} {}",
        mean("white"),
        mean("plain")
    );
    // A stream of another name, and one that lacks the frame.
    job.write(
        "other.toml",
        &format!("{look}\n[whitewater]\nstream = \"other\"\n"),
    );
    let said = job.expect(
        4,
        "render cache/small/pbf --look other.toml -o other --frames 8",
    );
    assert_has(&said, &["swell whitewater", "other"]);
    job.expect(0, &format!("{MAKE} --overwrite --last 5"));
    let said = job.expect(
        4,
        "render cache/small/pbf --look white.toml -o late --frames 8",
    );
    assert_has(&said, &["frame 8", "missing from it"]);
}

/// What a job that makes the stream of settings `name` anew says.
fn said_of(job: &Job, name: &str) -> String {
    let make = format!("whitewater cache/small/pbf --settings {name}.toml --overwrite");
    job.expect(0, &make)
}

#[test]
fn kill_volumes_end_whitewater_in_their_time() {
    let job = baked();
    job.expect(0, MAKE);
    let room = "[[kill]]\nmin = [-1.5, 0.0, 0.0]\nmax = [-0.5, 3.0, 2.0]\nfrom = 0.1\n";
    job.write("killed.toml", &format!("{SETTINGS}{room}"));
    job.expect(0, "whitewater cache/small/pbf --settings killed.toml");
    let read = |stream: &str, frame: u32| -> Particles {
        let path = format!("cache/small/pbf/whitewater/{stream}");
        let reader = CacheReader::open(&job.path(&path)).unwrap();
        reader.read(frame).unwrap()
    };
    let inside = |of: &Particles| of.position.iter().filter(|x| x[0] <= -0.5).count();
    // Frame 6 ends at 0.1 s, which is not after it.
    assert_eq!(read("tuned", 6), read("killed", 6));
    for frame in [7, 8] {
        let (tuned, killed) = (read("tuned", frame), read("killed", frame));
        assert_eq!(inside(&killed), 0, "frame {frame}");
        // Negative control: without the room there is whitewater in it; outside there is with it.
        assert!(inside(&tuned) > 10, "frame {frame}: {}", inside(&tuned));
        assert!(!killed.is_empty(), "frame {frame}");
    }
    job.expect(0, "check cache/small/pbf/whitewater/killed --frames 8");
    // The same room as a mesh, which the stream keeps a copy of and goes on with.
    let cube = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n\
        f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";
    job.write("cube.obj", cube);
    let mesh = "[[kill]]\nfrom = 0.1\nmesh = { file = \"cube.obj\", translate = [-1.5, 0.0, 0.0], \
        scale = [1.0, 3.0, 2.0] }\n";
    job.write("meshed.toml", &format!("{SETTINGS}{mesh}"));
    let make = "whitewater cache/small/pbf --settings meshed.toml";
    job.expect(0, &format!("{make} --last 7"));
    fs::remove_file(job.path("cube.obj")).unwrap();
    let said = job.expect(2, make);
    assert_has(&said, &["meshed.toml", "kill[0].mesh.file", "cube.obj"]);
    job.write("cube.obj", cube);
    job.expect(0, make);
    assert_eq!(read("meshed", 8).position, read("killed", 8).position);
    job.expect(0, "verify cache/small/pbf/whitewater/meshed");
    job.expect(0, "check cache/small/pbf/whitewater/meshed --frames 8");
    // Volumes that end nothing are told of, and none of these is.
    assert!(!said_of(&job, "killed").contains("warning: kill"));
    let idle = "[[kill]]\nmin = [50, 0, 0]\nmax = [51, 3, 2]\n[[kill]]\nsides = 0.1\nfrom = 9.0\n";
    job.write("idle.toml", &format!("{SETTINGS}{idle}"));
    let said = said_of(&job, "idle");
    assert!(
        said.contains("kill[0]: its room is outside the domain"),
        "{said}"
    );
    assert!(said.contains("kill[1].from: it begins after 9 s"), "{said}");
    // Meshes outside of the settings' folder are taken where that is asked for.
    fs::create_dir_all(job.path("apart")).unwrap();
    job.write(
        "apart/meshed.toml",
        &format!("{SETTINGS}{}", mesh.replace("cube", "../cube")),
    );
    let make = "whitewater cache/small/pbf --settings apart/meshed.toml --name apart";
    assert_has(
        &job.expect(2, make),
        &["kill[0].mesh.file", "--allow-outside"],
    );
    job.expect(0, &format!("{make} --allow-outside"));
    assert_eq!(read("apart", 8).position, read("killed", 8).position);
    job.write("broken.toml", "[[kill]]\nfrom = 0.1\n");
    let said = job.expect(2, "whitewater cache/small/pbf --settings broken.toml");
    assert_has(&said, &["broken.toml", "kill[0]", "no room"]);
    assert!(!job.path("cache/small/pbf/whitewater/broken").exists());
}
