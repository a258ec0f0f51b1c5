//! The whitewater stream that a look draws.

use std::path::{Path, PathBuf};

use crate::{derived::is_of, whitewater::directory};
use swell_cache::{CacheError, CacheReader};
use swell_domain::particles::Particles;

/// Why a stream cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StreamError {
    /// There is no stream of that name.
    #[error(
        "the look draws whitewater `{stream}`, but {} does not exist: make the stream first",
        directory.display()
    )]
    Missing {
        /// Name of the stream.
        stream: String,
        /// Where it would be.
        directory: PathBuf,
        /// Directory of the bake's cache.
        cache: PathBuf,
    },
    /// The stream lacks a frame, or has one made from other water.
    #[error("{}: frame {frame} {how}: make it again", directory.display())]
    Frame {
        /// Directory of the stream.
        directory: PathBuf,
        /// The frame.
        frame: u32,
        /// What is wrong with it.
        how: &'static str,
    },
    /// Reading the stream failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
}

/// A whitewater stream beside the water.
pub(super) struct WhitewaterStream {
    stream: CacheReader,
}

impl WhitewaterStream {
    /// Opens the stream and checks that it has all requested frames, each made from the water that
    /// is now in `water`.
    pub(super) fn open(
        cache: &Path,
        stream: &str,
        water: &CacheReader,
        frames: &[u32],
    ) -> Result<Self, StreamError> {
        let directory = directory(cache, stream);
        if !swell_cache::exists(&directory) {
            return Err(StreamError::Missing {
                stream: stream.to_owned(),
                directory,
                cache: cache.to_owned(),
            });
        }
        let stream = CacheReader::open(&directory)?;
        for &frame in frames {
            let how = match stream.has_particles(frame) {
                false => "is missing from it",
                true if !is_of(stream.entry(frame)?, water) => {
                    "was made from water that no longer exists"
                }
                true => continue,
            };
            return Err(StreamError::Frame {
                directory,
                frame,
                how,
            });
        }
        Ok(Self { stream })
    }

    pub(super) fn read(&self, frame: u32) -> Result<Particles, CacheError> {
        self.stream.read(frame)
    }

    pub(super) fn frame_hash(&self, frame: u32) -> Result<&str, CacheError> {
        self.stream.frame_hash(frame)
    }
}
