//! The cache against crashes, damage, second writers and other people's files.

#![expect(
    clippy::unwrap_used,
    reason = "in a test a panic is the report, and helpers are no #[test]"
)]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::Instant;

use proptest::prelude::*;
use serde_json::{Value, json};
use swell::cache::{
    self, Asset, CacheError, CacheReader, CacheWriter, Clock, Manifest, ProbeRecord, ProbeValues,
    Summary, directory_hash,
};
use swell::domain::particles::Particles;
use tempfile::TempDir;

const SCENE: &str = "[shot]\nname = \"tank\"\n";
const LEDGER: &str = "frames.jsonl";

fn manifest() -> Manifest {
    Manifest {
        format_version: Manifest::FORMAT_VERSION,
        program: "swell".to_owned(),
        program_version: "0.1.0".to_owned(),
        shot: "tank".to_owned(),
        scene_hash: "5ce".to_owned(),
        solver: "pbf".to_owned(),
        device: "a device".to_owned(),
        driver: "its driver 1.2".to_owned(),
        backend: "Vulkan".to_owned(),
        frames_per_second: 60.0,
        // No short decimal: must come back to the last bit.
        particle_spacing: 0.1 + 0.2,
        rest_density: 1000.0,
        origin: [0.0; 3],
        grids: None,
        probes: probes(),
        attributes: vec!["foam".to_owned(), "age".to_owned()],
        start_particles: 0,
        files: Vec::new(),
    }
}

fn probes() -> Vec<ProbeRecord> {
    let probe = |name: &str, kind: &str, at: &[f64], columns: &[&str]| ProbeRecord {
        name: name.to_owned(),
        kind: kind.to_owned(),
        at: at.to_vec(),
        columns: columns.iter().map(|&column| column.to_owned()).collect(),
    };
    vec![
        probe("gauge", "elevation", &[0.5, 1.5], &["elevation_m"]),
        probe("energy-1", "energy", &[], &["kinetic_J", "potential_J"]),
    ]
}

/// What they see at a time; the first is dry at each third frame.
fn seen(clock: Clock) -> ProbeValues {
    let wet = !clock.frame.is_multiple_of(3);
    let at = |scale: f64| Some(scale * (1.0 + clock.time).ln());
    vec![vec![at(0.1).filter(|_| wet)], vec![at(1e20), at(-1e-7)]]
}

fn assets() -> Vec<Asset> {
    let asset = |name: &str, bytes: &[u8]| Asset {
        name: name.to_owned(),
        bytes: bytes.to_vec(),
    };
    vec![
        asset("city.obj", b"v 0 0 0"),
        asset("tables/stroke.csv", b"0,1\n"),
    ]
}

/// A stand-in for a solver: frame k follows from frame k - 1 and the clock alone.
fn step(before: &Particles, clock: Clock, frame: u32) -> (Clock, Particles, Value) {
    let mut after = before.clone();
    for (i, x) in after.position.iter_mut().enumerate() {
        *x = x.map(|c| (c * 1.7 + clock.time as f32 + i as f32).sin());
    }
    for (v, x) in after.velocity.iter_mut().zip(&after.position) {
        *v = x.map(|c| c * 0.3);
    }
    for column in after.attributes.values_mut() {
        column.iter_mut().for_each(|a| *a += 0.1);
    }
    let clock = Clock {
        frame,
        // Accumulates rounding, so that a clock which lost its last bit in the ledger shows.
        time: clock.time + 1.0 / 60.0,
        substeps: 1 + frame % 3,
        steps: clock.steps + u64::from(1 + frame % 3),
    };
    let report = json!({ "density_error": { "mean": 0.1 / f64::from(frame) }, "capped": frame });
    (clock, after, report)
}

fn start() -> Particles {
    let n = 7;
    Particles {
        position: (0..n).map(|i| [i as f32, 0.5, -0.0]).collect(),
        velocity: vec![[0.0; 3]; n],
        id: (0..n as u32).map(|i| i * 3).collect(),
        attributes: [("age", 1.0), ("foam", 0.0)]
            .map(|(name, value)| (name.to_owned(), vec![value; n]))
            .into(),
    }
}

fn create(dir: &Path) -> CacheWriter {
    let seen = seen(Clock::default());
    CacheWriter::create(dir, manifest(), SCENE, &assets(), &start(), &seen).unwrap()
}

