//! Mesh files that give a solid its shape over time.

use std::path::PathBuf;

use swell_domain::shape::ShapeSequence;

use super::{Scene, words::shown};

/// Most files that a warning names.
const MOST_NAMED: usize = 4;

/// Mesh files of a solid whose shape changes.
#[derive(Clone, Debug, PartialEq)]
pub struct MeshSequence {
    /// The meshes in their placement, at their times.
    pub shape: ShapeSequence,
    /// Paths and BLAKE3 hashes of the files, hexadecimal.
    pub files: Vec<(PathBuf, String)>,
    /// Number of the first file.
    pub first: u32,
    /// Number of the file that is at frame 1 of the shot; `None` where file 0 is at its start.
    pub start: Option<u32>,
    /// What was odd in the files, a sentence each.
    pub faults: Vec<String>,
}

impl MeshSequence {
    /// Returns the file whose triangles the mesh has at `time`, seconds.
    pub fn file_at(&self, time: f64) -> &(PathBuf, String) {
        &self.files[self.shape.triangles_of(time)]
    }

    fn name(&self, index: usize) -> String {
        let name = self.files[index].0.file_name().unwrap_or_default();
        name.to_string_lossy().into_owned()
    }

    /// Returns the name that the files have in common, without numbers at its end.
    pub(crate) fn stem(name: &str) -> &str {
        let letters = name.trim_end_matches(|c: char| c.is_ascii_digit());
        match letters.trim_end_matches(['.', '_', '-']) {
            "" => name,
            stem => stem,
        }
    }
}

/// Formats a time to a microsecond.
fn seconds(time: f64) -> String {
    shown((1e6 * time).round() / 1e6)
}

impl Scene {
    /// Warnings about files whose triangles change, that end before the shot does, or that only
    /// lie before or after it.
    pub(super) fn lint_sequences(&self, lints: &mut Vec<String>) {
        for sequence in self.sequences() {
            let shape = &sequence.shape;
            lints.extend(sequence.faults.iter().cloned());
            let breaks: Vec<usize> = shape.breaks().collect();
            if !breaks.is_empty() {
                let named = breaks.iter().take(MOST_NAMED).map(|&k| sequence.name(k));
                let more = match breaks.len().saturating_sub(MOST_NAMED) {
                    0 => String::new(),
                    more => format!(" and {more} more"),
                };
                lints.push(format!(
                    "solid.sequence: the triangles of {}{more} are not those of the file before; \
                     the surface moves there from the nearest point, and not along itself",
                    named.collect::<Vec<_>>().join(", ")
                ));
            }
            let ([begin, end], until) = (shape.times(), self.shot.duration());
            let last = sequence.files.len() - 1;
            // Half of an interval, so that rounding is none.
            let slack = 0.5 / shape.rate();
            if begin > until - slack || end < slack {
                lints.push(format!(
                    "solid.sequence: {} to {} are at {} s to {} s, and the shot ends at {} s, so \
                     that the shape never changes; start = {} makes the first of them frame 1",
                    sequence.name(0),
                    sequence.name(last),
                    seconds(begin),
                    seconds(end),
                    seconds(until),
                    sequence.first
                ));
            } else if end < until - slack {
                lints.push(format!(
                    "solid.sequence: {} is at {} s, and the shot ends at {} s: the shape rests \
                     from there on",
                    sequence.name(last),
                    seconds(end),
                    seconds(until)
                ));
            }
            if self.has_bodies() && self.bodies().any(|it| it.collides) {
                lints.push(format!(
                    "body.collides: bodies do not collide with {}, whose shape changes; only the \
                     water is between them",
                    MeshSequence::stem(&sequence.name(0))
                ));
            }
        }
    }
}
