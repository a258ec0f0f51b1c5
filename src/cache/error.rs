//! Errors of reading and writing a cache.

use std::path::PathBuf;

use swell_domain::{keep::Keep, output::FileError};

/// Errors of a cache.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CacheError {
    /// The operating system refused an operation.
    #[error(transparent)]
    Io(#[from] FileError),
    /// The directory holds no manifest.
    #[error("{} {why}", dir.display())]
    NotACache {
        /// The directory.
        dir: PathBuf,
        /// What is there instead.
        why: String,
    },
    /// A new bake was sent to a directory that holds other files.
    #[error(
        "{} contains files that do not belong to a cache ({found}) and was left untouched; choose \
         another folder",
        dir.display()
    )]
    Occupied {
        /// The directory.
        dir: PathBuf,
        /// One of the other files.
        found: String,
    },
    /// A new bake was sent to a directory that already holds a bake.
    #[error(
        "{} already holds a cache and was left untouched; resume it, or choose another folder",
        dir.display()
    )]
    Exists {
        /// The directory.
        dir: PathBuf,
    },
    /// Another process is writing to the cache.
    #[error("{} is being written by another bake", dir.display())]
    Locked {
        /// The directory.
        dir: PathBuf,
    },
    /// A bake cannot be resumed because this run differs in a field that decides its bytes.
    #[error(
        "{} was baked with {field} = {cached}, and this run has {given}; choose another folder",
        dir.display()
    )]
    OtherScene {
        /// The directory.
        dir: PathBuf,
        /// Name of the manifest field.
        field: String,
        /// Value in the manifest.
        cached: String,
        /// Value in this run.
        given: String,
    },
    /// A bake in an older format, which can be read but not resumed.
    #[error(
        "{} was baked in cache format {found}, and this program writes {newest}: begin from one of \
         its frames in another folder, or bake it again",
        dir.display()
    )]
    OldFormat {
        /// The directory.
        dir: PathBuf,
        /// Format version of the cache.
        found: u32,
        /// Format version that this program writes.
        newest: u32,
    },
    /// A bake cannot be resumed with other probes: the existing frames were not observed by them.
    #[error(
        "{} was baked with {cached}, and this run has {given}: a probe records while a frame is \
         computed, not afterwards; continue with the same probes, or choose another folder",
        dir.display()
    )]
    OtherProbes {
        /// The directory.
        dir: PathBuf,
        /// The probes in the manifest, in words.
        cached: String,
        /// The probes of this run, in words.
        given: String,
    },
    /// A bake cannot be resumed because its frames began from another parent frame than this run
    /// asks for.
    #[error(
        "{} began from {cached}, and this run from {given}; choose another folder",
        dir.display()
    )]
    OtherParent {
        /// The directory.
        dir: PathBuf,
        /// The parent in the manifest, in words.
        cached: String,
        /// The parent that this run asks for, in words.
        given: String,
    },
    /// The cache has a format version that this program does not read.
    #[error(
        "{} has cache format {found}, and this program reads {oldest} to {newest}: bake it again, \
         or use the program that wrote it",
        dir.display()
    )]
    Format {
        /// The directory.
        dir: PathBuf,
        /// `format_version` as the manifest has it.
        found: String,
        /// Oldest version that this program reads.
        oldest: u32,
        /// Newest version that this program reads, which is also the one it writes.
        newest: u32,
    },
    /// The content of a file is not what was written.
    #[error("{} is damaged: {what}", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// The fault, in words.
        what: String,
    },
    /// A frame was requested that was not baked.
    #[error("{} has frames {first} to {last}, not {frame}", dir.display())]
    NoFrame {
        /// The directory.
        dir: PathBuf,
        /// The requested frame.
        frame: u32,
        /// First frame of the cache.
        first: u32,
        /// Last frame of the cache.
        last: u32,
    },
    /// A frame was requested whose particles the bake did not keep.
    #[error(
        "{} has no particles of frame {frame}, as its scene has [keep] particles = \"{keep}\"; the \
         nearest frames that have them are {before} and {after}",
        dir.display()
    )]
    NotKept {
        /// The directory.
        dir: PathBuf,
        /// The requested frame.
        frame: u32,
        /// The scene's `keep.particles`.
        keep: Keep,
        /// Last frame before the requested one that has its particles.
        before: u32,
        /// First frame after the requested one that has its particles.
        after: u32,
    },
    /// A value that cannot be written to a cache; a bug in the caller.
    #[error("cannot be cached: {0}")]
    Unfit(String),
    /// The writer failed at an earlier frame and reported its error then.
    #[error("the cache writer stopped at an earlier error")]
    Stopped,
}

impl CacheError {
    pub(super) fn damaged(file: impl Into<PathBuf>, what: impl Into<String>) -> Self {
        Self::Damaged {
            file: file.into(),
            what: what.into(),
        }
    }
}
