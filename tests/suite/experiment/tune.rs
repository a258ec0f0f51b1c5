//! `swell tune`: the choice is right, as bakes of the written scene show, and bad
//! requests are refused.

use std::{collections::BTreeMap, fs};
use swell::files::load_scene;

use swell::{
    cache::CacheReader, domain::aggregates::Aggregates, stage::gauge, study::measure::Gauge,
};

use crate::support::{
    events::{events, named},
    job::{Job, assert_has},
};

const SCENE: &str = r#"
# A small dam.
[shot]
name = "tiny"
frames = 24
frames_per_second = 24
[domain]
min = [0.0, 0.0, 0.0]
max = [3.2, 1.6, 0.8]
[[water.block]]
min = [0.0, 0.0, 0.0]
max = [0.8, 0.8, 0.8]
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.08   # ten layers
"#;

/// A row of the table, by column title.
type Row = BTreeMap<String, String>;

/// Splits a CSV line, some of whose cells are quoted.
fn cells(line: &str) -> Vec<String> {
    // A quote within quotes is doubled; no cell is empty and quoted.
    let line = line.replace("\"\"", "\r");
    let parts = line.split('"').enumerate();
    let parts = parts.map(|(k, part)| match k % 2 {
        0 => part.replace(',', "\n"),
        _ => part.to_owned(),
    });
    let text = parts.collect::<String>();
    text.split('\n')
        .map(|cell| cell.replace('\r', "\""))
        .collect()
}

fn rows(job: &Job) -> Vec<Row> {
    let text = fs::read_to_string(job.path("out/results.csv")).unwrap();
    let mut lines = text.lines().map(cells);
    let titles = lines.next().unwrap();
    let row = |cells: Vec<String>| titles.iter().cloned().zip(cells).collect();
    lines.map(row).collect()
}

fn number(row: &Row, title: &str) -> f64 {
    row[title]
        .parse()
        .unwrap_or_else(|_| panic!("{title}: {row:?}"))
}

/// Whether a row may be chosen.
fn is_candidate(row: &&Row) -> bool {
    let why = &row["for"];
    why != "reference" && why != "a millionth more gravity" && row["failed"].is_empty()
}

/// Measures a cache's frames with the tuning's gauge. Energies are per mass: for a density of 1 and
/// the lattice's volume.
fn aggregates(job: &Job, cache: &str, gauge: &Gauge) -> Vec<Aggregates> {
    let cache = CacheReader::open(&job.path(cache)).unwrap();
    let spacing = cache.manifest().particle_spacing;
    let gravity = glam::DVec3::new(0.0, -9.81, 0.0);
    let of = |frame| {
        let particles = cache.read(frame).unwrap();
        let volume = particles.len() as f64 * spacing.powi(3);
        let sums = gauge.aggregates(&particles, spacing, 1.0, gravity);
        Aggregates {
            kinetic_energy: sums.kinetic_energy / volume,
            potential_energy: sums.potential_energy / volume,
            ..sums
        }
    };
    (1..=cache.last_frame()).map(of).collect()
}

/// Mean difference over the frames that have the quantity, per cent of the reference's maximum.
fn error(run: &[Aggregates], fine: &[Aggregates], of: fn(&Aggregates) -> Option<f64>) -> f64 {
    let off = run
        .iter()
        .zip(fine)
        .filter_map(|(a, b)| Some((of(a)? - of(b)?).abs()));
    let off: Vec<f64> = off.collect();
    let greatest = fine.iter().filter_map(of).fold(0.0, f64::max);
    100.0 * off.iter().sum::<f64>() / off.len() as f64 / greatest
}

