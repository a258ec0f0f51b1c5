//! FLIP on the GPU: its passes against naive f64 twins, against analysis, and what must hold in any run.
#![allow(missing_docs, clippy::unwrap_used, reason = "tests")]

mod support;

use glam::{DVec3, Vec3};
use support::{context, jitter, lattice, noise};
use swell::{
    domain::{
        bricks::{Bricks, CELLS},
        particles::Particles,
        solver::{Solver, StepReport},
    },
    gpu::adapter::Context,
    scene::{
        Method, Scene,
        flip::{Flip as Settings, Preconditioner, Pressure, Surface, Transfer},
        plan::{Capacity, Counts, Plan},
    },
    solve::{
        boundary::Boundary,
        flip::{Flip, capacity},
        pbf::device_limits,
    },
};

/// Δx.
const DX: f64 = 0.1;

fn settings() -> Settings {
    Settings {
        cell_size: DX,
        particles_per_cell: 8,
        transfer: Transfer::Flip,
        pic_blend: 0.05,
        cfl: 2.0,
        max_substeps: 32,
        surface: Surface::GhostFluid,
        density_correction: true,
        pressure: Pressure {
            preconditioner: Preconditioner::Multigrid,
            tolerance: 1e-5,
            max_iterations: 400,
            residual_limit: 1e-2,
        },
    }
}

/// A box of so many cells.
fn scene(cells: [f64; 3]) -> Scene {
    let mut scene = support::scene(cells.map(|n| n * DX));
    scene.solver.method = Method::Flip;
    scene.solver.flip = Some(settings());
    scene
}

fn flip(scene: &mut Scene) -> &mut Settings {
    scene.solver.flip.as_mut().unwrap()
}

fn solver_with(context: &Context, scene: &Scene, particles: &Particles, boundary: &Boundary, bricks: Capacity) -> Flip {
    let counts = Counts { particles: particles.len(), bricks, ..boundary.counts() };
    let plan = Plan::new(scene, counts, device_limits(context));
    let mut solver = Flip::new(context, scene, plan, boundary, false).unwrap();
    solver.load(0, particles).unwrap();
    solver
}

fn solver(context: &Context, scene: &Scene, particles: &Particles) -> Flip {
    solver_with(context, scene, particles, &Boundary::default(), capacity(scene, particles))
}

fn run(context: &Context, scene: &Scene, particles: &Particles, frames: u32) -> (Particles, StepReport) {
    let mut solver = solver(context, scene, particles);
    let mut last = None;
    for _ in 0..frames {
        last = Some(solver.advance().unwrap());
    }
    last.unwrap()
}

/// A block of water of whole cells, eight particles each.
fn block(corner: [usize; 3], cells: [usize; 3]) -> Particles {
    lattice(corner.map(|c| c as f64 * DX), cells.map(|n| 2 * n), [DX / 2.0; 3])
}

fn position(particles: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(particles.position[k]).as_dvec3()
}

fn velocity(particles: &Particles, k: usize) -> DVec3 {
    Vec3::from_array(particles.velocity[k]).as_dvec3()
}

/// Values of one plane of a field, by cell.
struct Field {
    bricks: Bricks,
    values: Vec<f32>,
    stride: usize,
}

impl Field {
    fn new(solver: &Flip, name: &str, planes: usize) -> Self {
        let stride = solver.plan().counts.bricks.slots * CELLS as usize;
        Self { bricks: solver.bricks().clone(), values: solver.field(name, planes * stride).unwrap(), stride }
    }

    fn at(&self, plane: usize, cell: [usize; 3]) -> f64 {
        let dims = self.bricks.table_dims.map(|n| n as usize);
        let [x, y, z] = cell.map(|c| c / 8);
        let slot = self.bricks.table[(z * dims[1] + y) * dims[0] + x] as usize;
        let local = cell[0] % 8 + 8 * (cell[1] % 8) + 64 * (cell[2] % 8);
        f64::from(self.values[plane * self.stride + 512 * slot + local])
    }
}

#[test]
fn free_fall_is_a_parabola() {
    let context = context();
    let mut scene = scene([20.0, 200.0, 20.0]);
    scene.shot.frames_per_second = 50.0;
    let mut particles = lattice([0.913, 18.477, 1.041], [1; 3], [DX; 3]);
    particles.velocity[0] = [0.5, 2.0, -0.25];
    let mut solver = solver(&context, &scene, &particles);
    let (mut y, mut v, mut state) = (position(&particles, 0).y, 2.0, particles.clone());
    for _ in 0..50 {
        let (next, report) = solver.advance().unwrap();
        state = next;
        let dt = 0.02 / f64::from(report.substeps);
        for _ in 0..report.substeps {
            v -= 9.81 * dt;
            y += v * dt;
        }
        println!("{} {y} {:?} {:?}", report.substeps, state.position[0], state.velocity[0]);
    }
    assert!((position(&state, 0).y - y).abs() < 1e-4, "{:?} {y}", state.position[0]);
}
