//! Meshes from OBJ, PLY and STL files, and from OpenVDB level sets.
//!
//! Every reader works on bytes already in memory, and nothing is allocated from a count that a
//! header merely promises: counts are first held against the bytes that are there.

mod needles;
mod obj;
pub mod parts;
mod ply;
mod polygons;
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

use super::{bounds::Bounds, mesh::TriangleMesh, text};

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

/// How exact a file's coordinates are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Digits {
    /// Decimals, read in 64 bits; the program that wrote them may have had fewer.
    #[default]
    Text,
    /// 32-bit floats.
    Single,
    /// 64-bit floats.
    Double,
}

/// Half the distance of neighbouring 32-bit floats about `x`.
fn rounding_of_single(x: f64) -> f64 {
    let x = x.abs() as f32;
    0.5 * (f64::from(x.next_up()) - f64::from(x))
}

/// Unchecked result of a reader.
#[derive(Default)]
struct Raw {
    digits: Digits,
    vertices: Vec<DVec3>,
    /// Corners of one face after another, as any index.
    corners: Vec<u64>,
    /// Where the corners of each face end.
    ends: Vec<usize>,
}

impl Raw {
    fn add_face(&mut self, corners: impl IntoIterator<Item = u64>) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    /// Of triangles alone.
    fn of_triangles(
        digits: Digits,
        vertices: Vec<DVec3>,
        triangles: impl IntoIterator<Item = [u64; 3]>,
    ) -> Self {
        let corners: Vec<_> = triangles.into_iter().flatten().collect();
        Self {
            digits,
            vertices,
            ends: (1..=corners.len() / 3).map(|face| 3 * face).collect(),
            corners,
        }
    }
}

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

    /// Reads a mesh from bytes; `file` only names it in errors.
    ///
    /// # Errors
    /// Those of [`Loaded::from_bytes`].
    pub fn from_bytes(bytes: &[u8], format: MeshFormat, file: &Path) -> Result<Self, MeshError> {
        Ok(Loaded::from_bytes(bytes, format, file)?.mesh)
    }
}

/// A mesh as a file has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// In the file's own frame and unit.
    pub mesh: TriangleMesh,
    /// How exact its coordinates are.
    pub digits: Digits,
    /// Polygons whose outline crosses itself, in a sentence; `None` where there are none.
    pub crossing: Option<String>,
}

impl Loaded {
    /// Reads a mesh from bytes; `file` only names it in errors. Polygons become triangles that use all their corners, vertices at
    /// the same place become one, vertices that no triangle uses are left out, and so are triangles without area, whose corners
    /// their neighbours take.
    ///
    /// # Errors
    /// [`MeshError::Malformed`] says what is wrong: no triangles, an index out of range, a vertex that is no number, no triangle
    /// with an area, or broken syntax.
    pub fn from_bytes(bytes: &[u8], format: MeshFormat, file: &Path) -> Result<Self, MeshError> {
        let welded = welded(bytes, format, file)?;
        Ok(Self {
            mesh: welded.mesh,
            digits: welded.digits,
            crossing: welded.crossing.words(),
        })
    }

    /// The coordinate that is farthest from zero, in the file's unit.
    pub fn farthest(&self) -> f64 {
        let all = self.mesh.vertices.iter();
        all.flat_map(|v| v.to_array())
            .fold(0.0, |far: f64, x| if x.abs() > far.abs() { x } else { far })
    }

    /// By how much 32-bit floats round the farthest coordinate along each axis at most, in the file's unit. That is also what the
    /// decimals of a text may be off, where the program that wrote them had 32 bits.
    pub fn rounding(&self) -> DVec3 {
        let all = self.mesh.vertices.iter();
        let far = all.fold(DVec3::ZERO, |far, v| far.max(v.abs()));
        far.map(rounding_of_single)
    }
}

/// Polygons whose outline crosses itself.
#[derive(Default)]
struct Crossing {
    count: usize,
    /// Number of the first in the file, and one of its corners.
    first: Option<(usize, DVec3)>,
}

impl Crossing {
    fn words(&self) -> Option<String> {
        let (face, at) = self.first?;
        let (count, [x, y, z]) = (self.count, at.to_array());
        let is = if count == 1 {
            "1 polygon crosses itself".to_owned()
        } else {
            format!("{count} polygons cross themselves")
        };
        Some(format!(
            "{is}, the first is face {face} (counted from 1) with a corner at ({x}, {y}, {z}); each is taken as a fan about one \
             corner, so part of it may fold back over itself; make it triangles where it was drawn"
        ))
    }
}

/// What a reader found, checked and welded.
struct Welded {
    mesh: TriangleMesh,
    /// Corners of each triangle of the mesh, counted over all faces of the file; from `in_file` on, those of `between`.
    corners: Vec<[u32; 3]>,
    in_file: usize,
    between: Vec<needles::Between>,
    digits: Digits,
    crossing: Crossing,
}

