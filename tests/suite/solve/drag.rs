//! Air drag: drops fall at measured speeds, wind carries them along, and bulk water is unaffected.

use glam::DVec3;
use swell::{
    domain::{air, boundary::Boundary, particles::Particles},
    scene::{Method, Scene, effects::drag::Settings},
};

use crate::support::{
    self, choose, context, flip as of_flip, pbf_of,
    solvers::{on_cpu, on_gpu},
};

const METHODS: [Method; 2] = [Method::Flip, Method::Pbf];

const FRAMES_PER_SECOND: f64 = 100.0;

/// A box that is periodic along x, so that wind is unbounded there.
fn scene(method: Method, cells: [f64; 3]) -> Scene {
    let mut scene = of_flip::scene(cells);
    let pbf = pbf_of(&mut scene);
    pbf.particle_spacing = of_flip::DX / 2.0;
    pbf.grid_projection = true;
    choose(&mut scene, method);
    scene.periodic = [true, false, false];
    scene.shot.frames_per_second = FRAMES_PER_SECOND;
    scene
}

fn drag(drop_radius: f64, wind: [f64; 3]) -> Option<Settings> {
    Some(Settings { drop_radius, wind })
}

/// Two drops too far apart to interact.
fn drops() -> Particles {
    Particles {
        id: vec![0, 1],
        position: vec![[0.31, 2.92, 0.23], [0.97, 2.87, 0.61]],
        velocity: vec![[0.0; 3]; 2],
        ..Particles::default()
    }
}

/// Drops of 0.2 and 0.5 mm diameter fall at 0.72 and 2.06 m/s in air at rest (Gunn and Kinzer 1949,
/// table 2), which the drag of a sphere reproduces within 5 %. Wind carries them along until they
/// fall relative to it as in air at rest. At the end 0.5 % of the faster drop's initial deviation,
/// exp(−g t / v), is left.
#[test]
fn drops_fall_as_measured_and_go_with_the_wind() {
    let context = context();
    let wind = [1.5, 0.0, 0.0];
    for method in METHODS {
        for (diameter, measured) in [(0.2e-3, 0.72), (0.5e-3, 2.06)] {
            let mut scene = scene(method, [16.0, 32.0, 8.0]);
            scene.effects.drag = drag(0.5 * diameter, wind);
            let frames = (1.1 * FRAMES_PER_SECOND) as u32;
            // In f64, frame by frame: v + g Δt and the drag of v.
            let fall = DVec3::new(0.0, -9.81 / FRAMES_PER_SECOND, 0.0);
            let step = |v: DVec3| {
                let air = DVec3::from_array(wind);
                air::blown([v, fall], air, 0.5 * diameter, 1.0 / FRAMES_PER_SECOND)
            };
            let by_hand = (0..frames).fold(DVec3::ZERO, |v, _| step(v));
            for state in [
                on_gpu(&context, &scene, &drops(), frames),
                on_cpu(&scene, &drops(), frames),
            ] {
                for v in &state.velocity {
                    let v = DVec3::from_array(v.map(f64::from));
                    println!("{method:?} {diameter}: {v}, by hand {by_hand}");
                    // One f32 sum per frame, of 16 m/s² at most.
                    assert!((v - by_hand).length() < 1e-4, "{v} {by_hand}");
                    assert!((-v.y / measured - 1.0).abs() < 0.05, "{v}");
                    assert!((v.x / wind[0] - 1.0).abs() < 0.01, "{v}");
                }
            }
            // Negative control: without drag they fall freely and the wind does not move them.
            scene.effects.drag = None;
            let state = on_gpu(&context, &scene, &drops(), 20);
            for v in &state.velocity {
                assert!((v[1] + 9.81 * 0.2).abs() < 1e-3 && v[0] == 0.0, "{v:?}");
            }
        }
    }
}

/// Wind that would accelerate a single drop at 80 m/s² leaves a plane surface at rest: its
/// particles have more neighbours than the threshold for exposure. A sheet one particle thick is
/// carried along.
#[test]
fn wind_takes_sheets_along_and_leaves_plane_water_at_rest() {
    let context = context();
    let wind = [20.0, 0.0, 0.0];
    for method in METHODS {
        let mut scene = scene(method, [16.0, 8.0, 8.0]);
        let mean = |scene: &Scene, particles: &Particles, frames: u32| -> f64 {
            let state = on_gpu(&context, scene, particles, frames);
            let speeds = state.velocity.iter().map(|v| f64::from(v[0]));
            speeds.sum::<f64>() / particles.len() as f64
        };
        let water = of_flip::block([0; 3], [16, 4, 8]);
        scene.effects.drag = drag(1e-3, wind);
        let taken = mean(&scene, &water, 50);
        println!("{method:?}: {taken:.2e} m/s of a plane water's mean after 0.5 s");
        // Compared with the wind's speed of 20 m/s; a single drop would gain 40 m/s.
        assert!(taken.abs() < 2e-4 * wind[0], "{taken}");
        // Negative control: a sheet half a cell thick.
        let spacing = of_flip::DX / 2.0;
        let sheet = support::lattice([0.0, 0.55, 0.0], [32, 1, 16], [spacing; 3]);
        scene.water.gravity = DVec3::ZERO;
        let taken = mean(&scene, &sheet, 50);
        println!("{method:?}: {taken:.2} m/s of a sheet's");
        assert!(taken > 0.1 * wind[0], "{taken}");
    }
}

/// Drag adds one pass to scenes that name it, no buffer and no byte.
#[test]
fn a_scene_that_names_no_drag_pays_for_none() {
    let context = context();
    for method in METHODS {
        let mut scene = scene(method, [16.0, 8.0, 8.0]);
        let plan = |scene: &Scene| support::plan(&context, scene, 1000, &Boundary::default());
        let bare = plan(&scene);
        scene.effects.drag = drag(1e-3, [0.0; 3]);
        let with = plan(&scene);
        assert_eq!(with.bytes(), bare.bytes());
        let names = |plan: &swell::solve::plan::Plan| -> Vec<&'static str> {
            plan.passes.iter().map(|pass| pass.spec.name).collect()
        };
        let mut added = names(&with);
        added.retain(|name| !names(&bare).contains(name));
        let expected = match method {
            Method::Flip => "effects/drag_by_cells",
            Method::Pbf => "effects/drag_by_density",
        };
        assert_eq!(added, [expected]);
    }
}
