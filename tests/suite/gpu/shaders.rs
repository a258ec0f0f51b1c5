//! Checks of shaders and modules that need no GPU.
use std::{fs, path::Path};

use swell::{
    gpu::{
        reflect::{Access, Layout, Stage, reflect},
        shader,
        variants::forms,
    },
    render,
    solve::{
        self,
        pressure::{DONE, ITERATING, ReduceStep, VERIFYING, WANTS_POCKETS},
    },
};

#[test]
fn reflection_refuses_what_no_pass_binds() {
    let kinds = "@group(0) @binding(0) var<uniform> u: vec4f;
        @group(0) @binding(1) var<storage, read> r: array<f32>;
        @group(0) @binding(2) var t: texture_2d<f32>;
        @group(0) @binding(3) var d: texture_depth_2d;
        @group(0) @binding(4) var s: sampler;
        @group(0) @binding(5) var c: sampler_comparison;
        @vertex fn v() -> @builtin(position) vec4f { return u + r[0]; }";
    let found = reflect("test", kinds).unwrap();
    let raster = |has_fragment| Stage::Raster { has_fragment };
    assert_eq!(found.stage, raster(false));
    let accesses: Vec<Access> = found
        .bindings
        .iter()
        .map(|binding| binding.access)
        .collect();
    let expected = [
        Access::Uniform,
        Access::Read,
        Access::Texture,
        Access::DepthTexture,
        Access::Sampler,
        Access::CompareSampler,
    ];
    assert_eq!(accesses, expected);
    let fragment = "@fragment fn f() -> @location(0) vec4f { return vec4f(0.0); }";
    let both = reflect("test", &format!("{kinds}\n{fragment}")).unwrap();
    assert_eq!(both.stage, raster(true));
    // Negative controls: a cube texture, a second group, a fragment shader by
    // itself, no entry point.
    let cube = kinds.replace("texture_2d<f32>", "texture_cube<f32>");
    let group = kinds.replace("@group(0) @binding(5)", "@group(1) @binding(5)");
    for refused in [cube.as_str(), group.as_str(), fragment, "fn f() {}"] {
        assert!(reflect("test", refused).is_err(), "{refused}");
    }
}

/// Returns an error if a shader's struct differs from all mirrors of its name.
fn check(found: &Layout, mirrors: &[Layout]) -> Result<(), String> {
    let mut named = mirrors.iter().filter(|mirror| mirror.name == found.name);
    if named.clone().next().is_none() || named.any(|mirror| mirror == found) {
        return Ok(());
    }
    let named: Vec<_> = mirrors.iter().filter(|m| m.name == found.name).collect();
    Err(format!("{found:?} in WGSL, {named:?} in Rust"))
}

/// Every bound struct has a mirror, and every mirror equals its struct in size, names and offsets.
#[test]
fn mirrors_match_naga() {
    let mirrors = [solve::mirrors(), render::mirrors()].concat();
    let mut seen = vec![false; mirrors.len()];
    for form in forms().unwrap() {
        let pass = &form.pass;
        let reflection = reflect(pass, &form.text).unwrap();
        for found in &reflection.layouts {
            check(found, &mirrors).unwrap_or_else(|message| panic!("{pass}: {message}"));
            for (seen, mirror) in seen.iter_mut().zip(&mirrors) {
                *seen |= mirror == found;
            }
        }
        for binding in reflection.bindings {
            let name = binding.element.name;
            let is_mirrored = |name: &String| mirrors.iter().any(|m| m.name == *name);
            assert!(
                name.iter().all(is_mirrored),
                "{pass}: {name:?} has no mirror"
            );
        }
    }
    let unseen = mirrors.iter().zip(&seen).filter(|(_, seen)| !**seen);
    assert_eq!(unseen.count(), 0, "a mirror without its struct: {seen:?}");

    // Negative controls: a misplaced member and a wrong size are detected.
    let text = shader::compose("pbf/predict", &[]).unwrap();
    let layouts = reflect("pbf/predict", &text).unwrap().layouts;
    let params = layouts.iter().find(|layout| layout.name == "Params");
    let params = params.unwrap();
    check(params, &mirrors).unwrap();
    let mut spoiled = params.clone();
    spoiled.members.swap(1, 2);
    check(&spoiled, &mirrors).unwrap_err();
    spoiled = params.clone();
    spoiled.size += 4;
    check(&spoiled, &mirrors).unwrap_err();
}

