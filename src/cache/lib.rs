//! Particle frames on disk: the files that separate baking from everything after it.
//!
//! ```text
//! cache/wave-city/pbf/
//!   manifest.json   what was baked, by what, on what; written once, last in a cache's creation
//!   scene.toml      the scene as baked; the manifest holds its hash
//!   assets/         copies of the files that the scene names; the manifest holds their hashes
//!   frames.jsonl    the ledger: one line a frame, chained by BLAKE3 back to the manifest
//!   frames/wave-city.0000.ply   the start; 0001 is the first frame after it. A bake that
//!                   began from a frame of another cache starts with that frame's number
//!   grids/wave-city.0000.vdb    where the scene asks: level set "surface", staggered "vel"
//!   probes/elevation-1.csv      where the scene has probes: a row per frame, from the ledger
//!   bodies/crate.csv            where the scene has bodies: their states, a row per frame
//!   timings.jsonl   seconds; not reproducible, so in no hash and in no comparison
//!   failed/         the frame that a bake failed at: its scene, the state before it, the report
//!   lock            held by the one writer
//! ```
//!
//! The same scene, binary and adapter give the same bytes in every file except `timings.jsonl`.
//! `failed/` has checksums of its own and is removed when a bake gets past its frame.
//!
//! The table [`stream::STREAMS`] lists what a cache keeps of each frame and in which folder. A
//! frame's files are written to a temporary file, flushed to the disk, renamed, and only then
//! entered into the ledger. The ledger therefore never names an incomplete frame, whatever kills
//! the process, and [`CacheWriter::resume`] clears what a crash can leave: a temporary file, a
//! frame without a line, half a line.
//!
//! The hash chain detects damage and edits. It is not a signature, and a ledger cut at the end of a
//! line reads like a bake that stopped there.

mod absent;
mod bodies;
mod disk;
mod error;
pub mod failed;
mod folder;
pub mod frame;
mod grids;
mod ledger;
mod manifest;
mod probes;
mod reader;
mod record;
mod sink;
pub mod stream;
mod tables;
pub mod vdb;
mod window;
mod writer;

pub use absent::within;
pub use bodies::body_records;
pub use disk::{directory_hash, file_hash, free_bytes};
pub use error::CacheError;
pub use folder::{IntoCache, refuse_inside, refuse_occupied};
pub use grids::GridRecord;
pub use ledger::{Clock, Files, LedgerEntry};
pub use manifest::{Manifest, Parent, exists};
pub use probes::{Look, ProbeRecord, ProbeValues, Rows};
pub use reader::{CacheReader, Problem, VerifyReport, survey};
pub use record::FileRecord;
pub use sink::Summary;
pub use writer::{Asset, CacheWriter};
