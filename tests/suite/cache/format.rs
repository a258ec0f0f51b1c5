//! The cache format: contents survive a round trip, the bytes are reproducible, and anything
//! else is rejected.

use std::fs;
use std::path::Path;

use serde_json::Value;
use swell::cache::{
    Asset, CacheError, CacheReader, CacheWriter, Clock, LedgerEntry, Manifest, ProbeValues,
    directory_hash,
    stream::{GRIDS, PARTICLES, PROBES, STREAMS},
};
use swell::domain::particles::Particles;
use tempfile::TempDir;

use crate::support::cache::*;

#[test]
fn a_cache_reads_back_as_it_was_written() {
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
        assert_eq!(
            entry.file(PARTICLES).unwrap().file,
            format!("frames/tank.000{frame}.ply")
        );
        assert_eq!(entry.particles, 7);
        let back = reader.read(frame).unwrap();
        assert_eq!(back, particles);
        assert_ne!(back, reader.read(frame - 1).unwrap(), "control");
    }
    assert_eq!(
        summary.bytes,
        (1..=3)
            .map(|f| reader.entry(f).unwrap().file(PARTICLES).unwrap().bytes)
            .sum::<u64>()
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
    let mut writer = CacheWriter::create(
        dir.path(),
        manifest,
        SCENE,
        &[],
        Clock::default(),
        &nothing,
        &Vec::new(),
    )
    .unwrap();
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

#[test]
fn resume_names_the_field_that_differs() {
    let dir = copied();
    let d = dir.path();
    let before = directory_hash(d).unwrap();
    type Change = fn(&mut Manifest);
    let changes: [(&str, Change); 8] = [
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
    let mut given = manifest();
    given.format_version += 1;
    let refused = CacheWriter::resume(d, &given);
    assert!(matches!(refused, Err(CacheError::OldFormat { .. })));
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

    // A changed, cut or additional row and a missing file: each is reported, and a
    // resume repairs it.
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

/// A resume with other probes is refused: a frame's probe values cannot be measured afterwards.
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

/// The ledger accepts only finite numbers, and each frame needs a value for each column.
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
    for version in ["0", "3", "4294967298", "-1", "1.5", "\"2\""] {
        let other = text.replacen(
            "\"format_version\": 2",
            &format!("\"format_version\": {version}"),
            1,
        );
        assert_ne!(other, text);
        fs::write(&path, other).unwrap();
        let error = CacheReader::open(dir.path()).unwrap_err();
        assert!(matches!(error, CacheError::Format { .. }), "{error:?}");
        let said = error.to_string();
        let expected =
            format!("cache format {version}, and this program reads 1 to 2: bake it again");
        assert!(said.contains(&expected) && !said.contains('\n'), "{said}");
    }
}

/// Formats a line as in format 1, in which a line does not list its files by stream.
fn line_of_format_1(entry: &LedgerEntry, manifest: Option<&str>) -> Vec<u8> {
    let particles = entry.file(PARTICLES).unwrap();
    let grids = entry.file(GRIDS).unwrap();
    let rows = serde_json::to_string(&entry.rows[PROBES]).unwrap();
    let manifest = manifest.map_or(String::new(), |hash| format!(r#""manifest":"{hash}","#));
    format!(
        r#"{{"frame":{frame},"file":"frames/tank.{frame:04}.ply","bytes":{},"blake3":"{}","particles":{},"grids":{{"file":"grids/tank.{frame:04}.vdb","bytes":{},"blake3":"{}"}},"probes":{rows},{manifest}"clock":{},"report":{}}}"#,
        particles.bytes,
        particles.blake3,
        entry.particles,
        grids.bytes,
        grids.blake3,
        serde_json::to_string(&entry.clock).unwrap(),
        entry.report,
        frame = entry.frame,
    )
    .into_bytes()
}

#[test]
fn a_cache_of_the_first_format_is_read_and_not_gone_on_with() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    bake_streams_of_format_1(d, 3);
    let now = CacheReader::open(d).unwrap();
    let text = fs::read_to_string(d.join("manifest.json")).unwrap();
    let old = text.replacen("\"format_version\": 2", "\"format_version\": 1", 1);
    let hash = blake3::hash(old.as_bytes()).to_hex();
    let lines = |of: &dyn Fn(&LedgerEntry, Option<&str>) -> Vec<u8>| -> Vec<Vec<u8>> {
        let entries = now.entries().iter();
        entries
            .map(|entry| of(entry, (entry.frame == 0).then_some(hash.as_str())))
            .collect()
    };
    let write = |lines: &[Vec<u8>]| {
        fs::write(d.join("manifest.json"), &old).unwrap();
        fs::write(d.join(LEDGER), chained(old.as_bytes(), lines)).unwrap();
    };
    write(&lines(&line_of_format_1));
    let reader = CacheReader::open(d).unwrap();
    assert_eq!(reader.manifest().format_version, 1);
    let report = reader.verify().unwrap();
    assert_eq!(report, CacheReader::verify(&now).unwrap());
    reader.check_beside(&[0, 1, 2, 3]).unwrap();
    for (old, new) in reader.entries().iter().zip(now.entries()) {
        let unchained = |entry: &LedgerEntry| LedgerEntry {
            chain: String::new(),
            manifest: None,
            ..entry.clone()
        };
        assert_eq!(unchained(old), unchained(new));
        assert_eq!(
            reader.read(old.frame).unwrap(),
            now.read(old.frame).unwrap()
        );
    }
    // The files that its lines vouch for are still checked.
    let grids = d.join("grids/tank.0002.vdb");
    let sound = fs::read(&grids).unwrap();
    fs::write(&grids, &sound[1..]).unwrap();
    assert_eq!(first_problem(d), grids);
    fs::write(&grids, sound).unwrap();

    let before = directory_hash(d).unwrap();
    let refused = CacheWriter::resume(d, &manifest_of_all_streams()).unwrap_err();
    let said = refused.to_string();
    assert!(
        said.contains("was baked in cache format 1, and this program writes 2")
            && said.contains("begin from one of its frames in another folder"),
        "{said}"
    );
    assert_eq!(directory_hash(d).unwrap(), before);

    // A line of one format is invalid in a cache of the other.
    let no_grids = |entry: &LedgerEntry, hash: Option<&str>| {
        let line = String::from_utf8(line_of_format_1(entry, hash)).unwrap();
        line.replace("\"grids\":", "\"meshes\":").into_bytes()
    };
    write(&lines(&no_grids));
    assert_eq!(damaged_file(CacheReader::open(d)), d.join(LEDGER));
    let newer = |entry: &LedgerEntry, _: Option<&str>| {
        let files = serde_json::to_string(&entry.files).unwrap();
        format!(
            r#"{{"frame":{},"particles":7,"files":{files}}}"#,
            entry.frame
        )
        .into_bytes()
    };
    write(&lines(&newer));
    assert_eq!(damaged_file(CacheReader::open(d)), d.join(LEDGER));
}

/// The files of any stream in the table are verified, refused on resume when damaged, and cleared
/// where a crash left them.
#[test]
fn every_stream_of_the_table_is_verified_and_resumed() {
    let whole = tempfile::tempdir().unwrap();
    bake_all_streams(whole.path(), 3);
    let expected = directory_hash(whole.path()).unwrap();
    for stream in &STREAMS {
        assert!(stream.is_in(&manifest_of_all_streams()), "{}", stream.name);
        let dir = tempfile::tempdir().unwrap();
        let d = dir.path();
        bake_all_streams(d, 2);
        let folder = d.join(stream.folder);
        // The last by name: for a stream with one file per frame, the last frame's.
        let path = folder.join(files(&folder).pop().unwrap());
        let sound = fs::read(&path).unwrap();
        let mut flipped = sound.clone();
        flipped[sound.len() / 2] ^= 1;
        fs::write(&path, flipped).unwrap();
        assert_eq!(first_problem(d), path);
        if stream.is_by_frame() {
            let refused = CacheWriter::resume(d, &manifest_of_all_streams());
            assert_eq!(damaged_file(refused), path);
            fs::write(&path, sound).unwrap();
            let of_3 = d.join(stream.frame_file(&manifest_of_all_streams(), 3));
            fs::write(of_3, "a frame without a line").unwrap();
        }
        fs::write(folder.join("half.tmp"), "half").unwrap();
        let (writer, last, particles) = CacheWriter::resume(d, &manifest_of_all_streams()).unwrap();
        assert_eq!(last.frame, 2);
        go_on(writer, last.clock, particles, 3).unwrap();
        assert_eq!(directory_hash(d).unwrap(), expected, "{}", stream.name);
    }
}

#[test]
fn a_line_lists_the_files_that_the_manifest_announces() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path();
    bake_all_streams(d, 1);
    let manifest = fs::read(d.join("manifest.json")).unwrap();
    let text = fs::read_to_string(d.join(LEDGER)).unwrap();
    let content = |line: &str| format!("{}}}", &line[..line.rfind(",\"chain\":").unwrap()]);
    let opened = |edit: &dyn Fn(&str) -> String| {
        let lines: Vec<_> = text
            .lines()
            .map(|line| edit(&content(line)).into_bytes())
            .collect();
        fs::write(d.join(LEDGER), chained(&manifest, &lines)).unwrap();
        CacheReader::open(d)
    };
    opened(&str::to_owned).unwrap();
    let record = r#"{"file":"frames/tank.0001.ply","bytes":1,"blake3":""}"#;
    let changes: [(&str, String); 7] = [
        ("\"grids\":", "\"meshes\":".to_owned()),
        ("\"particles\":{", "\"spray\":{".to_owned()),
        ("\"files\":{", format!("\"files\":{{\"meshes\":{record},")),
        ("grids/tank.0001", "../tank.0001".to_owned()),
        ("frames/tank.0001", "frames/tank.0000".to_owned()),
        ("\"rows\":{", "\"rows\":{\"spray\":[[1.0]],".to_owned()),
        ("\"probes\":", "\"gauges\":".to_owned()),
    ];
    for (from, to) in changes {
        assert!(text.contains(from), "{from}");
        let refused = opened(&|line| line.replace(from, &to));
        assert_eq!(damaged_file(refused), d.join(LEDGER), "{to}");
    }
}

#[test]
fn what_cannot_be_cached_is_refused_before_anything_is_written() {
    let dir = tempfile::tempdir().unwrap();
    let d = dir.path().join("new");
    let refuse = |manifest: Manifest, assets: &[Asset], start: &Particles| {
        let result = CacheWriter::create(
            &d,
            manifest,
            SCENE,
            assets,
            Clock::default(),
            start,
            &seen(Clock::default()),
        );
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
    // `gauge` and `GAUGE` are one file on some file systems.
    refuse(
        with(|m| m.probes[1].name = "GAUGE".to_owned()),
        &[],
        &start(),
    );
    refuse(with(|m| m.probes.truncate(1)), &[], &start());
    create(&d);
}

#[test]
fn writer_refuses_frames_out_of_order() {
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
