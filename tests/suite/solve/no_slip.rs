//! No-slip walls: their shear stress in closed form, no passes for them in other scenes, and a dam
//! break over a no-slip floor.

use glam::DVec3;
use swell::{
    domain::{
        boundary::Boundary,
        flip::VON_KARMAN,
        particles::Particles,
        solver::{Solver, StepReport},
        statistics::percentile,
    },
    gpu::adapter::Context,
    reference,
    scene::{Scene, Wall},
    solve::plan::{Capacity, Counts, DeviceLimits, LIST_BUDGET, Plan},
};

use crate::support::{
    context,
    device::{self, PooledDevice},
    flip::*,
    lattice, noise,
};

fn wall(name: &str) -> Wall {
    Wall::NAMED
        .into_iter()
        .find(|(word, _)| *word == name)
        .unwrap()
        .1
}

fn first_frame<S: Solver>(mut solver: S, particles: &Particles) -> (Particles, StepReport)
where
    S::Error: std::fmt::Debug,
{
    solver.load(0, particles).unwrap();
    solver.advance().unwrap()
}

/// State and report after one frame, on the GPU and with the reference.
fn both(context: &Context, scene: &Scene, particles: &Particles) -> [(Particles, StepReport); 2] {
    let cpu = reference::flip::Flip::new(&scene.with_flip().unwrap(), &Boundary::default());
    [
        first_frame(solver(context, scene, particles), particles),
        first_frame(cpu, particles),
    ]
}

fn spoiled(from: &'static str, to: &'static str) -> PooledDevice {
    device::spoiled("flip/wall_friction", from, to)
}

/// Velocity of the water along x and along z, m/s: 1 m/s in magnitude.
const ALONG: [f64; 2] = [0.8, 0.6];

/// A block three cells deep that slides diagonally over a floor, without gravity and away from all
/// other walls. Only the floor acts on it, and no pressure arises, because the floor's stress is
/// the same everywhere.
fn sliding(no_slip: &[&str]) -> (Scene, Particles) {
    let mut scene = scene([20.0, 8.0, 20.0]);
    scene.water.gravity = DVec3::ZERO;
    scene.no_slip = no_slip.iter().map(|name| wall(name)).collect();
    let mut particles = block([6, 0, 6], [6, 3, 6]);
    particles.velocity = vec![[ALONG[0] as f32, 0.0, ALONG[1] as f32]; particles.len()];
    (scene, particles)
}

/// Fraction of 1 m/s that is left at the faces nearest to the wall after a substep of 0.01 s.
fn left() -> f64 {
    1.0 / (1.0 + VON_KARMAN * VON_KARMAN * 0.01 / DX)
}

/// Largest difference of a particle's velocity from the closed form, m/s. The faces of the first
/// row are at half a cell and affect particles up to one and a half.
fn sliding_gaps(context: &Context, no_slip: &[&str]) -> [f64; 2] {
    let (scene, particles) = sliding(no_slip);
    both(context, &scene, &particles).map(|(state, report)| {
        assert_eq!(report.substeps, 1);
        let gap = |k: usize| {
            let part = (1.5 - position(&particles, k).y / DX).clamp(0.0, 1.0);
            let speed = 1.0 - part * (1.0 - left());
            let exact = speed * DVec3::new(ALONG[0], 0.0, ALONG[1]);
            (velocity(&state, k) - exact).length()
        };
        (0..state.len()).map(gap).fold(0.0, f64::max)
    })
}

/// Velocities of 1 m/s are sums of some 20 weights that each round by 20 ε, and the solve leaves
/// 1e-5 of a divergence that is itself rounding.
#[test]
fn a_floor_slows_water_by_its_shear_stress() {
    let tolerance = 1e-5;
    let found = sliding_gaps(&context(), &["-y"]);
    println!("{found:?}, of {}", 1.0 - left());
    assert!(found.iter().all(|gap| *gap < tolerance), "{found:?}");
    // Walls that the water does not touch add nothing.
    let found = sliding_gaps(&context(), &["-x", "-y", "+y", "+z"]);
    assert!(found.iter().all(|gap| *gap < tolerance), "{found:?}");
    // Negative controls: free slip, another wall, a von Kármán constant 1 % off, and the stress of
    // a single velocity component.
    for no_slip in [&[][..], &["+y"]] {
        let found = sliding_gaps(&context(), no_slip);
        assert!(found.iter().all(|gap| *gap > 0.01), "{found:?}");
    }
    for (from, to) in [
        ("VON_KARMAN = 0.41", "VON_KARMAN = 0.415"),
        ("length(along)", "abs(along.x)"),
    ] {
        let [gap, _] = sliding_gaps(&spoiled(from, to), &["-y"]);
        println!("{to}: {gap:.1e}");
        assert!(gap > 10.0 * tolerance, "{to}: {gap:e}");
    }
}

