//! `--dry-run`: reports what a command would make.

use serde_json::{Value, json};

use super::{count, output, progress::Progress, size};

/// The prediction that all commands report.
pub(super) struct DryRun {
    /// Numbers of the frames to be made.
    pub(super) frames: Vec<u32>,
    /// Number of frames that exist already.
    pub(super) standing: usize,
    /// Predicted bytes on disk; `None` if unknown.
    pub(super) bytes: Option<u64>,
    /// Output folder.
    pub(super) place: String,
}

impl DryRun {
    /// Reports the prediction. `words` extends the line, and `more` the keys for programs.
    pub(super) fn tell(&self, progress: &Progress, words: &str, mut more: Value) {
        let frames = self.frames.len();
        let bytes = match self.bytes {
            Some(bytes) => format!("about {}", size(bytes)),
            None => "of unknown size".to_owned(),
        };
        let span = match self.frames[..] {
            [] => String::new(),
            [frame] => format!(" ({frame})"),
            [first, .., last] => format!(" ({first} to {last})"),
        };
        let text = format!(
            "would make {}{span}, {bytes}; {} already exist; in {}{words}\n",
            count(frames as u64, "frame"),
            self.standing,
            self.place,
        );
        let known = json!({
            "event": "dry_run", "frames": frames, "numbers": self.frames, "skipped": self.standing,
            "bytes": self.bytes,
            "place": self.place,
        });
        if let (Value::Object(more), Value::Object(known)) = (&mut more, known) {
            more.extend(known);
        }
        match progress.is_json() {
            true => progress.tell(more),
            false => output::print(&text),
        }
        output::log(text.trim_end());
    }
}
