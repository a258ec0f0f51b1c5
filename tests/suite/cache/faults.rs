//! The cache against crashes, damage, second writers and other people's files.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use proptest::prelude::*;
use serde_json::Value;
use swell::cache::{
    self, CacheError, CacheReader, CacheWriter, Clock, Manifest, Parent, directory_hash,
};
use tempfile::TempDir;

use crate::support::cache::*;

/// A kill leaves a prefix of the ledger, and possibly a frame without a line or a temporary file.
#[test]
fn resumed_from_any_torn_ledger_it_is_the_unbroken_bake() {
    let whole = directory_hash(baked()).unwrap();
    let ledger = fs::read(baked().join(LEDGER)).unwrap();
    let first_line = ledger.iter().position(|&b| b == b'\n').unwrap() + 1;
    let dir = copied();
    let d = dir.path();
    // Every length would take minutes of flushing; multiples of a prime hit all parts of a line.
    let lengths = (0..ledger.len()).filter(|n| n % 37 == 0 || ledger[n.max(&1) - 1] == b'\n');
    for length in lengths.chain([first_line, ledger.len() - 1]) {
        fs::write(d.join(LEDGER), &ledger[..length]).unwrap();
        fs::write(d.join("frames/tank.0003.ply.tmp"), "half a frame").unwrap();
        if length < first_line {
            // The manifest is written after the first line, so no crash leaves this state.
            let before = directory_hash(d).unwrap();
            assert_eq!(damaged_file(resume(d, 4)), d.join(LEDGER));
            assert_eq!(directory_hash(d).unwrap(), before, "refused untouched");
            continue;
        }
        let is_torn = ledger[length - 1] != b'\n';
        let problems = CacheReader::open(d).unwrap().survey().problems;
        let is_off = |file: &str| problems.iter().any(|problem| problem.file == d.join(file));
        assert_eq!(is_off(LEDGER), is_torn, "{length}");
        // Rows of frames that are no longer in the ledger.
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
    fn a_flipped_bit_is_found(
        file in any::<prop::sample::Index>(),
        at in any::<prop::sample::Index>(),
        bit in 0u8..8,
    ) {
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
        // `read` refuses a frame; `open` or `survey` refuses the rest.
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
    fn garbage_in_place_of_a_file_never_panics(
        file in any::<prop::sample::Index>(),
        bytes in prop::collection::vec(any::<u8>(), 0..200),
    ) {
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
            // A truncated ledger is a stopped bake, which has its own test above.
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
    // In the last frame a flipped bit is found too, because the bake resumes from it.
    let dir = copied();
    let path = dir.path().join("frames/tank.0004.ply");
    let mut bytes = fs::read(&path).unwrap();
    let at = bytes.len() - 9;
    bytes[at] ^= 1;
    fs::write(&path, bytes).unwrap();
    assert_eq!(damaged_file(resume(dir.path(), 6)), path);
}

/// A cache whose meshes differ from the baked ones can be neither read nor resumed.
#[test]
fn a_damaged_asset_stops_readers_and_a_resume_untouched() {
    let dir = copied();
    let d = dir.path();
    for (name, other) in [
        ("city.obj", "tables/stroke.csv"),
        ("tables/stroke.csv", "city.obj"),
    ] {
        let [path, other] = [name, other].map(|name| d.join("assets").join(name));
        let sound = fs::read(&path).unwrap();
        let refused = || {
            let before = directory_hash(d).unwrap();
            assert_eq!(damaged_file(CacheReader::open(d)), path);
            assert_eq!(damaged_file(resume(d, 6)), path);
            assert_eq!(directory_hash(d).unwrap(), before);
        };
        for bit in 0..8 * sound.len() {
            let mut bytes = sound.clone();
            bytes[bit / 8] ^= 1 << (bit % 8);
            fs::write(&path, bytes).unwrap();
            refused();
        }
        fs::remove_file(&path).unwrap();
        refused();
        // All damaged files are reported, not only the first.
        let sound_other = fs::read(&other).unwrap();
        fs::write(&other, "").unwrap();
        let problems = cache::survey(d).unwrap().problems;
        let files: Vec<_> = problems.into_iter().map(|problem| problem.file).collect();
        assert!(files.len() == 2 && files.contains(&path) && files.contains(&other));
        fs::write(&other, sound_other).unwrap();
        fs::write(&path, sound).unwrap();
    }
    assert_eq!(resume(d, 6).unwrap().last_frame, 6, "control");
}

/// Readers that use the files beside the particles can ask for their check.
#[test]
fn a_frames_further_files_are_checked_for_who_asks() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    bake_all_streams(d, 2);
    let reader = CacheReader::open(d).unwrap();
    let check = || reader.check_beside(&[0, 1, 2]);
    check().unwrap();
    assert!(matches!(
        reader.check_beside(&[3]),
        Err(CacheError::NoFrame { .. })
    ));
    for name in [
        "grids/tank.0001.vdb",
        "grids/tank.0002.vdb",
        "probes/gauge.csv",
        "probes/energy-1.csv",
    ] {
        let path = d.join(name);
        let sound = fs::read(&path).unwrap();
        let mut bytes = sound.clone();
        bytes[sound.len() / 2] ^= 1;
        for spoiled in [Some(bytes), Some(sound[1..].to_vec()), None] {
            match spoiled {
                Some(bytes) => fs::write(&path, bytes).unwrap(),
                None => fs::remove_file(&path).unwrap(),
            }
            assert_eq!(damaged_file(check()), path);
        }
        fs::write(&path, sound).unwrap();
        check().unwrap();
    }
    // Frames that were not asked for are not checked.
    fs::remove_file(d.join("grids/tank.0002.vdb")).unwrap();
    reader.check_beside(&[0, 1]).unwrap();
    // A cache without grids has none that could be damaged.
    CacheReader::open(baked())
        .unwrap()
        .check_beside(&[1])
        .unwrap();
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

/// Each line is whole and the manifest is the same, but the frames belong to two histories.
#[test]
fn a_ledger_spliced_from_two_bakes_is_refused() {
    let other = tempfile::tempdir().unwrap();
    let mut writer = create(other.path());
    let (mut clock, mut particles) = (Clock::default(), start());
    for frame in 1..=4 {
        (clock, particles, _) = step(&particles, clock, frame);
        let report = serde_json::json!({ "another": frame });
        writer
            .submit(clock, particles.clone(), seen(clock), report, Value::Null)
            .unwrap();
    }
    writer.finish().unwrap();
    let lines = |d: &Path| -> Vec<String> {
        let text = fs::read_to_string(d.join(LEDGER)).unwrap();
        text.split_inclusive('\n').map(str::to_owned).collect()
    };
    let (ours, theirs) = (lines(baked()), lines(other.path()));
    assert_eq!(ours[0], theirs[0]);
    let dir = copied();
    let d = dir.path();
    for taken in 1..=4 {
        fs::write(d.join(LEDGER), ours.concat()).unwrap();
        assert!(CacheReader::open(d).is_ok(), "control");
        let mut spliced = ours.clone();
        spliced[taken] = theirs[taken].clone();
        fs::write(d.join(LEDGER), spliced.concat()).unwrap();
        // After only the first line beyond the start either history is valid; the next
        // line reveals it.
        if taken == 1 {
            spliced.truncate(2);
            fs::write(d.join(LEDGER), spliced.concat()).unwrap();
            assert!(CacheReader::open(d).is_ok(), "a bake that stopped there");
            fs::write(d.join(LEDGER), [&spliced[..], &ours[2..]].concat().concat()).unwrap();
        }
        assert_eq!(
            damaged_file(CacheReader::open(d)),
            d.join(LEDGER),
            "{taken}"
        );
        assert_eq!(damaged_file(resume(d, 6)), d.join(LEDGER), "{taken}");
    }
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
            Clock::default(),
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
    // `directory_hash` ignores a lock, the listing does not.
    assert_eq!((directory_hash(d).unwrap(), files(d)), (before, listing));

    let file = d.join("scene.toml");
    assert!(matches!(attempt(&file), Err(CacheError::Occupied { .. })));
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");

    let dir = copied();
    let before = directory_hash(dir.path()).unwrap();
    let refused = attempt(dir.path());
    assert!(matches!(refused, Err(CacheError::Exists { .. })));
    assert!(refused.unwrap_err().to_string().contains("resume it"));
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

/// The start of a bake from a frame of another cache has that frame's number, also where the
/// creation was interrupted.
#[test]
fn a_cache_that_begins_at_a_frame_is_numbered_from_there() {
    let parent = Parent {
        shot: "other".to_owned(),
        solver: "pbf".to_owned(),
        scene_hash: "5ce".to_owned(),
        frame: 120,
        blake3: "b3".to_owned(),
        shaders: None,
    };
    let given = Manifest {
        parent: Some(parent),
        ..manifest()
    };
    let clock = Clock {
        frame: 120,
        time: 2.0,
        substeps: 3,
        steps: 400,
        ..Clock::default()
    };
    let attempt = |d: &Path, clock| {
        let (start, seen) = (start(), seen(clock));
        CacheWriter::create(d, given.clone(), SCENE, &assets(), clock, &start, &seen)
    };
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let unfit = attempt(&d.join("unfit"), Clock::default());
    assert!(matches!(unfit, Err(CacheError::Unfit(_))) && !d.join("unfit").exists());
    let whole = d.join("whole");
    go_on(attempt(&whole, clock).unwrap(), clock, start(), 124).unwrap();
    let reader = CacheReader::open(&whole).unwrap();
    assert_eq!((reader.first_frame(), reader.last_frame()), (120, 124));
    assert_eq!(reader.verify().unwrap().frames, 4);
    assert_eq!(reader.entry(120).unwrap().clock, clock);
    for missing in [0, 119, 125] {
        let said = reader.read(missing).unwrap_err().to_string();
        assert!(
            said.contains(&format!("frames 120 to 124, not {missing}")),
            "{said}"
        );
    }
    // Stopped at any frame, it can be resumed, whether or not the run names the parent.
    for (stop, parent) in [(120, None), (121, given.parent.clone()), (124, None)] {
        let part = d.join(format!("part{stop}"));
        go_on(attempt(&part, clock).unwrap(), clock, start(), stop).unwrap();
        let run = Manifest {
            parent,
            ..manifest()
        };
        let (writer, entry, particles) = CacheWriter::resume(&part, &run).unwrap();
        assert_eq!(entry.frame, stop);
        go_on(writer, entry.clock, particles, 124).unwrap();
        assert_eq!(
            directory_hash(&part).unwrap(),
            directory_hash(&whole).unwrap()
        );
    }
    let mut other = given.clone();
    other.parent.as_mut().unwrap().blake3 = "another".to_owned();
    let refused = CacheWriter::resume(&whole, &other);
    assert!(
        matches!(refused, Err(CacheError::OtherParent { .. })),
        "{refused:?}"
    );
    // Interrupted before the manifest: with one frame it starts over, with two it holds a bake.
    let cut = d.join("cut");
    attempt(&cut, clock).unwrap().finish().unwrap();
    let begun = directory_hash(&cut).unwrap();
    fs::remove_file(cut.join("manifest.json")).unwrap();
    attempt(&cut, clock).unwrap().finish().unwrap();
    assert_eq!(directory_hash(&cut).unwrap(), begun);
    fs::remove_file(whole.join("manifest.json")).unwrap();
    let refused = attempt(&whole, clock);
    assert!(
        matches!(refused, Err(CacheError::Occupied { .. })),
        "{refused:?}"
    );
}

/// Submits frames until the writer reports an error; the depth of its queue bounds
/// how many it takes.
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
fn malformed_frames_are_an_error_on_finish() {
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
    assert!(matches!(error, CacheError::Io(_)), "{error}");
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

/// Links the frame's temporary file to `/dev/full`: every write ends with ENOSPC.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_an_error_and_the_bake_goes_on_after_it() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    let mut writer = create(d);
    let temporary = d.join("frames/tank.0002.ply.tmp");
    std::os::unix::fs::symlink("/dev/full", &temporary).unwrap();
    match submit_until_error(&mut writer) {
        CacheError::Io(error) => {
            assert_eq!(error.path, temporary);
            assert_eq!(error.source.kind(), std::io::ErrorKind::StorageFull);
        }
        other => panic!("{other}"),
    }
    drop(writer);
    assert_eq!(ledger_holds(d), 1);
    assert!(cache::survey(d).unwrap().problems.is_empty());
    assert_eq!(resume(d, 4).unwrap().frames, 3);
    assert_eq!(directory_hash(d).unwrap(), directory_hash(baked()).unwrap());
}
