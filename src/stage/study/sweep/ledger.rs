//! `results.jsonl`: one line a finished point.

use std::{
    collections::BTreeMap,
    fs::{self, File, OpenOptions},
    io::Write,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

use super::super::StudyError;
use crate::study::median;

/// A point and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// Of all that it depends on.
    pub(super) hash: String,
    pub(super) method: String,
    pub(super) key: String,
    pub(super) setting: String,
    pub(super) verdict: Verdict,
}

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Verdict {
    Done(Box<Run>),
    /// In the solver's words.
    Failed(String),
}

/// What a point measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Run {
    pub(super) particles: usize,
    /// Output frames, or 1 projection.
    pub(super) frames: u32,
    /// Wall clock of all frames, of each repeat.
    pub(super) seconds: Vec<f64>,
    /// Summed over the frames.
    pub(super) substeps: u64,
    /// Summed over the frames.
    pub(super) iterations: u64,
    /// The cost that no machine changes, summed over the frames: neighbour visits or matrix-vector products.
    pub(super) work: f64,
    /// Pressure solves that ended above their tolerance.
    pub(super) missed: u32,
    /// Mean, 99th percentile and maximum of max(0, ρ/ρ0 − 1) at each frame's end.
    pub(super) density: Vec<[f64; 3]>,
    /// At equally spaced times, where the run is compared with the finest.
    pub(super) samples: Vec<Sample>,
    /// RMS over the particles of the way from the end to where their constraints hold, in spacings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) distance: Option<f64>,
    /// Of a projection.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) projection: Option<ProjectionErrors>,
}

/// What a frame is compared by.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sample {
    /// Metres above the still level.
    pub(super) crest: f64,
    /// Metres along the wave's way.
    pub(super) front: Option<f64>,
    /// m²/s².
    pub(super) energy: f64,
    /// Elevation along the wave's way, metres.
    pub(super) profile: Vec<f64>,
}

/// One projection against the exact solution of its system.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct ProjectionErrors {
    /// ‖p − p64‖ / ‖p64‖.
    pub(super) pressure: f64,
    /// ‖u − u64‖ / ‖u64‖.
    pub(super) velocity: f64,
    /// Largest |∇·u| Δt.
    pub(super) divergence: f64,
    /// ‖b − Ap‖ / ‖b‖ as the device reports it.
    pub(super) residual: f64,
    /// Rows of the system.
    pub(super) rows: usize,
    /// ‖b − Ap64‖ / ‖b‖ of the exact solution.
    pub(super) exact_residual: f64,
    /// Whether that is by a sparse Cholesky factor, not by conjugate gradients.
    pub(super) has_factor: bool,
}

impl Run {
    /// Seconds a frame: least, median and greatest of the repeats.
    pub(super) fn per_frame(&self) -> [f64; 3] {
        let frames = f64::from(self.frames);
        let least = self.seconds.iter().copied().fold(f64::INFINITY, f64::min);
        let most = self.seconds.iter().copied().fold(0.0, f64::max);
        let middle = median(self.seconds.clone()).unwrap_or(0.0);
        [least, middle, most].map(|seconds| seconds / frames)
    }
}

/// The file, open for more lines.
pub(super) struct Ledger {
    path: PathBuf,
    file: File,
    records: BTreeMap<String, Record>,
}

impl Ledger {
    /// Opens the directory's results, or begins them; a torn last line is cut off.
    pub(super) fn open(directory: &Path) -> Result<Self, StudyError> {
        let path = directory.join("results.jsonl");
        let fault = |source| StudyError::File {
            file: path.clone(),
            source,
        };
        fs::create_dir_all(directory).map_err(fault)?;
        let text = match fs::read_to_string(&path) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => String::new(),
            Err(error) => return Err(fault(error)),
        };
        let whole = text.rfind('\n').map_or(0, |end| end + 1);
        let mut records = BTreeMap::new();
        for (index, line) in text[..whole].lines().enumerate() {
            let record: Record =
                serde_json::from_str(line).map_err(|error| StudyError::Ledger {
                    file: path.clone(),
                    line: index + 1,
                    what: error.to_string(),
                })?;
            records.insert(record.hash.clone(), record);
        }
        let file = OpenOptions::new()
            .create(true)
            .append(true)
            .open(&path)
            .map_err(fault)?;
        file.set_len(whole as u64).map_err(fault)?;
        Ok(Self {
            file,
            records,
            path,
        })
    }

    pub(super) fn find(&self, hash: &str) -> Option<&Record> {
        self.records.get(hash)
    }

    /// Adds a line; it is on the disk when this returns.
    pub(super) fn append(&mut self, record: &Record) -> Result<(), StudyError> {
        // Finite numbers, strings and lists alone: nothing that JSON cannot hold.
        let line = serde_json::to_string(record).map_err(std::io::Error::other);
        let written = line.and_then(|line| {
            self.file.write_all(format!("{line}\n").as_bytes())?;
            self.file.sync_data()
        });
        written.map_err(|source| StudyError::File {
            file: self.path.clone(),
            source,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_torn_line_is_cut_off_and_a_spoiled_one_is_named() {
        let folder = tempfile::tempdir().expect("a folder");
        let record = |hash: &str| Record {
            hash: hash.into(),
            method: "jacobi".into(),
            key: "k".into(),
            setting: "4".into(),
            verdict: Verdict::Failed("too fast".into()),
        };
        let mut ledger = Ledger::open(folder.path()).expect("new");
        ledger.append(&record("a")).expect("written");
        ledger.append(&record("b")).expect("written");
        let path = folder.path().join("results.jsonl");
        let text = fs::read_to_string(&path).expect("text");
        fs::write(&path, &text[..text.len() - 9]).expect("written");
        let mut ledger = Ledger::open(folder.path()).expect("torn");
        assert_eq!(ledger.find("a"), Some(&record("a")));
        assert_eq!(ledger.find("b"), None);
        ledger.append(&record("b")).expect("written");
        assert_eq!(fs::read_to_string(&path).expect("text"), text);
        fs::write(&path, format!("{text}{{}}\n")).expect("written");
        let error = Ledger::open(folder.path())
            .err()
            .expect("spoiled")
            .to_string();
        assert!(error.contains("results.jsonl:3: missing field"), "{error}");
    }
}
