//! `[domain] motion` and `turn` in scene files: written and read again, and refused where something
//! does not know of them.

use std::path::Path;

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
    let motion = scene.frame.as_ref().unwrap().motion().unwrap();
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
}
