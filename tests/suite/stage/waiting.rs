//! Emitters covered by solids: a bake emits what `inspect` predicts, with both solvers and
//! at any frame rate.

use crate::support::job::{Job, assert_has};
use swell::cache::CacheReader;

const D: f64 = 0.05;

/// An emitter that begins within a box, 0.05 m deep, and extends beyond it over an
/// equally wide face.
const SCENE: &str = r#"
[shot]
name = "waiting"
frames = 12
frames_per_second = 24

[domain]
min = [0.0, 0.0, 0.0]
max = [1.6, 0.8, 0.8]

[[water.block]]
min = [0.0, 0.0, 0.0]
max = [1.6, 0.1, 0.8]

[[solid]]
mesh = "box.obj"

[[emitter]]
min = [0.65, 0.55, 0.3]
max = [1.05, 0.75, 0.5]
velocity = [1.0, 0.0, 0.0]

[solver]
method = "pbf"

[solver.pbf]
particle_spacing = 0.05

[solver.flip]
cell_size = 0.1
"#;

const BOX: &str = "v 0.3 0.5 0.2\nv 0.7 0.5 0.2\nv 0.7 0.8 0.2\nv 0.3 0.8 0.2\n\
    v 0.3 0.5 0.6\nv 0.7 0.5 0.6\nv 0.7 0.8 0.6\nv 0.3 0.8 0.6\n\
    f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 4 8 7 3\nf 1 5 8 4\nf 2 3 7 6\n";

fn job() -> Job {
    Job::of(&[("waiting.toml", SCENE), ("box.obj", BOX)])
}

/// Particles that entered over a cache's frames, and particles that never will.
fn brought(job: &Job, cache: &str) -> [u64; 2] {
    let reader = CacheReader::open(&job.path(cache)).unwrap();
    let of = |key: &str| {
        let entries = reader.entries()[1..].iter();
        let counts = entries.map(|entry| entry.report["exchange"][key].as_u64().unwrap_or(0));
        counts.sum()
    };
    ["entered", "blocked"].map(of)
}

/// A layer is 4 × 4 particles. In half a second 10 layers enter the emitter's volume; 0.05 m of
/// their path, plus at most an eighth of a spacing, is within the box, so that one or two are still
/// covered at the end.
#[test]
fn what_a_solid_covers_enters_later_at_any_frame_rate() {
    let job = job();
    for solver in ["pbf", "flip"] {
        let solved = format!("waiting.toml --solver {solver}");
        let said = job.json(0, &format!("inspect {solved}"));
        assert_eq!(said["entering"], 160.0, "{said}");
        let told = job.expect(0, &format!("inspect {solved}"));
        assert_has(&told, &["emitter[0] brings 0.0400 m³/s"]);
        assert!(!told.contains("warning"), "{told}");
        for rate in [12, 24, 48, 96] {
            let cache = format!("{solver}-{rate}");
            let shot = format!(
                "--set shot.frames={} --set shot.frames_per_second={rate}",
                rate / 2
            );
            let said = job.expect(0, &format!("bake {solved} {shot} --device cpu -o {cache}"));
            assert!(!said.contains("did not enter"), "{said}");
            let [entered, blocked] = brought(&job, &cache);
            assert!((128..=144).contains(&entered), "{cache}: {entered}");
            assert_eq!((entered % 16, blocked), (0, 0), "{cache}");
        }
    }
    // Negative control: without the solid nothing waits.
    job.expect(0, "bake waiting.toml --device cpu -o open --set solid=[]");
    assert_eq!(brought(&job, "open"), [160, 0]);
}

/// The same on the GPU, where a bake resumes bit for bit while water is waiting.
#[test]
fn a_bake_goes_on_where_water_waits() {
    let job = job();
    for solver in ["pbf", "flip"] {
        let bake = format!("bake waiting.toml --solver {solver}");
        job.expect(0, &format!("{bake} -o whole"));
        assert_eq!(brought(&job, "whole")[0] % 16, 0);
        job.expect(0, &format!("{bake} --frames 1-2 -o parts"));
        let waiting = brought(&job, "parts")[0];
        job.expect(0, &format!("{bake} --resume -o parts"));
        assert_eq!(job.hash("parts"), job.hash("whole"), "{solver}");
        // Two layers have entered the emitter's volume by then, and one of them is still covered.
        assert!(waiting < 32, "{waiting}");
        for cache in ["whole", "parts"] {
            std::fs::remove_dir_all(job.path(cache)).unwrap();
        }
    }
}

/// Water that a solid covers everywhere is left out of the prediction, reported, and
/// counted in the ledger.
#[test]
fn what_never_enters_is_told_of() {
    let job = job();
    // The box, extended along the emitter's volume over its lower half.
    job.edit("waiting.toml", "mesh = \"box.obj\"", "mesh = \"beam.obj\"");
    job.write(
        "beam.obj",
        &BOX.replace("v 0.7", "v 1.2").replace(" 0.8 ", " 0.65 "),
    );
    let covered = "emitter[0]: solids cover 50.0 % of its cross-section all along its volume, and \
        nothing enters there: it brings 0.0200 m³/s";
    let said = job.expect(0, "inspect waiting.toml");
    assert_has(&said, &[covered, "emitter[0] brings 0.0200 m³/s"]);
    assert_eq!(job.json(0, "inspect waiting.toml")["entering"], 80.0);
    // The volume is 0.4 m long: after 0.4 s the first particles leave it.
    let said = job.expect(0, "bake waiting.toml --device cpu -o cache");
    let [entered, blocked] = brought(&job, "cache");
    assert_eq!(entered, 80);
    // A tenth of a second later two layers of 4 × 2 have left.
    assert_eq!(blocked, 2 * 8);
    assert_has(
        &said,
        &[
            covered,
            "warning: 16 particles of emitters did not enter in the frames computed now: solids \
             blocked the whole path",
        ],
    );
    assert_has(&job.expect(0, "inspect cache"), &[covered]);
    // Each enters above the solid, whose top is at 0.65 m.
    let reader = CacheReader::open(&job.path("cache")).unwrap();
    let (mut next, mut born) = (reader.read(0).unwrap().len() as u32, 0);
    for frame in 1..=reader.last_frame() {
        let particles = reader.read(frame).unwrap();
        let new = particles.id.iter().zip(&particles.position);
        for (_, x) in new.filter(|(id, _)| **id >= next) {
            assert!(f64::from(x[1]) > 0.65 + 0.3 * D - 1e-6, "{frame}: {x:?}");
            born += 1;
        }
        next = next.max(particles.id.last().unwrap() + 1);
    }
    assert_eq!(born, entered);
}
