//! What was baked, by what, on what.

use std::fmt;
use std::fs;
use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::absent;
use super::error::{AtPath, CacheError};
use super::frame::Stamp;
use super::grids::GridRecord;
use super::probes::ProbeRecord;
use super::record::{FileRecord, is_file_stem, is_relative};
use swell_domain::keep::{Compression, Keep};

/// File name of the manifest.
pub(super) const FILE: &str = "manifest.json";
/// The scene as baked.
pub(super) const SCENE: &str = "scene.toml";
/// Folder of the scene's own files.
pub(super) const ASSETS: &str = "assets";

/// Whether `dir` holds a cache whose creation was finished, so that a bake must resume it or leave it.
pub fn exists(dir: &Path) -> bool {
    dir.join(FILE).is_file()
}

/// `manifest.json`: written once, and hashed into the first line of the ledger.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// [`Manifest::FORMAT_VERSION`] of the program that wrote it.
    pub format_version: u32,
    /// `swell`.
    pub program: String,
    /// Version of the program.
    pub program_version: String,
    /// BLAKE3 of the shaders that were read from a folder, hex; absent where they were the program's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shaders: Option<String>,
    /// Shot name, which the frame files carry: letters, digits, `.`, `_`, `-`.
    pub shot: String,
    /// Hash of all that decides the physics, hex.
    pub scene_hash: String,
    /// `pbf` or `flip`.
    pub solver: String,
    /// Adapter name, or that it was the f64 reference.
    pub device: String,
    /// Driver and its version; of the reference what it was built for.
    pub driver: String,
    /// `Vulkan`, `Metal`, `Dx12`; `CPU` of the reference.
    pub backend: String,
    /// Output frames a second.
    pub frames_per_second: f64,
    /// d, metres.
    pub particle_spacing: f64,
    /// kg/m³.
    pub rest_density: f64,
    /// World position of what the solver has as [0, 0, 0], metres; absent where it is the world's own.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub origin: [f64; 3],
    /// Names of what each particle carries beside position, velocity and id; sorted by
    /// [`CacheWriter::create`](super::CacheWriter::create).
    pub attributes: Vec<String>,
    /// Grids of each frame; absent where the scene asks for no grids.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grids: Option<GridRecord>,
    /// Of which frames the particles stay; absent where those of all do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub keep: Option<Keep>,
    /// How frames are compressed; absent where they are plain PLY.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compression: Option<Compression>,
    /// Probes, which measure each frame; absent where the scene has no probe.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub probes: Vec<ProbeRecord>,
    /// The frame of another cache that this bake began from; absent where it began from its scene's start.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub parent: Option<Parent>,
    /// Warnings about the scene that were shown before the bake; absent where there were none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Particles at the start; filled in by `create`.
    pub start_particles: u64,
    /// `scene.toml` and the assets; filled in by `create`.
    pub files: Vec<FileRecord>,
}

/// A frame of another cache. The bake that began there goes on with its number and its clock, so the frame is the
/// first of both.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Parent {
    /// Shot of that cache.
    pub shot: String,
    /// Solver of that cache.
    pub solver: String,
    /// Hash of its physics, hex.
    pub scene_hash: String,
    /// Number of the frame, in both caches.
    pub frame: u32,
    /// BLAKE3 of the frame's file there, hex.
    pub blake3: String,
    /// BLAKE3 of the shaders that it was baked with, hex; absent where they were the program's own.
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

/// Fields that a resumed bake must have in common with the cache, the most telling first. The scene's hash
/// comes last: it differs where any of the fields above it that a scene sets does.
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
    /// The format that this program writes. Since 2 a line of the ledger lists its files and its rows by stream.
    pub const FORMAT_VERSION: u32 = 2;

    /// The oldest format that it reads. A bake in an older one than [`Self::FORMAT_VERSION`] is not gone on with.
    pub const OLDEST_FORMAT: u32 = 1;

    /// In the place of a solver: a stream of whitewater.
    pub const WHITEWATER: &str = "whitewater";

    /// Whether it is no bake's, but that of a stream of whitewater that was made from one.
    pub fn is_whitewater(&self) -> bool {
        self.solver == Self::WHITEWATER
    }

    /// Names of the scene's own files, as [`Asset`](super::Asset) has them.
    pub fn asset_names(&self) -> impl Iterator<Item = &str> {
        let files = self.files.iter().map(|record| &*record.file);
        files.filter_map(|file| file.strip_prefix(ASSETS)?.strip_prefix('/'))
    }

    /// Number of the first frame: 0 is a scene's own start.
    pub fn first_frame(&self) -> u32 {
        self.parent.as_ref().map_or(0, |parent| parent.frame)
    }

    /// Hash of the edited shaders that made its frames or those that they began from, hex; `None` where only the program's
    /// own did.
    pub fn edited_shaders(&self) -> Option<&str> {
        let of_parent = || self.parent.as_ref()?.shaders.as_deref();
        self.shaders.as_deref().or_else(of_parent)
    }

    /// Whether a cache whose newest frame is `newest` has the particles of this one.
    pub fn has_particles(&self, frame: u32, newest: u32) -> bool {
        frame == newest || self.keeps(frame)
    }

    /// Whether this frame's particles stay when later frames are there.
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

    /// Bytes of `manifest.json`.
    pub(super) fn to_bytes(&self) -> Result<Vec<u8>, CacheError> {
        let mut text = serde_json::to_vec_pretty(self)
            .map_err(|error| CacheError::Unfit(format!("manifest: {error}")))?;
        text.push(b'\n');
        Ok(text)
    }

    /// Reads `manifest.json` and its hash.
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

    /// Refuses `scene.toml` and the assets where one is missing or not what was written.
    pub(super) fn check_files(&self, dir: &Path) -> Result<(), CacheError> {
        self.files.iter().try_for_each(|record| record.check(dir))
    }

    /// Refuses what could not be read back, and names that lead out of the cache.
    pub(super) fn check(&self) -> Result<(), String> {
        if !is_file_stem(&self.shot) {
            return Err(format!("shot name `{}` is no file name", self.shot));
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
        ProbeRecord::check_all(&self.probes)?;
        for (i, record) in self.files.iter().enumerate() {
            let is_asset = record
                .file
                .strip_prefix(ASSETS)
                .and_then(|rest| rest.strip_prefix('/'))
                .is_some_and(is_relative);
            if record.file != SCENE && !is_asset {
                return Err(format!("file name `{}` leads elsewhere", record.file));
            }
            if self.files[..i].iter().any(|r| r.file == record.file) {
                return Err(format!("`{}` is named twice", record.file));
            }
        }
        Ok(())
    }

    /// Refuses to go on with a cache that this run would not have written.
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
        // Without a parent this run asks for none: what stands there is all that it needs.
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
