//! What each effect adds to a solver: a file an effect, for both.
//!
//! Its passes bind buffers by name and run in order: of PBF after the velocity update, of FLIP on the grid before the
//! projection, or on the particles before the grid.

mod zone;

use crate::{
    gpu::program::{BufferSpec, PassSpec, Program},
    scene::{Scene, effects::with_effects},
};

/// What an effect adds to a solver.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Addition {
    /// In the order in which they run, with their own constants.
    pub passes: Vec<PassSpec>,
    /// Of FLIP on the sorted particles, before the grid is given their velocities; over cells of water.
    pub on_particles: Vec<PassSpec>,
    /// Beyond what the solver has anyway.
    pub buffers: Vec<BufferSpec>,
}

impl Addition {
    /// Every pass.
    pub(super) fn all(&self) -> impl Iterator<Item = &PassSpec> {
        self.passes.iter().chain(&self.on_particles)
    }
}

/// An effect's pass with its constants.
fn pass(name: &'static str, constants: &[(&'static str, f64)]) -> PassSpec {
    PassSpec {
        name,
        defines: Vec::new(),
        constants: constants.to_vec(),
    }
}

/// What an effect's settings do on the device beside its passes.
trait OnDevice {
    /// Fills what its passes are told anew of each substep; `time` is the one at which velocities stand when they run, s.
    fn upload(&self, _program: &Program, _scene: &Scene, _time: f64) {}
}

macro_rules! additions {
    ($($name:ident),+ $(,)?) => {
        $(pub mod $name;)+

        /// What a scene's effects add to PBF with so many particles, by key.
        pub(super) fn of_pbf(scene: &Scene, particles: usize) -> Vec<(&'static str, Addition)> {
            let mut all = Vec::new();
            $(all.extend(scene.effects.$name.iter().map(|settings| (stringify!($name), $name::pbf(settings, scene, particles))));)+
            all
        }

        /// Fills what effects are told anew of each substep; `time` is the one at which velocities stand when their passes run, s.
        pub(super) fn upload(program: &Program, scene: &Scene, time: f64) {
            $(scene.effects.$name.iter().for_each(|settings| settings.upload(program, scene, time));)+
        }

        /// What they add to FLIP with so many cells in its arrays.
        pub(super) fn of_flip(scene: &Scene, cells: usize) -> Vec<(&'static str, Addition)> {
            let mut all = Vec::new();
            $(all.extend(scene.effects.$name.iter().map(|settings| (stringify!($name), $name::flip(settings, scene, cells))));)+
            all
        }
    };
}

with_effects!(additions);
