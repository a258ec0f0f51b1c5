//! Summary of the differences between two caches.

use std::collections::BTreeMap;

use serde::Serialize;
use swell_domain::tolerance::ErrorLimit;

use super::{frames::FrameDiff, streams::StreamDiff};

/// Differences between two caches.
#[derive(Clone, Debug, Serialize)]
pub struct CacheDiff {
    /// Program and device that baked each cache.
    pub bakes: [String; 2],
    /// First key in which the scenes differ, with b's value, then a's.
    pub physics: Option<String>,
    /// First frame of each: 0, or that which a branch began with. Earlier frames of the other are
    /// not compared.
    pub begins: [u32; 2],
    /// Requested frames that only a has, from where b begins.
    pub only_a: Vec<u32>,
    /// Requested frames that only b has, from where a begins.
    pub only_b: Vec<u32>,
    /// Frames whose particles both caches have kept.
    pub frames: Vec<FrameDiff>,
    /// Frames of both whose particles one of them has not kept: only their streams are compared.
    pub without_particles: Vec<u32>,
    /// Streams that only a has: `grids`, `grid NAME`, `probe NAME`.
    pub streams_only_a: Vec<String>,
    /// Streams that only b has.
    pub streams_only_b: Vec<String>,
    /// Differences in streams beside the particles, by frame.
    pub streams: Vec<StreamDiff>,
    /// Limits of aggregates by which caches of different devices are judged if no tolerance is
    /// given: roundings differ, so that bits cannot be the same.
    pub device_limits: Option<BTreeMap<String, ErrorLimit>>,
    /// Whether stream differences are judged: only where every bit has to be the same, because a
    /// tolerance does not name streams.
    pub streams_judged: bool,
}

impl CacheDiff {
    /// Returns whether everything is within tolerance and nothing exists on only one side.
    pub fn is_within(&self) -> bool {
        let same_streams = self.streams.is_empty()
            && self.streams_only_a.is_empty()
            && self.streams_only_b.is_empty();
        // Aggregates are judged by frame: without one nothing is.
        let is_judged = self.streams_judged || !self.frames.is_empty();
        is_judged
            && self.only_a.is_empty()
            && self.only_b.is_empty()
            && self.frames.iter().all(|frame| frame.faults.is_empty())
            && (same_streams || !self.streams_judged)
    }
}
