//! Progress: a bar on a terminal, plain lines otherwise, JSON lines for farms.

use std::io::IsTerminal as _;

use clap::ValueEnum;
use indicatif::{ProgressBar, ProgressStyle};
use serde_json::Value;

use super::output;

/// How progress is told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(super) enum Mode {
    /// A bar on a terminal, lines otherwise.
    #[default]
    Auto,
    /// One line a frame.
    Plain,
    /// One JSON object a line, on standard output.
    Json,
    /// Nothing.
    None,
}

impl Mode {
    /// This mode without a bar, for lines between jobs.
    pub(super) fn lines(self) -> Self {
        match self {
            Self::Auto => Self::Plain,
            other => other,
        }
    }
}

/// A job's progress over frames.
pub(super) struct Progress {
    mode: Mode,
    bar: Option<ProgressBar>,
}

impl Progress {
    pub(super) fn new(mode: Mode, frames: u64) -> Self {
        let mode = match mode {
            Mode::Auto if !std::io::stderr().is_terminal() => Mode::Plain,
            other => other,
        };
        let bar = (mode == Mode::Auto).then(|| {
            let style =
                ProgressStyle::with_template("{bar:40} {pos}/{len} [{elapsed} < {eta}] {msg}")
                    .unwrap_or_else(|_| ProgressStyle::default_bar());
            ProgressBar::new(frames).with_style(style)
        });
        Self { mode, bar }
    }

    /// A line that is no frame; `event` is what farms read.
    pub(super) fn say(&self, text: &str, event: Value) {
        match self.mode {
            Mode::Json => output::print(&format!("{event}\n")),
            Mode::None => {}
            _ => match &self.bar {
                Some(bar) => bar.println(text),
                None => output::say(text),
            },
        }
    }

    /// A frame is done.
    pub(super) fn frame(&self, text: &str, event: Value) {
        match &self.bar {
            Some(bar) => {
                bar.set_message(text.to_owned());
                bar.inc(1);
            }
            None => self.say(text, event),
        }
    }

    /// [`Self::frame`] with a line that stays.
    pub(super) fn frame_to_keep(&self, text: &str, event: Value) {
        self.say(text, event);
        if let Some(bar) = &self.bar {
            bar.inc(1);
        }
    }

    pub(super) fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
