use std::path::Path;

use swell_domain::absorber::{AbsorberState, AbsorberStates};

use crate::parse_scene;

const SCENE: &str = r#"
[shot]
name = "a"
frames = 10
frames_per_second = 20
[domain]
min = [0, 0, 0]
max = [4, 1, 0.5]
[[water.block]]
min = [0, 0, 0]
max = [4, 0.4, 0.5]
[[wave_maker]]
wall = "+x"
motion = { kind = "still" }
absorption = { depth = 0.4, period = 1.14, room = 0.3 }
[solver]
method = "flip"
[solver.flip]
cell_size = 0.1
cfl = 1.0
"#;

/// A wall that makes no waves and moves only as it absorbs: 1.2 m/s, and 2.2 m/s at the end
/// of a tenth of a second at 10 m/s². Without its state it is at rest.
#[test]
fn the_speed_of_an_absorbing_wall_counts() {
    let scene = parse_scene(SCENE, Path::new("s.toml"), Path::new(""), &[]).expect("valid");
    let scene = scene.with_flip().expect("a scene of FLIP");
    let substeps = |absorbers: &AbsorberStates| {
        let first = scene.flip_substep((absorbers, &[]), 1, 0.0, 0.05, 0.0, (0, 0.0));
        first.expect("few").0
    };
    let mut absorbers = AbsorberStates::default();
    assert_eq!(scene.peak_boundary_speed(&absorbers, &[], 0.0, 0.1), 0.0);
    let at_rest = substeps(&absorbers);
    absorbers[0] = Some(AbsorberState {
        start: 0.0,
        displacement: 0.0,
        velocity: 1.2,
        acceleration: 10.0,
        level: None,
        mean: 0.0,
    });
    assert!((scene.peak_boundary_speed(&absorbers, &[], 0.0, 0.1) - 2.2).abs() < 1e-12);
    // 1.7 m/s for 0.05 s are 0.085 m and gravity adds 0.025 m: more than a cell.
    assert_eq!((at_rest, substeps(&absorbers)), (1.0, 2.0));
}
