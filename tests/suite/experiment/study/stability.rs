//! A study of hard cases, from its file to the page.

use super::{Job, stands};

/// Falling water: the marks bound its speed; one holds and one does not.
pub(super) const FALL: &str = r#"
kind = "stability"
about = ["Why <this> is hard."]
[[case]]
number = 1
name = "a block"
scene = "tiny.toml"
frames = 4
solvers = ["pbf"]
[[case.against]]
[[case.mark]]
of = "speed"
at_most = 10.0
[[case.mark]]
of = "difference"
at_most = 0.0
[[case.mark]]
of = "climb"
at_most = -5.0
known_failure = "water does not fall by five spacings in four frames"
[[case]]
number = 2
name = "no room"
scene = "tiny.toml"
solvers = ["flip"]
devices = ["cpu"]
set = ["solver.flip.cell_size=-1.0"]
refused = ["cell_size"]
[[case]]
number = 3
name = "elsewhere"
test = "cargo test nothing"
[[limit]]
name = "iterations"
scene = "tiny.toml"
solvers = ["pbf"]
set = ["solver.pbf.max_substeps=32", "solver.pbf.cfl={}"]
passes = 1.0
fails = 1e-4
ratio = 1e5
seconds = 0.05
unit = "CFL"
[[limit.mark]]
of = "speed"
at_most = 10.0
"#;

#[test]
fn cases_and_limits_run_once_and_are_told() {
    let job = Job::new();
    let (outcome, points) = job.run(FALL, true).unwrap();
    assert!(outcome.page.is_none() && points.is_empty());

    let (outcome, points) = job.run(FALL, false).unwrap();
    assert_eq!((points.len(), outcome.missed.len()), (5, 0), "{outcome:?}");
    // Three marks of every run, three of its own, a refusal; the known failure does not hold.
    assert_eq!(outcome.findings[0], "marks: 6 of 7 hold");
    assert!(outcome.findings[1].starts_with("known failures: 1 a block, pbf, climb"));
    let limit = "iterations, pbf: passes at 1 CFL, fails at 1.00e-4 CFL";
    assert_eq!(outcome.findings[2], limit);
    // Six marks on each device, the refusal, the limit.
    assert_eq!(job.column("quantity").len(), 14);
    assert_eq!(job.column("verdict")[12], "passes");
    let page = job.read("index.html");
    let place = |text: &str| page.find(text).unwrap_or_else(|| panic!("{text}: {page}"));
    assert!(
        place("<h1>tiny-study</h1>") < place("6 of 7 hold; 1 are known failures and 0 are missed")
    );
    assert!(place("6 of 7 hold") < place("Why &lt;this&gt; is hard."));
    assert!(place("<svg") < place("<summary>What was run</summary>"));
    assert!(page.contains("cargo test nothing"));
    // A mark that cannot be missed on one device only has no row: each run must lose no particle.
    assert!(!page.contains("particles lost or doubled"));

    // Again: nothing is run; both runs of the limit and both of the case are reused.
    let lines = job.read("results.jsonl");
    assert_eq!(lines.lines().count(), 4);
    let written = (job.read("results.csv"), page);
    let (_, points) = job.run(FALL, false).unwrap();
    assert_eq!(stands(&points), 4);
    assert_eq!(job.read("results.jsonl"), lines);
    assert_eq!((job.read("results.csv"), job.read("index.html")), written);

    // A stricter mark judges the same run again. Negative control: it is missed.
    let strict = FALL.replace("at_most = 0.0", "at_most = -1.0");
    let (outcome, _) = job.run(&strict, false).unwrap();
    assert_eq!(outcome.missed, ["1 a block, pbf, difference"]);
    assert_eq!(job.read("results.jsonl"), lines);
    // A change in what is measured, or when, needs another run.
    let later = FALL.replace("at_most = -5.0", "at_most = -5.0\nafter = 0.05");
    job.run(&later, false).unwrap();
    assert_eq!(job.read("results.jsonl").lines().count(), 6);
}