/// Frames `clock.frame + 1 ..= last`, from a state.
fn go_on(
    mut writer: CacheWriter,
    mut clock: Clock,
    mut particles: Particles,
    last: u32,
) -> Result<Summary, CacheError> {
    for frame in clock.frame + 1..=last {
        let report;
        (clock, particles, report) = step(&particles, clock, frame);
        let seconds = json!({ "seconds": Instant::now().elapsed().as_secs_f64() });
        writer.submit(clock, particles.clone(), seen(clock), report, seconds)?;
    }
    writer.finish()
}

fn bake(dir: &Path, last: u32) -> Summary {
    go_on(create(dir), Clock::default(), start(), last).unwrap()
}

fn resume(dir: &Path, last: u32) -> Result<Summary, CacheError> {
    let (writer, entry, particles) = CacheWriter::resume(dir, &manifest())?;
    go_on(writer, entry.clock, particles, last)
}

/// A baked cache of four frames that the tests copy.
fn baked() -> &'static Path {
    static BAKED: OnceLock<TempDir> = OnceLock::new();
    BAKED
        .get_or_init(|| {
            let dir = tempfile::tempdir().unwrap();
            bake(dir.path(), 4);
            dir
        })
        .path()
}

fn copied() -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    for file in files(baked()) {
        let to = dir.path().join(&file);
        fs::create_dir_all(to.parent().unwrap()).unwrap();
        fs::copy(baked().join(&file), to).unwrap();
    }
    dir
}

/// All files below, relative.
fn files(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![dir.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                found.push(path.strip_prefix(dir).unwrap().to_owned());
            }
        }
    }
    found.sort();
    found
}

fn damaged_file<T: std::fmt::Debug>(result: Result<T, CacheError>) -> PathBuf {
    match result {
        Err(CacheError::Damaged { file, .. }) => file,
        other => panic!("expected damage: {other:?}"),
    }
}

fn first_problem(dir: &Path) -> PathBuf {
    damaged_file(cache::survey(dir).unwrap().into_result())
}

/// Every line of the ledger names a file that is there and is the one that was written.
fn ledger_holds(dir: &Path) -> u32 {
    let reader = CacheReader::open(dir).unwrap();
    for entry in reader.entries() {
        reader.read(entry.frame).unwrap();
    }
    reader.last_frame()
}

#[test]
fn what_goes_in_comes_out() {
    let dir = tempfile::tempdir().unwrap();
    let summary = bake(dir.path(), 3);
    assert_eq!((summary.frames, summary.last_frame), (3, 3));
    let reader = CacheReader::open(dir.path()).unwrap();
    assert_eq!(reader.scene_toml(), SCENE);
    assert_eq!(reader.asset("tables/stroke.csv").unwrap(), b"0,1\n");
    assert!(reader.asset("other.obj").is_err());
    let written = reader.manifest();
    assert_eq!(written.particle_spacing.to_bits(), (0.1f64 + 0.2).to_bits());
    assert_eq!(written.attributes, ["age", "foam"], "sorted");
    assert_eq!(written.start_particles, 7);
    assert_eq!(written.files.len(), 3);

    let (mut clock, mut particles) = (Clock::default(), start());
    assert_eq!(reader.read(0).unwrap(), particles);
    assert_eq!(reader.entry(0).unwrap().report, Value::Null);
    for frame in 1..=3 {
        let report;
        (clock, particles, report) = step(&particles, clock, frame);
        let entry = reader.entry(frame).unwrap();
        assert_eq!(entry.clock.time.to_bits(), clock.time.to_bits());
        assert_eq!((entry.clock, &entry.report), (clock, &report));
        assert_eq!(entry.file, format!("frames/tank.000{frame}.ply"));
        assert_eq!(entry.particles, 7);
        let back = reader.read(frame).unwrap();
        assert_eq!(back, particles);
        assert_ne!(back, reader.read(frame - 1).unwrap(), "control");
    }
    assert_eq!(
        summary.bytes,
        (1..=3).map(|f| reader.entry(f).unwrap().bytes).sum::<u64>()
    );
    assert!(matches!(
        reader.read(4),
        Err(CacheError::NoFrame {
            frame: 4,
            last: 3,
            ..
        })
    ));
    let report = reader.verify().unwrap();
    assert_eq!(report.frames, 3);
    let timings = fs::read_to_string(dir.path().join("timings.jsonl")).unwrap();
    assert_eq!(timings.lines().count(), 3);
}