/// Momentum that a substep takes from a block moving along x below a no-slip ceiling, relative to
/// that of the stress ρ κ² u². The block fills the four lowest cells, the topmost of which is open
/// to `open` of its height.
fn ceiling_stress(context: &Context, open: f64) -> [f64; 2] {
    const LAYERS: usize = 40;
    let mut scene = scene([20.0, 3.0 + open, 4.0]);
    scene.water.gravity = DVec3::ZERO;
    scene.no_slip = vec![wall("+y")];
    flip(&mut scene).particles_per_cell = 64;
    flip(&mut scene).density_correction = false;
    let height = (3.0 + open) * DX;
    let spacing = height / LAYERS as f64;
    let mut particles = lattice([0.6, 0.0, 0.0], [32, LAYERS, 16], [0.025, spacing, 0.025]);
    particles.velocity = vec![[1.0, 0.0, 0.0]; particles.len()];
    // Cells of water in a column.
    let mass = 3.0 + open;
    both(context, &scene, &particles).map(|(state, _)| {
        let sum: f64 = (0..state.len()).map(|k| 1.0 - velocity(&state, k).x).sum();
        sum / state.len() as f64 * mass / (1.0 - left())
    })
}

/// A layer one cell thick shares the stress wherever the wall cuts a cell: exactly where the cut is
/// half of the cell or less, and 1 % more where little of the cell is left; hats over 40 layers add
/// up to 1 %.
#[test]
fn a_walls_stress_does_not_depend_on_where_it_cuts_a_cell() {
    let context = context();
    for open in [1.0, 0.8, 0.5, 0.3, 0.1] {
        let found = ceiling_stress(&context, open);
        println!("{open}: {found:?}");
        assert!(
            found.iter().all(|part| (part - 1.0).abs() < 0.03),
            "{open}: {found:?}"
        );
    }
    // Negative control: the whole layer in each of the two rows that share it.
    let whole = spoiled(
        "clamp(1.5 - (params.cut_max - place), vec3f(0.0), vec3f(1.0))",
        "ceil(clamp(1.5 - (params.cut_max - place), vec3f(0.0), vec3f(1.0)))",
    );
    let [found, _] = ceiling_stress(&whole, 0.5);
    assert!(found > 1.2, "{found}");
}

/// Stirred water in a box of no-slip walls: each wall takes energy and none adds any, and water at
/// rest stays.
#[test]
fn walls_take_energy_and_give_none() {
    let stirred = |part: f64, no_slip: Vec<Wall>| {
        let (mut scene, mut particles) = tank([10, 8, 10], 8);
        scene.water.gravity = DVec3::ZERO;
        scene.no_slip = no_slip;
        for (k, v) in particles.velocity.iter_mut().enumerate() {
            let speed = |axis: u64| part * noise(3 * (k as u64) + axis + 7);
            *v = [speed(0) as f32, speed(1) as f32, speed(2) as f32];
        }
        both(&context(), &scene, &particles).map(|(_, report)| report.kinetic_energy)
    };
    let all: Vec<Wall> = Wall::NAMED.iter().map(|named| named.1).collect();
    let free = stirred(1.0, Vec::new());
    let held = stirred(1.0, all.clone());
    for k in 0..2 {
        let mut taken = 0.0;
        for wall in &all {
            let one = free[k] - stirred(1.0, vec![*wall])[k];
            assert!(one > 0.0, "{}: {one} J", wall.name());
            taken += one;
        }
        let part = (free[k] - held[k]) / taken;
        println!(
            "{:.4} J of {:.4} J, {part} of the walls one by one",
            taken, free[k]
        );
        assert!((0.9..1.0).contains(&part), "{part}");
    }
    assert!(stirred(0.0, all).iter().all(|energy| *energy == 0.0));
}

