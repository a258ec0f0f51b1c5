//! Runs a scene with the solver that it names, on the GPU or with the f64 reference.

use swell::{
    domain::{boundary::Boundary, particles::Particles, solver::Solver},
    gpu::adapter::Context,
    reference,
    scene::{Method, Scene},
};

/// State of the particles after `frames` frames on the GPU.
pub fn on_gpu(context: &Context, scene: &Scene, particles: &Particles, frames: u32) -> Particles {
    match scene.solver.method() {
        Method::Flip => super::flip::run(context, scene, particles, frames).0,
        Method::Pbf => super::run(context, scene, particles, frames).0,
    }
}

/// State of the particles after `frames` frames of the f64 reference.
pub fn on_cpu(scene: &Scene, particles: &Particles, frames: u32) -> Particles {
    let none = Boundary::default();
    let advance = |solver: &mut dyn Solver<Error = reference::ReferenceError>| {
        solver.load(0, particles).unwrap();
        let states = (0..frames).map(|_| solver.advance().unwrap().0);
        states.last().unwrap()
    };
    match scene.solver.method() {
        Method::Flip => advance(&mut reference::flip::Flip::new(
            &scene.with_flip().unwrap(),
            &none,
        )),
        Method::Pbf => advance(&mut reference::pbf::Pbf::new(
            &scene.with_pbf().unwrap(),
            &none,
        )),
    }
}