fn welded(bytes: &[u8], format: MeshFormat, file: &Path) -> Result<Welded, MeshError> {
    let raw = match format {
        MeshFormat::Obj => obj::read(bytes),
        MeshFormat::Ply => ply::read(bytes),
        MeshFormat::Stl => stl::read(bytes),
        MeshFormat::Vdb => vdb::read(bytes),
    };
    raw.and_then(|raw| weld(&raw))
        .map_err(|detail| MeshError::Malformed {
            file: file.to_owned(),
            detail,
        })
}

/// Checks what a reader found, cuts polygons into triangles, and welds vertices at the same place, whatever the format: STL has
/// no shared vertices, and exporters split OBJ and PLY ones along seams.
fn weld(raw: &Raw) -> Result<Welded, String> {
    if raw.ends.is_empty() {
        return Err("no triangles".into());
    }
    let mut welded = Welded {
        mesh: TriangleMesh::default(),
        corners: Vec::with_capacity(raw.ends.len()),
        in_file: raw.corners.len(),
        between: Vec::new(),
        digits: raw.digits,
        crossing: Crossing::default(),
    };
    let joined = Joined::of(raw);
    let mut by_place = HashMap::new();
    let mut begin = 0;
    let mut places = Vec::new();
    for (face, &end) in raw.ends.iter().enumerate() {
        places.clear();
        for &index in &raw.corners[begin..end] {
            places.push(place(raw, face, index)?);
        }
        let cut = polygons::triangles(&places).unwrap_or_else(|polygons::Crossing| {
            welded.crossing.count += 1;
            welded.crossing.first.get_or_insert((face + 1, places[0]));
            polygons::fan(&places)
        });
        for triangle in cut {
            let mesh = &mut welded.mesh;
            let vertices = triangle.map(|k| {
                let v = places[k];
                *by_place.entry(joined.key(v)).or_insert_with(|| {
                    mesh.vertices.push(v);
                    mesh.vertices.len() as u32 - 1
                })
            });
            let [a, b, c] = vertices;
            // A triangle that comes down to an edge or a point: it has no edge that another triangle needs.
            if a != b && b != c && c != a {
                mesh.triangles.push(vertices);
                welded.corners.push(triangle.map(|k| (begin + k) as u32));
            }
        }
        begin = end;
    }
    needles::dissolve(&mut welded);
    let Welded { mesh, corners, .. } = &mut welded;
    if mesh.triangles.is_empty() {
        return Err("no triangle has an area".into());
    }
    if mesh.open_edges().is_empty() && mesh.signed_volume() < 0.0 {
        // Closed and inside out: the sign of a distance does not mind, normals of samples do.
        for [_, b, c] in &mut mesh.triangles {
            std::mem::swap(b, c);
        }
        for [_, b, c] in corners {
            std::mem::swap(b, c);
        }
    }
    Ok(welded)
}

/// Which vertices are one.
struct Joined {
    /// Least coordinates, and the step within which decimals are the same place; `None` of binary files: what is equal.
    steps: Option<(DVec3, f64)>,
}

impl Joined {
    /// Part of a mesh's size: the last of the bits that a 32-bit float has. Programs that compute in 64 bits write the corner that two
    /// faces share with last digits that differ.
    const STEP: f64 = 1.0 / 16_777_216.0;

    fn of(raw: &Raw) -> Self {
        let used = raw.corners.iter();
        let used = used.filter_map(|&index| raw.vertices.get(usize::try_from(index).ok()?));
        let around = Bounds::of_points(used.copied()).filter(|_| raw.digits == Digits::Text);
        // A power of two: no decimal with few digits is midway between two of its multiples.
        let step = |around: &Bounds| around.size().max_element().log2().ceil().exp2() * Self::STEP;
        Self {
            steps: around
                .map(|around| (around.min, step(&around)))
                .filter(|(_, step)| *step > 0.0),
        }
    }

    fn key(&self, v: DVec3) -> [u64; 3] {
        let place = match self.steps {
            Some((least, step)) => ((v - least) / step).round(),
            None => v,
        };
        // + 0.0 makes one zero of the two.
        (place + DVec3::ZERO).to_array().map(f64::to_bits)
    }
}

/// Where the vertex with this index is.
fn place(raw: &Raw, face: usize, index: u64) -> Result<DVec3, String> {
    let vertex = usize::try_from(index)
        .ok()
        .and_then(|i| raw.vertices.get(i));
    let &v = vertex.ok_or_else(|| {
        format!(
            "face {face} refers to vertex {index}, but there are {} (counted from 0)",
            raw.vertices.len()
        )
    })?;
    if !(v.is_finite() && v.abs().max_element() <= MAX_COORDINATE) {
        return Err(format!(
            "vertex {index} is ({}, {}, {}); allowed are numbers up to {MAX_COORDINATE:e}",
            v.x, v.y, v.z
        ));
    }
    Ok(v)
}

/// [`text::without_mark`], with its error in words.
fn without_mark(bytes: &[u8]) -> Result<&[u8], String> {
    text::without_mark(bytes).map_err(|error| error.to_string())
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
