//! Scenes written out: all keys are present, and reading gives an equal scene.

use std::collections::BTreeSet;

use super::*;
use crate::scene_to_toml;

#[test]
fn what_is_written_loads_again_equal() {
    let dir = assets();
    let mut scene = parse(dir.path(), FULL, &[]).expect("valid");
    let text = scene_to_toml(&scene, &|file, _| {
        file.file_name()
            .map(|n| n.to_string_lossy().into_owned())
            .unwrap_or_default()
    });
    let again = parse(dir.path(), &text, &[]).expect("valid");
    assert_eq!(scene, again);
    assert!(text.contains("artificial_pressure = 0.0"), "{text}");
    assert_eq!(scene.mesh_files().len(), 1);

    // Control: a scene with one other number is not equal.
    if let Some(Solver::Flip(flip)) = &mut scene.unchosen {
        flip.cfl = 0.9;
    }
    assert_ne!(scene, again);
    // A mesh that differs from the baked one is rejected.
    fs::write(
        dir.path().join("cube.obj"),
        CUBE.replace("v 1 1 1", "v 1 1 2"),
    )
    .expect("written");
    let message = parse(dir.path(), &text, &[]).expect_err("another mesh");
    assert!(message.contains("water.mesh[0].blake3"), "{message}");
}