#[test]
fn a_bake_with_no_slip_walls_resumes_exactly() {
    let context = context();
    let (mut scene, mut particles) = tank([16, 10, 6], 6);
    particles
        .velocity
        .iter_mut()
        .for_each(|v| *v = [0.7, 0.0, 0.2]);
    scene.no_slip = Wall::NAMED.iter().map(|named| named.1).collect();
    let mut first = solver(&context, &scene, &particles);
    let states: Vec<Particles> = (0..6).map(|_| first.advance().unwrap().0).collect();
    let go_on = |frame: u32, state: &Particles| {
        let mut resumed = solver(&context, &scene, &particles);
        resumed.load(frame, state).unwrap();
        (frame..6)
            .map(|_| resumed.advance().unwrap().0)
            .last()
            .unwrap()
    };
    assert!(go_on(2, &states[1]) == states[5]);
    // Negative control: without the walls the result differs.
    scene.no_slip.clear();
    let mut free = solver(&context, &scene, &particles);
    free.load(2, &states[1]).unwrap();
    let last = (2..6).map(|_| free.advance().unwrap().0).last().unwrap();
    assert!(last != states[5]);
}

#[test]
fn what_no_scene_names_is_not_planned() {
    let plan = |no_slip: &[&str]| {
        let mut scene = scene([16.0; 3]);
        scene.no_slip = no_slip.iter().map(|name| wall(name)).collect();
        let counts = Counts {
            particles: 5000,
            bricks: Capacity {
                laden: 9,
                wet: 9,
                slots: 15,
            },
            ..Counts::default()
        };
        let limits = DeviceLimits {
            binding: 128 << 20,
            buffer: 256 << 20,
            list_budget: LIST_BUDGET,
        };
        Plan::new(&scene, counts, limits)
    };
    let (free, held) = (plan(&[]), plan(&["-y", "+z"]));
    assert_eq!(free.buffers, held.buffers);
    let (own, others): (Vec<_>, Vec<_>) =
        (held.passes.into_iter()).partition(|pass| pass.spec.name == "flip/wall_friction");
    assert_eq!(free.passes, others);
    let constants = own.iter().map(|pass| pass.spec.constants.as_slice());
    assert_eq!(constants.collect::<Vec<_>>(), [&[("NO_SLIP", 34.0)]]);
}

/// Time t √(2g/a) and front position in column widths, for a column twice as high as wide (Martin
/// and Moyce 1952).
const FRONT: [(f64, f64); 6] = [
    (0.84, 1.22),
    (1.43, 1.67),
    (1.98, 2.33),
    (2.51, 3.00),
    (2.98, 3.67),
    (3.33, 4.11),
];

/// Mean relative error of the front, taken as the 99.5th percentile of the particles' x, in a slab
/// of three cells, with twelve cells per column width.
fn front_error(no_slip: &[&str]) -> f64 {
    const WIDTH: f64 = 12.0;
    let mut scene = scene([6.0 * WIDTH, 2.5 * WIDTH, 3.0]);
    scene.no_slip = no_slip.iter().map(|name| wall(name)).collect();
    flip(&mut scene).cfl = 3.0;
    let unit = (WIDTH * DX / (2.0 * 9.81)).sqrt();
    scene.shot.frames_per_second = 20.0 / unit;
    let particles = block([0; 3], [12, 24, 3]);
    let mut solver = solver(&context(), &scene, &particles);
    let mut fronts = vec![1.0];
    for _ in 0..67 {
        let (state, _) = solver.advance().unwrap();
        let x = state
            .position
            .iter()
            .map(|x| f64::from(x[0]) / (WIDTH * DX));
        fronts.push(percentile(x.collect(), 0.995).unwrap());
    }
    let errors = FRONT.map(|(time, front)| {
        let (frame, part) = ((20.0 * time).floor(), (20.0 * time).fract());
        let k = frame as usize;
        let found = fronts[k] + part * (fronts[k + 1] - fronts[k]);
        (found / front - 1.0).abs()
    });
    println!("{no_slip:?}: {errors:.3?}");
    errors.iter().sum::<f64>() / errors.len() as f64
}

/// The side walls of the slab are free-slip: they stand for a symmetry plane.
#[test]
fn a_no_slip_floor_holds_a_dam_breaks_front_back() {
    let held = front_error(&["-y"]);
    assert!(held < 0.05, "{held}");
    // Negative controls: a free-slip floor, and another wall.
    for other in [&[][..], &["-x"]] {
        let free = front_error(other);
        assert!(free > 0.06, "{free}");
    }
}