#[test]
fn an_empty_state_is_a_cache_too() {
    let dir = tempfile::tempdir().unwrap();
    let mut manifest = manifest();
    manifest.attributes.clear();
    manifest.probes.clear();
    let nothing = Particles::default();
    let mut writer =
        CacheWriter::create(dir.path(), manifest, SCENE, &[], &nothing, &Vec::new()).unwrap();
    let clock = Clock {
        frame: 1,
        ..Clock::default()
    };
    writer
        .submit(clock, nothing.clone(), Vec::new(), Value::Null, Value::Null)
        .unwrap();
    writer.finish().unwrap();
    let reader = CacheReader::open(dir.path()).unwrap();
    assert_eq!(reader.read(1).unwrap(), nothing);
    assert!(reader.verify().is_ok());
    assert!(!dir.path().join("timings.jsonl").exists());
    assert!(!dir.path().join("probes").exists());
    let ledger = fs::read_to_string(dir.path().join(LEDGER)).unwrap();
    assert!(!ledger.contains("probes"));
}

#[test]
fn two_bakes_are_the_same_bytes() {
    let dirs = [(); 3].map(|()| tempfile::tempdir().unwrap());
    bake(dirs[0].path(), 4);
    bake(dirs[1].path(), 4);
    bake(dirs[2].path(), 3);
    let hashes = dirs.each_ref().map(|d| directory_hash(d.path()).unwrap());
    assert_eq!(hashes[0], hashes[1]);
    assert_ne!(hashes[0], hashes[2], "control");
    for file in files(dirs[0].path()) {
        if file != Path::new("timings.jsonl") {
            let bytes = |d: &TempDir| fs::read(d.path().join(&file)).unwrap();
            assert!(bytes(&dirs[0]) == bytes(&dirs[1]), "{}", file.display());
        }
    }
}

#[test]
fn resumed_at_any_frame_it_is_the_unbroken_bake() {
    let whole = directory_hash(baked()).unwrap();
    for stop in 0..=4 {
        let dir = tempfile::tempdir().unwrap();
        bake(dir.path(), stop);
        assert_eq!(directory_hash(dir.path()).unwrap() == whole, stop == 4);
        let summary = resume(dir.path(), 4).unwrap();
        assert_eq!(summary.frames, 4 - stop);
        assert_eq!(directory_hash(dir.path()).unwrap(), whole, "{stop}");
    }
}

/// A kill leaves a prefix of the ledger, and beyond it a frame without a line or a temporary file.
#[test]
fn resumed_from_any_torn_ledger_it_is_the_unbroken_bake() {
    let whole = directory_hash(baked()).unwrap();
    let ledger = fs::read(baked().join(LEDGER)).unwrap();
    let first_line = ledger.iter().position(|&b| b == b'\n').unwrap() + 1;
    let dir = copied();
    let d = dir.path();
    // Every length would take minutes of flushing; the primes fall on all parts of a line.
    let lengths = (0..ledger.len()).filter(|n| n % 37 == 0 || ledger[n.max(&1) - 1] == b'\n');
    for length in lengths.chain([first_line, ledger.len() - 1]) {
        fs::write(d.join(LEDGER), &ledger[..length]).unwrap();
        fs::write(d.join("frames/tank.0003.ply.tmp"), "half a frame").unwrap();
        if length < first_line {
            // The manifest comes after the first line, so no crash leaves this.
            let before = directory_hash(d).unwrap();
            assert_eq!(damaged_file(resume(d, 4)), d.join(LEDGER));
            assert_eq!(directory_hash(d).unwrap(), before, "refused untouched");
            continue;
        }
        let is_torn = ledger[length - 1] != b'\n';
        let problems = CacheReader::open(d).unwrap().survey().problems;
        let is_off = |file: &str| problems.iter().any(|problem| problem.file == d.join(file));
        assert_eq!(is_off(LEDGER), is_torn, "{length}");
        // Rows of frames that are not in the ledger any more.
        assert_eq!(
            is_off("probes/gauge.csv"),
            length < ledger.len(),
            "{length}"
        );
        assert_eq!(resume(d, 4).unwrap().last_frame, 4);
        assert_eq!(directory_hash(d).unwrap(), whole, "{length}");
    }
}

