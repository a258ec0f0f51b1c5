//! `--keep-going`: frames that failed while the command continued.

use std::error::Error;

use serde_json::json;

use super::{
    Failure, chain, count,
    progress::{Progress, Status},
};
use swell_domain::frame_range::ranges;

/// Reports a frame that failed.
pub(super) fn frame_failed(progress: &Progress, frame: u32, error: &(dyn Error + 'static)) {
    let message = chain(error);
    progress.frame(
        &format!("frame {frame:4}  failed: {message}"),
        Status::Failed,
        json!({ "event": "frame", "frame": frame, "message": message }),
    );
}

/// Suffix of a command's last line with the number of failed frames.
pub(super) fn failed_in_all(frames: &[u32]) -> String {
    match frames.len() {
        0 => String::new(),
        many => format!(", {many} failed"),
    }
}

/// Ends a command that continued: exit code 4 if frames failed.
pub(super) fn refuse_failed(frames: &[u32]) -> Result<u8, Failure> {
    let mut numbers = frames.to_vec();
    numbers.sort_unstable();
    match numbers.len() {
        0 => Ok(0),
        many => Err(Failure {
            code: 4,
            error: format!(
                "{} failed: {}",
                count(many as u64, "frame"),
                ranges(&numbers)
            )
            .into(),
        }),
    }
}