/// A key that is not written out is in no hash and no comparison: a bake would continue
/// with another scene.
#[test]
fn every_key_of_a_scene_is_written_out() {
    let dir = assets();
    let more = r#"
[[solid]]
mesh = "cube.obj"
translate = [6.0, 0.0, 2.0]
direction = [1.0, 0.0, 0.0]
motion = { kind = "KIND" }
pivot = [6.5, 0.5, 2.5]
axis = [0.0, 1.0, 0.0]
turn = { kind = "TURN" }
[[solid]]
mesh = "cube.obj"
translate = [8.0, 0.0, 2.0]
track = { poses = [[0, 8, 0, 2, 0, 0, 0, 1], [1, 8, 1, 2, 0, 1, 0, 0]] }
[[wave_maker]]
wall = "+x"
motion = { kind = "KIND" }
absorption = { depth = 1.0, period = 3.0, room = 0.1 }
[grids]
surface = true
velocity = true
[keep]
particles = "every 10"
[[probe]]
kind = "elevation"
at = [5.0, 2.0]
rate_hz = 60.0
window = 0.1
[[probe]]
kind = "front"
axis = "+x"
quantile = 0.99
[[probe]]
kind = "force"
solid = "-y"
about = [1.0, 0.0, 0.0]
"#;
    let of_solid = FULL.replace("[solver]\n", &format!("{more}[solver]\n"));
    let kinds = [
        "\"sine\", stroke = 0.1, period = 2.0, ramp = 1.0",
        "\"constant_velocity\", velocity = 0.1, until = 1.0",
        "\"table\", points = [[0, 0], [1, 0.1]]",
    ];
    let variants: [&[&str]; 3] = [
        &[],
        &["solver.pbf.iteration=red_black"],
        &[
            "solver.pbf={particle_spacing=0.1,iteration=\"chebyshev\",spectral_radius=0.9}",
            "solver.pbf.iterations=4",
        ],
    ];
    let turns = [
        "\"sine\", swing_degrees = 10.0, period = 2.0, ramp = 1.0",
        "\"constant_velocity\", degrees_per_second = 5.0, until = 1.0",
        "\"table\", points = [[0, 0], [1, -10]]",
    ];
    let mut written = BTreeSet::new();
    for ((kind, turn), overrides) in kinds.iter().zip(turns).zip(variants) {
        let text = of_solid.replace("\"KIND\"", kind).replace("\"TURN\"", turn);
        let flip = [
            "solver.method=flip",
            "effects.viscosity.xsph=0.02",
            "domain.no_slip=[\"-y\"]",
            "effects.generation_zone={walls=[\"-z\"],length=1.0,waves={kind=\"stokes\",height=0.1,\
             period=3.0,depth=1.0,direction_degrees=90.0}}",
        ];
        let all: Vec<&str> = flip.iter().chain(overrides).copied().collect();
        // One of the three has a Newtonian viscosity.
        let viscous = ["effects.viscosity={coefficient=2.0}"];
        let viscous = &viscous[..usize::from(overrides.is_empty())];
        let moves = [
            "domain.direction=[1,0,0]".to_owned(),
            format!("domain.motion={{kind={kind}}}"),
            "domain.pivot=[1,0,0]".to_owned(),
            "domain.axis=[0,0,1]".to_owned(),
            format!("domain.turn={{kind={turn}}}"),
        ];
        let moves: Vec<&str> = moves.iter().map(String::as_str).collect();
        let all: Vec<&str> = all.iter().chain(viscous).chain(&moves).copied().collect();
        let scene = parse(dir.path(), &text, &all).expect("valid");
        let toml = scene_to_toml(&scene, &|_, _| "a.obj".to_owned());
        let table: toml::Table = toml::from_str(&toml).expect("TOML");
        collect_keys("", &table, &mut written);
    }
    // The full scene has obstacles along all three axes.
    let slab = r#"
[shot]
name = "slab"
frames = 1
frames_per_second = 30
[domain]
min = [0, 0, 0]
max = [4, 4, 2]
periodic = ["z"]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.25
[[wave_maker]]
wall = "-x"
motion = { kind = "sea", significant_height = 0.1, peak_period = 3.0, shortest_period = 2.0, depth = 1.0, seed = 3, second_order = true }
[[wave_maker]]
wall = "-y"
motion = { kind = "focused", height = 0.1, at = 1.0, time = 9.0, spectrum = "tma", peak_period = 3.0, shortest_period = 2.0, depth = 1.0 }
[[water.wave]]
kind = "solitary"
height = 0.2
depth = 1.0
at = 1.0
[[water.wave]]
kind = "stokes"
height = 0.1
period = 2.0
depth = 1.0
[[water.wave]]
kind = "sea"
significant_height = 0.1
peak_period = 3.0
peak_enhancement = 2.0
shortest_period = 2.0
depth = 1.0
seed = 5
[[emitter]]
min = [1.0, 1.0, 0.5]
max = [1.5, 1.5, 1.5]
velocity = [1.0, 0.0, 0.0]
from = 1.0
until = 2.0
[[emitter]]
mesh = { file = "cube.obj", translate = [2.0, 2.0, 0.5], scale = 0.5, rotate_degrees = [0, 90, 0] }
level = 2.2
[[drain]]
min = [1.0, 0.0, 0.5]
max = [1.5, 0.5, 1.5]
level = 0.2
from = 1.0
until = 2.0
[[drain]]
mesh = { file = "cube.obj", translate = [2.0, 1.0, 0.5], scale = 0.5, rotate_degrees = [0, 90, 0] }
rate = 0.01
[[force]]
kind = "acceleration"
acceleration = [1.0, 0.0, 0.0]
min = [1.0, 0.0, 0.5]
max = [1.5, 0.5, 1.5]
fade = 0.1
on = ["water"]
from = 1.0
until = 2.0
[[force]]
kind = "vortex"
at = [2.0, 0.0, 1.0]
axis = [0.0, 2.0, 0.0]
strength = 3.0
core = 0.5
falloff = 1
mesh = { file = "cube.obj", translate = [2.0, 1.0, 0.5], scale = 0.5, rotate_degrees = [0, 90, 0] }
[effects]
drag = { drop_radius = 0.002, wind = [1.0, 0.0, 0.0] }
surface_tension = { coefficient = 0.0728 }
absorbing_zone = { walls = ["+x"], length = 1.0, period = 2.0 }
generation_zone = { walls = ["+x"], length = 1.0, waves = { kind = "sea", significant_height = 0.1, peak_period = 3.0, depth = 1.0, peak_enhancement = 2.0, shortest_period = 2.0, ramp = 3.0, direction_degrees = 180.0 } }
"#;
    let scene = parse(dir.path(), slab, &[]).expect("valid");
    let toml = scene_to_toml(&scene, &|_, _| "a.obj".to_owned());
    collect_keys("", &toml::from_str(&toml).expect("TOML"), &mut written);
    let packet = "effects.generation_zone={walls=[\"+x\"],length=1.0,waves={kind=\"focused\",\
                  height=0.1,at=[1.0,1.0],time=40.0,peak_period=3.0,depth=1.0,spreading=4.0,\
                  direction_degrees=180.0}}";
    let open = ["domain.periodic=[]", packet, "water.wave.2.spreading=4.0"];
    let scene = parse(dir.path(), slab, &open).expect("valid");
    let toml = scene_to_toml(&scene, &|_, _| "a.obj".to_owned());
    collect_keys("", &toml::from_str(&toml).expect("TOML"), &mut written);
    let floats = r#"
[shot]
name = "floats"
frames = 1
frames_per_second = 30
[domain]
min = [0, 0, 0]
max = [4, 4, 4]
[[solid]]
sequence = { files = ["cube.obj", "cube.obj"], start = 1 }
scale = 0.5
[[body]]
mesh = "cube.obj"
translate = [2.5, 1.0, 1.0]
scale = 0.5
density = 300.0
centre = [2.5, 1.1, 1.0]
inertia = [1.0, 1.0, 1.0]
free = ["y", "turn_z"]
mooring = [{ anchor = [2, 0, 1], at = [2, 1, 1], length = 1.0, stiffness = 1e3, damping = 1.0 }]
[[body]]
mesh = "cube.obj"
translate = [1.0, 1.0, 1.0]
scale = 0.5
mass = 30.0
hinge = { at = [1, 0, 1], axis = [1, 0, 0] }
[solver]
method = "flip"
[solver.flip]
cell_size = 0.25
"#;
    let scene = parse(dir.path(), floats, &[]).expect("valid");
    let toml = scene_to_toml(&scene, &|_, _| "a.obj".to_owned());
    collect_keys("", &toml::from_str(&toml).expect("TOML"), &mut written);
    let pool = r#"
[shot]
name = "pool"
frames = 1
frames_per_second = 30
[domain]
min = [0, 0, 0]
max = [4, 4, 4]
periodic = ["x"]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.25
band = 5
[water]
current = [1.0, 0.0, 0.0]
"#;
    let scene = parse(dir.path(), pool, &[]).expect("valid");
    let toml = scene_to_toml(&scene, &|_, _| "a.obj".to_owned());
    collect_keys("", &toml::from_str(&toml).expect("TOML"), &mut written);
    let ocean = r#"
[shot]
name = "ocean"
frames = 1
frames_per_second = 30
[domain]
min = [0, 0, 0]
max = [8, 4, 4]
[[water.wave]]
kind = "stokes"
height = 0.3
period = 1.8
depth = 9.0
simulated_depth = 3.0
[solver]
method = "flip"
[solver.flip]
cell_size = 0.25
[effects]
generation_zone = { walls = ["-x"], length = 4.0, waves = { kind = "stokes", height = 0.3, period = 1.8, depth = 9.0, simulated_depth = 3.0, ramp = 0.0 } }
"#;
    let scene = parse(dir.path(), ocean, &[]).expect("valid");
    let toml = scene_to_toml(&scene, &|_, _| "a.obj".to_owned());
    collect_keys("", &toml::from_str(&toml).expect("TOML"), &mut written);
    // A motion's file is written as the points read from it; `walls` is written as the list
    // of no-slip walls.
    let read = [
        "motion.file",
        "turn.file",
        "track.file",
        "track.node",
        "track.start",
    ];
    let missing: Vec<_> = keys::paths(keys::SCENE)
        .into_iter()
        .filter(|key| !read.iter().any(|file| key.ends_with(file)) && key != "domain.walls")
        .filter(|key| !written.contains(key))
        .collect();
    assert_eq!(missing, [] as [&str; 0]);
}