#[test]
fn frames_beyond_the_ledger_are_cleared_and_other_files_kept() {
    let dir = copied();
    let d = dir.path();
    let ledger = fs::read_to_string(d.join(LEDGER)).unwrap();
    let three: String = ledger.split_inclusive('\n').take(3).collect();
    fs::write(d.join(LEDGER), three).unwrap();
    for name in ["notes.txt", "other.0004.ply", "tank.4.ply"] {
        fs::write(d.join("frames").join(name), "mine").unwrap();
    }
    let (writer, entry, particles) = CacheWriter::resume(d, &manifest()).unwrap();
    assert_eq!(entry.frame, 2);
    assert_eq!(particles, CacheReader::open(d).unwrap().read(2).unwrap());
    writer.finish().unwrap();
    let left: Vec<_> = files(&d.join("frames"));
    let expected = [
        "notes.txt",
        "other.0004.ply",
        "tank.0000.ply",
        "tank.0001.ply",
        "tank.0002.ply",
        "tank.4.ply",
    ];
    assert_eq!(left, expected.map(PathBuf::from));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Any bit of any file that carries content; the lock and the timings carry none.
    #[test]
    fn a_flipped_bit_is_found(file in any::<prop::sample::Index>(), at in any::<prop::sample::Index>(), bit in 0u8..8) {
        static COPY: OnceLock<TempDir> = OnceLock::new();
        let d = COPY.get_or_init(copied).path();
        let all: Vec<_> = files(d)
            .into_iter()
            .filter(|f| f != Path::new("lock") && f != Path::new("timings.jsonl"))
            .collect();
        let path = d.join(file.get(&all));
        prop_assert!(cache::survey(d).unwrap().problems.is_empty(), "control");
        let sound = fs::read(&path).unwrap();
        let mut flipped = sound.clone();
        flipped[at.index(sound.len())] ^= 1 << bit;
        fs::write(&path, &flipped).unwrap();
        let found = cache::survey(d);
        // A frame is refused by `read`, the rest by `open` or by `survey`.
        if path.extension().is_some_and(|e| e == "ply") {
            let number = path.to_str().unwrap().rsplit('.').nth(1).unwrap().parse().unwrap();
            let read = CacheReader::open(d).unwrap().read(number);
            prop_assert_eq!(damaged_file(read), path.clone());
        }
        fs::write(&path, &sound).unwrap();
        match found {
            Ok(report) => prop_assert_eq!(damaged_file(report.into_result()), path),
            // The digit of the format version itself.
            Err(CacheError::Format { .. }) => prop_assert!(path.ends_with("manifest.json")),
            Err(error) => prop_assert!(false, "{}", error),
        }
    }

    #[test]
    fn garbage_in_place_of_a_file_never_panics(file in any::<prop::sample::Index>(), bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        static COPY: OnceLock<TempDir> = OnceLock::new();
        let d = COPY.get_or_init(copied).path();
        let all = files(baked());
        let path = file.get(&all);
        fs::write(d.join(path), &bytes).unwrap();
        let _ = cache::survey(d);
        let _ = CacheWriter::resume(d, &manifest());
        fs::copy(baked().join(path), d.join(path)).unwrap();
    }
}

#[test]
fn a_missing_or_truncated_file_is_named() {
    for file in files(baked()) {
        if file == Path::new("lock") || file == Path::new("timings.jsonl") {
            continue;
        }
        let dir = copied();
        let d = dir.path();
        let path = d.join(&file);
        let bytes = fs::read(&path).unwrap();
        if file != Path::new(LEDGER) {
            // A ledger cut short is a bake that stopped; its own test is above.
            fs::write(&path, &bytes[..bytes.len() - 1]).unwrap();
            if file != Path::new("manifest.json") || cache::survey(d).is_ok() {
                assert_eq!(first_problem(d), path);
            }
        }
        fs::remove_file(&path).unwrap();
        if file == Path::new("manifest.json") {
            assert!(matches!(
                cache::survey(d),
                Err(CacheError::NotACache { .. })
            ));
        } else {
            assert_eq!(first_problem(d), path);
        }
    }
}

#[test]
fn a_damaged_frame_stops_a_resume_untouched() {
    for name in ["tank.0002.ply", "tank.0004.ply"] {
        let dir = copied();
        let d = dir.path();
        let path = d.join("frames").join(name);
        let bytes = fs::read(&path).unwrap();
        fs::write(&path, &bytes[..bytes.len() - 4]).unwrap();
        let before = directory_hash(d).unwrap();
        assert_eq!(damaged_file(resume(d, 6)), path);
        assert_eq!(directory_hash(d).unwrap(), before);
        fs::remove_file(&path).unwrap();
        assert_eq!(damaged_file(resume(d, 6)), path);
        fs::write(&path, &bytes).unwrap();
        assert_eq!(resume(d, 6).unwrap().last_frame, 6, "control");
    }
    // In the last frame a flipped bit too, because the bake goes on from it.
    let dir = copied();
    let path = dir.path().join("frames/tank.0004.ply");
    let mut bytes = fs::read(&path).unwrap();
    let at = bytes.len() - 9;
    bytes[at] ^= 1;
    fs::write(&path, bytes).unwrap();
    assert_eq!(damaged_file(resume(dir.path(), 6)), path);
}

