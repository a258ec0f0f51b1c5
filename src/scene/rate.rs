//! Time codes per second of a camera's or an animation's file.

use super::words::shown;

/// Relative difference up to which two rates are equal: 23.976 stands for 24000/1001.
const SAME_RATE: f64 = 1e-5;

/// Time codes per second of a file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// Time codes per second.
    pub codes_per_second: f64,
    /// Metadata key that sets the rate; `None` for the format's default.
    pub said: Option<&'static str>,
}

impl Rate {
    /// Warns if the file at `key` has another frame rate than the shot; `None` if they are equal.
    pub fn lint(self, key: &str, frames_per_second: f64) -> Option<String> {
        let rate = self.codes_per_second;
        if (rate / frames_per_second - 1.0).abs() <= SAME_RATE {
            return None;
        }
        let by = match self.said {
            Some(said) => format!("by its {said}"),
            None => "as every layer that does not say its timeCodesPerSecond".to_owned(),
        };
        Some(format!(
            "{key}: the file has {} time codes a second, {by}, and the shot has {} frames; a \
             second of the file is one of the shot, and its time codes are not the shot's frames",
            shown(rate),
            shown(frames_per_second)
        ))
    }
}
