//! A scene that is edited between a bake and its resume: the refusal names every key that changes
//! the physics, and every other edit is allowed. The keys are those of the cache's own scene, which
//! writes out every default; a unit test of `scene` asserts that it writes each possible key.

use std::{collections::BTreeSet, fs, path::Path, sync::atomic::AtomicBool};

use crate::support::job::Job;
use swell::{
    domain::frame_range::FrameRange,
    files::{load_scene, parse_scene},
    scene::Scene,
    stage::{
        Blame,
        bake::{BakeError, BakeRequest, bake},
        device::Device,
    },
};
use toml::Value;

/// Part of both scenes, so that their caches have every key: all kinds of motion and probes.
const MORE: &str = r#"
[[water.mesh]]
file = "box.obj"
translate = [-1.2, 0.9, 0.0]
scale = 0.8

[[wave_maker]]
wall = "+x"
motion = { kind = "constant_velocity", velocity = 0.5, until = 0.1 }

[[wave_maker]]
wall = "+z"
motion = { kind = "solitary", height = 0.1, depth = 1.0 }

[[wave_maker]]
wall = "-z"
motion = { kind = "table", points = [[0.0, 0.0], [1.0, 0.1]] }

[grids]
surface = true
velocity = true
voxel_size = 0.3

[keep]
particles = "every 2"

[[probe]]
kind = "elevation"
at = [-0.5, 0.75]

[[probe]]
kind = "pressure"
at = [-0.6, 0.7, 0.75]

[[probe]]
kind = "energy"

[[probe]]
kind = "volume"

[[probe]]
kind = "front"
axis = "+x"
quantile = 0.9

[[probe]]
kind = "run_up"

[[probe]]
kind = "flux"
axis = "-x"
at = [-0.3]
"#;

const MOVING: &str = r#"
[[solid]]
mesh = "box.obj"
translate = [0.3, 0.6, 0.0]
scale = 0.5
direction = [1.0, 0.0, 0.0]
motion = { kind = "sine", stroke = 0.05, period = 4.0, ramp = 1.0 }
pivot = [0.5, 0.8, 0.3]
axis = [0.0, 0.0, 1.0]
turn = { kind = "sine", swing_degrees = 5.0, period = 4.0, ramp = 1.0 }
"#;

/// Strings that some key accepts.
const WORDS: [&str; 26] = [
    "f32",
    "f64",
    "pbf",
    "flip",
    "apic",
    "jacobi",
    "red_black",
    "chebyshev",
    "none",
    "ipp",
    "multigrid",
    "voxel",
    "ghost_fluid",
    "half",
    "float",
    "-x",
    "+x",
    "-y",
    "+y",
    "-z",
    "+z",
    "other",
    "copy.obj",
    "elevation",
    "energy",
    "volume",
];

type Step = Result<String, usize>;

/// Collects the paths to all values that are neither tables nor arrays.
fn leaves(value: &Value, path: &mut Vec<Step>, found: &mut Vec<Vec<Step>>) {
    let mut below = |step: Step, value: &Value| {
        path.push(step);
        leaves(value, path, found);
        path.pop();
    };
    match value {
        Value::Table(table) => table.iter().for_each(|(k, v)| below(Ok(k.clone()), v)),
        Value::Array(array) => array.iter().enumerate().for_each(|(k, v)| below(Err(k), v)),
        _ => found.push(path.clone()),
    }
}

fn name(path: &[Step]) -> String {
    let step = |step: &Step| match step {
        Ok(key) => format!(".{key}"),
        Err(index) => format!("[{index}]"),
    };
    path.iter().map(step).collect::<String>()[1..].to_owned()
}

fn at<'a>(root: &'a mut Value, path: &[Step]) -> &'a mut Value {
    path.iter().fold(root, |value, step| match step {
        Ok(key) => value.get_mut(key.as_str()).unwrap(),
        Err(index) => value.get_mut(*index).unwrap(),
    })
}