#[test]
fn a_damaged_middle_of_the_ledger_stops_a_resume() {
    let dir = copied();
    let d = dir.path();
    let ledger = fs::read_to_string(d.join(LEDGER)).unwrap();
    let lines: Vec<&str> = ledger.split_inclusive('\n').collect();
    let without_2 = [lines[0], lines[1], lines[3], lines[4]].concat();
    let swapped = [lines[0], lines[2], lines[1], lines[3], lines[4]].concat();
    let edited = ledger.replacen("\"capped\":2", "\"capped\":3", 1);
    let spaced = ledger.replacen("{\"frame\":2,", "{\"frame\":2, ", 1);
    for (i, text) in [without_2, swapped, edited, spaced].iter().enumerate() {
        assert_ne!(*text, ledger);
        fs::write(d.join(LEDGER), text).unwrap();
        let before = directory_hash(d).unwrap();
        assert_eq!(damaged_file(resume(d, 6)), d.join(LEDGER), "{i}");
        assert_eq!(damaged_file(CacheReader::open(d)), d.join(LEDGER), "{i}");
        assert_eq!(directory_hash(d).unwrap(), before);
    }
    fs::write(d.join(LEDGER), &ledger).unwrap();
    assert!(resume(d, 6).is_ok(), "control");
}

#[test]
fn a_second_writer_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let writer = create(d);
    let before = directory_hash(d).unwrap();
    match CacheWriter::resume(d, &manifest()) {
        Err(CacheError::Locked { dir }) => assert_eq!(dir, d),
        other => panic!("{other:?}"),
    }
    assert!(CacheReader::open(d).is_ok(), "readers do not lock");
    assert_eq!(directory_hash(d).unwrap(), before);
    writer.finish().unwrap();
    assert!(resume(d, 1).is_ok(), "control");
}

#[test]
fn other_peoples_directories_stay_untouched() {
    let attempt = |d: &Path| {
        CacheWriter::create(
            d,
            manifest(),
            SCENE,
            &assets(),
            &start(),
            &seen(Clock::default()),
        )
    };
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    fs::write(d.join("scene.toml"), "mine").unwrap();
    fs::create_dir(d.join("frames")).unwrap();
    let listing = files(d);
    let before = directory_hash(d).unwrap();
    assert!(matches!(attempt(d), Err(CacheError::Occupied { .. })));
    assert!(matches!(resume(d, 1), Err(CacheError::NotACache { .. })));
    assert!(matches!(
        CacheReader::open(d),
        Err(CacheError::NotACache { .. })
    ));
    // `directory_hash` looks past a lock, the listing does not.
    assert_eq!((directory_hash(d).unwrap(), files(d)), (before, listing));

    let file = d.join("scene.toml");
    assert!(matches!(attempt(&file), Err(CacheError::Occupied { .. })));
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");

    let dir = copied();
    let before = directory_hash(dir.path()).unwrap();
    let refused = attempt(dir.path());
    assert!(matches!(refused, Err(CacheError::Exists { .. })));
    assert!(refused.unwrap_err().to_string().contains("--resume"));
    assert_eq!(directory_hash(dir.path()).unwrap(), before);

    // A cache whose manifest was lost still holds a bake.
    fs::remove_file(dir.path().join("manifest.json")).unwrap();
    let before = directory_hash(dir.path()).unwrap();
    assert!(matches!(
        attempt(dir.path()),
        Err(CacheError::Occupied { .. })
    ));
    assert_eq!(directory_hash(dir.path()).unwrap(), before);
}

#[test]
fn a_creation_that_was_cut_short_begins_anew() {
    let whole = directory_hash(baked()).unwrap();
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    create(d).finish().unwrap();
    fs::rename(d.join("manifest.json"), d.join("manifest.json.tmp")).unwrap();
    fs::write(d.join("frames/tank.0000.ply.tmp"), "half").unwrap();
    fs::write(d.join("assets/stale.obj"), "of another scene").unwrap();
    assert!(!cache::exists(d));
    assert!(matches!(resume(d, 1), Err(CacheError::NotACache { .. })));
    bake(d, 4);
    assert!(cache::exists(d));
    assert_eq!(directory_hash(d).unwrap(), whole);
}

