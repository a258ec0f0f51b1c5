//! Passes and buffers that each effect adds to the solvers, one file per effect.
//!
//! Passes bind buffers by name and run in order. PBF runs them after the velocity update; FLIP runs
//! them on the grid before the projection, on the grid between two projections, or on the particles
//! before the transfer to the grid.

mod zone;

use swell_gpu::{
    buffer::BufferSpec,
    program::{PassSpec, Program},
    recording::Command,
};
use swell_scene::{Scene, effects::with_effects};

/// Passes and buffers that an effect adds to a solver.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Addition {
    /// Passes in the order in which they run, with the effect's own constants.
    pub passes: Vec<PassSpec>,
    /// FLIP only: passes on the sorted particles before the transfer to the grid, dispatched over
    /// cells with water.
    pub on_particles: Vec<PassSpec>,
    /// FLIP only: passes on the grid between two projections.
    pub between: Option<Between>,
    /// Buffers that the solver itself does not have.
    pub buffers: Vec<BufferSpec>,
}

/// Work of an effect between two projections: an iterative solve, and a step after the second
/// projection.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Between {
    /// Passes, with the effect's own constants.
    pub passes: Vec<PassSpec>,
    /// Commands that start the solve, with the first double iteration.
    pub begin: Vec<Command>,
    /// Commands of each further double iteration.
    pub again: Vec<Command>,
    /// Commands after the second projection.
    pub end: Vec<Command>,
}

impl Addition {
    /// Iterates over all passes.
    pub(super) fn all(&self) -> impl Iterator<Item = &PassSpec> {
        let between = self.between.iter().flat_map(|between| &between.passes);
        self.passes.iter().chain(&self.on_particles).chain(between)
    }
}

fn pass(name: &'static str, constants: &[(&'static str, f64)]) -> PassSpec {
    PassSpec {
        name,
        defines: Vec::new(),
        constants: constants.to_vec(),
    }
}

/// Host-side work of an effect, besides its passes.
trait OnDevice {
    /// Uploads data that changes with the substep. `_span` is the time at which the effect's passes
    /// evaluate velocities, and the length of the substep, seconds.
    fn upload(&self, _program: &Program, _scene: &Scene, _span: (f64, f64)) {}

    /// Returns the iterations between two projections for a substep of `_length` seconds; `None`
    /// for an effect without such a solve.
    fn turns(&self, _scene: &Scene, _length: f64) -> Option<Turns> {
        None
    }
}

/// Iterations of an implicit solve between two projections.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Turns {
    /// Double iterations after the first one.
    pub(super) again: u32,
    /// Whether the solve needs more iterations than the settings allow.
    pub(super) is_short: bool,
}

macro_rules! additions {
    ($($name:ident),+ $(,)?) => {
        $(pub mod $name;)+

        /// Returns what the scene's effects add to PBF with `particles` particles, by the effects'
        /// keys.
        pub(super) fn of_pbf(scene: &Scene, particles: usize) -> Vec<(&'static str, Addition)> {
            let mut all = Vec::new();
            $(all.extend(
                scene.effects.$name.iter()
                    .map(|settings| (stringify!($name), $name::pbf(settings, scene, particles))),
            );)+
            all
        }

        /// Uploads the effects' data that changes with the substep. `span` is the time at which
        /// their passes evaluate velocities, and the length of the substep, seconds.
        pub(super) fn upload(program: &Program, scene: &Scene, span: (f64, f64)) {
            $(
                scene.effects.$name.iter()
                    .for_each(|settings| settings.upload(program, scene, span));
            )+
        }

        /// Returns the iterations of the effect that acts between two projections, if there is one,
        /// for a substep of `length` seconds.
        pub(super) fn turns(scene: &Scene, length: f64) -> Option<Turns> {
            None$(.or_else(|| scene.effects.$name.as_ref()?.turns(scene, length)))+
        }

        /// Returns what the scene's effects add to FLIP, whose arrays hold `cells` cells.
        pub(super) fn of_flip(scene: &Scene, cells: usize) -> Vec<(&'static str, Addition)> {
            let mut all = Vec::new();
            $(all.extend(
                scene.effects.$name.iter()
                    .map(|settings| (stringify!($name), $name::flip(settings, scene, cells))),
            );)+
            all
        }
    };
}

with_effects!(additions);
