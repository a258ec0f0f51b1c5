//! The keys of all files that users write, each declared once: name, type, range, unit, default,
//! whether it affects the physics, and purpose.
//!
//! Derived from a table are the struct that it is read into (`super::declare`), validation and the
//! wording of faults (`super::document`), the defaults, the scene as written into a cache
//! (`super::write`), the comparison on resume (`super::difference`), and the reference page
//! ([`page`], printed by `swell keys`).

mod body;
pub(super) mod budget;
mod motion;
mod outputs;
mod page;
mod scene;
mod solver;
mod study;
#[cfg(test)]
mod tests;
mod whitewater;

use super::{declare::Keyed, key::Key, look, tolerance};

pub use page::page;

pub(super) use body::{BodySpec, DEGREES, HingeSpec, MooringSpec};
pub(super) use budget::BudgetSpec;
pub(super) use motion::{MotionKind, SolidMotionSpec, TrackSpec, TurnSpec, WallMotionSpec};
pub(super) use outputs::{
    BearerSpec, COMPRESSIONS, FRONT_QUANTILE, GridsSpec, KeepSpec, ProbeSpec, RUN_UP_QUANTILE,
};
pub(super) use scene::{
    AbsorptionSpec, BoxSpec, DomainSpec, DrainSpec, EmitterSpec, FilesSpec, ForceSpec, MeshSpec,
    ScaleSpec, SceneSpec, SequenceSpec, SolidSpec, SwarmSpec, WALLS, WaterSpec, WaveMakerSpec,
};
pub(super) use solver::{CHEBYSHEV_RELAXATION, PbfSpec, RELAXATION, SolverSpec};
pub(super) use study::KEYS as STUDY;
pub(super) use whitewater::{
    BubblesSpec, EmissionSpec, FoamSpec, KillSpec, SpraySpec, WhitewaterSpec,
};

/// Keys of a scene.
pub(super) const SCENE: &[Key] = SceneSpec::KEYS;

/// Keys of whitewater settings.
pub(super) const WHITEWATER: &[Key] = WhitewaterSpec::KEYS;

/// A kind of file with keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum File {
    /// A scene file.
    Scene,
    /// A look file.
    Look,
    /// A study file.
    Study,
    /// A tolerance file.
    Tolerance,
    /// A whitewater settings file.
    Whitewater,
}

impl File {
    /// All kinds with the names used on the command line.
    pub const NAMED: [(&'static str, Self); 5] = [
        ("scene", Self::Scene),
        ("look", Self::Look),
        ("study", Self::Study),
        ("tolerance", Self::Tolerance),
        ("whitewater", Self::Whitewater),
    ];

    /// Returns its keys in the order of the page.
    pub(super) fn keys(self) -> &'static [Key] {
        match self {
            Self::Scene => SCENE,
            Self::Look => look::KEYS,
            Self::Study => STUDY,
            Self::Tolerance => tolerance::KEYS,
            Self::Whitewater => WHITEWATER,
        }
    }
}

/// Returns the dotted names of all keys, including tables.
#[cfg(test)]
pub(super) fn paths(keys: &'static [Key]) -> Vec<String> {
    let of = |key: &'static Key| {
        let below = paths(key.below()).into_iter();
        let below = below.map(|path| format!("{}.{path}", key.name));
        std::iter::once(key.name.to_owned()).chain(below)
    };
    keys.iter().flat_map(of).collect()
}
