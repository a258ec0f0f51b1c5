//! Bakes on a device as imprecise as Vulkan permits.

use std::{path::Path, sync::atomic::AtomicBool};

use swell::{
    files::load_scene,
    gpu::{adapter::Context, imprecision::Imprecision},
    stage::{
        bake::{BakeRequest, bake},
        device::Device,
        diff::{self, DiffOutcome, diff},
    },
};
use tempfile::TempDir;

const FRAMES: &str = "1-3";

/// Compares frames of a shot that are baked with a profile with its baseline, as on an adapter that
/// the baseline does not know. Returns whether they are within its limits, and the report.
fn compared(shot: &str, solver: &str, profile: Imprecision) -> (bool, String) {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let context = Context::open_imprecise(None, profile).unwrap();
    let set = [format!("solver.method={solver}")];
    let scene = load_scene(&root.join(format!("scenes/{shot}.toml")), &set).unwrap();
    let folder = TempDir::new().unwrap();
    let request = BakeRequest {
        scene,
        directory: folder.path().join("cache"),
        frames: Some(FRAMES.parse().unwrap()),
        resume: false,
        from: None,
        device: Device::Open(Box::new(context)),
        time_passes: false,
    };
    bake(&request, &AtomicBool::new(false), &mut |_| {}).unwrap();
    let request = diff::DiffRequest {
        a: request.directory,
        b: root.join(format!("tests/baselines/{shot}-{solver}.json")),
        frames: request.frames,
        tolerance: None,
        images: None,
        ignores_hashes: false,
    };
    let outcome = diff(&request).unwrap();
    assert!(matches!(outcome, DiffOutcome::Baseline(_)), "{outcome:?}");
    (outcome.is_within(), format!("{outcome:?}"))
}

/// `tools/regress` allows another adapter what roundings alone change.
#[test]
fn a_bake_as_imprecise_as_vulkan_permits_is_within_the_limits_of_another_adapter() {
    let legal = Imprecision::vulkan_worst(1);
    let (is_within, report) = compared("quickstart", "flip", legal);
    assert!(is_within, "{report}");
    let gross = Imprecision {
        division: 65536.0,
        ..Imprecision::NONE
    };
    let (is_within, report) = compared("quickstart", "flip", gross);
    assert!(!is_within, "{report}");
}
