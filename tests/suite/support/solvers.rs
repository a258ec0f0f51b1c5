//! A scene by its own solver, on the GPU and in f64.

use swell::{
    domain::{boundary::Boundary, particles::Particles, solver::Solver},
    gpu::adapter::Context,
    reference,
    scene::{Method, Scene},
};

/// The state of particles after so many frames.
pub fn on_gpu(context: &Context, scene: &Scene, particles: &Particles, frames: u32) -> Particles {
    match scene.solver.method {
        Method::Flip => super::flip::run(context, scene, particles, frames).0,
        Method::Pbf => super::run(context, scene, particles, frames).0,
    }
}

/// The same by the reference.
pub fn on_cpu(scene: &Scene, particles: &Particles, frames: u32) -> Particles {
    let none = Boundary::default();
    let advance = |solver: &mut dyn Solver<Error = reference::ReferenceError>| {
        solver.load(0, particles).unwrap();
        let states = (0..frames).map(|_| solver.advance().unwrap().0);
        states.last().unwrap()
    };
    match scene.solver.method {
        Method::Flip => advance(&mut reference::flip::Flip::new(scene, &none)),
        Method::Pbf => advance(&mut reference::pbf::Pbf::new(scene, &none)),
    }
}
