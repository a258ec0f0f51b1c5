use std::path::Path;

use swell_scene::Scene;

use crate::parse_scene;

const SCENE: &str = r#"
[shot]
name = "a"
frames = 10
frames_per_second = 20
[domain]
min = [0, 0, 0]
max = [1, 1, 1]
[[water.block]]
min = [0, 0, 0]
max = [1, 0.074, 1]
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.05
"#;

fn scene(set: &[&str]) -> Scene {
    let set: Vec<String> = set.iter().map(|&text| text.to_owned()).collect();
    parse_scene(SCENE, Path::new("s.toml"), Path::new(""), &set).expect("valid")
}

#[test]
fn a_block_of_half_layers_is_told_of_with_its_volumes() {
    assert_eq!(
        scene(&[]).lints(),
        [
            "water.block[0]: 0.07400 m³ are requested and 0.05000 m³ are made, 32.4 % less: it \
             is filled with whole layers, 20 × 1 × 20 particles"
        ]
    );
    let more = scene(&["solver.pbf.particle_spacing=0.1"]).lints();
    assert!(
        more.len() == 1 && more[0].contains("35.1 % more"),
        "{more:?}"
    );
    // Two per cent are tolerated, a little more is not.
    let of = |top: f64| scene(&[&format!("water.block=[{{min=[0,0,0],max=[1,{top},1]}}]")]).lints();
    assert_eq!(of(0.5101), [] as [&str; 0]);
    assert_eq!(of(0.5103).len(), 1);
    assert_eq!(of(0.1), [] as [&str; 0]);
}

#[test]
fn the_volume_asked_for_is_of_all_water() {
    let all = scene(&[
        "water.block=[{min=[0,0,0],max=[1,0.5,1]},{min=[0,0.6,0],max=[0.5,0.8,1]}]",
        "water.particles=[{at=[[0.5,0.9,0.5],[0.6,0.9,0.5]]}]",
    ]);
    assert!((all.asked_volume() - (0.5 + 0.1 + 2.0 * 0.05_f64.powi(3))).abs() < 1e-12);
}

#[test]
fn a_scene_without_water_is_told_of() {
    let dry = "water.block=[]";
    let [lint] = &scene(&[dry]).lints()[..] else {
        panic!("one lint");
    };
    assert!(lint.contains("holds no water"), "{lint}");
    let emitter = "emitter=[{min=[0,0,0],max=[0.5,0.5,0.5],velocity=[1,0,0]}]";
    assert_eq!(scene(&[dry, emitter]).lints(), [] as [&str; 0]);
    assert_eq!(
        scene(&[dry, "water.particles=[{at=[[0.5,0.5,0.5]]}]"]).lints(),
        [] as [&str; 0]
    );
}

#[test]
fn a_force_without_strength_is_told_of() {
    let of = |strength: f64| {
        let force = format!("force=[{{kind=\"attract\",at=[0,0,0],core=0.1,strength={strength}}}]");
        scene(&["water.block=[{min=[0,0,0],max=[1,0.1,1]}]", &force]).lints()
    };
    assert_eq!(of(-1.0), [] as [&str; 0]);
    assert_eq!(of(0.0), ["force[0]: it is 0 m/s², which moves nothing"]);
}
