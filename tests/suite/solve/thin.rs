//! Thin walls between water and an empty region.

use swell::cache::CacheReader;

use crate::support::job::Job;

/// Number of particles behind a wall after half a second. The wall has `thickness` (m), its middle
/// at `x`, and is rotated by `degrees` about the vertical.
fn leaked(job: &Job, solver: &str, thickness: f64, x: f64, degrees: f64) -> usize {
    let name = format!("{solver}-{thickness}-{x}-{degrees}");
    job.expect(
        0,
        &format!(
            "bake 16-thin-wall.toml --solver {solver} -o {name} --frames 1-30 \
             --set water.block[0].max=[0.6,1.0,0.6] \
             --set solid[0].scale=[{thickness},2.6,2.0] --set solid[0].translate=[{x},0.6,0.3] \
             --set solid[0].rotate_degrees=[0,{degrees},0]"
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

/// Walls of 1.5 spacings, the least thickness that the lint accepts, hold water at any position;
/// half of that leaks at some position.
#[test]
fn walls_as_thick_as_the_lint_asks_for_hold_water_wherever_they_stand() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/hard_cases/");
    let text = |name: &str| std::fs::read_to_string(format!("{folder}{name}")).unwrap();
    let (scene, mesh) = (text("16-thin-wall.toml"), text("box.obj"));
    let job = Job::of(&[("16-thin-wall.toml", &scene), ("box.obj", &mesh)]);
    for solver in ["flip", "pbf"] {
        for place in 0..7 {
            let x = 0.8 + 0.1 * f64::from(place) / 7.0;
            assert_eq!(leaked(&job, solver, 0.15, x, 0.0), 0, "{solver} at {x}");
        }
        assert_eq!(
            leaked(&job, solver, 0.15, 0.85, 25.0),
            0,
            "{solver}, turned"
        );
        // Negative control: half as thick.
        let through = leaked(&job, solver, 0.08, 0.88, 0.0);
        assert!(through > 20, "{solver}: {through} of 360");
    }
}
