//! Predicts a job that makes whitewater without a device and without writing anything.

use std::path::PathBuf;

use super::{WhitewaterError, WhitewaterRequest, hash};
use crate::derived;
use swell_cache::stream::PARTICLES;

/// Prediction of a job.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct ExpectedWhitewater {
    /// Directory of the stream.
    pub directory: PathBuf,
    /// First frame that would be computed.
    pub first: u32,
    /// Last frame that would be computed.
    pub last: u32,
    /// Number of frames that exist, not counting the first.
    pub standing: u32,
    /// Predicted bytes of the frames to be computed, from the mean of the existing ones; `None` if
    /// none exist.
    pub bytes: Option<u64>,
}

/// Examines the bake and the existing stream as a job would.
///
/// # Errors
/// Those of [`whitewater`](super::whitewater()) that need no device.
pub fn expected(request: &WhitewaterRequest) -> Result<ExpectedWhitewater, WhitewaterError> {
    let (cache, last) = derived::bake(&request.cache, request.last)?;
    let directory = super::directory(&request.cache, &request.name);
    let mut found = ExpectedWhitewater {
        first: cache.first_frame() + 1,
        last,
        standing: 0,
        bytes: None,
        directory,
    };
    let hash = hash(&cache, request)?;
    if let Some(stream) = derived::standing(&found.directory, &hash, request.overwrite)? {
        found.first = stream.last_frame() + 1;
        let made = stream.entries().iter().skip(1);
        let bytes: u64 = made
            .filter_map(|entry| Some(entry.file(PARTICLES)?.bytes))
            .sum();
        found.standing = stream.last_frame() - stream.first_frame();
        let left = u64::from((last + 1).saturating_sub(found.first));
        let each = bytes.checked_div(found.standing.into());
        found.bytes = each.map(|each| each * left);
    }
    Ok(found)
}
