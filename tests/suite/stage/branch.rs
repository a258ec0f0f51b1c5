//! Bakes that begin from a frame of another cache, and bakes that are extended past
//! their last frame.

use std::fs;

use crate::support::job::Job;
use swell::cache::{CacheReader, LedgerEntry};

/// Grids and probes for the small scene; no frame stores the pressure that its probe measures.
const WATCHED: &str = r#"
[grids]
surface = true
velocity = true

[[probe]]
kind = "elevation"
at = [-0.5, 0.75]

[[probe]]
kind = "pressure"
at = [-0.6, 0.7, 0.75]

[[probe]]
kind = "energy"
"#;

fn watched() -> Job {
    let job = Job::new();
    job.edit("small.toml", "[effects]", &format!("{WATCHED}\n[effects]"));
    job
}

fn file(job: &Job, cache: &str, name: &str) -> Vec<u8> {
    let path = job.path(cache).join(name);
    fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// A ledger entry without its chain hash, which depends on the manifest.
fn told(job: &Job, cache: &str, frame: u32) -> LedgerEntry {
    let reader = CacheReader::open(&job.path(cache)).unwrap();
    let mut entry = reader.entry(frame).unwrap().clone();
    entry.chain.clear();
    entry.manifest = None;
    entry
}

/// First frame of `range` in which two caches differ: particles, grids, or the ledger's entry.
fn parts(job: &Job, [a, b]: [&str; 2], range: std::ops::RangeInclusive<u32>) -> Option<u32> {
    range.into_iter().find(|&frame| {
        let files = [
            format!("frames/small.{frame:04}.ply"),
            format!("grids/small.{frame:04}.vdb"),
        ];
        let differs = |name: &String| file(job, a, name) != file(job, b, name);
        files.iter().any(differs) || told(job, a, frame) != told(job, b, frame)
    })
}

/// `setting` belongs to both bakes; `other` is a setting that changes the physics.
fn branches_are_the_unbroken_bake(solver: &str, setting: &str, other: &str) {
    let job = watched();
    let bake = format!("bake small.toml --solver {solver} {setting}");
    job.expect(0, &format!("{bake} -o whole"));
    let whole = job.hash("whole");
    for k in [1, 5] {
        let cache = format!("from{k}");
        let said = job.expect(0, &format!("{bake} --from whole:{k} -o {cache}"));
        assert!(
            said.contains(&format!("begins from frame {k} of small {solver} (")),
            "{said}"
        );
        assert!(!said.contains("note: "), "nothing changed: {said}");
        job.expect(0, &format!("verify {cache}"));
        let start = format!("frames/small.{k:04}.ply");
        assert_eq!(file(&job, &cache, &start), file(&job, "whole", &start));
        assert_eq!(parts(&job, ["whole", &cache], k + 1..=8), None);
        let rows = |cache: &str| {
            let text = String::from_utf8(file(&job, cache, "probes/elevation-1.csv")).unwrap();
            let from = |row: &&str| {
                row.split(',')
                    .next()
                    .unwrap()
                    .parse()
                    .is_ok_and(|f: u32| f >= k)
            };
            text.lines()
                .filter(from)
                .map(str::to_owned)
                .collect::<Vec<_>>()
        };
        assert_eq!(rows("whole"), rows(&cache));
        assert_eq!(rows(&cache).len() as u32, 9 - k);
    }
    assert_eq!(job.hash("whole"), whole, "the parent is not touched");
    // A stopped branch is resumed by the same command, or without the cache that it came from.
    job.expect(0, &format!("{bake} --from whole:5 -o stopped --frames 6"));
    assert_ne!(job.hash("stopped"), job.hash("from5"));
    job.expect(
        0,
        &format!("{bake} --from whole:5 -o stopped --frames 6-7 --resume"),
    );
    let said = job.expect(4, &format!("{bake} --from whole:4 -o stopped --resume"));
    assert!(
        said.contains("began from frame 5") && said.contains("this run from frame 4"),
        "{said}"
    );
    let said = job.expect(4, &format!("{bake} --from from1:5 -o whole --resume"));
    assert!(said.contains("began from the start of its scene"), "{said}");
    fs::rename(job.path("whole"), job.path("away")).unwrap();
    job.expect(0, &format!("{bake} -o stopped --resume"));
    assert_eq!(job.hash("stopped"), job.hash("from5"));
    // A branch of a branch has the same bytes again.
    job.expect(0, &format!("{bake} --from from1:5 -o twice"));
    assert_eq!(parts(&job, ["twice", "from5"], 6..=8), None);
    // Negative control: the same beginning with other physics, which is reported.
    let said = job.expect(0, &format!("{bake} --from away:5 -o other --set {other}"));
    let key = other.split('=').next().unwrap();
    assert!(
        said.contains(&format!("note: {key}")) && said.contains("is now"),
        "{said}"
    );
    assert_eq!(parts(&job, ["other", "from5"], 6..=8), Some(6));
}

#[test]
fn a_branch_is_the_unbroken_bake() {
    branches_are_the_unbroken_bake("pbf", "", "solver.pbf.iterations=5");
}

#[test]
fn a_flip_branch_is_the_unbroken_bake() {
    branches_are_the_unbroken_bake("flip", "", "solver.flip.pic_blend=0.06");
}

#[test]
fn an_apic_branch_is_the_unbroken_bake() {
    let apic = "--set solver.flip.transfer=apic";
    branches_are_the_unbroken_bake("flip", apic, "water.gravity=[0,-9,0]");
}

#[test]
fn a_branch_of_the_reference_is_the_unbroken_bake() {
    branches_are_the_unbroken_bake("pbf", "--device cpu", "solver.pbf.iterations=5");
}

/// A scene with an origin of its own has 64-bit frames, and a branch begins with the same bits.
#[test]
fn a_branch_far_from_the_origin_is_the_unbroken_bake() {
    let far = "--set domain.min=[9999.0,0.5,0.25] --set domain.max=[10001.0,2.5,1.25] \
        --set solid=[] --set water.block=[{min=[9999.0,0.5,0.25],max=[9999.8,1.5,1.25]}] --set \
        probe=[{kind=\"elevation\",at=[9999.5,0.75]}]";
    branches_are_the_unbroken_bake("pbf", far, "solver.pbf.iterations=5");
}

/// Attributes that only one of the two caches has are always reported.
#[test]
fn attributes_made_zero_or_left_out_are_told() {
    let job = watched();
    let apic = "--set solver.flip.transfer=apic";
    job.expect(0, "bake small.toml --solver flip -o flip --frames 1-3");
    job.expect(
        0,
        &format!("bake small.toml --solver flip {apic} -o apic --frames 1-3"),
    );
    let said = job.expect(
        0,
        &format!("bake small.toml --solver flip {apic} --from flip:3 -o rows --frames 4"),
    );
    assert!(
        said.contains("note: the frame has no affine") && said.contains(": zero"),
        "{said}"
    );
    let said = job.expect(
        0,
        "bake small.toml --solver flip --from apic:3 -o plain --frames 4",
    );
    assert!(
        said.contains("note: the scene does not use affine"),
        "{said}"
    );
    let read = |cache: &str| {
        CacheReader::open(&job.path(cache))
            .unwrap()
            .read(3)
            .unwrap()
    };
    assert!(
        read("rows")
            .attributes
            .values()
            .flatten()
            .all(|&value| value == 0.0)
    );
    let rows = read("apic").attributes;
    assert!(
        rows.values().flatten().any(|&value| value != 0.0),
        "control"
    );
    assert_eq!(read("rows").attributes.len(), rows.len());
    assert!(read("plain").attributes.is_empty());
    job.expect(0, "verify rows");
    job.expect(0, "verify plain");
}

#[test]
fn the_other_commands_read_a_branch() {
    let job = watched();
    job.expect(0, "bake small.toml -o whole --frames 1-6");
    job.expect(0, "bake small.toml -o branch --from whole:3 --frames 4-6");
    // Pictures of the frames that the branch computed are the same as those of the whole bake.
    job.expect(0, "render whole --look look.toml -o of-whole");
    job.expect(0, "render branch --look look.toml -o of-branch");
    let picture = |folder: &str, frame: u32| job.path(folder).join(format!("small.{frame:04}.exr"));
    for frame in 1..=6 {
        assert_eq!(picture("of-branch", frame).exists(), frame > 3);
    }
    job.expect(0, "render branch --look look.toml -o of-branch --frames 3");
    job.expect(
        4,
        "render branch --look look.toml -o of-branch --frames 2-4",
    );
    // The header contains the hashes of the scene and the frame, which are the same.
    assert_eq!(
        fs::read(picture("of-whole", 5)).unwrap(),
        fs::read(picture("of-branch", 5)).unwrap()
    );
    job.expect(0, "check branch");
    job.expect(0, "check branch --frames 3");
    let said = job.expect(4, "check branch --frames 2");
    assert!(said.contains("has frames 3 to 6, not 2"), "{said}");
    let shown = |words: &str| job.expect(0, words);
    assert!(shown("diff whole branch --frames 3-6").contains("the same, bit for bit"));
    // Frames before a branch are not missing in it.
    for (words, whole, branch) in [
        ("diff whole branch", "A", "B"),
        ("diff branch whole", "B", "A"),
    ] {
        let text = job.expect(0, words);
        let begins =
            format!("{branch} begins with frame 3: earlier frames of {whole} are not compared");
        assert!(
            text.contains(&begins) && text.contains("compared frames 3-6"),
            "{text}"
        );
    }
    // Control: frames after its end are.
    job.expect(0, "bake small.toml -o short --from whole:3 --frames 4-5");
    for (words, side) in [("diff whole short", "A"), ("diff short branch", "B")] {
        let text = job.expect(1, words);
        assert!(
            text.contains(&format!("frames only in {side}: 6")) && !text.contains("0-2"),
            "{text}"
        );
    }
    job.expect(
        0,
        "bake small.toml -o other --from whole:3 --frames 4-6 --set solver.pbf.iterations=5",
    );
    let text = job.expect(1, "diff branch other");
    assert!(
        text.contains("other physics") && text.contains("OUT OF TOLERANCE"),
        "control: {text}"
    );
    assert!(shown("verify branch").contains("ok: 3 frames"));
    let text = shown("inspect branch --plot plots");
    assert!(text.contains("begins from frame 3 of small pbf"), "{text}");
    assert!(!shown("inspect whole").contains("begins from"));
    let curve = fs::read_to_string(job.path("plots/energy-1.svg")).unwrap();
    assert!(curve.contains("<svg"));
    // A baseline of a branch contains its own frames.
    job.expect(0, "diff branch --write-baseline branch.json");
    let text = shown("diff branch branch.json");
    assert!(text.contains("within tolerance"), "{text}");
    // A study that measures frames which a branch lacks is refused.
    fs::create_dir_all(job.path("out/cache")).unwrap();
    fs::rename(job.path("branch"), job.path("out/cache/pbf")).unwrap();
    let said = job.expect(4, "study study.toml -o out");
    assert!(said.contains("has frames 3 to 6, not "), "{said}");
    job.edit("study.toml", "1-6", "4-6");
    job.edit("study.toml", "3-6x3", "6");
    job.expect(0, "study study.toml -o out");
    assert!(job.path("out/index.html").exists());
}

#[test]
fn a_frame_that_does_not_fit_is_refused_and_nothing_is_written() {
    let job = Job::new();
    job.expect(0, "bake small.toml -o whole --frames 1-3");
    let entries = || fs::read_dir(job.folder.path()).unwrap().count();
    let before = entries();
    let wall =
        "wave_maker=[{wall=\"-x\",motion={kind=\"constant_velocity\",velocity=6.0,until=0.1}}]";
    for (code, words, expected) in [
        (
            2,
            "--from whole:3 --solver flip",
            "solver.method = \"pbf\", and the scene has \"flip\"",
        ),
        (
            2,
            "--from whole:3 --set shot.frames_per_second=30",
            "shot.frames_per_second = 60.0, and the scene has 30.0",
        ),
        (
            2,
            "--from whole:3 --set solver.pbf.particle_spacing=0.09",
            "solver.pbf.particle_spacing = 0.1, and the scene has 0.09",
        ),
        (
            2,
            &format!("--from whole:3 --set {wall}"),
            "lie beyond the walls of the scene at 0.05 s",
        ),
        (4, "--from whole:4", "has frames 0 to 3, not 4"),
        (4, "--from nowhere:1", "nowhere does not exist"),
        (2, "--from whole", "not a cache and a frame"),
        (2, "--from whole:x", "not a cache and a frame"),
        (
            2,
            "--from whole:3 --set shot.frames=3",
            "nothing is left to bake after frame 3; raise shot.frames",
        ),
        (
            2,
            "--from whole:3 --frames 5-8",
            "frame 4 has not been baked",
        ),
        (2, "--from whole:3 --frames 4-9", "raise shot.frames"),
    ] {
        let said = job.expect(code, &format!("bake small.toml -o new {words}"));
        assert!(said.contains(expected), "{words}: {said}");
        assert_eq!(entries(), before, "{words}");
    }
    let said = job.expect(4, "bake small.toml -o whole --from whole:2");
    assert!(said.contains("already holds a cache"), "{said}");
    // A damaged frame cannot begin a bake.
    let frame = job.path("whole/frames/small.0002.ply");
    let mut bytes = fs::read(&frame).unwrap();
    let last = bytes.len() - 5;
    bytes[last] ^= 1;
    fs::write(&frame, bytes).unwrap();
    let said = job.expect(4, "bake small.toml -o new --from whole:2");
    assert!(said.contains("small.0002.ply is damaged"), "{said}");
    job.expect(0, "bake small.toml -o new --from whole:3 --frames 4");
    // A solid placed over the water pushes it out, and a warning reports it.
    job.edit(
        "small.toml",
        "mesh = \"box.obj\"",
        "mesh = \"box.obj\"\ntranslate = [-1.0, 0.0, 0.0]",
    );
    // Without the grid projection, the push raises the energy by more than the walls' work, and
    // beyond the default budget.
    let covered = "bake small.toml -o covered --from whole:3 --frames 4 \
        --set solver.pbf.grid_projection=false";
    let said = job.expect(5, covered);
    for words in ["particles lie within solids of the scene", "budget.energy"] {
        assert!(said.contains(words), "{said}");
    }
    job.expect(0, &format!("{covered} --resume --set budget.energy=false"));
    job.expect(0, "verify covered");
}

/// A finished bake is extended past its last frame, with the bytes of a shot that was
/// longer from the start.
#[test]
fn a_finished_bake_is_extended() {
    for solver in ["pbf", "flip"] {
        let job = Job::new();
        let bake = format!("bake small.toml --solver {solver}");
        job.expect(0, &format!("{bake} -o long --set shot.frames=12"));
        for (cache, longer) in [
            ("by-range", "--frames 1-12"),
            ("by-key", "--set shot.frames=12"),
        ] {
            job.expect(0, &format!("{bake} -o {cache}"));
            let said = job.expect(0, &format!("{bake} -o {cache} --resume"));
            assert!(said.contains("nothing left to bake"), "{said}");
            let said = job.expect(0, &format!("{bake} -o {cache} --resume {longer}"));
            assert!(said.contains("frames 9 to 12"), "{said}");
            job.expect(0, &format!("verify {cache}"));
            for frame in 0..=12 {
                let name = format!("frames/small.{frame:04}.ply");
                assert_eq!(
                    file(&job, cache, &name),
                    file(&job, "long", &name),
                    "{frame}"
                );
                assert_eq!(told(&job, cache, frame), told(&job, "long", frame));
            }
        }
        // A mistyped range does not make a new bake longer.
        let said = job.expect(2, &format!("{bake} -o new --frames 1-12"));
        assert!(
            said.contains("raise shot.frames") && !job.path("new").exists(),
            "{said}"
        );
    }
    // Faults of the longer shot are found before the bake: the wall would meet the other one.
    let job = Job::new();
    let wall = "wave_maker=[{wall=\"-x\",motion={kind=\"constant_velocity\",velocity=4.0}}]";
    job.expect(0, &format!("bake small.toml -o pushed --set {wall}"));
    let before = job.hash("pushed");
    let said = job.expect(
        2,
        &format!("bake small.toml -o pushed --set {wall} --frames 1-40 --resume"),
    );
    assert!(said.contains("wave_maker"), "{said}");
    assert_eq!(job.hash("pushed"), before);
}
