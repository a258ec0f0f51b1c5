//! Thin water on solids that cut cells, in cells whose centre is inside the solid.

use crate::support::{
    context,
    flip::{DX, block, half_space, position, scene, solver_with},
};
use glam::DVec3;
use swell::{
    domain::{boundary::Boundary, particles::Particles, solver::Solver},
    gpu::adapter::{Context, InjectedFault},
    reference::flip::Flip as Reference,
    scene::Scene,
    solve::plan::Capacity,
};

/// Treats all cells that a solid cuts as air.
const SPOIL: InjectedFault = InjectedFault {
    pass: "flip/find_water",
    from: "select(share_of_room(element), share, is_in_wall)",
    to: "0.0",
};

fn spoiled(context: &Context) -> Context {
    let mut spoiled = context.clone();
    spoiled.spoil = Some(SPOIL);
    spoiled
}

/// A capacity for every brick: water may be anywhere.
fn everywhere(scene: &Scene) -> Capacity {
    let full = (scene.domain.size() / DX).round().as_uvec3();
    swell::solve::flip::capacity(
        &scene.with_flip().unwrap(),
        &block([0; 3], full.to_array().map(|n| n as usize)),
    )
}

/// Open part of the lowest cells above the floor.
const OPEN: f64 = 0.3;

/// A box whose floor is a solid that cuts the third layer of cells, with one cell's worth of water
/// there, squeezed into a sheet a tenth of a cell thick.
fn pressed() -> (Scene, Boundary, Particles) {
    let scene = scene([8.0, 8.0, 8.0]);
    let floor = (3.0 - OPEN) * DX;
    let mut particles = block([0; 3], [8, 1, 8]);
    let layer: Vec<_> = (particles.position.iter())
        .filter(|x| f64::from(x[1]) < 0.5 * DX)
        .copied()
        .collect();
    particles.position = (0..2)
        .flat_map(|k| {
            let y = floor + (0.06 + 0.03 * f64::from(k)) * DX;
            layer.iter().map(move |x| [x[0], y as f32, x[2]])
        })
        .collect();
    let count = particles.position.len();
    particles.velocity = vec![[0.0; 3]; count];
    particles.id = (0..count as u32).collect();
    (scene, half_space(DVec3::Y, floor), particles)
}

/// Mean height of the particles over the floor of [`pressed`] after a quarter of a second, in
/// cells.
fn height<S: Solver>(mut solver: S) -> f64
where
    S::Error: std::fmt::Debug,
{
    let state = (0..25).fold(None, |_, _| Some(solver.advance().unwrap().0));
    let state = state.unwrap();
    let sum: f64 = (0..state.len()).map(|k| position(&state, k).y).sum();
    sum / state.len() as f64 / DX - (3.0 - OPEN)
}

/// At the start no particle reaches the centre of a cell in the open.
#[test]
fn water_that_is_pressed_against_a_solid_comes_back_to_its_depth() {
    let context = context();
    let (scene, boundary, particles) = pressed();
    let on = |context: &Context| {
        let bricks = everywhere(&scene);
        height(solver_with(context, &scene, &particles, &boundary, bricks))
    };
    let mut reference = Reference::new(&scene.with_flip().unwrap(), &boundary);
    reference.load(0, &particles).unwrap();
    let found = [on(&context), height(reference)];
    println!("{found:?}");
    // A cell of water has its middle at 0.5; the cut cells take slightly more than their part.
    for height in found {
        assert!((0.4..0.55).contains(&height), "{height}");
    }
    // Negative control: it stays a sheet.
    let height = on(&spoiled(&context));
    println!("{height}");
    assert!(height < 0.25, "{height}");
}

/// A pool over a slope of 1 : 8 that rises out of the water: scene, slope and particles.
fn shore() -> (Scene, Boundary, Particles) {
    let mut scene = scene([20.0, 8.0, 8.0]);
    scene.shot.frames_per_second = 25.0;
    let n = DVec3::new(-1.0, 8.0, 0.0).normalize();
    let d = n.dot(DVec3::new(1.65, 0.4, 0.0));
    let mut particles = block([0; 3], [20, 4, 8]);
    particles
        .position
        .retain(|x| n.dot(DVec3::from_array(x.map(f64::from))) - d > 0.25 * DX);
    let count = particles.position.len();
    particles.velocity.truncate(count);
    particles.id.truncate(count);
    (scene, half_space(n, d), particles)
}

/// Open part of a cell of [`shore`], sampled at 16 × 16 points.
fn open_part(x: usize, y: usize) -> f64 {
    let at = |k: usize, sub: usize| (k as f64 + (sub as f64 + 0.5) / 16.0) * DX;
    let is_open = |k: &usize| at(y, k / 16) > 0.4 + (at(x, k % 16) - 1.65) / 8.0;
    (0..256).filter(is_open).count() as f64 / 256.0
}

/// Content of the fullest cell relative to its open part, averaged over the last two seconds of
/// five, and the largest speed in that time, m/s.
fn crowding(context: &Context) -> (f64, f64) {
    let (scene, boundary, particles) = shore();
    let bricks = everywhere(&scene);
    let mut solver = solver_with(context, &scene, &particles, &boundary, bricks);
    let (mut sum, mut fastest) = (0.0, 0.0f64);
    for frame in 0..125 {
        let (state, report) = solver.advance().unwrap();
        let mut held = vec![0.0; 20 * 8 * 8];
        for k in 0..state.len() {
            let cell = (position(&state, k) / DX).as_uvec3();
            held[(cell.x + 20 * (cell.y + 8 * cell.z)) as usize] += 0.125;
        }
        let part = |k: usize| held[k] / open_part(k % 20, k / 20 % 8);
        let fullest = (0..held.len())
            .filter(|&k| open_part(k % 20, k / 20 % 8) > 0.2)
            .map(part)
            .fold(0.0, f64::max);
        if frame >= 75 {
            sum += fullest / 50.0;
            fastest = fastest.max(report.max_speed);
        }
    }
    (sum, fastest)
}

/// The water's edge lies in cells that the slope cuts, most of which have their centre inside the
/// slope.
#[test]
fn water_at_a_shore_does_not_gather_there() {
    let context = context();
    let (fullest, fastest) = crowding(&context);
    println!("{fullest} {fastest}");
    assert!((1.0..3.0).contains(&fullest), "{fullest}");
    assert!(fastest < 0.3, "{fastest}");
    // Negative control: water in cut cells is not incompressible, and never rests.
    let (fullest, fastest) = crowding(&spoiled(&context));
    println!("{fullest} {fastest}");
    assert!(fastest > 0.3, "{fastest}");
}
