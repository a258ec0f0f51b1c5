//! What can be wrong with a scene.

use std::{fmt, io, path::PathBuf};

/// Why a scene could not be loaded or compared.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read {file}")]
    Read {
        /// Which file.
        file: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// Something in the scene, or in an override of it.
    #[error("{0}")]
    Fault(Box<Fault>),
    /// An override that is none.
    #[error("--set {text}: {reason}")]
    Override {
        /// As given.
        text: String,
        /// What is wrong, and what is allowed.
        reason: String,
    },
    /// One of two texts to compare is no TOML.
    #[error("cannot compare scenes: {reason}")]
    NotToml {
        /// The parser's complaint.
        reason: String,
    },
}

/// One fault of a scene: where, which key, what is wrong and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The scene file.
    pub file: PathBuf,
    /// Where in it.
    pub place: Place,
    /// Dotted, as in `water.block[0].max`; empty where the text is no TOML.
    pub key: String,
    /// What is wrong, and what is allowed.
    pub message: String,
}

/// Where a fault stands.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of the file, from 1.
    Line(usize),
    /// An override, as given.
    Override(String),
    /// Nowhere: something is missing.
    Whole,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        match &self.place {
            Place::Line(line) => write!(f, ":{line}")?,
            Place::Override(text) => write!(f, " with --set {text}")?,
            Place::Whole => {}
        }
        if !self.key.is_empty() {
            write!(f, ": {}", self.key)?;
        }
        write!(f, ": {}", self.message)
    }
}
