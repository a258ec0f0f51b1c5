//! Reads meshes from OBJ, PLY and STL files, and from OpenVDB level sets.
//!
//! Every reader works on bytes in memory, and allocates nothing from a count in a header before
//! checking it against the bytes that are there.

mod needles;
mod obj;
mod outline;
pub mod parts;
mod ply;
mod polygons;
mod stl;
mod vdb;

use std::{
    borrow::Cow,
    collections::HashMap,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
};

use glam::DVec3;

use super::{bounds::Bounds, mesh::TriangleMesh, text};

pub use outline::Outline;

/// Largest mesh file that is read, bytes. A binary scan of ten million triangles takes half of it.
pub const MAX_FILE_BYTES: u64 = 1 << 30;

/// Largest coordinate accepted, metres, so that areas and volumes stay far from overflow.
const MAX_COORDINATE: f64 = 1e9;

/// Reason why a mesh could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The file cannot be read.
    #[error("cannot read mesh {file}")]
    Read {
        /// File concerned.
        file: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file has more bytes than [`MAX_FILE_BYTES`].
    #[error("mesh {file} is larger than {} MiB", MAX_FILE_BYTES >> 20)]
    TooLarge {
        /// File concerned.
        file: PathBuf,
    },
    /// The extension names no known format.
    #[error("mesh {file}: unknown extension; allowed are .obj, .ply, .stl and .vdb")]
    UnknownFormat {
        /// File concerned.
        file: PathBuf,
    },
    /// The content is invalid.
    #[error("mesh {file}: {detail}")]
    Malformed {
        /// File concerned.
        file: PathBuf,
        /// What is wrong, and where.
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
    /// OpenVDB level set, negative inside: the surface is where it is 0.
    Vdb,
}

impl MeshFormat {
    /// Returns the format that the file name's extension stands for, in upper or lower case.
    ///
    /// # Errors
    /// [`MeshError::UnknownFormat`] for any other extension.
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

/// Precision of a file's coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Digits {
    /// Decimals, read as 64-bit floats; the program that wrote them may have used fewer bits.
    #[default]
    Text,
    /// 32-bit floats.
    Single,
    /// 64-bit floats.
    Double,
}

/// Half the distance between neighbouring 32-bit floats at `x`.
fn rounding_of_single(x: f64) -> f64 {
    let x = x.abs() as f32;
    0.5 * (f64::from(x.next_up()) - f64::from(x))
}

/// Unchecked output of a reader.
#[derive(Default)]
struct Raw {
    digits: Digits,
    vertices: Vec<DVec3>,
    /// Corners of all faces, one face after another, as unchecked vertex indices.
    corners: Vec<u64>,
    /// End of each face in `corners`.
    ends: Vec<usize>,
}

impl Raw {
    fn add_face(&mut self, corners: impl IntoIterator<Item = u64>) {
        self.corners.extend(corners);
        self.ends.push(self.corners.len());
    }

    /// Builds a mesh of triangles only.
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

/// Reads the bytes of a mesh file, at most [`MAX_FILE_BYTES`].
///
/// # Errors
/// [`MeshError::Read`], also for anything but a plain file (a pipe might not end);
/// [`MeshError::TooLarge`].
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
    /// [`MeshError`] names the file and what is wrong with it.
    pub fn load(path: &Path) -> Result<Self, MeshError> {
        let format = MeshFormat::of(path)?;
        Self::from_bytes(&read_bytes(path)?, format, path)
    }

    /// Reads a mesh from bytes; `file` is only used in error messages.
    ///
    /// # Errors
    /// Those of [`Loaded::from_bytes`].
    pub fn from_bytes(bytes: &[u8], format: MeshFormat, file: &Path) -> Result<Self, MeshError> {
        Ok(Loaded::from_bytes(bytes, format, file)?.mesh)
    }
}

/// A mesh and the properties of the file that it was read from.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The mesh, in the file's own frame and unit.
    pub mesh: TriangleMesh,
    /// Precision of the coordinates.
    pub digits: Digits,
    /// Warning about polygons whose outline crosses itself, one sentence; `None` if there are none.
    pub crossing: Option<String>,
}

impl Loaded {
    /// Reads a mesh from bytes; `file` is only used in error messages. Polygons are triangulated
    /// over all their corners. Vertices at the same position are merged, and unused vertices are
    /// dropped. Triangles without area are removed, and their neighbours take over their corners.
    ///
    /// # Errors
    /// [`MeshError::Malformed`] says what is wrong: no triangles, an index out of range, a vertex
    /// that is not a number, no triangle with an area, or broken syntax.
    pub fn from_bytes(bytes: &[u8], format: MeshFormat, file: &Path) -> Result<Self, MeshError> {
        Ok(Self::like(bytes, format, file, None)?.0)
    }

