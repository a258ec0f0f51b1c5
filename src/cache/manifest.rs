//! `manifest.json`: what was baked, by which program, on which device.

use std::fmt;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::absent;
use super::error::CacheError;
use super::frame::Stamp;
use super::grids::GridRecord;
use super::probes::ProbeRecord;
use super::record::{FileRecord, is_file_stem, is_relative};
use swell_domain::{
    keep::{Compression, Keep},
    output::AtPath as _,
};

/// File name of the manifest.
pub(super) const FILE: &str = "manifest.json";
/// File name of the scene as baked.
pub(super) const SCENE: &str = "scene.toml";
/// Folder of the files that the scene names.
pub(super) const ASSETS: &str = "assets";

/// Whether `dir` holds a cache whose creation was completed, which a bake must resume or leave
/// alone.
pub fn exists(dir: &Path) -> bool {
    dir.join(FILE).is_file()
}

/// `manifest.json`: written once, and hashed into the first line of the ledger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Cache format: [`Manifest::FORMAT_VERSION`] of the program that wrote it.
    pub format_version: u32,
    /// Program name, `swell`.
    pub program: String,
    /// Version of the program.
    pub program_version: String,
    /// BLAKE3 of the shaders that were loaded from a folder, hex; absent if the built-in shaders
    /// ran.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shaders: Option<String>,
    /// Shot name, part of each frame file's name: letters, digits, `.`, `_`, `-`.
    pub shot: String,
    /// Hash of everything that decides the physics, hex.
    pub scene_hash: String,
    /// `pbf`, `flip`, [`Manifest::WHITEWATER`] or [`Manifest::WET`].
    pub solver: String,
    /// Name of the adapter, or of the f64 reference.
    pub device: String,
    /// Driver and its version; for the reference, the target it was built for.
    pub driver: String,
    /// `Vulkan`, `Metal` or `Dx12`; `CPU` for the reference.
    pub backend: String,
    /// Output frames per second.
    pub frames_per_second: f64,
    /// Particle spacing d, metres.
    pub particle_spacing: f64,
    /// Rest density, kg/m³.
    pub rest_density: f64,
    /// World position of the solver's [0, 0, 0], metres; absent if it is the world's origin.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub origin: [f64; 3],
    /// Names of the per-particle attributes besides position, velocity and id.
    /// [`CacheWriter::create`](super::CacheWriter::create) sorts them.
    pub attributes: Vec<String>,
    /// Grids of each frame; absent if the scene asks for none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grids: Option<GridRecord>,
    /// Which frames keep their particles; absent if all do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub keep: Option<Keep>,
    /// How frames are compressed; absent if they are plain PLY.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compression: Option<Compression>,
    /// Probes, which measure each frame; absent if the scene has none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub probes: Vec<ProbeRecord>,
    /// Bodies that the water moves, whose states are in the ledger, in their order; absent if the
    /// scene has none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub bodies: Vec<ProbeRecord>,
    /// The frame of another cache that this bake began from; absent if it began from its scene's
    /// start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parent: Option<Parent>,
    /// Warnings about the scene that were shown before the bake; absent if there were none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Number of particles at the start; filled in by `create`.
    pub start_particles: u64,
    /// Records of `scene.toml` and the assets; filled in by `create`.
    pub files: Vec<FileRecord>,
}

/// A frame of another cache that a bake began from. The bake continues with its frame number and
/// clock, so the frame belongs to both caches.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parent {
    /// Shot name of the other cache.
    pub shot: String,
    /// Solver of the other cache.
    pub solver: String,
    /// Hash of its physics, hex.
    pub scene_hash: String,
    /// Number of the frame, the same in both caches.
    pub frame: u32,
    /// BLAKE3 of the frame's file in the other cache, hex.
    pub blake3: String,
    /// BLAKE3 of the edited shaders that it was baked with, hex; absent if the built-in shaders
    /// ran.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shaders: Option<String>,
}

impl fmt::Display for Parent {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let hash: String = self.blake3.chars().take(16).collect();
        write!(
            f,
            "frame {} of {} {} ({hash})",
            self.frame, self.shot, self.solver
        )?;
        match &self.shaders {
            Some(shaders) => write!(f, " with shaders {shaders}, not the shipped ones"),
            None => Ok(()),
        }
    }
}

fn is_zero(origin: &[f64; 3]) -> bool {
    *origin == [0.0; 3]
}

