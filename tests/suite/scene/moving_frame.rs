//! `[domain] motion` and `turn` in scene files: written and read again, and refused where something
//! does not know of them.

use std::path::Path;

use crate::support::job::Job;
use swell::{
    files::{parse_scene, scene_to_toml},
    scene::Scene,
};

const SCENE: &str = r#"
[shot]
name = "rolls"
frames = 10
frames_per_second = 24
[domain]
min = [100.0, 0.0, -4.0]
max = [102.4, 1.6, -2.4]
direction = [0.0, 0.0, 2.0]
motion = { kind = "table", points = [[0.0, 0.0], [0.5, -0.2], [1.0, 0.1]] }
pivot = [101.0, 0.3, -3.0]
axis = [3.0, 0.0, 0.0]
turn = { kind = "sine", swing_degrees = 8.0, period = 1.63, ramp = 0.5 }
[[water.block]]
min = [100.0, 0.0, -4.0]
max = [102.4, 0.8, -2.4]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
"#;

const CUBE: &str = "\
v 0 0 0\nv 0.4 0 0\nv 0.4 0.4 0\nv 0 0.4 0\nv 0 0 0.4\nv 0.4 0 0.4\nv 0.4 0.4 0.4\nv 0 0.4 0.4
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 1 5 8 4\nf 2 3 7 6\nf 4 8 7 3
";

fn parse(text: &str) -> Result<Scene, String> {
    parse_scene(text, Path::new("rolls.toml"), Path::new("."), &[])
        .map_err(|error| error.to_string())
}

#[test]
fn a_motion_is_written_and_read_again() {
    let scene = parse(SCENE).unwrap();
    let written = scene_to_toml(&scene, &|path, _| path.display().to_string());
    let again = parse(&written).unwrap();
    assert_eq!(again.frame, scene.frame);
    let motion = scene.frame.as_ref().unwrap().motion();
    // The scene's coordinates begin at its origin, and the farthest corner is (100, 1.6, -4).
    let pivot = motion.turn.as_ref().unwrap().pivot + scene.origin;
    assert!((pivot - glam::DVec3::new(101.0, 0.3, -3.0)).length() < 1e-12);
    assert!((motion.reach - glam::DVec3::new(1.4, 1.3, 1.0).length()).abs() < 1e-12);
    // Control: another turn is another scene.
    let other = parse(&SCENE.replace("swing_degrees = 8.0", "swing_degrees = 8.1")).unwrap();
    assert_ne!(other.frame, scene.frame);
    let keys = ["direction", "motion", "pivot", "axis", "turn"];
    let is_kept = |line: &&str| !keys.iter().any(|key| line.starts_with(key));
    let still: Vec<&str> = SCENE.lines().filter(is_kept).collect();
    assert!(parse(&still.join("\n")).unwrap().frame.is_none());
}

#[test]
fn what_does_not_know_the_motion_is_refused() {
    let fails = |from: &str, to: &str, part: &str| {
        assert!(SCENE.contains(from), "{from}");
        let error = parse(&SCENE.replace(from, to)).unwrap_err();
        assert!(error.contains(part), "{error}");
    };
    fails("axis = [3.0", "axis = [0.0", "domain.axis: no direction");
    fails(
        "direction = [0.0, 0.0, 2.0]",
        "",
        "domain.motion: given without direction",
    );
    fails("pivot = [101.0, 0.3, -3.0]\n", "", "pivot");
    fails(
        "axis = [",
        "periodic = [\"x\"]\naxis = [",
        "domain.periodic does not feel that",
    );
    fails(
        "cell_size = 0.1",
        "cell_size = 0.1\nband = 5\ncfl = 1.0",
        "solver.flip.band does not feel that",
    );
    fails(
        "swing_degrees = 8.0, period = 1.63",
        "swing_degrees = 1e9, period = 1.63",
        "domain.motion: it moves at",
    );
}

/// What a scene says can be refused only as a user meets it: with a body's mesh, a bake's frame, and
/// a cache for whitewater.
#[test]
fn bodies_other_motions_and_whitewater_are_refused() {
    let small = SCENE.replace(
        "[solver.flip]\ncell_size = 0.1",
        "[solver.flip]\ncell_size = 0.2",
    );
    let job = Job::of(&[("rolls.toml", &small), ("cube.obj", CUBE)]);
    let body = "--set body=[{mesh=\"cube.obj\",translate=[101,1,-3],density=300}]";
    let words = format!("inspect rolls.toml {body}");
    job.expect_clear(2, &words, "[[body]] does not feel that");
    job.expect(0, "bake rolls.toml -o rolls --frames 1-2");
    job.expect_clear(
        2,
        "whitewater rolls",
        "moves, which spray in the air would not feel",
    );
    let from = "bake rolls.toml -o other --frames 1-2 --from rolls:1";
    job.expect(0, from);
    let other = format!(
        "{} --set domain.turn.period=1.5",
        from.replace("other", "third")
    );
    job.expect_clear(2, &other, "a motion of the domain");
}

/// A sudden start takes the substeps that its speed asks for, and the default limit of speed is that
/// speed beyond a fall.
#[test]
fn a_sudden_start_is_a_jump_of_the_velocity() {
    let jumps = |velocity: f64| {
        let motion = format!("motion = {{ kind = \"constant_velocity\", velocity = {velocity} }}");
        let from = "motion = { kind = \"table\", points = [[0.0, 0.0], [0.5, -0.2], [1.0, 0.1]] }";
        let text = SCENE.replace(from, &motion);
        let kept = text
            .lines()
            .filter(|line| !line.starts_with("turn") && !line.starts_with("axis"));
        let kept: Vec<&str> = kept.filter(|line| !line.starts_with("pivot")).collect();
        parse(&kept.join("\n")).unwrap()
    };
    let (slow, fast) = (jumps(1.0), jumps(4.0));
    assert_eq!(
        fast.jump_of_domain(0.0, 0.04) - slow.jump_of_domain(0.0, 0.04),
        3.0
    );
    assert_eq!(
        fast.most_acceleration(0.0, 0.04),
        slow.most_acceleration(0.0, 0.04)
    );
    let limit = |scene: &Scene| scene.budget.speed.unwrap();
    let more = limit(&fast) - limit(&slow);
    assert!((more / 3.0 - 4.0).abs() < 1e-9, "{more}");
}
