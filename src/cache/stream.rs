//! The streams of a cache: what it keeps of every frame. Writer, reader, verification, resume and
//! comparison are all driven by the table [`STREAMS`].

use std::io::{self, Write};

use super::frame::{self, Stamp, WrittenFile, planes};
use super::grids::GridRecord;
use super::manifest::Manifest;
use super::probes::ProbeRecord;
use super::vdb;
use swell_domain::keep::Compression;
use swell_domain::particles::Particles;

/// Name of the stream that every cache has: a frame's particles, from which a bake resumes.
pub const PARTICLES: &str = "particles";
/// Name of the stream of level sets and velocity grids.
pub const GRIDS: &str = "grids";
/// Name of the stream of probe measurements.
pub const PROBES: &str = "probes";

/// Name of the stream of the bodies' states.
pub const BODIES: &str = "bodies";

/// The particle stream.
pub(super) static OF_PARTICLES: &Stream = &STREAMS[0];

/// All streams, the particles first: the other files of a frame follow from them.
pub static STREAMS: [Stream; 4] = [
    Stream {
        name: PARTICLES,
        folder: "frames",
        extension: "ply",
        content: Content::Particles,
        layout: Layout::FileAFrame(encode_particles),
        part: "field",
        parts: |_| vec!["position", "velocity"],
    },
    Stream {
        name: GRIDS,
        folder: "grids",
        extension: "vdb",
        content: Content::SparseGrids,
        layout: Layout::FileAFrame(encode_grids),
        part: "grid",
        parts: |manifest| manifest.grids.iter().flat_map(GridRecord::names).collect(),
    },
    Stream {
        name: PROBES,
        folder: "probes",
        extension: "csv",
        content: Content::Columns,
        layout: Layout::RowAFrame(|manifest| &manifest.probes),
        part: "probe",
        parts: |manifest| manifest.probes.iter().map(|probe| &*probe.name).collect(),
    },
    Stream {
        name: BODIES,
        folder: "bodies",
        extension: "csv",
        content: Content::Columns,
        layout: Layout::RowAFrame(|manifest| &manifest.bodies),
        part: "body",
        parts: |manifest| manifest.bodies.iter().map(|body| &*body.name).collect(),
    },
];

/// One kind of file that a cache keeps of its frames.
#[derive(Debug)]
pub struct Stream {
    /// Name in the ledger and in reported differences.
    pub name: &'static str,
    /// Folder of its files, relative to the cache's folder.
    pub folder: &'static str,
    /// Extension of its files, without the dot.
    pub extension: &'static str,
    /// Kind of its content.
    pub content: Content,
    /// How its files grow with the bake.
    pub(super) layout: Layout,
    /// Noun that precedes a part's name in reported differences.
    pub part: &'static str,
    /// Names of its parts in a bake with this manifest; empty if the bake does not have the stream.
    parts: fn(&Manifest) -> Vec<&str>,
}

/// Kind of a stream's content, which decides how two streams are compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Content {
    /// Particles, compared field by field and matched by id.
    Particles,
    /// Sparse grids, compared voxel by voxel.
    SparseGrids,
    /// Named columns, one row per frame, compared column by column.
    Columns,
}

/// Writes the file of a frame.
type Encode = fn(&mut dyn Write, &Manifest, &Stamp<'_>, &Particles) -> io::Result<WrittenFile>;

/// How the files of a stream grow with the bake.
#[derive(Debug)]
pub(super) enum Layout {
    /// `FOLDER/SHOT.0001.EXTENSION`: complete on disk before the ledger names it with its checksum.
    FileAFrame(Encode),
    /// `FOLDER/TABLE.EXTENSION`, one file per table for the whole bake. The values are in the
    /// ledger lines of their frames, so that the files can be rewritten from there: as rows, or
    /// as the states of bodies.
    RowAFrame(fn(&Manifest) -> &[ProbeRecord]),
}

impl Stream {
    /// The streams of a bake with this manifest.
    pub fn all(manifest: &Manifest) -> impl Iterator<Item = &'static Self> {
        STREAMS.iter().filter(|stream| stream.is_in(manifest))
    }

    /// Whether a bake with this manifest has the stream.
    pub fn is_in(&self, manifest: &Manifest) -> bool {
        !(self.parts)(manifest).is_empty()
    }

    /// Whether the stream has one file per frame, named in the ledger.
    pub fn is_by_frame(&self) -> bool {
        matches!(self.layout, Layout::FileAFrame(_))
    }

    /// Parts that `manifest` has and `other` does not: `grids`, `grid vel`, `probe gauge`.
    pub fn lone(&self, manifest: &Manifest, other: &Manifest) -> Vec<String> {
        if self.is_by_frame() && self.is_in(manifest) && !self.is_in(other) {
            return vec![self.name.to_owned()];
        }
        let others = (self.parts)(other);
        let parts = (self.parts)(manifest).into_iter();
        let lone = parts.filter(|part| !others.contains(part));
        lone.map(|name| format!("{} {name}", self.part)).collect()
    }

    /// Path of a frame's file relative to the cache's folder, with `/`:
    /// `frames/wave-city.0001.ply`, or `….ply.zst` if the manifest asks for compression.
    pub fn frame_file(&self, manifest: &Manifest, frame: u32) -> String {
        let packed = match (self.content, manifest.compression) {
            (Content::Particles, Some(Compression::Zstd)) => ".zst",
            _ => "",
        };
        let (folder, shot, extension) = (self.folder, &manifest.shot, self.extension);
        format!("{folder}/{shot}.{frame:04}.{extension}{packed}")
    }

    /// Path of a table's file relative to the cache's folder, with `/`: `probes/gauge.csv`.
    pub fn table_file(&self, table: &str) -> String {
        format!("{}/{table}.{}", self.folder, self.extension)
    }

    /// Tables of a bake with this manifest; empty for a stream with one file per frame.
    pub fn tables<'a>(&self, manifest: &'a Manifest) -> &'a [ProbeRecord] {
        match self.layout {
            Layout::FileAFrame(_) => &[],
            Layout::RowAFrame(tables) => tables(manifest),
        }
    }
}