#[test]
fn resume_names_the_field_that_differs() {
    let dir = copied();
    let d = dir.path();
    let before = directory_hash(d).unwrap();
    type Change = fn(&mut Manifest);
    let changes: [(&str, Change); 9] = [
        ("format_version", |m| m.format_version += 1),
        ("program_version", |m| m.program_version.push('1')),
        ("scene_hash", |m| m.scene_hash.push('1')),
        ("solver", |m| m.solver = "flip".to_owned()),
        ("device", |m| m.device = "another".to_owned()),
        ("driver", |m| m.driver.push('1')),
        ("backend", |m| m.backend = "Metal".to_owned()),
        ("particle_spacing", |m| m.particle_spacing = 0.3),
        ("attributes", |m| m.attributes.clear()),
    ];
    for (name, change) in changes {
        let mut given = manifest();
        change(&mut given);
        match CacheWriter::resume(d, &given) {
            Err(CacheError::OtherScene {
                dir,
                field,
                cached,
                given,
            }) => {
                assert_eq!((dir.as_path(), field.as_str()), (d, name));
                assert_ne!(cached, given);
            }
            other => panic!("{name}: {other:?}"),
        }
    }
    assert_eq!(directory_hash(d).unwrap(), before);
    assert!(CacheWriter::resume(d, &manifest()).is_ok(), "control");
}

#[test]
fn probes_have_a_file_each_that_the_ledger_vouches_for() {
    let text = fs::read_to_string(baked().join("probes/gauge.csv")).unwrap();
    let mut expected = "frame,time_s,elevation_m\n".to_owned();
    let (mut clock, mut particles) = (Clock::default(), start());
    for frame in 0..=4 {
        if frame > 0 {
            (clock, particles, _) = step(&particles, clock, frame);
        }
        let value = seen(clock)[0][0].map_or(String::new(), |v| format!("{v:?}"));
        expected += &format!("{frame},{:?},{value}\n", clock.time);
    }
    assert_eq!(text, expected);
    assert!(text.contains("\n3,0.05,\n"), "dry is empty: {text}");
    let energy = fs::read_to_string(baked().join("probes/energy-1.csv")).unwrap();
    assert!(energy.starts_with("frame,time_s,kinetic_J,potential_J\n0,0.0,0.0,-0.0\n1,"));

    // A row changed, cut, added; the file gone: each is named, and mended by going on.
    let spoil: [fn(&Path); 4] = [
        |path| {
            let text = fs::read_to_string(path).unwrap();
            fs::write(path, text.replacen("\n2,", "\n2,1", 1)).unwrap();
        },
        |path| {
            let text = fs::read(path).unwrap();
            fs::write(path, &text[..text.len() - 5]).unwrap();
        },
        |path| {
            let text = fs::read_to_string(path).unwrap();
            fs::write(path, text + "5,0.1,1.0\n").unwrap();
        },
        |path| fs::remove_file(path).unwrap(),
    ];
    for (k, spoil) in spoil.into_iter().enumerate() {
        let dir = copied();
        let path = dir.path().join("probes/gauge.csv");
        spoil(&path);
        let problems = CacheReader::open(dir.path()).unwrap().survey().problems;
        assert_eq!(problems.len(), 1, "{k}: {problems:?}");
        assert_eq!(problems[0].file, path);
        let what = ["line 4 ", "line 6 ", "line 7 ", "it is missing"][k];
        assert!(problems[0].what.starts_with(what), "{k}: {problems:?}");
        fs::write(dir.path().join("probes/other.csv.tmp"), "half").unwrap();
        resume(dir.path(), 4).unwrap();
        assert_eq!(
            directory_hash(dir.path()).unwrap(),
            directory_hash(baked()).unwrap()
        );
    }
}

/// What a frame showed to a probe is gone with the frame's computation.
#[test]
fn a_bake_goes_on_with_its_own_probes_alone() {
    let dir = copied();
    let before = directory_hash(dir.path()).unwrap();
    let changes: [fn(&mut Manifest); 3] = [
        |m| m.probes.truncate(1),
        |m| m.probes[0].at[1] = 1.25,
        |m| m.probes.clear(),
    ];
    for change in changes {
        let mut given = manifest();
        change(&mut given);
        let error = CacheWriter::resume(dir.path(), &given).unwrap_err();
        let message = error.to_string();
        assert!(matches!(error, CacheError::OtherProbes { .. }), "{message}");
        assert!(
            message.contains(
                "was baked with gauge (elevation at [0.5, 1.5]), energy-1, and this run has"
            ),
            "{message}"
        );
    }
    assert_eq!(directory_hash(dir.path()).unwrap(), before);
}

