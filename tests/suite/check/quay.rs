//! Solids whose faces lie on those of cells.

use std::path::Path;

use swell::{
    files::load_scene,
    gpu::adapter::Context,
    stage::{check::check_frame, prepare::Start},
};

use super::{controls::control, faults};
use crate::support::context;

/// A quay with samples that single precision puts into other cells than double precision does.
#[test]
fn samples_on_faces_of_cells_are_neighbours_as_on_the_device() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/harbour.toml");
    let set = ["solver.method=pbf", "solver.pbf.particle_spacing=0.3"].map(str::to_owned);
    let scene = load_scene(&file, &set).unwrap();
    let start = Start::of(&scene).unwrap();
    let checked = |context: &Context| check_frame(context, &scene, &start, 0, &start.particles);
    // Negative control: samples that are a little too far.
    let farther = control(
        "pbf/build_neighbors",
        "if dot(d, d) < h2 {",
        "if dot(d, d) < 1.02 * h2 {",
        "pbf/build_neighbors",
        &["wrong members of a list"],
    );
    let (_, faults) = faults(&context(), &checked, &[farther]);
    assert!(faults.is_empty(), "{faults}");
}
