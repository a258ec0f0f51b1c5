//! NaNs that one pass writes are caught within the frame, and the pass is named.

use std::{fs, path::Path};

use swell::{
    cache::{CacheReader, directory_hash, failed},
    domain::budget::Watched,
    gpu::adapter::{Context, InjectedFault},
    scene::Scene,
    stage::{
        device::needs,
        prepare::Start,
        replay::{Failure, replay},
    },
};
use tempfile::TempDir;

use super::{Baked, SOLVERS, bake, load, opened, spoil, spoiled};

/// A NaN in WGSL, computed from a variable because a constant NaN does not compile.
macro_rules! nan {
    ($seed:literal) => {
        concat!("bitcast<f32>(0x7fc00000u | min(", $seed, ", 1u))")
    };
}

/// Resumes a sound cache on a device with a fault in one pass.
pub(super) fn is_caught(context: &Context, scene: &Scene, sound: &Path, spoil: InjectedFault) {
    let opened = spoiled(context, spoil);
    let mut broken = bake_copy(sound);
    broken.go_on(&opened, scene, "1-4");
    let Failure { breach, place } = broken.failure();
    assert_eq!(
        (breach.watched, breach.frame),
        (Watched::NotFinite, 3),
        "{breach}"
    );
    assert_eq!(
        place.as_ref().map(|place| place.pass),
        Some(spoil.pass),
        "{breach}"
    );
    let said = broken.error.as_ref().unwrap().to_string();
    assert!(
        said.contains(&format!("first in {} of substep 1", spoil.pass)),
        "{said}"
    );
    // A replay gives the same message.
    let kept = failed::read(&broken.cache().join("failed")).unwrap();
    let start = Start::of(scene).unwrap();
    let again = replay(
        &opened.open(needs(scene)).unwrap(),
        scene,
        &start,
        kept.last_frame,
        &kept.start,
    )
    .unwrap();
    assert_eq!(again.as_ref(), Some(broken.failure()));
    assert!(said.starts_with(&again.unwrap().to_string()), "{said}");
    // The rest of the cache is unchanged.
    failed::remove(&broken.cache()).unwrap();
    assert_eq!(
        directory_hash(&broken.cache()).unwrap(),
        directory_hash(sound).unwrap()
    );
    assert_eq!(
        CacheReader::open(&broken.cache()).unwrap().read(2).unwrap(),
        kept.start
    );
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let (path, to) = {
            let entry = entry.unwrap();
            (entry.path(), to.join(entry.file_name()))
        };
        if path.is_dir() {
            copy(&path, &to);
        } else {
            fs::copy(&path, &to).unwrap();
        }
    }
}

fn bake_copy(sound: &Path) -> Baked {
    let folder = TempDir::new().unwrap();
    copy(sound, &folder.path().join("cache"));
    Baked {
        folder,
        reports: Vec::new(),
        removed: 0,
        particles: 0,
        error: None,
    }
}

/// Hard case 34 with PBF.
#[test]
fn what_is_no_number_is_caught_within_the_frame_and_its_pass_named_pbf() {
    let context = crate::support::context();
    let scene = load("34-not-a-number", &[SOLVERS[0]]);
    let sound = bake(&opened(&context), &scene, "1-2");
    for spoil in [
        spoil(
            "pbf/predict",
            "packed(x);",
            concat!("packed(x + ", nan!("thread"), ");"),
        ),
        spoil(
            "pbf/reorder",
            "start_position[thread] = x;",
            concat!(
                "start_position[thread] = packed(three(x) * ",
                nan!("thread"),
                ");"
            ),
        ),
        spoil(
            "pbf/compute_lambda",
            "let lambda = -max(",
            concat!("let lambda = ", nan!("i"), " - max("),
        ),
        spoil(
            "pbf/compute_delta",
            "delta));",
            concat!("delta) + ", nan!("i"), ");"),
        ),
        spoil(
            "pbf/update_velocity",
            "velocity[thread] = packed(v);",
            concat!("velocity[thread] = packed(v * ", nan!("thread"), ");"),
        ),
        spoil(
            "effects/viscosity_apply",
            "+ three(viscosity_change[i])",
            concat!("+ three(viscosity_change[i]) * ", nan!("i")),
        ),
        spoil(
            "pbf/measure_density",
            "density[thread] = ",
            concat!("density[thread] = ", nan!("thread"), " + "),
        ),
    ] {
        is_caught(&context, &scene, &sound.cache(), spoil);
    }
    // Negative control: without a fault the frames are complete, and a replay finds
    // nothing in them.
    let mut whole = bake_copy(&sound.cache());
    whole.go_on(&opened(&context), &scene, "1-4");
    assert!(whole.error.is_none(), "{:?}", whole.error);
}

/// Hard case 34 with FLIP.
#[test]
fn what_is_no_number_is_caught_within_the_frame_and_its_pass_named_flip() {
    let context = crate::support::context();
    let scene = load("34-not-a-number", &[SOLVERS[1]]);
    let sound = bake(&opened(&context), &scene, "1-2");
    for spoil in [
        spoil(
            "flip/cut_cells",
            "face_open[element] = lower.x;",
            concat!("face_open[element] = lower.x * ", nan!("element"), ";"),
        ),
        spoil(
            "flip/spread_faces",
            "let c = center_weights(f.z);",
            concat!("let c = center_weights(f.z) * ", nan!("i"), ";"),
        ),
        spoil(
            "flip/find_water",
            "liquid_distance[element] = -depth",
            concat!("liquid_distance[element] = ", nan!("element"), " - inside"),
        ),
        spoil(
            "pressure/displace",
            "-face.difference, face.is_open",
            concat!(
                "-face.difference * ",
                nan!("face.element"),
                ", face.is_open"
            ),
        ),
        spoil(
            "flip/grid_to_particle",
            "carried[k] = u;",
            concat!("carried[k] = u * ", nan!("i"), ";"),
        ),
        spoil(
            "flip/advect",
            "position[i] = packed(x);",
            concat!(
                "position[i] = packed(clamp(x, low, high) * ",
                nan!("i"),
                ");"
            ),
        ),
    ] {
        is_caught(&context, &scene, &sound.cache(), spoil);
    }
    let mut whole = bake_copy(&sound.cache());
    whole.go_on(&opened(&context), &scene, "1-4");
    assert!(whole.error.is_none(), "{:?}", whole.error);
}
