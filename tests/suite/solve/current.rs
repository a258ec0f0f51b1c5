//! Water that a steady current carries behaves as water at rest does (Galilean invariance), with
//! both solvers, on the GPU and in f64.

use glam::DVec3;

use swell::{domain::particles::Particles, gpu::adapter::Context, scene::Method};

use crate::support::{
    context,
    device::spoiled,
    flip as of_flip, noise,
    solvers::{self, SOLVERS},
};

/// Speed of the current, m/s, and the cells that it goes in a step.
const SPEED: f64 = 3.0;
const CELLS_A_STEP: f64 = 0.9;

/// Largest deviation of a particle's velocity from the current's after four seconds, m/s; at the
/// start there is noise of 1 mm/s. `bump` is the height, in layers of particles, of a step in the film.
fn unrest(context: Option<&Context>, method: (Method, bool), bump: usize) -> f64 {
    let mut scene = solvers::scene(method, [16.0, 16.0, 8.0]);
    scene.periodic = [true, false, true];
    scene.water.gravity = -9.81 * DVec3::Y;
    let frames = (SPEED / (CELLS_A_STEP * of_flip::DX)).round();
    scene.shot.frames_per_second = frames;
    let mut water: Particles = of_flip::block([0; 3], [16, 2, 8]);
    let kept: Vec<bool> = (water.position.iter())
        .map(|x| {
            let layer = (f64::from(x[1]) / (0.5 * of_flip::DX)) as usize;
            layer < 3 + usize::from(x[0] < 0.8) * bump
        })
        .collect();
    water.retain(&kept);
    let noise = |k: usize| 1e-3 * noise(k as u64) as f32;
    water.velocity = (0..water.len())
        .map(|k| {
            [
                SPEED as f32 + noise(3 * k),
                noise(3 * k + 1),
                noise(3 * k + 2),
            ]
        })
        .collect();
    let states = solvers::run(context, &scene, &water, (4.0 * frames) as u32);
    let (last, _) = states.last().unwrap();
    let off = |v: &[f32; 3]| (DVec3::from(v.map(f64::from)) - SPEED * DVec3::X).length();
    last.velocity.iter().map(off).fold(0.0, f64::max)
}

/// In a film, a cell and a half deep, noise of 1 mm/s stays as it is with PBF and comes to 14 with
/// FLIP, whose particles pass from cell to cell; it may come to three times that. By the midpoint
/// rule, in the field of the step's start, FLIP's comes to 1.4 m/s.
#[test]
fn a_current_stays_a_current() {
    let context = context();
    for solver in [SOLVERS[0], SOLVERS[1]] {
        for device in [Some(&*context), None] {
            let found = unrest(device, solver, 0);
            println!("{solver:?}, {}: {found:.1e} m/s", device.is_some());
            assert!(found < 0.04, "{solver:?}: {found}");
        }
        // Controls: a step of one layer makes waves, and so does the midpoint rule.
        let waves = unrest(Some(&context), solver, 1);
        println!("{solver:?}, with a step: {waves:.1e} m/s");
        assert!(waves > 0.05, "{solver:?}: {waves}");
        if solver.0 == Method::Flip {
            let midpoint = spoiled(
                "flip/advect",
                "return 1.0 - sum / max",
                "return 0.0 * sum / max",
            );
            let grown = unrest(Some(&midpoint), solver, 0);
            println!("by the midpoint rule: {grown:.1e} m/s");
            assert!(grown > 0.4, "{grown}");
        }
    }
}
