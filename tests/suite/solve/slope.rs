//! Water that slides down a slope without friction, with both solvers, on the GPU and in f64.

use std::path::Path;

use glam::{DVec3, Vec3};

use swell::{
    files::{load_scene, parse_scene},
    scene::{Method, Scene},
    stage::{device::Opened, drive::Drive, prepare::Start},
};

use crate::support::{context, device};

/// A quarter of a second on the slope, half a second beside the plate.
const FRAMES: u32 = 24;

/// Mean velocity of the water after [`FRAMES`] frames, m/s.
fn mean_velocity(opened: &Opened, scene: &Scene) -> DVec3 {
    let start = Start::of(scene).unwrap();
    let mut drive = Drive::new(opened, scene, &start, false).unwrap();
    let last = (0..FRAMES).map(|_| drive.advance().unwrap()).last();
    let velocity = last.unwrap().particles.velocity;
    let sum: DVec3 = velocity.iter().map(|&v| Vec3::from(v).as_dvec3()).sum();
    sum / velocity.len() as f64
}

/// Speed along the slope after a quarter of a second, over g t sin θ: whatever the water does, a
/// slope without friction pushes at right angles to itself.
fn speed_ratio(opened: &Opened, method: Method, degrees: f64) -> f64 {
    let above = 2.182 + 0.5 * degrees.to_radians().tan() + 0.3;
    let set = [
        format!("solver.method=\"{}\"", method.name()),
        format!("solid.0.rotate_degrees=[0, 0, {}]", -degrees),
        format!("water.block.0.max=[2.5, {above}, 0.2]"),
    ];
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/validation/slope.toml");
    let scene = load_scene(&file, &set).unwrap();
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let along = mean_velocity(opened, &scene).dot(DVec3::new(cosine, -sine, 0.0));
    along / (9.81 * sine * f64::from(FRAMES) / scene.shot.frames_per_second)
}

/// The water has a depth of six cells. Closed faces of full weight, which is the control, slow it
/// by 2.1 to 2.7 % here.
#[test]
fn a_slope_without_friction_does_not_slow_the_water() {
    let gpu = Opened::Gpu(Box::new((*context()).clone()));
    let full = device::spoiled(
        "flip/cut_cells",
        "max(part * part, vec3f(LEAST_FACING))",
        "vec3f(1.0)",
    );
    let full = Opened::Gpu(Box::new((*full).clone()));
    for method in [Method::Flip, Method::Pbf] {
        for degrees in [20.0, 45.0] {
            for opened in [&gpu, &Opened::Cpu] {
                let ratio = speed_ratio(opened, method, degrees);
                println!("{method:?}, {degrees} degrees: {ratio:.4}");
                assert!((ratio - 1.0).abs() < 0.01, "{method:?}, {degrees}: {ratio}");
            }
        }
        let slowed = speed_ratio(&full, method, 20.0);
        assert!(slowed < 0.985, "{method:?}: {slowed}");
    }
}

/// Mean velocity along x of water that has run against a plate, one cell thick, on the cells'
/// boundaries, half a second after its dam broke to the left or the right of it; m/s.
fn against_a_plate(opened: &Opened, is_mirrored: bool) -> f64 {
    let block = if is_mirrored {
        "min = [1.5625, 0, 0]\nmax = [2.0625, 0.75, 0.25]"
    } else {
        "min = [0, 0, 0]\nmax = [0.5, 0.75, 0.25]"
    };
    let text = format!(
        "[shot]\nname = \"plate\"\nframes = 24\nframes_per_second = 48\n\
         [domain]\nmin = [0, 0, 0]\nmax = [2.0625, 1.25, 0.25]\n[[water.block]]\n{block}\n\
         [[solid]]\nmesh = \"box.obj\"\ntranslate = [1.03125, 0.6, 0.125]\n\
         scale = [0.0625, 1.6, 0.5]\n\
         [solver]\nmethod = \"flip\"\n[solver.flip]\ncell_size = 0.0625\n",
    );
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hard_cases");
    let scene = parse_scene(&text, Path::new("plate.toml"), &folder, &[]).unwrap();
    mean_velocity(opened, &scene).x
}

/// The plate stops water alike on both sides, although faces are stored with the cells after them.
/// Control: faces count where the distance grows over the cell that they are stored with, which it
/// does not inside the plate.
#[test]
fn a_thin_plate_stops_water_on_both_sides() {
    let gpu = Opened::Gpu(Box::new((*context()).clone()));
    let blind = device::spoiled(
        "flip/cut_cells",
        "select(closed, facing_weights(cell, cut.corners, by_solid), by_solid)",
        "select(closed, vec3f(1e-4), by_solid & (rises_over(cut.corners) <= vec3f(0.0)))",
    );
    let blind = Opened::Gpu(Box::new((*blind).clone()));
    let apart = |opened: &Opened| {
        let [there, mirrored] = [false, true].map(|side| against_a_plate(opened, side));
        println!("{there:.5} and {mirrored:.5} m/s");
        (there + mirrored).abs()
    };
    for opened in [&gpu, &Opened::Cpu] {
        assert!(apart(opened) < 1e-3);
    }
    assert!(apart(&blind) > 0.01);
}
