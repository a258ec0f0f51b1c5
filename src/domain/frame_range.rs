//! Frame ranges as written on a command line.

use std::fmt;
use std::str::FromStr;

/// Frames selected by `7`, `1-240`, `1-240x2`, `1-240:2`, or a comma-separated list of these.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameRange {
    /// Sorted, without duplicates, never empty.
    frames: Vec<u32>,
    /// The text as given.
    text: String,
}

/// Error for a text that is not a frame range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{part}` is not a frame range: {what}; write 7, 1-240, 1-240x2, or several with commas between"
)]
pub struct FrameRangeError {
    /// Item of the list that is wrong.
    pub part: String,
    /// The reason.
    pub what: String,
}

/// Largest number of frames: 46 hours at 60 frames per second, so more is a typing error.
const MOST: u64 = 10_000_000;

impl FrameRange {
    /// Returns the frames from `first` to `last`, both included; `None` if `last` comes before
    /// `first` or there are more than 10⁷.
    pub fn inclusive(first: u32, last: u32) -> Option<Self> {
        format!("{first}-{last}").parse().ok()
    }

    /// Iterates over the frames in ascending order, each once.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = u32> + DoubleEndedIterator + '_ {
        self.frames.iter().copied()
    }

    /// Returns whether `frame` is one of them.
    pub fn contains(&self, frame: u32) -> bool {
        self.frames.binary_search(&frame).is_ok()
    }

    /// Returns the smallest frame.
    pub fn first(&self) -> u32 {
        self.frames[0]
    }

    /// Returns the largest frame.
    pub fn last(&self) -> u32 {
        self.frames[self.frames.len() - 1]
    }

    /// Returns the number of frames, at least one.
    #[expect(
        clippy::len_without_is_empty,
        reason = "a range is never empty, so the question would mislead"
    )]
    pub fn len(&self) -> usize {
        self.frames.len()
    }
}

/// Formats ascending numbers as a person writes them: `0-4, 7`.
pub fn ranges(numbers: &[u32]) -> String {
    let runs = numbers.chunk_by(|a, b| a.checked_add(1) == Some(*b));
    let run = |run: &[u32]| match run {
        [first, .., last] => format!("{first}-{last}"),
        other => other.iter().map(u32::to_string).collect(),
    };
    runs.map(run).collect::<Vec<_>>().join(", ")
}

impl fmt::Display for FrameRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// `first`, `last` and `step` of one item of a list.
type Span = (u32, u32, u32);

impl FromStr for FrameRange {
    type Err = FrameRangeError;

    fn from_str(text: &str) -> Result<Self, FrameRangeError> {
        let mut spans = Vec::new();
        let mut total = 0;
        for part in text.split(',').map(str::trim) {
            let error = |what: String| FrameRangeError {
                part: part.to_owned(),
                what,
            };
            let (first, last, step) = parse_span(part).map_err(error)?;
            total += u64::from((last - first) / step) + 1;
            // Checked before anything is allocated.
            if total > MOST {
                return Err(error(format!("more than {MOST} frames")));
            }
            spans.push((first, last, step as usize));
        }
        let mut frames: Vec<u32> = spans
            .into_iter()
            .flat_map(|(first, last, step)| (first..=last).step_by(step))
            .collect();
        frames.sort_unstable();
        frames.dedup();
        Ok(Self {
            frames,
            text: text.to_owned(),
        })
    }
}

fn parse_span(part: &str) -> Result<Span, String> {
    if part.is_empty() {
        return Err("it is empty".to_owned());
    }
    let (range, step) = match part.split_once(['x', ':']) {
        Some((range, step)) => (range, Some(number(step)?)),
        None => (part, None),
    };
    let (first, last) = match range.split_once('-') {
        Some((first, last)) => (number(first)?, number(last)?),
        None if step.is_some() => return Err("a step needs a range before it".to_owned()),
        None => (number(range)?, number(range)?),
    };
    if last < first {
        return Err(format!("{last} comes before {first}"));
    }
    match step {
        Some(0) => Err("the step is 0".to_owned()),
        _ => Ok((first, last, step.unwrap_or(1))),
    }
}

fn number(digits: &str) -> Result<u32, String> {
    // `parse` would accept `+1`.
    if !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit()) {
        return digits
            .parse()
            .map_err(|_| format!("{digits} is more than {}", u32::MAX));
    }
    Err(format!("`{digits}` is not a frame number"))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn frames(text: &str) -> Vec<u32> {
        text.parse::<FrameRange>().unwrap().iter().collect()
    }

    #[test]
    fn every_form() {
        assert_eq!(frames("7"), [7]);
        assert_eq!(frames("0"), [0]);
        assert_eq!(frames("1-4"), [1, 2, 3, 4]);
        assert_eq!(frames("4-4"), [4]);
        assert_eq!(frames("1-6x2"), [1, 3, 5]);
        assert_eq!(frames("1-6:2"), [1, 3, 5]);
        assert_eq!(frames("1-7x2"), [1, 3, 5, 7]);
        assert_eq!(frames("1-3x9"), [1]);
        assert_eq!(frames("9, 1-5x2,3-4"), [1, 3, 4, 5, 9]);
        assert_eq!(frames("4294967294-4294967295"), [4_294_967_294, u32::MAX]);
    }

    #[test]
    fn faults_are_named() {
        for (text, words) in [
            ("", "empty"),
            ("1,,2", "empty"),
            ("1-2,", "empty"),
            ("9-1", "1 comes before 9"),
            ("1-9x0", "step is 0"),
            ("1-9:0", "step is 0"),
            ("3x2", "needs a range"),
            ("-3", "not a frame number"),
            ("1-", "not a frame number"),
            ("1-2-3", "`2-3` is not a frame number"),
            ("1-9x2x2", "`2x2` is not a frame number"),
            ("+1", "not a frame number"),
            ("1.5", "not a frame number"),
            ("all", "not a frame number"),
            ("4294967296", "more than 4294967295"),
            ("1-4294967295", "more than 10000000 frames"),
            ("1-9000000,1-9000000", "more than 10000000 frames"),
        ] {
            let error = text.parse::<FrameRange>().unwrap_err().to_string();
            assert!(error.contains(words), "{text}: {error}");
            assert!(error.contains("1-240x2"), "tells how: {error}");
        }
        assert_eq!(frames("1-10000000").len(), 10_000_000, "control");
    }

    #[test]
    fn questions() {
        let range: FrameRange = "1-9x4,20".parse().unwrap();
        assert_eq!((range.first(), range.last(), range.len()), (1, 20, 4));
        assert!(range.contains(5) && !range.contains(6));
        assert_eq!(range.to_string(), "1-9x4,20");
        assert_eq!(FrameRange::inclusive(3, 2), None);
        let three = FrameRange::inclusive(3, 5).unwrap();
        assert!(three.iter().eq([3, 4, 5]) && three.iter().rev().eq([5, 4, 3]));
    }

    proptest! {
        #[test]
        fn any_text_parses_or_is_refused(text in "[0-9x:,+ -]{0,12}") {
            if let Ok(range) = text.parse::<FrameRange>() {
                prop_assert!(range.iter().zip(range.iter().skip(1)).all(|(a, b)| a < b));
                prop_assert!(range.len() >= 1);
            }
        }
    }
}
