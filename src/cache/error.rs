//! What goes wrong with a cache.

use std::io;
use std::path::{Path, PathBuf};

use swell_domain::keep::Keep;

/// Errors of a cache. All but [`CacheError::Io`] mean that the cache is damaged or not the
/// one that was meant.
#[derive(Debug, thiserror::Error)]
pub enum CacheError {
    /// The operating system refused.
    #[error("{}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// The error of the operating system.
        source: io::Error,
    },
    /// No manifest.
    #[error("{} {why}", dir.display())]
    NotACache {
        /// The directory.
        dir: PathBuf,
        /// What is there instead.
        why: String,
    },
    /// A new bake was sent to a directory with other files in it.
    #[error(
        "{} holds files that are no cache of ours ({found}); left untouched, choose another -o",
        dir.display()
    )]
    Occupied {
        /// The directory.
        dir: PathBuf,
        /// One of them.
        found: String,
    },
    /// A new bake was sent to a directory that holds a bake.
    #[error(
        "{} already holds a cache; left untouched: --resume goes on, or choose another -o",
        dir.display()
    )]
    Exists {
        /// The directory.
        dir: PathBuf,
    },
    /// Another process writes.
    #[error("{} is being written by another bake", dir.display())]
    Locked {
        /// The directory.
        dir: PathBuf,
    },
    /// A bake cannot go on because its bytes would not follow from those before.
    #[error(
        "{} was baked with {field} = {cached}, and this run has {given}; choose another -o",
        dir.display()
    )]
    OtherScene {
        /// The directory.
        dir: PathBuf,
        /// Manifest field.
        field: String,
        /// Value in the manifest.
        cached: String,
        /// Value in this run.
        given: String,
    },
    /// A bake in an older format, which is read and not gone on with.
    #[error(
        "{} was baked in cache format {found}, and this program writes {newest}: begin from one of its frames with \
         --from {}:FRAME and another -o, or bake it anew",
        dir.display(), dir.display()
    )]
    OldFormat {
        /// The directory.
        dir: PathBuf,
        /// Its format.
        found: u32,
        /// The format that this program writes.
        newest: u32,
    },
    /// Frames that stand there were not looked at by the probes that this run has.
    #[error(
        "{} was baked with {cached}, and this run has {given}: what a probe sees while a frame is computed cannot be \
         made up afterwards; go on with the same probes, or choose another -o",
        dir.display()
    )]
    OtherProbes {
        /// The directory.
        dir: PathBuf,
        /// Value in the manifest.
        cached: String,
        /// Value in this run.
        given: String,
    },
    /// Frames that stand there follow from another frame than the one that this run is to begin from.
    #[error("{} began from {cached}, and this run from {given}; choose another -o", dir.display())]
    OtherParent {
        /// The directory.
        dir: PathBuf,
        /// Value in the manifest.
        cached: String,
        /// Value in this run.
        given: String,
    },
    /// Written in a format that this program does not read.
    #[error(
        "{} has cache format {found}, and this program reads {oldest} to {newest}: bake it anew, or use the program \
         that wrote it",
        dir.display()
    )]
    Format {
        /// The directory.
        dir: PathBuf,
        /// `format_version` as it stands.
        found: String,
        /// The first that this program reads.
        oldest: u32,
        /// The last one, which it writes.
        newest: u32,
    },
    /// A file is not what was written.
    #[error("{} is damaged: {what}", file.display())]
    Damaged {
        /// The file.
        file: PathBuf,
        /// The fault.
        what: String,
    },
    /// A frame was asked for that was not baked.
    #[error("{} has frames {first} to {last}, not {frame}", dir.display())]
    NoFrame {
        /// The directory.
        dir: PathBuf,
        /// Asked for.
        frame: u32,
        /// First one there.
        first: u32,
        /// Last one there.
        last: u32,
    },
    /// A frame was asked for whose particles the bake did not keep.
    #[error(
        "{} has no particles of frame {frame}, as its scene has [keep] particles = \"{keep}\"; the nearest frames that \
         have them are {before} and {after}",
        dir.display()
    )]
    NotKept {
        /// The directory.
        dir: PathBuf,
        /// Asked for.
        frame: u32,
        /// What the scene says.
        keep: Keep,
        /// The last one before it that has them.
        before: u32,
        /// The first one after it.
        after: u32,
    },
    /// A value that cannot be written to a cache: a bug of the caller.
    #[error("cannot be cached: {0}")]
    Unfit(String),
    /// The writer failed before and said so then.
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

/// Names the path that an [`io::Error`] keeps to itself.
pub(super) trait AtPath<T> {
    fn at(self, path: &Path) -> Result<T, CacheError>;
}

impl<T> AtPath<T> for io::Result<T> {
    fn at(self, path: &Path) -> Result<T, CacheError> {
        self.map_err(|source| CacheError::Io {
            path: path.to_owned(),
            source,
        })
    }
}
