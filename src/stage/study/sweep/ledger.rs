//! A point of a sweep as its line holds it.

use serde::{Deserialize, Serialize};

use super::super::ledger::Line;
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

impl Line for Record {
    fn hash(&self) -> &str {
        &self.hash
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::{super::super::ledger::Ledger, *};

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
        let mut ledger = Ledger::<Record>::open(folder.path()).expect("new");
        ledger.append(&record("a")).expect("written");
        ledger.append(&record("b")).expect("written");
        let path = folder.path().join("results.jsonl");
        let text = fs::read_to_string(&path).expect("text");
        fs::write(&path, &text[..text.len() - 9]).expect("written");
        let busy = Ledger::<Record>::open(folder.path()).err();
        assert!(busy.is_some(), "two at once");
        drop(ledger);
        let mut ledger = Ledger::<Record>::open(folder.path()).expect("torn");
        assert_eq!(ledger.find("a"), Some(&record("a")));
        assert_eq!(ledger.find("b"), None);
        ledger.append(&record("b")).expect("written");
        assert_eq!(fs::read_to_string(&path).expect("text"), text);
        drop(ledger);
        fs::write(&path, format!("{text}{{}}\n")).expect("written");
        let error = Ledger::<Record>::open(folder.path())
            .err()
            .expect("spoiled")
            .to_string();
        assert!(error.contains("results.jsonl:3: missing field"), "{error}");
    }
}
