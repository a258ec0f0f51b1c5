//! What two caches differ by, all in all.

use serde::Serialize;

use super::{frames::FrameDiff, streams::StreamDiff};

/// Differences between two caches.
#[derive(Clone, Debug, Serialize)]
pub struct CacheDiff {
    /// Program and device that baked each.
    pub bakes: [String; 2],
    /// The first key of the scenes that differs, with b's value and then a's.
    pub physics: Option<String>,
    /// Frames that a alone has, of those that were asked for.
    pub only_a: Vec<u32>,
    /// Frames that b alone has.
    pub only_b: Vec<u32>,
    /// Frames of both whose particles both have kept.
    pub frames: Vec<FrameDiff>,
    /// Frames of both that one of them has kept no particles of: there the streams beside them alone are compared.
    pub without_particles: Vec<u32>,
    /// Streams that a alone has: `grids`, `grid NAME`, `probe NAME`.
    pub streams_only_a: Vec<String>,
    /// Streams that b alone has.
    pub streams_only_b: Vec<String>,
    /// Differences in streams beside the particles, by frame.
    pub streams: Vec<StreamDiff>,
    /// Whether those count: without a tolerance they do, and with one nothing in it names them.
    pub streams_judged: bool,
}

impl CacheDiff {
    /// Whether nothing is out of tolerance, and nothing on one side alone.
    pub fn is_within(&self) -> bool {
        let same_streams = self.streams.is_empty()
            && self.streams_only_a.is_empty()
            && self.streams_only_b.is_empty();
        self.only_a.is_empty()
            && self.only_b.is_empty()
            && self.frames.iter().all(|frame| frame.faults.is_empty())
            && (same_streams || !self.streams_judged)
    }
}