    /// Reads a mesh as [`Self::from_bytes`] does, and its outline. Where the faces have the same
    /// corners as those of `outline`, the mesh has the triangles of that one, also where polygons
    /// or corners at one position would be split otherwise: so vertices of several files are the
    /// same points of a surface.
    ///
    /// # Errors
    /// Those of [`Self::from_bytes`].
    pub fn like(
        bytes: &[u8],
        format: MeshFormat,
        file: &Path,
        outline: Option<&Outline>,
    ) -> Result<(Self, Outline), MeshError> {
        let read = || {
            let raw = raw(bytes, format)?;
            if let Some((mesh, outline)) = outline.and_then(|it| Some((it.mesh(&raw)?, it))) {
                let loaded = Self {
                    mesh,
                    digits: raw.digits,
                    crossing: None,
                };
                return Ok((loaded, outline.clone()));
            }
            let welded = weld(&raw)?;
            let outline = Outline::of(raw, &welded);
            let loaded = Self {
                mesh: welded.mesh,
                digits: welded.digits,
                crossing: welded.crossing.words(),
            };
            Ok((loaded, outline))
        };
        read().map_err(|detail| MeshError::Malformed {
            file: file.to_owned(),
            detail,
        })
    }

    /// Returns the coordinate that is farthest from zero, in the file's unit.
    pub fn farthest(&self) -> f64 {
        let all = self.mesh.vertices.iter();
        all.flat_map(|v| v.to_array())
            .fold(0.0, |far: f64, x| if x.abs() > far.abs() { x } else { far })
    }

    /// Returns the largest error, along each axis, of rounding the coordinates to 32-bit floats, in
    /// the file's unit. The decimals of a text may be off by as much if the program that wrote them
    /// used 32 bits.
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
    /// One-based number of the first such face in the file, and one of its corners.
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
            "{is}, the first is face {face} (counted from 1) with a corner at ({x}, {y}, {z}); \
             each is split into a fan about one corner, so part of it may fold back over itself; \
             triangulate it in the program that made it"
        ))
    }
}

/// A reader's output, checked and welded.
struct Welded {
    mesh: TriangleMesh,
    /// Corners of each triangle of the mesh, numbered over all faces of the file; those from
    /// `in_file` on are in `between`.
    corners: Vec<[u32; 3]>,
    in_file: usize,
    between: Vec<needles::Between>,
    digits: Digits,
    crossing: Crossing,
}

fn welded(bytes: &[u8], format: MeshFormat, file: &Path) -> Result<Welded, MeshError> {
    let raw = raw(bytes, format);
    raw.and_then(|raw| weld(&raw))
        .map_err(|detail| MeshError::Malformed {
            file: file.to_owned(),
            detail,
        })
}

fn raw(bytes: &[u8], format: MeshFormat) -> Result<Raw, String> {
    match format {
        MeshFormat::Obj => obj::read(bytes),
        MeshFormat::Ply => ply::read(bytes),
        MeshFormat::Stl => stl::read(bytes),
        MeshFormat::Vdb => vdb::read(bytes),
    }
}

/// Checks a reader's output, triangulates polygons, and welds vertices at the same position,
/// whatever the format: STL has no shared vertices, and exporters split those of OBJ and PLY
/// along seams.
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
            // A triangle that collapses to an edge or a point has no edge that another
            // triangle needs.
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
        // Closed and inside out: the sign of a distance is unaffected, but normals of samples
        // are not.
        for [_, b, c] in &mut mesh.triangles {
            std::mem::swap(b, c);
        }
        for [_, b, c] in corners {
            std::mem::swap(b, c);
        }
    }
    Ok(welded)
}

/// Decides which vertices are the same.
struct Joined {
    /// Least coordinates, and the step within which decimals count as equal; `None` for binary
    /// files, where only equal values match.
    steps: Option<(DVec3, f64)>,
}

impl Joined {
    /// Step relative to the mesh's size: the last bit of a 32-bit float. Programs that compute in
    /// 64 bits write a corner that two faces share with different last digits.
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
        // Adding +0.0 turns −0.0 into +0.0.
        (place + DVec3::ZERO).to_array().map(f64::to_bits)
    }
}

/// Position of the vertex with this index.
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

/// [`text::without_mark`] with its error as text.
fn without_mark(bytes: &[u8]) -> Result<&[u8], String> {
    text::without_mark(bytes).map_err(|error| error.to_string())
}

/// Decodes text and normalises line ends `\r\n` and `\r` to `\n`.
fn lines_of(bytes: &[u8]) -> Cow<'_, str> {
    let text = String::from_utf8_lossy(bytes);
    if text.contains('\r') {
        text.replace("\r\n", "\n").replace('\r', "\n").into()
    } else {
        text
    }
}

/// Beginning of a line for a message: quoted, with unprintable characters escaped.
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
