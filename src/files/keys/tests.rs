//! Compares the tables with what is read and written, and the page with the tables.

use std::{collections::BTreeSet, path::Path};

use swell_scene::{Scene, look::ViewSpec};
use toml::{Table, Value};

use super::{super::key::*, super::*, *};
use crate::{load_scene, parse_scene, write::written};

/// A scene with every table, each as small as possible.
const LEAST: &str = r#"
[shot]
name = "least"
frames = 10
frames_per_second = 50
[domain]
min = [0, 0, 0]
max = [4, 3, 12]
[[water.mesh]]
file = "cube.obj"
[[water.particles]]
at = [[2, 1, 1]]
[[solid]]
mesh = "cube.obj"
[[body]]
mesh = "room.obj"
density = 500.0
mooring = [{ anchor = [2.5, 0, 0.5], at = [2.5, 0, 0.5], length = 1.0, stiffness = 1e3 }]
[[wave_maker]]
wall = "-x"
motion = { kind = "sine", stroke = 0.5, period = 2.0 }
[[emitter]]
mesh = { file = "room.obj" }
level = 0.5
[[drain]]
mesh = { file = "room.obj" }
[[force]]
kind = "acceleration"
acceleration = [1.0, 0.0, 0.0]
mesh = { file = "room.obj" }
[solver]
method = "pbf"
[solver.pbf]
particle_spacing = 0.1
[solver.flip]
cell_size = 0.2
[grids]
surface = true
"#;

const SEA: &str = "wave_maker.0.motion={ kind = \"sea\", significant_height = 0.1, peak_period = \
                   3.0, shortest_period = 2.0, depth = 1.0 }";

const CUBE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\nv 0 0 1\nv 1 0 1\nv 0 1 1\nv 1 1 1\n\
    f 1 5 7 3\nf 2 4 8 6\nf 1 2 6 5\nf 3 7 8 4\nf 1 3 4 2\nf 5 6 8 7\n";

fn load(set: &[&str]) -> Scene {
    let folder = tempfile::tempdir().expect("a folder");
    let room = CUBE.replace("v 0", "v 2").replace("v 1", "v 3");
    for (file, text) in [("cube.obj", CUBE), ("room.obj", &room)] {
        std::fs::write(folder.path().join(file), text).expect("written");
    }
    let set: Vec<_> = set.iter().map(|&s| s.to_owned()).collect();
    parse_scene(LEAST, Path::new("least.toml"), folder.path(), &set).expect("the least is enough")
}

/// Returns the first value at a dotted path, taking the first table of each array.
fn value_at<'v>(table: &'v Table, path: &str) -> Option<&'v Value> {
    let first = |value: &'v Value| match value {
        Value::Array(items) if items.first().is_some_and(Value::is_table) => items.first(),
        other => Some(other),
    };
    match path.split_once('.') {
        None => table.get(path),
        Some((name, rest)) => value_at(first(table.get(name)?)?.as_table()?, rest),
    }
}

/// Normalizes a value: integers become floats, and a uniform scale becomes one per axis.
fn plain(path: &str, value: &Value) -> Value {
    match value {
        Value::Integer(whole) => Value::Float(*whole as f64),
        Value::Float(scale) if path.ends_with(".scale") => {
            Value::Array(vec![Value::Float(*scale); 3])
        }
        other => other.clone(),
    }
}

#[test]
fn what_is_left_out_is_the_default_of_the_table() {
    let chebyshev = written(&load(&["solver.pbf.iteration=chebyshev"]), &|_, _| {
        "a.obj".to_owned()
    });
    let kept = written(&load(&["keep={}"]), &|_, _| "a.obj".to_owned());
    let zone = "effects.generation_zone={walls=[\"-x\"],length=1.0,waves={kind=\"sea\",\
                significant_height=0.1,peak_period=3.0,depth=1.0}}";
    let drag = "effects.drag={drop_radius=0.001}";
    let vortex = "force=[{kind=\"vortex\",at=[0,0,0],strength=1.0,core=1.0}]";
    let start = "water={wave=[{kind=\"sea\",significant_height=0.1,peak_period=3.0,depth=1.0}]}";
    let sea = written(
        &load(&[SEA, "wave_maker.0.wall=+x", zone, drag, start, vortex]),
        &|_, _| "a.obj".to_owned(),
    );
    let mut compared = BTreeSet::new();
    for path in paths(SCENE) {
        let key = find(SCENE, &path).expect("a key");
        let LeftOut::Value(toml) = key.default else {
            continue;
        };
        let table: Table = toml::from_str(&format!("v = {toml}")).expect(toml);
        // Tables, and the key that the least scene sets.
        if path == "grids.surface" || table["v"].is_table() {
            continue;
        }
        let scene = match key.only {
            Some(("kind", _)) => &sea,
            Some(_) => &chebyshev,
            None if path.starts_with("effects.") || path.starts_with("water.wave") => &sea,
            None => &kept,
        };
        let found = value_at(scene, &path).unwrap_or_else(|| panic!("{path} is not written"));
        assert_eq!(plain(&path, found), plain(&path, &table["v"]), "{path}");
        compared.insert(path);
    }
    assert!(
        compared.contains("solver.flip.pressure.tolerance") && compared.len() > 25,
        "{compared:?}"
    );
}

