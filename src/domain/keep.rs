//! Which frames a bake keeps the particles of, and how it compresses them.

use std::{fmt, str::FromStr};

use serde::{Deserialize, Serialize};

/// Lossless compression of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Compression {
    /// Zstandard (RFC 8878). Bytes are grouped by their position within a particle's row first.
    Zstd,
}

/// Frames whose particles stay on disk. A cache also holds those of its first frame, and those of
/// its newest, from which a bake resumes; the latter are removed once the next frame is complete
/// on disk.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub enum Keep {
    /// Every frame.
    All,
    /// Frames whose number is a multiple of this, which is at least 1.
    Every(u32),
    /// No frame but the first and the newest.
    Newest,
}

impl Keep {
    /// Largest step of [`Keep::Every`]: the length of the longest shot, frames.
    pub const MOST: u32 = 1_000_000;

    /// Returns whether a frame's particles stay once later frames exist.
    pub fn keeps(self, frame: u32) -> bool {
        match self {
            Self::All => true,
            Self::Every(step) => frame.is_multiple_of(step),
            Self::Newest => false,
        }
    }
}

/// As written in scenes: `all`, `every 10`, `none`.
impl fmt::Display for Keep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::All => f.write_str("all"),
            Self::Every(step) => write!(f, "every {step}"),
            Self::Newest => f.write_str("none"),
        }
    }
}

/// Error for a text that does not select frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum KeepError {
    /// The step is 0, and a bake could not resume from such frames.
    #[error("every 0th frame is none, and a bake resumes from the frames that it keeps")]
    Zero,
    /// The text has any other fault.
    #[error("it names no frames")]
    Unknown,
}

impl FromStr for Keep {
    type Err = KeepError;

    fn from_str(text: &str) -> Result<Self, KeepError> {
        match text {
            "all" => return Ok(Self::All),
            "none" => return Ok(Self::Newest),
            _ => {}
        }
        let digits = text.strip_prefix("every ").unwrap_or_default();
        let is_number = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
        match digits.parse() {
            Ok(0) if is_number => Err(KeepError::Zero),
            Ok(step) if is_number && step <= Self::MOST => Ok(Self::Every(step)),
            _ => Err(KeepError::Unknown),
        }
    }
}

impl TryFrom<String> for Keep {
    type Error = KeepError;

    fn try_from(text: String) -> Result<Self, KeepError> {
        text.parse()
    }
}

impl From<Keep> for String {
    fn from(keep: Keep) -> Self {
        keep.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_read_as_they_are_written() {
        for keep in [Keep::All, Keep::Every(1), Keep::Every(10), Keep::Newest] {
            assert_eq!(keep.to_string().parse(), Ok(keep));
        }
        assert_eq!("every 0".parse::<Keep>(), Err(KeepError::Zero));
        for bad in [
            "",
            "every",
            "every ",
            "every -3",
            "every +3",
            "every 1.5",
            "every 1000001",
            "10",
            "None",
            "every 99999999999",
        ] {
            assert_eq!(bad.parse::<Keep>(), Err(KeepError::Unknown), "{bad}");
        }
    }

    #[test]
    fn frames_that_are_kept_are_those_that_the_words_say() {
        let kept = |keep: Keep| {
            (0..8)
                .filter(|&frame| keep.keeps(frame))
                .collect::<Vec<_>>()
        };
        assert_eq!(kept(Keep::Every(3)), [0, 3, 6]);
        assert_eq!(kept(Keep::All).len(), 8);
        assert!(kept(Keep::Newest).is_empty());
    }
}