/// Constants that the host and the shaders share.
#[test]
fn numbers_match_naga() {
    let reduce = reflect(
        "pressure/reduce",
        &shader::compose("pressure/reduce", &[]).unwrap(),
    );
    let constants = reduce.unwrap().constants;
    let value = |name: &str| constants.iter().find(|(of, _)| of == name).unwrap().1;
    for (name, state) in [
        ("ITERATING", ITERATING),
        ("VERIFYING", VERIFYING),
        ("DONE", DONE),
        ("WANTS_POCKETS", WANTS_POCKETS),
    ] {
        assert_eq!(value(name), state, "{name}");
    }
    for (name, step) in [
        ("BEGIN", ReduceStep::Begin),
        ("DIRECTION", ReduceStep::Direction),
        ("LENGTH", ReduceStep::Length),
        ("VERIFIED", ReduceStep::Verified),
    ] {
        assert_eq!(value(name), step as u32, "{name}");
    }
    // Negative control.
    assert_ne!(value("VERIFIED"), ReduceStep::Length as u32);
}

#[test]
fn composition_faults_name_their_place() {
    let fault = shader::compose("pbf/no_such_pass", &[])
        .unwrap_err()
        .to_string();
    assert!(fault.contains("pbf/no_such_pass.wgsl"), "{fault}");
    let fault = reflect(
        "test",
        "@compute @workgroup_size(1) fn main() { let x: u32 = 1.5; }",
    )
    .unwrap_err()
    .to_string();
    assert!(fault.contains("test"), "{fault}");
}

fn sources(dir: &Path, out: &mut Vec<std::path::PathBuf>) {
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            out.push(path);
        }
    }
}

/// Files of each effect: its settings, its passes, its check, and its f64 reference passes.
const EFFECT_FILES: [&str; 6] = [
    "scene/effects",
    "files/effects",
    "solve/effects",
    "check/effects",
    "reference/pbf/effects",
    "reference/flip/effects",
];

/// Lines that name an effect outside its own files, without comments, tests and
/// descriptions of keys.
fn mentions(files: &[(String, String)], effect: &str) -> Vec<String> {
    let own = EFFECT_FILES.map(|folder| format!("{folder}/{effect}.rs"));
    files
        .iter()
        .filter(|(file, _)| {
            !own.contains(file) && !file.ends_with("/tests.rs") && !file.contains("/tests/")
        })
        .flat_map(|(file, text)| {
            let code = text.split("#[cfg(test)]").next().unwrap_or("");
            code.lines()
                .map(str::trim_start)
                .filter(|line| !line.starts_with("//") && !line.contains(".about("))
                .filter(|line| !line.starts_with('"'))
                .filter(|line| line.contains(effect))
                .map(move |line| format!("{file}: {line}"))
        })
        .collect()
}

#[test]
fn an_effect_is_its_files_and_one_line() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    sources(&root, &mut paths);
    let mut files: Vec<(String, String)> = paths
        .iter()
        .map(|path| {
            let name = path
                .strip_prefix(&root)
                .unwrap()
                .to_string_lossy()
                .replace('\\', "/");
            (name, fs::read_to_string(path).unwrap())
        })
        .collect();
    assert!(swell::scene::Effects::NAMES.len() >= 2);
    for effect in swell::scene::Effects::NAMES {
        let found = mentions(&files, effect);
        assert_eq!(found.len(), 1, "{effect}: {found:#?}");
        assert!(found[0].starts_with("scene/effects/mod.rs: "), "{found:?}");
        for folder in EFFECT_FILES {
            assert!(root.join(format!("{folder}/{effect}.rs")).exists());
        }
    }
    // Negative control: a solver that names an effect is detected.
    files.push((
        "solve/special.rs".into(),
        "if scene.effects.viscosity.is_some() {}".into(),
    ));
    assert_eq!(mentions(&files, "viscosity").len(), 2);
}
