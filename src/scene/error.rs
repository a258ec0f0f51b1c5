//! Errors of scenes.

use std::{fmt, io, path::PathBuf};

/// What to do about a path that leads out of the folder of the file that names it.
pub const LEADS_OUT: &str = "copy it there, or allow files outside of it";

/// Why a scene could not be loaded or compared.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The file cannot be read.
    #[error("cannot read {file}")]
    Read {
        /// Path of the file.
        file: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// A fault in the scene or in an override of it.
    #[error("{0}")]
    Fault(Box<Fault>),
    /// A malformed override.
    #[error("set {text}: {reason}")]
    Override {
        /// The override as given.
        text: String,
        /// What is wrong, and what is allowed.
        reason: String,
    },
    /// One of two texts to compare is not valid TOML.
    #[error("cannot compare scenes: {reason}")]
    NotToml {
        /// Message of the parser.
        reason: String,
    },
}

impl SceneError {
    /// Whether a path leads farther than the file may reach.
    pub fn leads_out(&self) -> bool {
        matches!(self, Self::Fault(fault) if fault.message.contains(LEADS_OUT))
    }
}

/// A fault in a file: its location, the key, what is wrong and what is allowed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// The scene file.
    pub file: PathBuf,
    /// Location in the file.
    pub place: Place,
    /// Dotted key such as `water.block[0].max`; empty if the text is not valid TOML.
    pub key: String,
    /// What is wrong, and what is allowed.
    pub message: String,
}

/// Location of a fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Place {
    /// A line of the file, counted from 1.
    Line(usize),
    /// An override, as given.
    Override(String),
    /// No location, because something is missing.
    Whole,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        match &self.place {
            Place::Line(line) => write!(f, ":{line}")?,
            Place::Override(text) => write!(f, " with {text}")?,
            Place::Whole => {}
        }
        if !self.key.is_empty() {
            write!(f, ": {}", self.key)?;
        }
        write!(f, ": {}", self.message)
    }
}
