//! Streams that are made from a bake: caches of their own, in a folder of the bake's. Each frame
//! records the frame of the bake that it was made from.

pub(crate) mod water;

use std::path::{Path, PathBuf};

use swell_cache::{
    Asset, CacheError, CacheReader, CacheWriter, Clock, LedgerEntry, Manifest, exists,
};
use swell_domain::{output, particles::Particles};

use super::Blame;

/// Key of a frame's report: the chained hash of the bake's frame.
pub(crate) const WATER: &str = "water";

/// Why a stream could not be made from a bake.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DerivedError {
    /// Reading or writing the bake's or the stream's cache failed.
    #[error(transparent)]
    Cache(#[from] CacheError),
    /// The given cache is itself a stream, not a bake.
    #[error("{} is a stream of {of}; give the cache that it was made from", directory.display())]
    IsStream {
        /// The given cache.
        directory: PathBuf,
        /// What it holds.
        of: &'static str,
    },
    /// The bake does not have the requested frame.
    #[error("frame {asked} was requested, but the bake has frames {first} to {last}")]
    NoFrame {
        /// The requested frame.
        asked: u32,
        /// First frame of the bake.
        first: u32,
        /// Last frame of the bake.
        last: u32,
    },
    /// The existing stream was made differently.
    #[error("{} was made {how}; choose another name, or overwrite it", directory.display())]
    Other {
        /// Directory of the stream.
        directory: PathBuf,
        /// What differs, in words.
        how: &'static str,
    },
    /// A stream that cannot be removed.
    #[error("cannot remove {}: {source}", directory.display())]
    Remove {
        /// Directory of the stream.
        directory: PathBuf,
        /// The system's error.
        source: std::io::Error,
    },
}

impl DerivedError {
    fn other(directory: &Path, how: &'static str) -> Self {
        Self::Other {
            directory: directory.to_owned(),
            how,
        }
    }
}

impl From<&DerivedError> for Blame {
    fn from(error: &DerivedError) -> Self {
        match error {
            DerivedError::Cache(error) => error.into(),
            DerivedError::Other { .. } | DerivedError::Remove { .. } => Self::Files,
            DerivedError::IsStream { .. } | DerivedError::NoFrame { .. } => Self::Input,
        }
    }
}

/// Whether a stream's frame was made from the frame of this number in `cache`; the first frame
/// depends on none before it.
pub fn is_of(frame: &LedgerEntry, cache: &CacheReader) -> bool {
    let now = cache.entry(frame.frame).map(|entry| &*entry.chain).ok();
    frame.frame == cache.first_frame() || frame.report[WATER].as_str() == now
}

/// Opens the bake in `cache`, and determines the last frame to make: `last`, or the bake's.
pub(crate) fn bake(cache: &Path, last: Option<u32>) -> Result<(CacheReader, u32), DerivedError> {
    let bake = CacheReader::open(cache)?;
    if let Some(of) = bake.manifest().stream_of() {
        return Err(DerivedError::IsStream {
            directory: cache.to_owned(),
            of,
        });
    }
    let (first, newest) = (bake.first_frame(), bake.last_frame());
    let asked = last.unwrap_or(newest);
    match (first..=newest).contains(&asked) {
        true => Ok((bake, asked)),
        false => Err(DerivedError::NoFrame {
            asked,
            first,
            last: newest,
        }),
    }
}

/// The existing stream, if `hash` is that of what it was made from; `None` if there is none or it
/// is to be overwritten.
pub(crate) fn standing(
    directory: &Path,
    hash: &str,
    overwrite: bool,
) -> Result<Option<CacheReader>, DerivedError> {
    if overwrite || !exists(directory) {
        return Ok(None);
    }
    let stream = CacheReader::open(directory)?;
    match stream.manifest().scene_hash == hash {
        true => Ok(Some(stream)),
        false => Err(DerivedError::other(
            directory,
            "with other settings, or from another bake",
        )),
    }
}

/// Removes a stream that is to be overwritten.
pub(crate) fn remove(directory: &Path) -> Result<(), DerivedError> {
    if !exists(directory) {
        return Ok(());
    }
    output::remove_folder(directory).map_err(|error| DerivedError::Remove {
        directory: directory.to_owned(),
        source: error.source,
    })
}

/// The manifest of a stream that the CPU makes: that of the bake with the fields that differ.
pub(crate) fn manifest(bake: &Manifest, kind: &str, hash: String, attributes: &[&str]) -> Manifest {
    Manifest {
        format_version: Manifest::FORMAT_VERSION,
        program: swell_domain::PROGRAM.into(),
        program_version: swell_domain::VERSION.into(),
        shaders: None,
        scene_hash: hash,
        solver: kind.to_owned(),
        device: "CPU".to_owned(),
        driver: String::new(),
        backend: "CPU".to_owned(),
        attributes: attributes.iter().map(|&it| it.to_owned()).collect(),
        grids: None,
        probes: Vec::new(),
        bodies: Vec::new(),
        warnings: Vec::new(),
        ..bake.clone()
    }
}

/// Creates a stream of the bake `cache` with its first frame. Beside `own`, it gets the assets that
/// the bake's scene names, so that it may be moved.
pub(crate) fn create(
    directory: &Path,
    manifest: Manifest,
    cache: &CacheReader,
    own: Vec<Asset>,
    (clock, first): (Clock, &Particles),
) -> Result<CacheWriter, DerivedError> {
    let mut assets = own;
    for name in cache.manifest().asset_names() {
        assets.push(Asset {
            name: name.to_owned(),
            bytes: cache.asset(name)?,
        });
    }
    let scene = cache.scene_toml();
    match CacheWriter::create(
        directory,
        manifest,
        scene,
        &assets,
        clock,
        first,
        &Vec::new(),
    ) {
        Err(CacheError::Exists { .. }) => Err(DerivedError::other(
            directory,
            "meanwhile, by another process",
        )),
        created => Ok(created?),
    }
}

/// Opens a stream of the bake `cache` to continue it; returns its last frame too.
pub(crate) fn resume(
    directory: &Path,
    manifest: &Manifest,
    cache: &CacheReader,
) -> Result<(CacheWriter, LedgerEntry, Particles), DerivedError> {
    let (writer, entry, last) = CacheWriter::resume(directory, manifest)?;
    match is_of(&entry, cache) {
        true => Ok((writer, entry, last)),
        false => Err(DerivedError::other(
            directory,
            "from water that no longer exists",
        )),
    }
}
