//! What each effect adds to a solver: a file an effect, for both.
//!
//! Its passes bind buffers by name and run in order: of PBF after the velocity update, of FLIP on the grid before the
//! projection.

use crate::{
    gpu::program::{BufferSpec, PassSpec},
    scene::{Scene, effects::with_effects},
};

/// What an effect adds to a solver.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Addition {
    /// In the order in which they run, with their own constants.
    pub passes: Vec<PassSpec>,
    /// Beyond what the solver has anyway.
    pub buffers: Vec<BufferSpec>,
}

/// An effect's pass with its constants.
fn pass(name: &'static str, constants: &[(&'static str, f64)]) -> PassSpec {
    PassSpec {
        name,
        defines: Vec::new(),
        constants: constants.to_vec(),
    }
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

        /// What they add to FLIP with so many cells in its arrays.
        pub(super) fn of_flip(scene: &Scene, cells: usize) -> Vec<(&'static str, Addition)> {
            let mut all = Vec::new();
            $(all.extend(scene.effects.$name.iter().map(|settings| (stringify!($name), $name::flip(settings, scene, cells))));)+
            all
        }
    };
}

with_effects!(additions);
