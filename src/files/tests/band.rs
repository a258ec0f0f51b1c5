use std::path::Path;

use swell_scene::{Scene, SceneError};

use crate::parse_scene;

/// A tank of 24 × 32 × 8 cells with a band, and more keys.
fn scene(keys: &[&str]) -> Result<Scene, SceneError> {
    parsed(&format!("{TANK}        band = 4\n"), keys)
}

const TANK: &str = r#"
        [shot]
        name = "band"
        frames = 1
        frames_per_second = 24
        [domain]
        min = [0.0, 0.0, 0.0]
        max = [2.4, 3.2, 0.8]
        [water]
        [[water.block]]
        min = [0.0, 0.0, 0.0]
        max = [2.4, 2.4, 0.8]
        [solver]
        method = "flip"
        [solver.pbf]
        particle_spacing = 0.1
        [solver.flip]
        cell_size = 0.1
        cfl = 2.0
"#;

fn parsed(text: &str, keys: &[&str]) -> Result<Scene, SceneError> {
    let keys: Vec<String> = keys.iter().map(|key| (*key).to_owned()).collect();
    parse_scene(text, Path::new("band.toml"), Path::new("."), &keys)
}

#[test]
fn a_band_is_read_and_measured_in_cells_of_the_domain() {
    let band = scene(&[]).expect("a scene").band().expect("a band");
    assert_eq!((band.grid.band, band.grid.per_edge), (4, 2));
    assert_eq!(band.grid.cells, [24, 32, 8]);
    let finer = scene(&["solver.flip.particles_per_cell=27"]).expect("a scene");
    assert_eq!(finer.band().expect("a band").grid.per_edge, 3);
    // The other method has none.
    let pbf = scene(&["solver.method=pbf"]).expect("a scene");
    assert_eq!(pbf.band(), None);
}

#[test]
fn what_a_band_cannot_be_combined_with_is_refused_by_its_key() {
    let cases: [(&[&str], &str); 9] = [
        (&["solver.flip.cfl=3.0"], "has at least 5 cells"),
        (
            &["solver.flip.particles_per_cell=16"],
            "16 particles in a cell",
        ),
        (&["domain.max=[2.45,3.2,0.8]"], "needs whole ones"),
        (&["solver.flip.transfer=apic"], "transfer"),
        (
            &[
                r#"wave_maker=[{wall="-x",motion={kind="constant_velocity",velocity=1.0,until=0.1}}]"#,
            ],
            "[[wave_maker]]",
        ),
        (
            &["drain=[{min=[0.0,0.0,0.0],max=[0.5,0.5,0.5]}]"],
            "[[drain]]",
        ),
        (
            &["force=[{kind=\"acceleration\",acceleration=[1.0,0.0,0.0]}]"],
            "[[force]]",
        ),
        (
            &["effects.surface_tension={coefficient=0.07}"],
            "effects.surface_tension",
        ),
        (&["effects.drag={drop_radius=0.001}"], "effects.drag"),
    ];
    for (keys, says) in cases {
        let error = scene(keys).expect_err("it is refused").to_string();
        let is_told = error.contains("solver.flip.band") && error.contains(says);
        assert!(is_told, "{keys:?}: {error}");
        // Without a band it is a scene.
        parsed(TANK, keys).expect("it is allowed");
    }
    let range = scene(&["solver.flip.band=7"]).expect_err("too thick");
    assert!(range.to_string().contains("3 to 6"), "{range}");
}