/// Defaults that depend on other keys are described in words, with the numbers that apply.
#[test]
fn defaults_that_are_computed_are_what_their_words_say() {
    let says = |path: &str, number: &str| {
        let LeftOut::Computed(words) = find(SCENE, path).expect("a key").default else {
            panic!("{path}");
        };
        assert!(words().contains(number), "{path}: {} for {number}", words());
    };
    for (set, path) in [
        ("solver.pbf.iteration=red_black", "solver.pbf.relaxation"),
        ("solver.pbf.iteration=chebyshev", "solver.pbf.relaxation"),
        (SEA, "wave_maker.motion.peak_enhancement"),
        ("solver.method=pbf", "budget.energy"),
        ("solver.method=flip", "budget.energy"),
        ("solver.method=flip", "budget.speed_jump"),
        ("solver.method=flip", "budget.density_error_max"),
        ("solver.method=flip", "budget.residual"),
    ] {
        let written = written(&load(&[set]), &|_, _| "a.obj".to_owned());
        let value = value_at(&written, path).expect(path);
        says(path, &value.to_string());
    }
}

#[test]
fn what_is_no_physics_is_said_once() {
    let of = |physics: Physics| {
        let mut paths = paths(SCENE);
        paths.retain(|path| find(SCENE, path).expect("a key").physics == physics);
        paths
    };
    let free = [
        "shot.name",
        "shot.frames",
        "solver.pbf.max_substeps",
        "solver.flip.max_substeps",
        "grids",
        "keep",
        "probe",
        "budget",
    ];
    assert_eq!(of(Physics::No), free);
    assert_eq!(
        of(Physics::ByHash),
        [
            "water.mesh.file",
            "solid.mesh",
            "solid.sequence.files",
            "body.mesh",
            "emitter.mesh.file",
            "drain.mesh.file",
            "force.mesh.file"
        ]
    );
}

#[test]
fn allowed_words_follow_from_the_declaration() {
    for (path, words) in [
        ("solver.pbf.cfl", "a number from 1e-5 to 5"),
        ("shot.frames", "a whole number from 1 to 1000000"),
        ("domain", "a table with at least min and max"),
        ("solver.pbf", "a table with at least particle_spacing"),
        ("water.block[3]", "an array of tables [[block]]"),
        ("water.gravity", "three numbers from -10000 to 10000, m/s²"),
        (
            "solid[1].scale",
            "a number from 1e-6 to 1e6, or three of them; negative ones mirror",
        ),
        ("solver.flip.transfer", "\"flip\" or \"apic\""),
        (
            "wave_maker[0].motion.ramp",
            "0 or a number from 1e-4 to 1e6, seconds; one period of a sine, two (of the peak) of \
             other waves, if left out",
        ),
        (
            "budget.speed",
            "a number from 1e-12 to 1e12, m/s, or false; ",
        ),
        (
            "solver.pbf.iterations",
            "a whole number from 1 to 10000, not together with density_error or max_iterations",
        ),
    ] {
        let key = find(SCENE, path).unwrap_or_else(|| panic!("{path}"));
        assert!(
            key.allowed().starts_with(words),
            "{path}: {}",
            key.allowed()
        );
    }
    for path in ["solver.pbf.cfi", "solver.pbf.cfl.x", "cfl", ""] {
        assert!(find(SCENE, path).is_none(), "{path}");
    }
    assert!(find(File::Tolerance.keys(), "attributes.any.max").is_some());
}

/// Names within a table are unique, every key has a purpose, and `only` refers to a key that
/// is read earlier.
#[test]
fn the_tables_are_whole() {
    fn look(keys: &'static [Key], path: &str) {
        for (place, key) in keys.iter().enumerate() {
            let before = || keys[..place].iter();
            assert!(
                before().all(|other| other.name != key.name),
                "{path}.{}",
                key.name
            );
            assert!(!key.about.is_empty(), "{path}.{}", key.name);
            if let Some((by, among)) = key.only {
                let by = before()
                    .find(|other| other.name == by)
                    .expect("a key before it");
                let Kind::Choice(words) = by.kind else {
                    panic!("{path}.{}", by.name);
                };
                assert!(
                    among.iter().all(|word| words.contains(word)),
                    "{path}.{}",
                    key.name
                );
            }
            let beside = key.without.iter().chain(&key.with);
            for other in beside {
                assert!(
                    keys.iter().any(|key| key.name == *other),
                    "{path}.{}",
                    key.name
                );
            }
            look(key.below(), key.name);
        }
    }
    for (name, file) in File::NAMED {
        look(file.keys(), name);
    }
}

