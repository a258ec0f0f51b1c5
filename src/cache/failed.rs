//! `failed/` in a cache's folder: the state before the step that could not be computed, so that the
//! step can be replayed.
//!
//! The ledger does not name it. Its report is written last and holds the checksums of the other two
//! files and its own. A bake that gets past the frame removes the folder.

use std::{fs, path::Path};

use serde::Deserialize as _;
use serde_json::{Map, Value, json};

use super::{
    error::CacheError,
    frame::{self, Stamp},
    manifest,
    record::FileRecord,
};
use swell_domain::{
    absorber::AbsorberStates,
    body::BodyState,
    output::{self, AtPath as _},
    particles::Particles,
};

/// Name of the folder in the cache.
pub const FAILED: &str = "failed";
const REPORT: &str = "report.json";
const START: &str = "start.ply";
/// Key of the report: records of the other files.
const FILES: &str = "files";
/// Key of the report: BLAKE3 of all its other fields.
const CHECKSUM: &str = "blake3";
/// Key of the report: the absorber state at the start; absent where no wall absorbs.
const WALLS: &str = "walls";
/// Key of the report: the bodies at the start; absent where there are none.
const BODIES: &str = "bodies";

/// Key of the report: length of the substep that ended in the start state, seconds.
const SUBSTEP: &str = "substep";

/// A frame that could not be computed.
#[derive(Clone, Debug, PartialEq)]
pub struct Failed {
    /// The scene of that run with every default written out; its mesh files are in the enclosing
    /// cache.
    pub scene_toml: String,
    /// The state that the frame began with: that of the last good frame.
    pub start: Particles,
    /// Number of the last good frame.
    pub last_frame: u32,
    /// Machine-readable report of the failed check, a JSON object. On disk it also has `files` and
    /// `blake3`.
    pub report: Value,
}

/// Whether `dir` is a folder of this kind.
pub fn is_failed(dir: &Path) -> bool {
    dir.join(REPORT).is_file() && dir.join(START).is_file()
}

/// Writes `failed/` in the cache at `cache` and replaces an existing one.
///
/// # Errors
/// [`CacheError::Io`]; [`CacheError::Unfit`] if the report is not a JSON object.
pub fn write(cache: &Path, failed: &Failed, stamp: &Stamp<'_>) -> Result<(), CacheError> {
    remove(cache)?;
    let dir = cache.join(FAILED);
    output::create_folder(&dir)?;
    let file = |name: &str, bytes: &[u8]| output::write(&dir.join(name), bytes);
    let scene = failed.scene_toml.as_bytes();
    file(manifest::SCENE, scene)?;
    let start = output::write_with(&dir.join(START), |out| {
        frame::encode(out, stamp, &failed.start)
    })?;
    let start = FileRecord::of_written(START, &start);
    let mut report = failed.report.clone();
    let fields = report
        .as_object_mut()
        .ok_or_else(|| CacheError::Unfit("a report that is no object".to_owned()))?;
    let files = [FileRecord::new(manifest::SCENE, scene), start];
    fields.insert(FILES.to_owned(), json!(files));
    if failed.start.walls != AbsorberStates::default() {
        fields.insert(WALLS.to_owned(), json!(failed.start.walls));
    }
    if !failed.start.bodies.is_empty() {
        fields.insert(BODIES.to_owned(), json!(failed.start.bodies));
    }
    fields.insert(SUBSTEP.to_owned(), json!(failed.start.substep));
    let checksum = checksum(fields);
    fields.insert(CHECKSUM.to_owned(), checksum.into());
    // Last, because the report is what marks the folder as replayable.
    Ok(file(REPORT, text(fields).as_bytes())?)
}

/// Content of the report file, fields sorted by name.
fn text(fields: &Map<String, Value>) -> String {
    format!("{:#}\n", Value::Object(fields.clone()))
}

fn checksum(fields: &Map<String, Value>) -> String {
    blake3::hash(text(fields).as_bytes()).to_hex().to_string()
}