/// Fields that a resumed bake must have in common with the cache, the most informative first. The
/// scene's hash comes last: it differs whenever a field above it that a scene sets differs.
const COMPARED: [&str; 16] = [
    "program",
    "program_version",
    "shaders",
    "solver",
    "device",
    "driver",
    "backend",
    "shot",
    "frames_per_second",
    "particle_spacing",
    "rest_density",
    "attributes",
    "grids",
    "keep",
    "compression",
    "scene_hash",
];

impl Manifest {
    /// Cache format that this program writes. From format 2 on, a line of the ledger lists its
    /// files and rows by stream.
    pub const FORMAT_VERSION: u32 = 2;

    /// Oldest cache format that this program reads. A bake in a format older than
    /// [`Self::FORMAT_VERSION`] cannot be resumed.
    pub const OLDEST_FORMAT: u32 = 1;

    /// Value of `solver` for a whitewater stream.
    pub const WHITEWATER: &str = "whitewater";

    /// Value of `solver` for a stream of the wetness of solids.
    pub const WET: &str = "wet";

    /// Whether this is the manifest of a whitewater stream made from a bake.
    pub fn is_whitewater(&self) -> bool {
        self.solver == Self::WHITEWATER
    }

    /// What this manifest's frames hold where they are a stream made from a bake; `None` for a
    /// bake.
    pub fn stream_of(&self) -> Option<&'static str> {
        match self.solver.as_str() {
            Self::WHITEWATER => Some("whitewater"),
            Self::WET => Some("wetness"),
            _ => None,
        }
    }

    /// Names of the scene's own files, relative to `assets/` as in [`Asset`](super::Asset).
    pub fn asset_names(&self) -> impl Iterator<Item = &str> {
        let files = self.files.iter().map(|record| &*record.file);
        files.filter_map(|file| file.strip_prefix(ASSETS)?.strip_prefix('/'))
    }

    /// Number of the first frame: 0 for a scene's own start, otherwise the parent's.
    pub fn first_frame(&self) -> u32 {
        self.parent.as_ref().map_or(0, |parent| parent.frame)
    }

    /// Hash of the edited shaders that made these frames or the parent's, hex; `None` if only
    /// built-in shaders ran.
    pub fn edited_shaders(&self) -> Option<&str> {
        let of_parent = || self.parent.as_ref()?.shaders.as_deref();
        self.shaders.as_deref().or_else(of_parent)
    }

    /// Whether a cache whose newest frame is `newest` has the particles of `frame`.
    pub fn has_particles(&self, frame: u32, newest: u32) -> bool {
        frame == newest || self.keeps(frame)
    }

    /// Whether the particles of `frame` are kept once later frames exist.
    pub(super) fn keeps(&self, frame: u32) -> bool {
        frame == self.first_frame() || self.keep.is_none_or(|keep| keep.keeps(frame))
    }

    /// Description for the file of this frame, at `time` seconds.
    pub(super) fn stamp(&self, frame: u32, time: f64) -> Stamp<'_> {
        Stamp {
            program: &self.program,
            program_version: &self.program_version,
            shot: &self.shot,
            frame,
            time,
            origin: self.origin.into(),
        }
    }

    /// Content of `manifest.json`.
    pub(super) fn to_bytes(&self) -> Result<Vec<u8>, CacheError> {
        let mut text = serde_json::to_vec_pretty(self)
            .map_err(|error| CacheError::Unfit(format!("manifest: {error}")))?;
        text.push(b'\n');
        Ok(text)
    }

    /// Reads and checks `manifest.json` and returns its hash as well.
    pub(super) fn read(dir: &Path) -> Result<(Self, blake3::Hash), CacheError> {
        if !exists(dir) {
            return Err(CacheError::NotACache {
                dir: dir.to_owned(),
                why: absent::why_none(dir, &exists),
            });
        }
        let path = dir.join(FILE);
        let bytes = fs::read(&path).at(&path)?;
        let value: Value = serde_json::from_slice(&bytes)
            .map_err(|error| CacheError::damaged(&path, error.to_string()))?;
        let found = &value["format_version"];
        let formats = u64::from(Self::OLDEST_FORMAT)..=u64::from(Self::FORMAT_VERSION);
        if !found.as_u64().is_some_and(|found| formats.contains(&found)) {
            return Err(CacheError::Format {
                dir: dir.to_owned(),
                found: found.to_string(),
                oldest: Self::OLDEST_FORMAT,
                newest: Self::FORMAT_VERSION,
            });
        }
        let manifest: Self = serde_json::from_value(value)
            .map_err(|error| CacheError::damaged(&path, error.to_string()))?;
        manifest
            .check()
            .map_err(|what| CacheError::damaged(&path, what))?;
        Ok((manifest, blake3::hash(&bytes)))
    }

    /// The record of `scene.toml`.
    pub(super) fn scene_record(&self, dir: &Path) -> Result<&FileRecord, CacheError> {
        self.files
            .iter()
            .find(|record| record.file == SCENE)
            .ok_or_else(|| CacheError::damaged(dir.join(FILE), "it names no scene.toml"))
    }

    /// Checks that `scene.toml` and the assets exist and are what was written.
    pub(super) fn check_files(&self, dir: &Path) -> Result<(), CacheError> {
        self.files.iter().try_for_each(|record| record.check(dir))
    }

    /// Refuses values that could not be read back, and names that lead out of the cache.
    pub(super) fn check(&self) -> Result<(), String> {
        if !is_file_stem(&self.shot) {
            return Err(format!("shot name `{}` is not a file name", self.shot));
        }
        for (name, value) in [
            ("frames_per_second", self.frames_per_second),
            ("particle_spacing", self.particle_spacing),
            ("rest_density", self.rest_density),
        ] {
            if !value.is_finite() {
                return Err(format!("{name} is {value}"));
            }
        }
        if let Some(grids) = &self.grids {
            grids.check()?;
        }
        ProbeRecord::check_all(&self.probes, "probe")?;
        ProbeRecord::check_all(&self.bodies, "body")?;
        for (i, record) in self.files.iter().enumerate() {
            let is_asset = record
                .file
                .strip_prefix(ASSETS)
                .and_then(|rest| rest.strip_prefix('/'))
                .is_some_and(is_relative);
            if record.file != SCENE && !is_asset {
                return Err(format!(
                    "file name `{}` leads out of the cache",
                    record.file
                ));
            }
            if self.files[..i].iter().any(|r| r.file == record.file) {
                return Err(format!("`{}` is listed twice", record.file));
            }
        }
        Ok(())
    }

    /// Refuses to resume a cache that this run would not have written.
    pub(super) fn expect(&self, dir: &Path, given: &Self) -> Result<(), CacheError> {
        if self.format_version != given.format_version {
            return Err(CacheError::OldFormat {
                dir: dir.to_owned(),
                found: self.format_version,
                newest: given.format_version,
            });
        }
        let fields = |manifest: &Self| {
            let mut sorted = manifest.clone();
            sorted.attributes.sort_unstable();
            serde_json::to_value(sorted)
                .map_err(|error| CacheError::Unfit(format!("manifest: {error}")))
        };
        let (cached, given_fields) = (fields(self)?, fields(given)?);
        // A run without a parent makes no demand: the existing frames are all it needs.
        if given.parent.is_some() && given.parent != self.parent {
            let name = |parent: &Option<Parent>| match parent {
                None => "the start of its scene".to_owned(),
                Some(parent) => parent.to_string(),
            };
            return Err(CacheError::OtherParent {
                dir: dir.to_owned(),
                cached: name(&self.parent),
                given: name(&given.parent),
            });
        }
        match COMPARED.iter().find(|&&f| cached[f] != given_fields[f]) {
            None if self.probes != given.probes => Err(CacheError::OtherProbes {
                dir: dir.to_owned(),
                cached: ProbeRecord::list(&self.probes),
                given: ProbeRecord::list(&given.probes),
            }),
            None => Ok(()),
            Some(&field) => Err(CacheError::OtherScene {
                dir: dir.to_owned(),
                field: field.to_owned(),
                cached: shown(field, &cached[field]),
                given: shown(field, &given_fields[field]),
            }),
        }
    }
}

/// A field's value in words.
fn shown(field: &str, value: &Value) -> String {
    match (field, value) {
        ("shaders", Value::Null) => "the shipped ones".to_owned(),
        ("shaders", Value::String(hash)) => format!("edited ones ({hash})"),
        ("keep", Value::Null) => "\"all\"".to_owned(),
        (_, Value::Null) => "none".to_owned(),
        (_, value) => value.to_string(),
    }
}