/// Both with the default ramp and from the written scene.
#[test]
fn regular_waves_are_written_with_their_ramp() {
    let flume = r#"
[shot]
name = "flume"
frames = 1
frames_per_second = 30
[domain]
min = [0, 0, 0]
max = [8, 2, 1]
[solver]
method = "flip"
[solver.flip]
cell_size = 0.25
[[wave_maker]]
wall = "-x"
motion = { kind = "KIND", height = 0.1, period = 4.0, depth = 1.0 }
"#;
    let dir = assets();
    for kind in ["stokes", "cnoidal"] {
        let scene = parse(dir.path(), &flume.replace("KIND", kind), &[]).expect("valid");
        let text = scene_to_toml(&scene, &|_, _| "a.obj".to_owned());
        assert!(text.contains(&format!("kind = \"{kind}\"")), "{text}");
        assert!(text.contains("ramp = 8.0"), "{text}");
        assert_eq!(scene, parse(dir.path(), &text, &[]).expect("valid"));
        // Control: another height is another scene.
        let higher = text.replace("height = 0.1", "height = 0.11");
        assert_ne!(scene, parse(dir.path(), &higher, &[]).expect("valid"));
    }
}

/// Collects the dotted keys of a table and of those below it, without indices.
fn collect_keys(path: &str, table: &toml::Table, keys: &mut BTreeSet<String>) {
    for (name, value) in table {
        let path = format!("{path}{name}");
        let array = value.as_array().into_iter().flatten();
        for below in array.chain([value]).filter_map(toml::Value::as_table) {
            collect_keys(&format!("{path}."), below, keys);
        }
        keys.insert(path);
    }
}