/// Caches and rendered pictures record these hashes of their scenes and looks.
#[test]
fn hashes_of_what_ships_are_those_of_the_caches_that_there_are() {
    let scenes = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes");
    for (name, method, hash) in SHIPPED {
        let set = [format!("solver.method={method}")];
        let scene = load_scene(&scenes.join(name).with_extension("toml"), &set).expect(name);
        assert_eq!(physics_hash(&scene), hash, "{name} {method}");
    }
    // The looks before their spray became denser and walls and houses got textures. Keys added
    // since then do not change the hash while they are left out.
    let bare = |text: &str| {
        let is_new = |line: &&str| {
            line.starts_with("texture = ") || line.starts_with("colour = [0.85, 0.83, 0.80]")
        };
        let kept: Vec<&str> = text.lines().filter(|line| !is_new(line)).collect();
        let white = "[solids]\ncolour = [1.0, 1.0, 1.0]";
        let text = kept.join("\n");
        assert!(text.contains(white));
        text.replace(white, "[solids]\ncolour = [0.62, 0.57, 0.50]")
    };
    for (name, density, hash) in [
        (
            "day",
            "24.0",
            "5902670e5453d87b94996af3d9c14cd1b1eadee27f2ddeb99b98433fc7c68f11",
        ),
        (
            "dusk",
            "14.0",
            "26f870b4d42f6f6544249c5cd187a47e98120197133b0bf183788d8c27e44b2a",
        ),
    ] {
        let file = scenes.join(format!("looks/{name}.toml"));
        let text = std::fs::read_to_string(&file).expect(name);
        let [from, to] = [density, "9.0"].map(|density| format!("density_per_metre = {density}"));
        assert!(text.contains(&from), "{name}");
        let hash_of = |text: &str| parse_look(text, &file).expect(name).hash();
        assert_eq!(hash_of(&bare(&text).replace(&from, &to)), hash, "{name}");
        assert_ne!(hash_of(&text), hash, "{name}, the control");
    }
}

const SHIPPED: [(&str, &str, &str); 8] = [
    (
        "quickstart",
        "pbf",
        "c5a3f9b0f4e1c31de5245b6be31e23d3ac99b201b2b87f713e26dd060af335ab",
    ),
    (
        "quickstart",
        "flip",
        "e349157df7fbebae0c2a33f0ddd8e7c1e56c95c022fa7aee33764bec109d115c",
    ),
    (
        "wave-city",
        "pbf",
        "248169e5402c5bb9998cba435f90943ee6ae71e13848c6487ed0e714a8f9f5a0",
    ),
    (
        "wave-city",
        "flip",
        "4f0fc88fb7d0ed51115399499105f6b74e763e27cbcadc726772014944816d88",
    ),
    (
        "dam-break",
        "pbf",
        "61cd2653ff85c0efef883fb5e93d267860f0820ed18fa2591760c6534b4dace9",
    ),
    (
        "dam-break",
        "flip",
        "ddd1c3ec08b60dc3a34f51adb580eb40eb34f66cdd22b315172365f58fcec592",
    ),
    (
        "wave-tank",
        "pbf",
        "0578104bd4b7d7385aa6a26ddc9175b021d0c5dfaf596bb36b63efc2e446b39d",
    ),
    (
        "wave-tank",
        "flip",
        "c98a10592a2688728a1767f5b69159b6a21b13c98256538c65b47e42d04cf6b9",
    ),
];

/// The page is the output of `target/release/swell keys > docs/keys.md`.
#[test]
fn the_page_of_keys_is_the_one_that_is_tracked() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/keys.md");
    let tracked = std::fs::read_to_string(file).expect("docs/keys.md");
    let now = page(&File::NAMED.map(|(_, file)| file));
    let differs = tracked
        .lines()
        .zip(now.lines())
        .find(|(old, new)| old != new);
    assert_eq!(differs, None, "swell keys > docs/keys.md");
    assert_eq!(tracked, now, "swell keys > docs/keys.md");
    // Control: another default would be printed here.
    assert!(now.contains(
        "| `tolerance` | a number from 1e-14 to 0.99, of the right-hand side's norm | `1e-5` |"
    ));
}

const LOOK: &str = "[camera]
focal_length_mm = 35.0
position = [0.0, 3.0, 0.0]
target = [10.0, 1.0, 0.0]
[image]
width = 64
height = 36
[sky]
model = \"hosek_wilkie\"
";

/// A program that has no look views pictures as a look does that says nothing of it.
#[test]
fn view_without_keys_is_the_default_view() {
    let view = |text: &str| {
        let look = parse_look(text, Path::new("a.toml")).expect("valid");
        format!("{:?}", look.spec().view)
    };
    let default = format!("{:?}", ViewSpec::default());
    assert_eq!(view(LOOK), default);
    assert_ne!(view(&format!("{LOOK}[view]\ncontrast = 1.1\n")), default);
}
