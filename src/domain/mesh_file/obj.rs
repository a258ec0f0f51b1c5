//! Reads OBJ through tobj, which is given only `v` and `f` lines, and of a corner `v/vt/vn`
//! only `v`.
//!
//! The rest carries no geometry, and is where tobj can still index out of bounds (normal and
//! texture indices near the largest integer wrap around) or be made to open other files. Objects
//! and groups are only names: all of them form one mesh.

use std::{borrow::Cow, fmt::Write as _, io::Cursor};

use glam::DVec3;

use super::{Raw, lines_of, quoted, without_mark};

/// Reads the vertices and faces of all objects and groups.
pub(super) fn read(bytes: &[u8]) -> Result<Raw, String> {
    let text = lines_of(without_mark(bytes)?);
    let mut geometry = Geometry::default();
    for (number, line) in statements(&text) {
        geometry.add(number, &line)?;
    }
    geometry.read()
}

/// Iterates over the statements of a text without their comments, each with the number of its first
/// line. A statement that ends in a backslash continues on the next line.
pub(super) fn statements(text: &str) -> impl Iterator<Item = (usize, Cow<'_, str>)> {
    fn bare(line: &str) -> &str {
        line.split('#').next().unwrap_or_default().trim_end()
    }
    let mut lines = text.lines().zip(1usize..);
    std::iter::from_fn(move || {
        let (line, number) = lines.next()?;
        let mut part = bare(line);
        let mut joined = String::new();
        while let Some(begun) = part.strip_suffix('\\') {
            joined.push_str(begun);
            joined.push(' ');
            part = lines.next().map_or("", |(line, _)| bare(line));
        }
        if joined.is_empty() {
            return Some((number, Cow::Borrowed(part)));
        }
        joined.push_str(part);
        Some((number, Cow::Owned(joined)))
    })
}

/// The lines that are passed on to tobj.
#[derive(Default)]
struct Geometry {
    text: String,
    vertices: i64,
    /// Greatest index of a face's corner, and its line number.
    greatest: (i64, usize),
}

impl Geometry {
    /// Adds a line without its comment.
    fn add(&mut self, number: usize, line: &str) -> Result<(), String> {
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let words: Vec<_> = words.collect();
                // Six or seven numbers: position and colour. Four: position and weight.
                let used = if words.len() == 4 { 4 } else { 3 };
                let is_number = |word: &&str| word.parse::<f64>().is_ok();
                if words.len() < 3 || !words[..used].iter().all(is_number) {
                    return Err(format!(
                        "line {number}: a vertex needs three numbers: {}",
                        quoted(line)
                    ));
                }
                self.vertices += 1;
                writeln!(self.text, "v {}", words[..used].join(" ")).map_err(|e| e.to_string())?;
            }
            Some("f") => {
                self.text.push('f');
                let mut corners = 0;
                for word in words {
                    let index = vertex_index(word, self.vertices).ok_or_else(|| {
                        format!(
                            "line {number}: {} is not a valid vertex index",
                            quoted(word)
                        )
                    })?;
                    self.greatest = self.greatest.max((index, number));
                    corners += 1;
                    write!(self.text, " {index}").map_err(|e| e.to_string())?;
                }
                if corners < 3 {
                    return Err(format!("line {number}: a face needs three corners"));
                }
                self.text.push('\n');
            }
            _ => {}
        }
        Ok(())
    }

    fn read(self) -> Result<Raw, String> {
        // Faces may precede their vertices.
        if self.greatest.0 > self.vertices {
            let (index, number) = self.greatest;
            return Err(format!(
                "line {number}: the face refers to vertex {index}, but there are {}",
                self.vertices
            ));
        }
        let options = tobj::LoadOptions {
            single_index: true,
            triangulate: false,
            ignore_points: true,
            ignore_lines: true,
        };
        let (models, _) = tobj::load_obj_buf(&mut Cursor::new(self.text), &options, |_| {
            Err(tobj::LoadError::GenericFailure)
        })
        .map_err(|e| e.to_string())?;
        let mut raw = Raw::default();
        for tobj::Model { mesh, .. } in models {
            let base = raw.vertices.len() as u64;
            let places = mesh.positions.chunks_exact(3);
            raw.vertices.extend(places.map(DVec3::from_slice));
            // For a mesh of triangles only, tobj reports no face sizes.
            let counts = match mesh.face_arities[..] {
                [] => vec![3; mesh.indices.len() / 3],
                _ => mesh.face_arities,
            };
            let mut indices = mesh.indices.iter().map(|&i| base + u64::from(i));
            for count in counts {
                raw.add_face(indices.by_ref().take(count as usize));
            }
        }
        Ok(raw)
    }
}

/// Vertex of a face's corner, counted from 1; negative indices count back from the vertices read
/// so far.
fn vertex_index(word: &str, vertex_count: i64) -> Option<i64> {
    index_of(word.split('/').next()?, vertex_count)
}

/// Parses an index into the `vertex_count` items read so far.
pub(super) fn index_of(word: &str, vertex_count: i64) -> Option<i64> {
    let index: i64 = word.parse().ok()?;
    let index = if index < 0 {
        vertex_count + 1 + index.max(-i64::from(u32::MAX))
    } else {
        index
    };
    (index > 0).then_some(index)
}