/// No number that is none gets into the ledger, and each frame has a value for each column.
#[test]
fn probes_that_measure_nothing_sensible_stop_the_bake() {
    let spoil: [fn(&mut ProbeValues); 3] = [
        |values| values[1][0] = Some(f64::NAN),
        |values| values[1].truncate(1),
        |values| values.clear(),
    ];
    for spoil in spoil {
        let dir = tempfile::tempdir().unwrap();
        let mut writer = create(dir.path());
        let (clock, particles, report) = step(&start(), Clock::default(), 1);
        let mut values = seen(clock);
        spoil(&mut values);
        writer
            .submit(clock, particles, values, report, Value::Null)
            .unwrap();
        assert!(matches!(writer.finish(), Err(CacheError::Unfit(_))));
        assert_eq!(ledger_holds(dir.path()), 0);
    }
}

#[test]
fn another_format_is_named_not_guessed_at() {
    let dir = copied();
    let path = dir.path().join("manifest.json");
    let text = fs::read_to_string(&path).unwrap();
    let newer = text.replacen("\"format_version\": 1", "\"format_version\": 2", 1);
    fs::write(&path, newer).unwrap();
    match CacheReader::open(dir.path()) {
        Err(CacheError::Format {
            found, supported, ..
        }) => {
            assert_eq!((found.as_str(), supported), ("2", 1));
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn what_cannot_be_cached_is_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path().join("new");
    let refuse = |manifest: Manifest, assets: &[Asset], start: &Particles| {
        let result =
            CacheWriter::create(&d, manifest, SCENE, assets, start, &seen(Clock::default()));
        assert!(matches!(result, Err(CacheError::Unfit(_))), "{result:?}");
        assert!(!d.exists());
    };
    let with = |change: fn(&mut Manifest)| {
        let mut manifest = manifest();
        change(&mut manifest);
        manifest
    };
    refuse(with(|m| m.shot = "../up".to_owned()), &[], &start());
    refuse(with(|m| m.frames_per_second = f64::NAN), &[], &start());
    refuse(with(|m| m.attributes.truncate(1)), &[], &start());
    let mut twice = start();
    twice.id[1] = twice.id[0];
    refuse(manifest(), &[], &twice);
    let mut leading_up = assets();
    leading_up[0].name = "../scene.toml".to_owned();
    refuse(manifest(), &leading_up, &start());
    leading_up[0].name = leading_up[1].name.clone();
    refuse(manifest(), &leading_up, &start());
    refuse(
        with(|m| m.probes[1].name = "../up".to_owned()),
        &[],
        &start(),
    );
    // One file on some file systems.
    refuse(
        with(|m| m.probes[1].name = "GAUGE".to_owned()),
        &[],
        &start(),
    );
    refuse(with(|m| m.probes.truncate(1)), &[], &start());
    create(&d);
}

#[test]
fn frames_come_in_turn() {
    let dir = tempfile::tempdir().unwrap();
    let mut writer = create(dir.path());
    for frame in [0, 2] {
        let clock = Clock {
            frame,
            ..Clock::default()
        };
        let refused = writer.submit(clock, start(), seen(clock), Value::Null, Value::Null);
        assert!(matches!(refused, Err(CacheError::Unfit(_))));
    }
    assert_eq!(
        go_on(writer, Clock::default(), start(), 2).unwrap().frames,
        2
    );
}

/// Submits until the writer speaks up; by the depth of its queue it must within a few frames.
fn submit_until_error(writer: &mut CacheWriter) -> CacheError {
    let (mut clock, mut particles) = (Clock::default(), start());
    for frame in 1..50 {
        let report;
        (clock, particles, report) = step(&particles, clock, frame);
        if let Err(error) =
            writer.submit(clock, particles.clone(), seen(clock), report, Value::Null)
        {
            return error;
        }
    }
    panic!("no error in 50 frames");
}

#[test]
fn unfit_frames_speak_up_on_finish() {
    let dir = tempfile::tempdir().unwrap();
    let mut writer = create(dir.path());
    let mut spoiled = start();
    spoiled.velocity.pop();
    let clock = Clock {
        frame: 1,
        ..Clock::default()
    };
    writer
        .submit(clock, spoiled, seen(clock), Value::Null, Value::Null)
        .unwrap();
    assert!(matches!(writer.finish(), Err(CacheError::Unfit(_))));
    assert_eq!(ledger_holds(dir.path()), 0);
    assert_eq!(resume(dir.path(), 4).unwrap().frames, 4);
    assert_eq!(
        directory_hash(dir.path()).unwrap(),
        directory_hash(baked()).unwrap()
    );
}

#[test]
fn a_directory_removed_in_mid_bake_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let mut writer = create(dir.path());
    fs::remove_dir_all(dir.path().join("frames")).unwrap();
    let error = submit_until_error(&mut writer);
    assert!(matches!(error, CacheError::Io { .. }), "{error}");
    let again = Clock {
        frame: 1,
        ..Clock::default()
    };
    assert!(
        writer
            .submit(again, start(), seen(again), Value::Null, Value::Null)
            .is_err()
    );
    assert!(matches!(writer.finish(), Err(CacheError::Stopped)));
}

#[test]
fn a_ledger_touched_in_mid_bake_is_an_error() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let mut writer = create(d);
    let ledger = fs::read(d.join(LEDGER)).unwrap();
    fs::write(d.join(LEDGER), [&ledger[..], b"x"].concat()).unwrap();
    assert_eq!(
        damaged_file::<()>(Err(submit_until_error(&mut writer))),
        d.join(LEDGER)
    );
    drop(writer);
    fs::write(d.join(LEDGER), ledger).unwrap();
    assert_eq!(resume(d, 4).unwrap().last_frame, 4);
    assert_eq!(directory_hash(d).unwrap(), directory_hash(baked()).unwrap());
}

