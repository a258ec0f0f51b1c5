//! Thin walls between water and an empty region.

use swell::cache::CacheReader;

use crate::support::job::Job;

/// A wall rotated about the vertical.
struct Wall {
    /// Thickness (m) and middle (m).
    thickness: f64,
    x: f64,
    degrees: f64,
    /// Width across the tank (m), which is 0.6 m wide.
    width: f64,
}

/// Number of particles behind a wall after half a second.
fn leaked(job: &Job, solver: &str, wall: &Wall) -> usize {
    let Wall {
        thickness,
        x,
        degrees,
        width,
    } = wall;
    let name = format!("{solver}-{thickness}-{x}-{degrees}-{width}");
    job.expect(
        0,
        &format!(
            "bake 16-thin-wall.toml --solver {solver} -o {name} --frames 1-30 \
             --set water.block[0].max=[0.6,1.0,0.6] \
             --set solid[0].scale=[{thickness},2.6,{width}] \
             --set solid[0].translate=[{x},0.6,0.3] --set solid[0].rotate_degrees=[0,{degrees},0]"
        ),
    );
    let state = CacheReader::open(&job.path(&name))
        .unwrap()
        .read(30)
        .unwrap();
    // The wall's normal; the box is rotated about its middle.
    let (sin, cos) = degrees.to_radians().sin_cos();
    let beyond = |p: &&[f32; 3]| cos * (f64::from(p[0]) - x) - sin * (f64::from(p[2]) - 0.3) > 0.0;
    state.position.iter().filter(beyond).count()
}

/// Walls thinner than a cell, and than the spacing of distances, hold water at any position; a wall
/// that leaves a third of the tank's width open does not.
#[test]
fn walls_thinner_than_a_cell_hold_water_wherever_they_stand() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/hard_cases/");
    let text = |name: &str| std::fs::read_to_string(format!("{folder}{name}")).unwrap();
    let (scene, mesh) = (text("16-thin-wall.toml"), text("box.obj"));
    let job = Job::of(&[("16-thin-wall.toml", &scene), ("box.obj", &mesh)]);
    let wall = |thickness, x, degrees, width| Wall {
        thickness,
        x,
        degrees,
        width,
    };
    for solver in ["flip", "pbf"] {
        for place in 0..5 {
            let x = 0.8 + 0.1 * f64::from(place) / 5.0;
            let through = leaked(&job, solver, &wall(0.02, x, 0.0, 2.0));
            assert_eq!(through, 0, "{solver} at {x}");
        }
        for (thickness, degrees) in [(0.08, 0.0), (0.15, 0.0), (0.02, 25.0)] {
            let through = leaked(&job, solver, &wall(thickness, 0.88, degrees, 2.0));
            assert_eq!(through, 0, "{solver}: {thickness} m at {degrees} degrees");
        }
        // Negative control.
        let through = leaked(&job, solver, &wall(0.15, 0.88, 0.0, 0.4));
        assert!(through > 20, "{solver}: {through} of 360");
    }
}
