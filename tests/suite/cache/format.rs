//! The cache as a format: what goes in comes out, the same bytes each time, and nothing else fits.

use std::fs;
use std::path::Path;

use serde_json::Value;
use swell::cache::{
    Asset, CacheError, CacheReader, CacheWriter, Clock, Manifest, ProbeValues, directory_hash,
};
use swell::domain::particles::Particles;
use tempfile::TempDir;

use crate::support::cache::*;

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
