//! Particle frames on disk: the file that stands between baking and everything after it.
//!
//! ```text
//! cache/wave-city/pbf/
//!   manifest.json   what was baked, by what, on what; written once, last in a cache's creation
//!   scene.toml      the scene as baked; the manifest holds its hash
//!   assets/         copies of the files that the scene names; the manifest holds their hashes
//!   frames.jsonl    the ledger: one line a frame, chained by BLAKE3 back to the manifest
//!   frames/wave-city.0000.ply   the start; 0001 is the first frame after it. A bake that began from a frame of another
//!                   cache starts with that number
//!   grids/wave-city.0000.vdb    where the scene asks: level set "surface", staggered "vel"
//!   probes/elevation-1.csv      where the scene has probes: a row a frame, from the ledger
//!   timings.jsonl   seconds, which no two bakes share: in no hash, in no comparison
//!   failed/         of the frame that a bake broke off at: its scene, the state that it began with, what was seen
//!   lock            held by the one writer
//! ```
//!
//! The same scene, binary and adapter give the same bytes in every file but `timings.jsonl`; `failed/` has checksums of its own, and goes when a bake gets past its frame.
//!
//! A frame, and its grids, go to a temporary file, to the platter, to their name, and only then into the ledger. So
//! the ledger never names a frame that is not whole, whatever kills the process, and what a crash can
//! leave (a temporary file, a frame without a line, half a line) is cleared by
//! [`CacheWriter::resume`].
//!
//! The chain finds damage and edits. It is no signature, and a ledger cut at the end of a line reads
//! as a bake that stopped there.

mod disk;
mod error;
pub mod failed;
pub mod frame;
mod grids;
mod ledger;
mod manifest;
mod probes;
mod reader;
pub mod vdb;
mod writer;

pub use disk::directory_hash;
pub use error::CacheError;
pub use frame::file_name;
pub use grids::GridRecord;
pub use ledger::{Clock, Entry};
pub use manifest::{FileRecord, Manifest, Parent};
pub use probes::{ProbeRecord, ProbeValues};
pub use reader::{CacheReader, Problem, VerifyReport, survey};
pub use writer::{Asset, CacheWriter, Summary};

use std::path::{Path, PathBuf};

/// Whether `dir` holds a cache whose creation was finished, so that a bake must resume it or leave it.
pub fn exists(dir: &Path) -> bool {
    dir.join(manifest::FILE).is_file()
}

/// The cache that a path lies in, or would lie in, links followed; also one whose creation has only begun.
pub fn around(path: &Path) -> Option<PathBuf> {
    let mut real = std::path::absolute(path).ok()?;
    // What is not there yet lies in the first folder above it that is.
    while real.canonicalize().map(|found| real = found).is_err() {
        if !real.pop() {
            return None;
        }
    }
    let is_cache =
        |dir: &Path| (exists(dir) && dir.join(ledger::FILE).is_file()) || disk::is_begun(dir);
    real.ancestors()
        .find(|dir| is_cache(dir))
        .map(Path::to_owned)
}
