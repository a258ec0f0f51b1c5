//! Probes that sample at substeps: their rates, their windows and the contents of their files.

use std::{fs, path::Path};
use swell::files::parse_scene;
use swell::files::scene_to_toml;

use crate::support::job::Job;

const SCENE: &str = r#"
[shot]
name = "tank"
frames = 5
frames_per_second = 30

[domain]
min = [-1.0, 0.5, 0.25]
max = [1.0, 2.5, 0.85]

[[water.block]]
min = [-1.0, 0.5, 0.25]
max = [-0.2, 1.3, 0.85]

[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
cfl = 0.05
[solver.flip]
cell_size = 0.2
cfl = 0.03
"#;

/// Each quantity once per frame and once at a rate of its own.
const PROBES: &str = r#"
[[probe]]
kind = "front"
axis = "+x"
[[probe]]
name = "front-all"
kind = "front"
axis = "+x"
rate_hz = "substep"
[[probe]]
kind = "pressure"
at = [-0.6, 0.8, 0.45]
[[probe]]
name = "pressure-all"
kind = "pressure"
at = [-0.6, 0.8, 0.45]
rate_hz = "substep"
window = 0.02
[[probe]]
name = "energy-60"
kind = "energy"
rate_hz = 60.0
window = 0.05
"#;

type Row = Vec<Option<f64>>;

/// Returns the header and rows of a probe's file.
fn file(job: &Job, path: &str) -> (String, Vec<Row>) {
    let text = fs::read_to_string(job.path(path)).unwrap();
    let number = |field: &str| (!field.is_empty()).then(|| field.parse().unwrap());
    let rows = text.lines().skip(1);
    let rows = rows.map(|line| line.split(',').map(number).collect());
    (text.lines().next().unwrap().to_owned(), rows.collect())
}

/// Returns the substeps of each frame from 1 on.
fn substeps(job: &Job, cache: &str) -> Vec<u64> {
    let ledger = fs::read_to_string(job.path(cache).join("frames.jsonl")).unwrap();
    let of = |line: &str| {
        let entry: serde_json::Value = serde_json::from_str(line).unwrap();
        entry["clock"]["substeps"].as_u64().unwrap()
    };
    ledger.lines().skip(1).map(of).collect()
}

/// Computes the mean, minimum and maximum of a column over the `window` seconds up to each row, as
/// docs/scene.md defines them.
fn windowed(rows: &[Row], column: usize, window: f64) -> Vec<[Option<f64>; 3]> {
    let time = |k: usize| rows[k][1].unwrap();
    let of = |k: usize| {
        let held = (0..=k).filter(|&i| time(i) > time(k) - window + 1e-9 * window);
        let held: Vec<(f64, f64)> = held
            .filter_map(|i| {
                let since = if i == 0 { time(0) } else { time(i - 1) };
                Some((time(i) - since.max(time(k) - window), rows[i][column]?))
            })
            .collect();
        let total: f64 = held.iter().map(|(span, _)| span).sum();
        let mean = held.iter().map(|(span, value)| span * value).sum::<f64>() / total;
        let mean = if total > 0.0 {
            Some(mean)
        } else {
            held.last().map(|h| h.1)
        };
        let values = || held.iter().map(|(_, value)| *value);
        [mean, values().reduce(f64::min), values().reduce(f64::max)]
    };
    (0..rows.len()).map(of).collect()
}

fn looks_at_substeps(bake: &str) {
    let scene = format!("{SCENE}{PROBES}");
    let job = Job::of(&[("tank.toml", &scene), ("plain.toml", SCENE)]);
    job.expect(0, &format!("bake tank.toml {bake} -o whole"));
    let substeps = substeps(&job, "whole");
    println!("{bake}: substeps {substeps:?}");
    assert!(substeps.iter().all(|&count| count > 1), "{substeps:?}");

    // One row at the start and one per substep; the frames' rows are among them to the last bit.
    for (frames, all) in [("front-1", "front-all"), ("pressure-1", "pressure-all")] {
        let (_, by_frame) = file(&job, &format!("whole/probes/{frames}.csv"));
        let (_, rows) = file(&job, &format!("whole/probes/{all}.csv"));
        assert_eq!(rows.len() as u64, 1 + substeps.iter().sum::<u64>());
        assert!(rows.windows(2).all(|two| two[0][1] < two[1][1]), "{rows:?}");
        let mut at = 0;
        for (frame, row) in by_frame.iter().enumerate() {
            at += if frame == 0 {
                0
            } else {
                substeps[frame - 1] as usize
            };
            assert_eq!(rows[at][..3], row[..3], "{all}, frame {frame}");
        }
        // Negative control: values between frames differ.
        assert_ne!(rows[at - 1][2], rows[at][2]);
    }
    // At 60 Hz there are two samples per frame, each at the first substep end at or after its time.
    let (header, energy) = file(&job, "whole/probes/energy-60.csv");
    let (_, all) = file(&job, "whole/probes/front-all.csv");
    assert_eq!(energy.len(), 1 + 2 * substeps.len());
    for (k, row) in energy.iter().enumerate() {
        let first = all.iter().map(|row| row[1].unwrap());
        let first = first
            .filter(|time| *time > k as f64 / 60.0 - 1e-6)
            .reduce(f64::min);
        assert_eq!(row[1], first, "look {k}");
        assert_eq!(row[0], Some((k as f64 / 2.0).ceil()), "look {k}");
    }
    assert!(
        header.starts_with(
            "frame,time_s,kinetic_J,kinetic_mean_J,kinetic_min_J,kinetic_max_J,potential_J,"
        ),
        "{header}"
    );
    let (_, pressure) = file(&job, "whole/probes/pressure-all.csv");
    for (rows, column, window) in [(&energy, 2, 0.05), (&energy, 6, 0.05), (&pressure, 2, 0.02)] {
        for (row, expected) in rows.iter().zip(windowed(rows, column, window)) {
            for (found, expected) in row[column + 1..column + 4].iter().zip(expected) {
                let (found, expected) = (found.unwrap_or(-1.0), expected.unwrap_or(-1.0));
                assert!(
                    (found - expected).abs() <= 1e-12 * expected.abs(),
                    "{row:?} {expected}"
                );
            }
        }
    }

    // Probes leave the simulation unchanged, and an interrupted bake ends with the same bytes.
    job.expect(0, &format!("bake plain.toml {bake} -o plain"));
    for frame in 0..=5 {
        let of =
            |cache: &str| fs::read(job.path(cache).join(format!("frames/tank.{frame:04}.ply")));
        assert_eq!(of("plain").unwrap(), of("whole").unwrap(), "frame {frame}");
    }
    job.expect(0, &format!("bake tank.toml {bake} -o stopped --frames 1-2"));
    let path = job.path("stopped/probes/pressure-all.csv");
    fs::write(
        &path,
        fs::read_to_string(&path).unwrap() + "3,0.07,1.0,1.0,1.0,1.0\n",
    )
    .unwrap();
    job.expect(4, "verify stopped");
    job.expect(0, &format!("bake tank.toml {bake} -o stopped --resume"));
    assert_eq!(job.hash("stopped"), job.hash("whole"));
    job.expect(0, "verify whole");
    let other = job.expect(
        4,
        &format!("bake tank.toml {bake} -o whole --resume --set probe[4].rate_hz=30.0"),
    );
    assert!(other.contains("energy at 60 Hz over 0.05 s"), "{other}");
    assert!(job.expect(0, "diff whole stopped").contains("same"));
    job.expect(0, "inspect whole --plot plots");
}

#[test]
fn pbf_looks_at_substeps() {
    looks_at_substeps("--solver pbf");
}

#[test]
fn flip_looks_at_substeps() {
    looks_at_substeps("--solver flip");
}

#[test]
fn the_reference_looks_at_substeps() {
    looks_at_substeps("--solver pbf --device cpu");
    looks_at_substeps("--solver flip --device cpu");
}

#[test]
fn impossible_probe_rate_is_refused_by_key() {
    let parse = |line: &str, set: &[&str]| {
        let text = format!("{SCENE}\n[[probe]]\nkind = \"energy\"\n{line}\n");
        let set: Vec<_> = set.iter().map(|&s| s.to_owned()).collect();
        parse_scene(&text, Path::new("a.toml"), Path::new(""), &set)
    };
    let cases: &[(&str, &[&str], &str, &str)] = &[
        ("rate_hz = \"often\"", &[], "probe[0].rate_hz", "\"often\""),
        ("rate_hz = true", &[], "probe[0].rate_hz", "a number"),
        ("rate_hz = 0.0", &[], "probe[0].rate_hz", "from 0.001 to"),
        ("rate_hz = nan", &[], "probe[0].rate_hz", "from 0.001 to"),
        (
            "rate_hz = 301.0",
            &["solver.pbf.max_substeps=10"],
            "probe[0].rate_hz",
            "from 0.001 to 300 are possible: shot.frames_per_second × solver.pbf.max_substeps",
        ),
        (
            "rate_hz = 301.0",
            &["solver.method=flip", "solver.flip.max_substeps=10"],
            "probe[0].rate_hz",
            "solver.flip.max_substeps",
        ),
        ("window = 0.0", &[], "probe[0].window", "from 1e-9 to"),
    ];
    for (line, set, key, words) in cases {
        let error = parse(line, set).unwrap_err().to_string();
        assert!(
            error.starts_with("a.toml:") && error.contains(key) && error.contains(words),
            "{line}: {error}"
        );
    }
    // The highest rate allowed is one sample per possible substep.
    for set in [
        &["solver.pbf.max_substeps=10"][..],
        &["solver.method=flip", "solver.flip.max_substeps=10"],
    ] {
        let scene = parse("rate_hz = 300.0\nwindow = 0.01", set).unwrap();
        let text = scene_to_toml(&scene, &|_, _| String::new());
        let again = parse_scene(&text, Path::new("b.toml"), Path::new(""), &[]).unwrap();
        assert_eq!(again, scene);
    }
    let scene = parse("rate_hz = \"substep\"", &[]).unwrap();
    let text = scene_to_toml(&scene, &|_, _| String::new());
    assert!(text.contains("rate_hz = \"substep\""), "{text}");
}