fn encode_particles(
    mut out: &mut dyn Write,
    manifest: &Manifest,
    stamp: &Stamp<'_>,
    particles: &Particles,
) -> io::Result<WrittenFile> {
    match manifest.compression {
        Some(Compression::Zstd) => planes::encode(&mut out, stamp, particles),
        None => frame::encode(&mut out, stamp, particles),
    }
}

fn encode_grids(
    mut out: &mut dyn Write,
    manifest: &Manifest,
    stamp: &Stamp<'_>,
    particles: &Particles,
) -> io::Result<WrittenFile> {
    let Some(asked) = &manifest.grids else {
        return Err(io::Error::other("no grids are asked for"));
    };
    let grids = asked
        .grids(particles, manifest.particle_spacing)
        .moved(manifest.origin.into());
    vdb::encode(&mut out, stamp, &grids, asked.precision)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use serde_json::{Value, json};

    use super::*;

    /// Two streams in one folder would clear each other's files on resume.
    #[test]
    fn no_two_streams_share_a_name_or_a_folder() {
        let names: BTreeSet<_> = STREAMS.iter().map(|stream| stream.name).collect();
        let folders: BTreeSet<_> = STREAMS.iter().map(|stream| stream.folder).collect();
        assert_eq!((names.len(), folders.len()), (STREAMS.len(), STREAMS.len()));
    }

    /// `diff` compares one stream of particles, with the tolerance's fields and the aggregates; a
    /// second one would need its own handling there.
    #[test]
    fn one_stream_is_compared_as_particles() {
        let particles = STREAMS.iter().filter(|s| s.content == Content::Particles);
        let names: Vec<_> = particles.map(|stream| stream.name).collect();
        assert_eq!(names, [PARTICLES]);
    }

    #[test]
    fn names_of_files_are_those_that_scenes_and_scripts_know() {
        let plain = manifest("wave-city", json!(null));
        let files = STREAMS.each_ref().map(|stream| match stream.layout {
            Layout::FileAFrame(_) => stream.frame_file(&plain, 7),
            Layout::RowAFrame(_) => stream.table_file("gauge"),
        });
        assert_eq!(
            files,
            [
                "frames/wave-city.0007.ply",
                "grids/wave-city.0007.vdb",
                "probes/gauge.csv",
                "bodies/gauge.csv"
            ]
        );
        let packed = manifest("a", json!("zstd"));
        let wide = [1, 9999, 10_000].map(|frame| STREAMS[0].frame_file(&packed, frame));
        assert_eq!(
            wide,
            [
                "frames/a.0001.ply.zst",
                "frames/a.9999.ply.zst",
                "frames/a.10000.ply.zst"
            ]
        );
        assert_eq!(STREAMS[1].frame_file(&packed, 1), "grids/a.0001.vdb");
    }

    fn manifest(shot: &str, compression: Value) -> Manifest {
        serde_json::from_value(json!({
            "format_version": Manifest::FORMAT_VERSION, "program": "swell", "program_version": "0",
            "shot": shot,
            "scene_hash": "", "solver": "pbf", "device": "", "driver": "", "backend": "",
            "frames_per_second": 24.0,
            "particle_spacing": 0.1, "rest_density": 1000.0, "attributes": [], "start_particles": 0,
            "files": [],
            "compression": compression,
        }))
        .unwrap()
    }
}
