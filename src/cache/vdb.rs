//! A frame's grids as an OpenVDB file.

use std::io::{self, Write};

use glam::DVec3;

use super::frame::{Stamp, WrittenFile};
use swell_domain::{
    sparse_grid::{Precision, SparseGrid},
    vdb::{self, Metadata, VdbGrid},
};

/// Grids of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grids {
    /// Level set `surface`, metres.
    pub surface: Option<SparseGrid<f32>>,
    /// Staggered velocity grid `vel`, m/s.
    pub velocity: Option<SparseGrid<[f32; 3]>>,
}

impl Grids {
    /// The grids translated by `way`, metres.
    #[must_use]
    pub fn moved(mut self, way: DVec3) -> Self {
        if let Some(grid) = &mut self.surface {
            grid.origin += way;
        }
        if let Some(grid) = &mut self.velocity {
            grid.origin += way;
        }
        self
    }
}

/// Writes one file.
///
/// # Errors
/// Those of `out`.
pub fn encode(
    out: &mut impl Write,
    stamp: &Stamp<'_>,
    grids: &Grids,
    precision: Precision,
) -> io::Result<WrittenFile> {
    let surface = grids
        .surface
        .iter()
        .map(|it| VdbGrid::LevelSet("surface", it));
    let velocity = grids
        .velocity
        .iter()
        .map(|it| VdbGrid::Staggered("vel", it));
    let bytes = file(
        stamp,
        &surface.chain(velocity).collect::<Vec<_>>(),
        precision,
    );
    out.write_all(&bytes)?;
    Ok(WrittenFile {
        bytes: bytes.len() as u64,
        hash: blake3::hash(&bytes),
    })
}

/// Returns the file of a frame with any grids.
pub fn file(stamp: &Stamp<'_>, grids: &[VdbGrid<'_>], precision: Precision) -> Vec<u8> {
    let program = format!("{} {}", stamp.program, stamp.program_version);
    let metadata = [
        ("creator", Metadata::Text(program)),
        ("frame", Metadata::Int(stamp.frame as i32)),
        ("shot", Metadata::Text(stamp.shot.to_owned())),
        ("time", Metadata::Double(stamp.time)),
    ];
    vdb::encode(&metadata, grids, precision)
}

/// Hash of the values at this precision, independent of frame, shot and program.
pub fn content_hash(grids: &Grids, precision: Precision) -> io::Result<blake3::Hash> {
    let stamp = Stamp {
        program: "",
        program_version: "",
        shot: "",
        frame: 0,
        time: 0.0,
        origin: DVec3::ZERO,
    };
    encode(&mut io::sink(), &stamp, grids, precision).map(|written| written.hash)
}
