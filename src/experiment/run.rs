//! What a point of a study came to, as its ledger keeps it.

use serde::{Deserialize, Serialize};

use swell_study::median;

/// What a point came to; `M` is what its kind of study measures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Run<M> {
    /// At the start.
    pub particles: usize,
    /// Output frames that were done, or 1 projection.
    pub frames: u32,
    /// Wall clock of all frames, of each repeat.
    pub seconds: Vec<f64>,
    /// Why it ended before its last frame, or did not begin.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<String>,
    /// What was measured so far.
    pub measured: M,
}

impl<M> Run<M> {
    /// Seconds a frame: least, median and greatest of the repeats.
    pub(super) fn per_frame(&self) -> [f64; 3] {
        let frames = f64::from(self.frames.max(1));
        let least = self.seconds.iter().copied().fold(f64::INFINITY, f64::min);
        let most = self.seconds.iter().copied().fold(0.0, f64::max);
        let middle = median(self.seconds.clone()).unwrap_or(0.0);
        [least, middle, most].map(|seconds| seconds / frames)
    }
}
