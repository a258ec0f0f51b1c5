//! Meshes from OBJ, PLY and STL files, and from OpenVDB level sets.
//!
//! Every reader works on bytes already in memory, and nothing is allocated from a count that a
//! header merely promises: counts are first held against the bytes that are there.

mod obj;
pub mod parts;
mod ply;
mod stl;
pub mod vdb;

use std::{
    borrow::Cow,
    collections::HashMap,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use glam::DVec3;

use super::mesh::TriangleMesh;

/// Largest mesh file read, bytes. A scan of ten million triangles is half of it in binary.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// Largest coordinate accepted, metres, so that areas and volumes stay far from overflow.
const MAX_COORDINATE: f64 = 1e9;

/// Why a mesh could not be loaded.
#[derive(Debug, thiserror::Error)]
pub enum MeshError {
    /// The file cannot be read.
    #[error("cannot read mesh {file}")]
    Read {
        /// Which file.
        file: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file has more bytes than [`MAX_FILE_BYTES`].
    #[error("mesh {file} is larger than {} MiB", MAX_FILE_BYTES >> 20)]
    TooLarge {
        /// Which file.
        file: PathBuf,
    },
    /// An extension that names no format.
    #[error("mesh {file}: unknown extension; allowed are .obj, .ply, .stl and .vdb")]
    UnknownFormat {
        /// Which file.
        file: PathBuf,
    },
    /// The reader's complaint.
    #[error("mesh {file}: {detail}")]
    Malformed {
        /// Which file.
        file: PathBuf,
        /// The fault and its place.
        detail: String,
    },
}

/// A mesh file format.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshFormat {
    /// Wavefront OBJ.
    Obj,
    /// Stanford PLY, ASCII or binary of either endianness.
    Ply,
    /// STL, ASCII or binary.
    Stl,
    /// A level set of OpenVDB, negative inside: the surface where it is 0.
    Vdb,
}

impl MeshFormat {
    /// Format by the file name's extension, upper or lower case.
    ///
    /// # Errors
    /// [`MeshError::UnknownFormat`].
    pub fn of(path: &Path) -> Result<Self, MeshError> {
        let extension = path
            .extension()
            .map(|e| e.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("obj") => Ok(Self::Obj),
            Some("ply") => Ok(Self::Ply),
            Some("stl") => Ok(Self::Stl),
            Some("vdb") => Ok(Self::Vdb),
            _ => Err(MeshError::UnknownFormat {
                file: path.to_owned(),
            }),
        }
    }
}

/// Unchecked result of a reader: vertices, and triangles as any index.
type Raw = (Vec<DVec3>, Vec<[u64; 3]>);

/// The bytes of a mesh file, at most [`MAX_FILE_BYTES`].
///
/// # Errors
/// [`MeshError::Read`], also of what is no plain file (a pipe would not end); [`MeshError::TooLarge`].
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, MeshError> {
    let fail = |source| MeshError::Read {
        file: path.to_owned(),
        source,
    };
    if !path.metadata().map_err(fail)?.is_file() {
        return Err(fail(io::Error::other("not a plain file")));
    }
    let mut bytes = Vec::new();
    File::open(path)
        .map_err(fail)?
        .take(MAX_FILE_BYTES + 1)
        .read_to_end(&mut bytes)
        .map_err(fail)?;
    if bytes.len() as u64 > MAX_FILE_BYTES {
        return Err(MeshError::TooLarge {
            file: path.to_owned(),
        });
    }
    Ok(bytes)
}

impl TriangleMesh {
    /// Loads a mesh in the format that the extension names, in the file's own frame and unit.
    ///
    /// # Errors
    /// [`MeshError`] names the file and what is wrong in it.
    pub fn load(path: &Path) -> Result<Self, MeshError> {
        let format = MeshFormat::of(path)?;
        Self::from_bytes(&read_bytes(path)?, format, path)
    }

    /// Reads a mesh from bytes; `file` only names it in errors. Polygons become fans, vertices at
    /// the same place become one, vertices that no triangle uses are left out.
    ///
    /// # Errors
    /// [`MeshError::Malformed`] says what is wrong: no triangles, an index out of range, a vertex
    /// that is no number, a triangle without area, or broken syntax.
    pub fn from_bytes(bytes: &[u8], format: MeshFormat, file: &Path) -> Result<Self, MeshError> {
        let welded = welded(bytes, format, file)?;
        Ok(welded.mesh)
    }
}

/// What a reader found, checked and welded.
struct Welded {
    mesh: TriangleMesh,
    /// For each triangle of the mesh its number in the file.
    kept: Vec<u32>,
    /// Whether the second and the third corner of each changed places.
    is_turned: bool,
}

fn welded(bytes: &[u8], format: MeshFormat, file: &Path) -> Result<Welded, MeshError> {
    let raw = match format {
        MeshFormat::Obj => obj::read(bytes),
        MeshFormat::Ply => ply::read(bytes),
        MeshFormat::Stl => stl::read(bytes),
        MeshFormat::Vdb => vdb::read(bytes),
    };
    raw.and_then(weld).map_err(|detail| MeshError::Malformed {
        file: file.to_owned(),
        detail,
    })
}

/// Checks what a reader found and welds vertices at the same place, whatever the format: STL has
/// no shared vertices, and exporters split OBJ and PLY ones along seams.
fn weld((vertices, triangles): Raw) -> Result<Welded, String> {
    if triangles.is_empty() {
        return Err("no triangles".into());
    }
    let mut mesh = TriangleMesh::default();
    let mut kept = Vec::with_capacity(triangles.len());
    let mut by_place = HashMap::new();
    for (t, triangle) in triangles.iter().enumerate() {
        let mut welded = [0; 3];
        for (slot, &index) in welded.iter_mut().zip(triangle) {
            let vertex = usize::try_from(index).ok().and_then(|i| vertices.get(i));
            let &v = vertex.ok_or_else(|| {
                format!(
                    "triangle {t} refers to vertex {index}, but there are {} (counted from 0)",
                    vertices.len()
                )
            })?;
            if !(v.is_finite() && v.abs().max_element() <= MAX_COORDINATE) {
                return Err(format!(
                    "vertex {index} is ({}, {}, {}); allowed are numbers up to {MAX_COORDINATE:e}",
                    v.x, v.y, v.z
                ));
            }
            // + 0.0 makes one zero of the two.
            let place = (v + DVec3::ZERO).to_array().map(f64::to_bits);
            *slot = *by_place.entry(place).or_insert_with(|| {
                mesh.vertices.push(v);
                mesh.vertices.len() as u32 - 1
            });
        }
        mesh.triangles.push(welded);
        // Exporters leave slivers without area, which bound nothing and turn no winding number.
        if mesh.area_vector(mesh.triangles.len() - 1).length_squared() == 0.0 {
            mesh.triangles.pop();
            continue;
        }
        kept.push(t as u32);
    }
    if mesh.triangles.is_empty() {
        return Err("no triangle has an area".into());
    }
    let is_turned = mesh.open_edges().is_empty() && mesh.signed_volume() < 0.0;
    if is_turned {
        // Closed and inside out: the sign of a distance does not mind, normals of samples do.
        for [_, b, c] in &mut mesh.triangles {
            std::mem::swap(b, c);
        }
    }
    Ok(Welded {
        mesh,
        kept,
        is_turned,
    })
}

/// A text file's bytes without the byte order mark that some editors put first.
fn without_mark(bytes: &[u8]) -> Result<&[u8], String> {
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Err("the file is text in UTF-16; save it as UTF-8".into());
    }
    Ok(bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes))
}

/// Text with one kind of line end: `\n`, also where the file has `\r\n` or `\r`.
fn lines_of(bytes: &[u8]) -> Cow<'_, str> {
    let text = String::from_utf8_lossy(bytes);
    if text.contains('\r') {
        text.replace("\r\n", "\n").replace('\r', "\n").into()
    } else {
        text
    }
}

/// The beginning of a line, for a message: in quotes, what cannot be printed escaped.
fn quoted(line: &str) -> String {
    const MOST: usize = 60;
    let line = line.trim();
    match line.char_indices().nth(MOST) {
        None => format!("{line:?}"),
        Some((end, _)) => format!("{:?} …", &line[..end]),
    }
}

#[cfg(test)]
mod tests;
