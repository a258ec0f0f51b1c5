//! Results of a point, as its ledger stores them.

use serde::{Deserialize, Serialize};

use swell_study::median;

/// Results of a point; `M` is what its kind of study measures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Run<M> {
    /// Number of particles at the start.
    pub particles: usize,
    /// Number of finished output frames, or 1 for a projection.
    pub frames: u32,
    /// Wall-clock seconds of all frames, one value per repeat.
    pub seconds: Vec<f64>,
    /// Reason why the run ended before its last frame or did not begin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<String>,
    /// Measurements up to the end of the run.
    pub measured: M,
}

impl<M> Run<M> {
    /// Seconds per frame: minimum, median and maximum of the repeats.
    pub(super) fn per_frame(&self) -> [f64; 3] {
        let frames = f64::from(self.frames.max(1));
        let least = self.seconds.iter().copied().fold(f64::INFINITY, f64::min);
        let most = self.seconds.iter().copied().fold(0.0, f64::max);
        let middle = median(self.seconds.clone()).unwrap_or(0.0);
        [least, middle, most].map(|seconds| seconds / frames)
    }
}
