//! What each effect adds to a solver: a file an effect, for both.
//!
//! Its passes bind buffers by name and run in order: of PBF after the velocity update, of FLIP on the grid before the
//! projection, or on the particles before the grid.

mod zone;

use swell_gpu::{
    program::{BufferSpec, PassSpec, Program},
    recording::Command,
};
use swell_scene::{Scene, effects::with_effects};

/// What an effect adds to a solver.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Addition {
    /// In the order in which they run, with their own constants.
    pub passes: Vec<PassSpec>,
    /// Of FLIP on the sorted particles, before the grid is given their velocities; over cells of water.
    pub on_particles: Vec<PassSpec>,
    /// Of FLIP on the grid, between two projections.
    pub between: Option<Between>,
    /// Beyond what the solver has anyway.
    pub buffers: Vec<BufferSpec>,
}

/// What an effect does between two projections: begins, goes to and fro as often as a substep asks for, and ends after the second.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Between {
    /// Its passes, with their own constants.
    pub passes: Vec<PassSpec>,
    /// Once, with the first to and fro.
    pub begin: Vec<Command>,
    /// Each further time.
    pub again: Vec<Command>,
    /// After the second projection.
    pub end: Vec<Command>,
}

impl Addition {
    /// Every pass.
    pub(super) fn all(&self) -> impl Iterator<Item = &PassSpec> {
        let between = self.between.iter().flat_map(|between| &between.passes);
        self.passes.iter().chain(&self.on_particles).chain(between)
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
    /// Fills what its passes are told anew of each substep: the time at which velocities stand when they run, and its length, s.
    fn upload(&self, _program: &Program, _scene: &Scene, _span: (f64, f64)) {}

    /// What it does between two projections of a substep of so many seconds.
    fn turns(&self, _scene: &Scene, _length: f64) -> Option<Turns> {
        None
    }
}

/// How an effect goes to and fro between two projections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turns {
    /// After the first one.
    pub(super) again: u32,
    /// Whether more were needed than it may take.
    pub(super) is_short: bool,
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

        /// Fills what effects are told anew of each substep: the time at which velocities stand when their passes run, and its length, s.
        pub(super) fn upload(program: &Program, scene: &Scene, span: (f64, f64)) {
            $(scene.effects.$name.iter().for_each(|settings| settings.upload(program, scene, span));)+
        }

        /// How the effect that acts between two projections goes in a substep of so many seconds, where one does.
        pub(super) fn turns(scene: &Scene, length: f64) -> Option<Turns> {
            None$(.or_else(|| scene.effects.$name.as_ref()?.turns(scene, length)))+
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