/// Other values that a key might accept.
fn others(value: &Value) -> Vec<Value> {
    match value {
        // Some limits are `false` or a number, some of them a number of particles.
        Value::Boolean(is) => vec![Value::Boolean(!is), Value::Float(0.5), Value::Float(1e6)],
        Value::Integer(n) => [n + 1, n - 1, 2 * n].map(Value::Integer).into(),
        Value::Float(x) => [
            x * 1.03125,
            x * 0.96875,
            x + 0.03125,
            x - 0.03125,
            x * 2.0,
            x * 0.5,
        ]
        .map(Value::Float)
        .into(),
        Value::String(text) => {
            let words = WORDS.iter().filter(|word| *word != text);
            words
                .map(|word| Value::String((*word).to_owned()))
                .collect()
        }
        other => panic!("{other}"),
    }
}

fn request(scene: Scene, cache: &Path) -> BakeRequest {
    BakeRequest {
        scene,
        directory: cache.to_owned(),
        frames: FrameRange::inclusive(1, 1),
        resume: true,
        from: None,
        device: Device::Cpu,
        time_passes: false,
    }
}

fn run(scene: Scene, cache: &Path) -> Result<(), BakeError> {
    bake(&request(scene, cache), &AtomicBool::new(false), &mut |_| {}).map(|_| ())
}

/// What the refusal of an edited key must say, or `None` where the edit is allowed. Every key that
/// is not listed here is physics, and the refusal names it in full.
fn expected(key: &str, solver: &str) -> Option<String> {
    let is_idle = ["pbf", "flip"]
        .iter()
        .any(|other| *other != solver && key.starts_with(&format!("solver.{other}.")));
    let is_free = [
        "shot.frames",
        "solver.pbf.max_substeps",
        "solver.flip.max_substeps",
    ];
    // The hash beside a file's path is physics, the path is not.
    let is_budget = key.starts_with("budget.");
    if is_idle
        || is_budget
        || is_free.contains(&key)
        || key.ends_with("].mesh")
        || key.ends_with("].file")
    {
        return None;
    }
    Some(if key == "shot.name" {
        "shot = \"small\", and this run has".to_owned()
    } else if key.starts_with("grids.") {
        "baked with grids = ".to_owned()
    } else if key.starts_with("keep.") {
        "baked with keep = ".to_owned()
    } else if key.starts_with("probe[") {
        "continue with the same probes".to_owned()
    } else {
        format!("another scene: {key} was ")
    })
}

/// Keys that cannot be edited without others: a hash belongs to its file, each kind of motion or
/// probe has its own keys, a table of displacements begins at 0, and all frames of a cache have the
/// same compression, whose change is refused with a message of its own.
fn is_bound(key: &str) -> bool {
    let is_own = |end: &&str| key.ends_with(end);
    [".blake3", ".kind", ".points[0][1]", "keep.compression"]
        .iter()
        .any(is_own)
}

/// Keys whose edit was refused, keys whose edit was allowed, and keys without another valid value.
type Found = (BTreeSet<String>, BTreeSet<String>, BTreeSet<String>);

