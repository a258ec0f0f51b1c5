//! The keys of every file that a user writes, each declared once: name, type, range, unit, default, whether it is physics,
//! what it is for.
//!
//! From these tables follow what a file may say and how a fault is worded (`super::document`), the defaults, the scene
//! as a cache has it (`super::write`), what a resume compares (`super::difference`), and the reference page
//! ([`page`], which `swell keys` prints).

mod motion;
mod page;
mod scene;
mod study;
#[cfg(test)]
mod tests;

use super::{key::Key, look, tolerance, whitewater};

pub use page::page;

pub(super) use scene::KEYS as SCENE;
pub(super) use study::KEYS as STUDY;

/// A kind of file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum File {
    /// A scene.
    Scene,
    /// A look.
    Look,
    /// A study.
    Study,
    /// A tolerance file.
    Tolerance,
    /// Settings of whitewater.
    Whitewater,
}

impl File {
    /// With the names that the command line uses.
    pub const NAMED: [(&'static str, Self); 5] = [
        ("scene", Self::Scene),
        ("look", Self::Look),
        ("study", Self::Study),
        ("tolerance", Self::Tolerance),
        ("whitewater", Self::Whitewater),
    ];

    /// Its keys, in the order of the page.
    pub(super) fn keys(self) -> &'static [Key] {
        match self {
            Self::Scene => SCENE,
            Self::Look => look::KEYS,
            Self::Study => STUDY,
            Self::Tolerance => tolerance::KEYS,
            Self::Whitewater => whitewater::KEYS,
        }
    }
}

/// Dotted names of all keys, tables included.
#[cfg(test)]
pub(super) fn paths(keys: &'static [Key]) -> Vec<String> {
    let of = |key: &'static Key| {
        let below = paths(key.below()).into_iter();
        let below = below.map(|path| format!("{}.{path}", key.name));
        std::iter::once(key.name.to_owned()).chain(below)
    };
    keys.iter().flat_map(of).collect()
}