/// Reads what [`write()`] wrote; `dir` is the `failed/` folder itself.
///
/// # Errors
/// [`CacheError::Damaged`] for a file that is missing or has a wrong checksum, [`CacheError::Io`].
pub fn read(dir: &Path) -> Result<Failed, CacheError> {
    let path = dir.join(REPORT);
    let damaged = |what: &str| CacheError::damaged(&path, what);
    let bytes = match fs::read(&path) {
        // The report is written last: the bake was killed while it wrote the folder.
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(damaged("it is missing"));
        }
        other => other.at(&path)?,
    };
    let mut fields: Map<String, Value> =
        serde_json::from_slice(&bytes).map_err(|error| damaged(&error.to_string()))?;
    // Digits beyond f64 precision may change without changing the value, so the text is compared
    // too.
    let is_as_written = text(&fields).as_bytes() == bytes;
    let recorded = fields.remove(CHECKSUM);
    if !is_as_written || recorded != Some(checksum(&fields).into()) {
        return Err(damaged("its BLAKE3 checksum does not match"));
    }
    let files = fields.remove(FILES).unwrap_or_default();
    let [scene, start] = <[FileRecord; 2]>::deserialize(files)
        .ok()
        .filter(|[scene, start]| scene.file == manifest::SCENE && start.file == START)
        .ok_or_else(|| damaged("it names other files"))?;
    let last_frame = fields.get("last_frame").and_then(Value::as_u64);
    let last_frame = last_frame
        .and_then(|frame| u32::try_from(frame).ok())
        .ok_or_else(|| damaged("it has no last_frame"))?;
    let walls = match fields.remove(WALLS) {
        Some(walls) => {
            AbsorberStates::deserialize(walls).map_err(|error| damaged(&error.to_string()))?
        }
        None => AbsorberStates::default(),
    };
    let bodies = match fields.remove(BODIES) {
        Some(bodies) => {
            Vec::<BodyState>::deserialize(bodies).map_err(|error| damaged(&error.to_string()))?
        }
        None => Vec::new(),
    };
    let substep = match fields.remove(SUBSTEP) {
        Some(seconds) => f64::deserialize(seconds).map_err(|error| damaged(&error.to_string()))?,
        None => 0.0,
    };
    let start = Particles {
        walls,
        bodies,
        substep,
        ..frame::decode(&start.read(dir)?, &dir.join(START))?
    };
    Ok(Failed {
        scene_toml: String::from_utf8(scene.read(dir)?)
            .map_err(|_| CacheError::damaged(dir.join(manifest::SCENE), "it is not UTF-8"))?,
        start,
        last_frame,
        report: Value::Object(fields),
    })
}

/// Removes `failed/` of the cache at `cache` if it exists.
///
/// # Errors
/// [`CacheError::Io`].
pub fn remove(cache: &Path) -> Result<(), CacheError> {
    Ok(output::remove_folder(&cache.join(FAILED))?)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    fn failed() -> Failed {
        Failed {
            scene_toml: "[shot]\nname = \"tank\"\n".to_owned(),
            start: Particles {
                position: vec![[0.5, 0.25, -1.0]],
                velocity: vec![[0.0, -3.0, 0.1]],
                id: vec![7],
                ..Particles::default()
            },
            last_frame: 12,
            report: json!({
                "last_frame": 12, "measured": 0.1 + 0.2, "limit": null,
                "pass": { "name": "flip/advect" },
            }),
        }
    }

    #[test]
    fn it_is_read_as_it_was_written_and_refused_with_any_bit_off() {
        let cache = tempfile::tempdir().unwrap();
        let stamp = Stamp {
            program: "swell",
            program_version: "0.1.0",
            shot: "tank",
            frame: 12,
            time: 0.2,
            origin: DVec3::ZERO,
        };
        write(cache.path(), &failed(), &stamp).unwrap();
        let dir = cache.path().join(FAILED);
        assert!(is_failed(&dir));
        assert_eq!(read(&dir).unwrap(), failed());
        for name in [manifest::SCENE, START, REPORT] {
            let path = dir.join(name);
            let sound = fs::read(&path).unwrap();
            // One or two bits of each byte, cycling through all bit positions.
            for bit in (0..8 * sound.len()).step_by(7) {
                let mut bytes = sound.clone();
                bytes[bit / 8] ^= 1 << (bit % 8);
                fs::write(&path, bytes).unwrap();
                match read(&dir) {
                    Err(CacheError::Damaged { file, .. }) => assert_eq!(file, path, "{bit}"),
                    other => panic!("{name}, bit {bit}: {other:?}"),
                }
            }
            fs::remove_file(&path).unwrap();
            assert!(read(&dir).is_err(), "{name} is missing");
            fs::write(&path, sound).unwrap();
        }
        assert_eq!(read(&dir).unwrap(), failed(), "control");
    }
}