/// `/dev/full` behind the name of the frame's temporary file: every write ends with ENOSPC.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_and_the_bake_goes_on_after_it() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let mut writer = create(d);
    let temporary = d.join("frames/tank.0002.ply.tmp");
    std::os::unix::fs::symlink("/dev/full", &temporary).unwrap();
    match submit_until_error(&mut writer) {
        CacheError::Io { path, source } => {
            assert_eq!(path, temporary);
            assert_eq!(source.kind(), std::io::ErrorKind::StorageFull);
        }
        other => panic!("{other}"),
    }
    drop(writer);
    assert_eq!(ledger_holds(d), 1);
    assert!(cache::survey(d).unwrap().problems.is_empty());
    assert_eq!(resume(d, 4).unwrap().frames, 3);
    assert_eq!(directory_hash(d).unwrap(), directory_hash(baked()).unwrap());
}

const KILLED_DIR: &str = "SWELL_TEST_KILLED_DIR";
const KILLED_LAST: u32 = 200;

/// The child half of the test below: bakes or goes on until it is killed.
#[test]
#[ignore = "runs as the child of the test below"]
fn killed_child() {
    let dir = PathBuf::from(std::env::var(KILLED_DIR).unwrap());
    if cache::exists(&dir) {
        resume(&dir, KILLED_LAST).unwrap();
    } else {
        bake(&dir, KILLED_LAST);
    }
}

#[test]
fn killed_at_random_moments_it_ends_as_the_unbroken_bake() {
    use std::process::{Command, Stdio};
    use std::time::Duration;

    let unbroken = tempfile::tempdir().unwrap();
    bake(unbroken.path(), KILLED_LAST);
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path().join("cache");
    let (mut kills, mut inside) = (0, 0);
    // Longer each time, so that the bake gets through on any machine, however slow to start.
    for round in 0..60u64 {
        let mut child = Command::new(std::env::current_exe().unwrap())
            .args(["--ignored", "--exact", "killed_child"])
            .env(KILLED_DIR, &d)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_micros(
            3000 + 1500 * round + round * round * 7919 % 2500,
        ));
        let ended = child.try_wait().unwrap();
        child.kill().unwrap();
        let status = child.wait().unwrap();
        if let Some(status) = ended {
            assert!(status.success(), "a resume was refused in round {round}");
            break;
        }
        if !status.success() {
            kills += 1;
        }
        if cache::exists(&d) {
            inside += u32::from(ledger_holds(&d) > 0);
        }
    }
    resume(&d, KILLED_LAST).unwrap();
    println!("{kills} kills, of which {inside} inside the bake");
    assert!(inside > 0, "nothing was killed, so nothing was tested");
    assert_eq!(
        directory_hash(&d).unwrap(),
        directory_hash(unbroken.path()).unwrap()
    );
}
