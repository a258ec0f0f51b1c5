//! Describes differences other than those of the particles.

use std::fmt::Write as _;

use swell_domain::frame_range::ranges;
use swell_stage::diff::{CacheDiff, Difference, GridDiff, StreamDiff};

use super::number;

/// Differences of one frame that are printed before the rest is only counted.
const MOST: usize = 3;

/// One line per stream: the frames in which it differs, and how in the first of them.
pub(super) fn show(out: &mut String, diff: &CacheDiff) -> std::fmt::Result {
    let mark = if diff.streams_judged { "out: " } else { "" };
    let lone = [("A", &diff.streams_only_a), ("B", &diff.streams_only_b)];
    for (side, names) in lone {
        for name in names {
            writeln!(out, "{mark}{name} only in {side}")?;
        }
    }
    for first in firsts(&diff.streams) {
        let same = diff.streams.iter().filter(|d| d.stream == first.stream);
        let frames: Vec<u32> = same.map(|d| d.frame).collect();
        let [a, b] = &first.files;
        let files = if a == b {
            a.clone()
        } else {
            format!("{a} and {b}")
        };
        writeln!(
            out,
            "{mark}{} not the same in frames {}; frame {}, {files}: {}",
            first.stream,
            ranges(&frames),
            first.frame,
            describe_all(&first.differences)
        )?;
    }
    let is_shown = !diff.streams.is_empty() || lone.iter().any(|(_, names)| !names.is_empty());
    if is_shown && !diff.streams_judged {
        let why = match diff.device_limits {
            Some(_) => "they were baked on different devices",
            None => "the tolerance file names none of these",
        };
        writeln!(out, "not judged: {why}")?;
    }
    Ok(())
}

/// The first frame in which each stream differs.
fn firsts(streams: &[StreamDiff]) -> Vec<&StreamDiff> {
    let mut found: Vec<&StreamDiff> = Vec::new();
    for diff in streams {
        if found.iter().all(|other| other.stream != diff.stream) {
            found.push(diff);
        }
    }
    found
}

fn describe_all(differences: &[Difference]) -> String {
    let words: Vec<String> = differences.iter().take(MOST).map(describe).collect();
    let mut text = words.join("; ");
    if let Some(more @ 1..) = differences.len().checked_sub(MOST) {
        // Writing to a String cannot fail.
        let _ = write!(text, "; {more} more");
    }
    text
}

fn describe(difference: &Difference) -> String {
    match difference {
        Difference::Value { key, a, b } => format!("{key}: A {a}, B {b}"),
        Difference::Bytes { a, b } => {
            format!("different bytes ({a} and {b} of them)")
        }
        Difference::Grid(grid) => describe_grid(grid),
    }
}

fn describe_grid(diff: &GridDiff) -> String {
    let [a, b] = diff.active;
    let unit = match diff.grid.as_str() {
        "surface" => " m",
        "vel" => " m/s",
        _ => "",
    };
    let place = diff.largest_at.map_or(String::new(), |at| {
        let largest = number(diff.largest);
        format!(", the largest difference {largest}{unit} at {at:?}")
    });
    format!(
        "{}: {} voxels differ of {a} and {b}{place}",
        diff.grid, diff.different
    )
}
