//! Passes and buffers that each effect adds to the solvers, one file per effect.
//!
//! Passes bind buffers by name and run in order. PBF runs them after the velocity update; FLIP runs
//! them on the grid before the projection, on the grid between two projections, or on the particles
//! before the transfer to the grid.

pub mod forces;
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
    /// FLIP only: passes after the transfer from the grid to the particles, dispatched over cells
    /// with water.
    pub after_transfer: Vec<PassSpec>,
    /// PBF only: passes on the particles before their prediction.
    pub before_prediction: Vec<PassSpec>,
    /// PBF only: passes on the particles after the velocity update, before `passes`.
    pub after_update: Vec<PassSpec>,
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
        let hooks = [&self.on_particles, &self.after_transfer];
        let hooks = hooks
            .into_iter()
            .chain([&self.before_prediction, &self.after_update]);
        self.passes.iter().chain(hooks.flatten()).chain(between)
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

        /// Returns what the scene's forces and effects add to PBF with `particles` particles, by
        /// the effects' keys.
        pub(super) fn of_pbf(scene: &Scene, particles: usize) -> Vec<(&'static str, Addition)> {
            let mut all: Vec<_> = forces::pbf(scene, particles)
                .map(|addition| (forces::OWNER, addition))
                .into_iter()
                .collect();
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

        /// Returns what the scene's forces and effects add to FLIP, whose arrays hold `wet` cells
        /// with water and `cells` in total.
        pub(super) fn of_flip(
            scene: &Scene,
            [wet, cells]: [usize; 2],
        ) -> Vec<(&'static str, Addition)> {
            let mut all: Vec<_> = forces::flip(scene, wet)
                .map(|addition| (forces::OWNER, addition))
                .into_iter()
                .collect();
            $(all.extend(
                scene.effects.$name.iter()
                    .map(|settings| (stringify!($name), $name::flip(settings, scene, cells))),
            );)+
            all
        }
    };
}

with_effects!(additions);
