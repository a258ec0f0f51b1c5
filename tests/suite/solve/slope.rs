//! Water that slides down a slope without friction, with both solvers, on the GPU and in f64.

use std::path::Path;

use glam::{DVec3, Vec3};

use swell::{
    files::load_scene,
    scene::Method,
    stage::{device::Opened, drive::Drive, prepare::Start},
};

use crate::support::{context, device};

/// Quarter of a second.
const FRAMES: u32 = 24;

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
    let start = Start::of(&scene).unwrap();
    let mut drive = Drive::new(opened, &scene, &start, false).unwrap();
    let last = (0..FRAMES).map(|_| drive.advance().unwrap()).last();
    let velocity = last.unwrap().particles.velocity;
    let sum: DVec3 = velocity.iter().map(|&v| Vec3::from(v).as_dvec3()).sum();
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let along = sum.dot(DVec3::new(cosine, -sine, 0.0)) / velocity.len() as f64;
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