fn edits(solver: &str, settings: &[&str], more: &str) -> Found {
    let job = Job::new();
    job.edit("small.toml", "[solver]\n", &format!("{more}\n[solver]\n"));
    job.edit(
        "small.toml",
        "[effects]",
        "[effects]\nvorticity_confinement = { strength = 0.1 }",
    );
    let method = format!("solver.method={solver}");
    let set: Vec<String> = settings
        .iter()
        .copied()
        .chain([method.as_str()])
        .map(str::to_owned)
        .collect();
    let cache = job.path("cache");
    run(load_scene(&job.path("small.toml"), &set).unwrap(), &cache).unwrap();
    let hash = job.hash("cache");
    // The scene as the cache has it, beside copies of its files.
    fs::create_dir(job.path("assets")).unwrap();
    for file in fs::read_dir(cache.join("assets")).unwrap() {
        let file = file.unwrap();
        fs::copy(file.path(), job.path("assets").join(file.file_name())).unwrap();
        fs::copy(file.path(), job.path("copy.obj")).unwrap();
    }
    let text = fs::read_to_string(cache.join("scene.toml")).unwrap();
    let load = |text: &str| parse_scene(text, Path::new("edited.toml"), job.folder.path(), &[]);
    run(load(&text).unwrap(), &cache).expect("control: the scene as it was");
    let base: Value = toml::from_str(&text).unwrap();
    let mut paths = Vec::new();
    leaves(&base, &mut Vec::new(), &mut paths);
    let (mut refused, mut allowed, mut bound) = Found::default();
    for path in paths {
        let key = name(&path);
        let old = at(&mut base.clone(), &path).clone();
        let edited = others(&old).into_iter().find_map(|value| {
            // Zero stays zero when it is scaled.
            if value == old {
                return None;
            }
            let mut edited = base.clone();
            *at(&mut edited, &path) = value;
            load(&toml::to_string(&edited).unwrap()).ok()
        });
        let Some(scene) = edited else {
            bound.insert(key);
            continue;
        };
        match (run(scene, &cache), expected(&key, solver)) {
            (Ok(()), None) => _ = allowed.insert(key.clone()),
            (Err(error), Some(words)) => {
                let said = error.to_string();
                assert!(said.contains(&words), "{key}: {said}");
                assert_eq!(Blame::from(&error), Blame::Files, "exit code 4: {said}");
                refused.insert(key.clone());
            }
            (Ok(()), Some(words)) => panic!("{key}: gone on with; expected `{words}`"),
            (Err(error), None) => panic!("{key}: {error}"),
        }
        assert_eq!(job.hash("cache"), hash, "{key}");
    }
    (refused, allowed, bound)
}

/// `held` is a key that another setting of this scene fixes; a test with another scene edits it.
fn check(solver: &str, settings: &[&str], more: &str, named: &[&str], held: &str) {
    let (refused, allowed, bound) = edits(solver, settings, more);
    println!(
        "{solver} {settings:?}: {} keys refused, allowed {allowed:?}, not edited {bound:?}",
        refused.len()
    );
    let loose: Vec<_> = bound
        .iter()
        .filter(|key| !is_bound(key) && *key != held)
        .collect();
    assert!(loose.is_empty(), "no other value was found for {loose:?}");
    for key in named {
        assert!(refused.contains(*key), "{key}: {refused:?}");
    }
    assert!(allowed.contains("shot.frames") && allowed.contains("solid[0].mesh"));
}

#[test]
fn each_edited_key_of_a_pbf_bake_is_named_or_allowed() {
    let named = [
        "solver.method",
        "solver.pbf.iteration",
        "solver.pbf.iterations",
        "water.gravity[1]",
        "wave_maker[0].motion.stroke",
        "effects.viscosity.xsph",
    ];
    // With a pressure probe, artificial pressure is not allowed.
    check("pbf", &[], MORE, &named, "solver.pbf.artificial_pressure");
}

#[test]
fn each_edited_key_of_a_chebyshev_bake_is_named_or_allowed() {
    let settings = [
        "solver.pbf.iteration=chebyshev",
        "solver.pbf.relaxation=0.7",
        "solver.pbf.spectral_radius=0.9",
    ];
    // The Chebyshev iteration has no pressure to probe.
    let more = MORE.replace(
        "kind = \"pressure\"
at = [-0.6, 0.7, 0.75]",
        "kind = \"volume\"
name = \"other\"",
    );
    check(
        "pbf",
        &settings,
        &more,
        &[
            "solver.pbf.spectral_radius",
            "solver.pbf.artificial_pressure",
        ],
        "solver.pbf.iteration",
    );
}

#[test]
fn each_edited_key_of_a_flip_bake_is_named_or_allowed() {
    let named = [
        "solver.flip.pic_blend",
        "solver.flip.pressure.tolerance",
        "solid[1].motion.stroke",
        "solid[1].direction[0]",
        "solid[1].pivot[0]",
        "solid[1].turn.swing_degrees",
    ];
    check(
        "flip",
        &[],
        &format!("{MORE}{MOVING}"),
        &named,
        "solver.method",
    );
}
