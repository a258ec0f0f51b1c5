//! Both solvers, on the GPU and with the f64 reference, without solids.

use swell::{
    domain::{
        boundary::Boundary,
        particles::Particles,
        solver::{Solver, StepReport},
    },
    gpu::adapter::Context,
    reference,
    scene::{Method, Scene},
};

use super::{choose, flip as of_flip, pbf_of};

/// Frames per second.
pub const RATE: f64 = 100.0;

/// FLIP, PBF with a projection, and PBF without one.
pub const SOLVERS: [(Method, bool); 3] = [
    (Method::Flip, true),
    (Method::Pbf, true),
    (Method::Pbf, false),
];

/// A box of cells for such a solver.
pub fn scene((method, has_projection): (Method, bool), cells: [f64; 3]) -> Scene {
    let mut scene = of_flip::scene(cells);
    let pbf = pbf_of(&mut scene);
    pbf.particle_spacing = of_flip::DX / 2.0;
    pbf.grid_projection = has_projection;
    choose(&mut scene, method);
    scene.shot.frames_per_second = RATE;
    scene
}

/// The state after each frame with its report, on the GPU or, without a context, of the reference.
pub fn run(
    context: Option<&Context>,
    scene: &Scene,
    start: &Particles,
    frames: u32,
) -> Vec<(Particles, StepReport)> {
    fn go<S: Solver>(mut solver: S, start: &Particles, frames: u32) -> Vec<(Particles, StepReport)>
    where
        S::Error: std::fmt::Debug,
    {
        solver.load(0, start).unwrap();
        (0..frames).map(|_| solver.advance().unwrap()).collect()
    }
    let none = Boundary::default();
    match (context, scene.solver.method()) {
        (Some(context), Method::Flip) => go(of_flip::solver(context, scene, start), start, frames),
        (Some(context), Method::Pbf) => {
            let solver = super::solver(context, scene, start, &none);
            go(solver, start, frames)
        }
        (None, Method::Flip) => {
            let scene = scene.with_flip().unwrap();
            go(reference::flip::Flip::new(&scene, &none), start, frames)
        }
        (None, Method::Pbf) => {
            let scene = scene.with_pbf().unwrap();
            go(reference::pbf::Pbf::new(&scene, &none), start, frames)
        }
    }
}

/// State of the particles after `frames` frames on the GPU.
pub fn on_gpu(context: &Context, scene: &Scene, particles: &Particles, frames: u32) -> Particles {
    last(run(Some(context), scene, particles, frames))
}

/// State of the particles after `frames` frames of the f64 reference.
pub fn on_cpu(scene: &Scene, particles: &Particles, frames: u32) -> Particles {
    last(run(None, scene, particles, frames))
}

fn last(all: Vec<(Particles, StepReport)>) -> Particles {
    all.into_iter().next_back().unwrap().0
}