#[test]
fn the_cheapest_settings_that_hold_are_written_and_hold_when_they_are_baked() {
    let job = Job::of(&[("tiny.toml", SCENE)]);
    let tune = "tune tiny.toml -o out --error energy=4% --error front=6%";
    let said = job.expect(0, tune);
    assert_has(
        &said,
        &["that holds.", "tiny.tuned.toml", "a millionth more gravity"],
    );
    let rows = rows(&job);

    // By the table: the chosen run holds, no cheaper one does, and some runs do not hold.
    let is_within =
        |row: &Row, title: &str, limit: f64| row[title].parse::<f64>().is_ok_and(|v| v <= limit);
    let holds =
        |row: &&Row| is_within(row, "energy_error", 4.0) && is_within(row, "front_error", 6.0);
    let all = || rows.iter().filter(is_candidate);
    let cheapest = all()
        .filter(holds)
        .min_by(|a, b| number(a, "ms").total_cmp(&number(b, "ms")));
    let cheapest = cheapest.expect("one that holds");
    assert!(!all().all(|row| holds(&row)));
    assert!(all().all(|row| (row["holds"] == "yes") == holds(&row)));
    assert!(said.contains(&format!("{}: ", cheapest["run"])), "{said}");

    // By bakes: the written scene against the reference.
    let reference = rows.iter().find(|row| row["for"] == "reference").unwrap();
    let set = reference["run"]
        .replace(" = ", "=")
        .replace(", ", " --set ");
    job.expect(0, "bake tiny.tuned.toml -o tuned");
    job.expect(0, &format!("bake tiny.toml -o reference --set {set}"));
    let gauge = {
        let cache = CacheReader::open(&job.path("reference")).unwrap();
        let scene = load_scene(&job.path("reference/scene.toml"), &[]).unwrap();
        let start = cache.read(0).unwrap().position;
        // Twice the scene's spacing: 2.5 times the reference's, which is 0.8 of the scene's.
        gauge::gauge(&scene, 0.16, &start, scene.particle_spacing())
    };
    let [tuned, fine] = ["tuned", "reference"].map(|cache| aggregates(&job, cache, &gauge));
    let energy = error(&tuned, &fine, |it| {
        Some(it.kinetic_energy + it.potential_energy)
    });
    let front = error(&tuned, &fine, |it| it.front);
    // The table has six decimals.
    let is_told = |value: f64, title| (value - number(cheapest, title)).abs() < 1e-5;
    assert!(is_told(energy, "energy_error") && energy <= 4.0, "{energy}");
    assert!(is_told(front, "front_error") && front <= 6.0, "{front}");

    // The tuned scene keeps its comments and states the reasons.
    let text = fs::read_to_string(job.path("tiny.tuned.toml")).unwrap();
    assert_has(
        &text,
        &[
            "# A small dam.",
            "# tune: ",
            "swell tune tiny.toml --error energy=4% --error front=6%",
        ],
    );
    let page = fs::read_to_string(job.path("out/index.html")).unwrap();
    for part in [
        "What cannot be promised",
        "What was not tried",
        "by the laws",
        "<svg",
    ] {
        assert!(page.contains(part), "{part}");
    }

    // If no setting holds, the nearest is reported and nothing is written. All results are reused.
    fs::remove_file(job.path("tiny.tuned.toml")).unwrap();
    let said = job.expect(1, &tune.replace("4%", "1e-6%"));
    assert_has(
        &said,
        &[
            "None of ",
            "The nearest is ",
            "point 1 of 13",
            "stands there",
        ],
    );
    // Except for the proposals of the scaling laws for the other limit.
    let is_new = |line: &&str| line.contains("  done") && !line.contains("proposal: ");
    assert_eq!(said.lines().find(is_new), None, "{said}");
    assert!(!job.path("tiny.tuned.toml").exists());
    // No bake holds a limit of one microsecond.
    let hurried = job.expect(1, &format!("{tune} --per-frame 1e-6"));
    assert_has(
        &hurried,
        &["holds energy 4 %, front 6 %, 0.000001 s a frame"],
    );
}

/// Shares divide the runs that are known at the start; the joining command makes laws,
/// proposals and the scene.
#[test]
fn shares_of_a_tuning_are_joined() {
    let job = Job::of(&[("tiny.toml", SCENE)]);
    let tune = "tune tiny.toml -o out --frames 1-4 --error energy=50%";
    let mut done = 0;
    for k in 1..=2 {
        // A dry run lists what this share would run.
        let told = events(&job, 0, &format!("{tune} --chunk {k}/2 --dry-run"));
        let dry = &named(&told, "dry_run")[0];
        assert_eq!(
            (&dry["points"], &dry["chunk"]),
            (&(8 - k).into(), &format!("{k}/2").into())
        );
        let told = events(&job, 0, &format!("{tune} --chunk {k}/2"));
        done += named(&told, "point").len();
        assert_eq!(told.last().unwrap()["left"], 13 - done);
        assert!(!job.path("tiny.tuned.toml").exists());
    }
    assert_eq!(done, 13);
    let told = events(&job, 0, tune);
    let points = named(&told, "point");
    let stand = points
        .iter()
        .filter(|point| point["status"] == "stands there");
    assert_eq!(stand.count(), 13);
    assert_eq!(named(&told, "joined").len(), 2);
    let page = fs::read_to_string(job.path("out/index.html")).unwrap();
    assert!(
        page.contains("share 2/2 ran 6") && page.contains("several machines"),
        "{page}"
    );
    let dry = named(&events(&job, 0, &format!("{tune} --dry-run")), "dry_run")[0].clone();
    assert_eq!(
        (&dry["points"], &dry["chunk"]),
        (&13.into(), &serde_json::Value::Null)
    );
    assert!(job.path("tiny.tuned.toml").exists());
}

#[test]
fn what_cannot_be_tuned_is_refused_before_anything_runs() {
    let job = Job::of(&[("tiny.toml", SCENE)]);
    for (words, part) in [
        ("--error crest=2", "crest: 2 has no unit"),
        (
            "--error crset=2%",
            "\"crset\" is not an error that is measured",
        ),
        ("--error front=2Pa", "front: \"Pa\" is not one of its units"),
        (
            "--error pressure=2%",
            "errors: pressure: the scene has no [[probe]]",
        ),
        ("--error front=2% --frames 3-4", "--frames 3-4"),
        (
            "--error front=2% --write /tmp/t.toml",
            "target: allowed is a file beside",
        ),
    ] {
        job.expect_clear(2, &format!("tune tiny.toml {words}"), part);
    }
    job.expect(2, "tune tiny.toml");
    let told = job.expect(0, "tune tiny.toml --error front=2% --dry-run");
    assert_has(
        &told,
        &[
            "tune, 7 parts, 13 points",
            "solver.pbf.particle_spacing = 0.16\n",
            "not tried",
        ],
    );
    // A scene that another author wrote is not overwritten.
    job.write("tiny.tuned.toml", "# mine");
    let said = job.expect(4, "tune tiny.toml --error front=2% -o out");
    assert_has(&said, &["is not a tuned scene", "(--write)"]);
    assert_eq!(
        fs::read_to_string(job.path("tiny.tuned.toml")).unwrap(),
        "# mine"
    );
}
