//! Where FLIP's particles go straight on, and where they do not.

use std::path::Path;

use swell::{
    domain::solver::StepReport,
    files::parse_scene,
    gpu::adapter::Context,
    scene::Scene,
    stage::{device::Opened, drive::Drive, prepare::Start},
};

use crate::support::{context, device::spoiled, noise};

fn scene(name: &str, domain: f64, water: &str, solid: &str) -> Scene {
    let text = format!(
        "[shot]\nname = \"{name}\"\nframes = 30\nframes_per_second = 24\n\
         [domain]\nmin = [0, 0, 0]\nmax = [{domain}, {domain}, {domain}]\n\
         [[water.block]]\n{water}\n{solid}\
         [solver]\nmethod = \"flip\"\n[solver.flip]\ncell_size = 0.1\n"
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hard_cases");
    parse_scene(&text, Path::new("paths.toml"), &folder, &[]).unwrap()
}

fn on(context: &Context) -> Opened {
    Opened::Gpu(Box::new(context.clone()))
}

fn reports(opened: &Opened, scene: &Scene, start: &Start, frames: u32) -> Vec<StepReport> {
    let mut drive = Drive::new(opened, scene, start, false).unwrap();
    (0..frames)
        .map(|_| drive.advance().unwrap().report)
        .collect()
}

/// Largest mean divergence of the water in a closed box around a block at an angle to the grid,
/// relative to the largest divergence in a cell, in the first three frames of a stirred start.
fn squeezed(opened: &Opened) -> f64 {
    let solid = "[[solid]]\nmesh = \"box.obj\"\ntranslate = [0.6, 0.6, 0.6]\nscale = 0.5\n\
                 rotate_degrees = [20, 0, 20]\n";
    let scene = scene(
        "closed",
        1.2,
        "min = [0, 0, 0]\nmax = [1.2, 1.2, 1.2]",
        solid,
    );
    let mut start = Start::of(&scene).unwrap();
    for (k, v) in start.particles.velocity.iter_mut().enumerate() {
        *v = std::array::from_fn(|axis| 0.5 * noise(3 * k as u64 + axis as u64) as f32);
    }
    let projections = reports(opened, &scene, &start, 3).into_iter();
    let projections = projections.map(|report| report.projection.unwrap());
    projections
        .map(|it| {
            assert_eq!(it.pockets, 1);
            it.incompatible / it.divergence_before
        })
        .fold(0.0, f64::max)
}

/// Rounding of a flux, of 60 operations (its bound in `swell check`), none larger than the largest
/// divergence.
const SUM: f64 = 60.0 * 0.5 * f32::EPSILON as f64;

/// What flows into cells of a closed box because straight paths contract their water flows out of
/// others. Control: not where walls and the block bound or cut cells.
#[test]
fn water_in_a_closed_box_is_not_squeezed() {
    let gpu = on(&context());
    let fault = ("is_cut || !is_straight() || is_bounded()", "!is_straight()");
    let without = on(&spoiled("flip/find_contraction", fault.0, fault.1));
    for opened in [&gpu, &Opened::Cpu] {
        let found = squeezed(opened);
        println!("{found:.1e}");
        assert!(found < SUM, "{found}");
    }
    let found = squeezed(&without);
    println!("without cut cells {found:.1e}");
    assert!(found > 1e-4, "{found}");
}

/// Largest mean density error in a frame of a column that falls a metre onto a floor.
fn landing(opened: &Opened) -> f64 {
    let scene = scene(
        "column",
        2.4,
        "min = [0.9, 1, 0.9]\nmax = [1.5, 2.2, 1.5]",
        "",
    );
    let start = Start::of(&scene).unwrap();
    let reports = reports(opened, &scene, &start, 30).into_iter();
    reports.map(|it| it.density_error_mean).fold(0.0, f64::max)
}

/// A column that lands at two to three cells a substep goes by the midpoint rule, because the
/// projection does not know yet how its water strains. Control: straight paths compress it.
#[test]
fn water_that_lands_is_not_compressed() {
    let straight = on(&spoiled(
        "flip/advect",
        "return 1.0 - sum / max",
        "return 1.0 + 0.0 * sum / max",
    ));
    for opened in [&on(&context()), &Opened::Cpu] {
        let found = landing(opened);
        println!("{found:.3}");
        assert!(found < 0.06, "{found}");
    }
    let found = landing(&straight);
    println!("straight {found:.3}");
    assert!(found > 0.08, "{found}");
}
