//! Meshes from OBJ, PLY and STL files.
//!
//! Every reader works on bytes already in memory, and nothing is allocated from a count that a
//! header merely promises: counts are first held against the bytes that are there.

use std::{
    collections::HashMap,
    fmt::Write as _,
    fs::File,
    io::{self, Cursor, Read},
    path::{Path, PathBuf},
};

use glam::DVec3;
use ply_rs_bw::{
    parser::{Parser, Reader},
    ply::{ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyType},
};

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
        /// What the system says.
        source: io::Error,
    },
    /// More bytes than [`MAX_FILE_BYTES`].
    #[error("mesh {file} is larger than {} MiB", MAX_FILE_BYTES >> 20)]
    TooLarge {
        /// Which file.
        file: PathBuf,
    },
    /// An extension that names no format.
    #[error("mesh {file}: unknown extension; allowed are .obj, .ply and .stl")]
    UnknownFormat {
        /// Which file.
        file: PathBuf,
    },
    /// The reader's complaint.
    #[error("mesh {file}: {detail}")]
    Malformed {
        /// Which file.
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
}

impl MeshFormat {
    /// By extension, in any case.
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
            _ => Err(MeshError::UnknownFormat {
                file: path.to_owned(),
            }),
        }
    }
}

/// What a reader hands over before it is checked: vertices, and triangles as any index.
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
        let raw = match format {
            MeshFormat::Obj => read_obj(bytes),
            MeshFormat::Ply => read_ply(bytes),
            MeshFormat::Stl => read_stl(bytes),
        };
        raw.and_then(weld).map_err(|detail| MeshError::Malformed {
            file: file.to_owned(),
            detail,
        })
    }
}

/// Checks what a reader found and welds vertices at the same place, whatever the format: STL has
/// no shared vertices, and exporters split OBJ and PLY ones along seams.
fn weld((vertices, triangles): Raw) -> Result<TriangleMesh, String> {
    if triangles.is_empty() {
        return Err("no triangles".into());
    }
    let mut mesh = TriangleMesh::default();
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
        }
    }
    if mesh.triangles.is_empty() {
        return Err("no triangle has an area".into());
    }
    if mesh.open_edges().is_empty() && mesh.signed_volume() < 0.0 {
        // Closed and inside out: the sign of a distance does not mind, normals of samples do.
        for [_, b, c] in &mut mesh.triangles {
            std::mem::swap(b, c);
        }
    }
    Ok(mesh)
}

/// OBJ through tobj, which sees `v` and `f` lines only, and of a corner `v/vt/vn` only `v`.
///
/// The rest carries no geometry, and is where tobj can still be driven out of bounds (normal and
/// texture indices near the largest integer wrap around) or asked to open other files.
fn read_obj(bytes: &[u8]) -> Result<Raw, String> {
    let text = String::from_utf8_lossy(bytes)
        .replace("\\\r\n", " ")
        .replace("\\\n", " ");
    let mut geometry = String::new();
    let mut vertex_count = 0i64;
    let mut greatest = (0i64, 0usize);
    for (number, line) in text.lines().enumerate() {
        let number = number + 1;
        let mut words = line.split_whitespace();
        match words.next() {
            Some("v") => {
                let words: Vec<_> = words.collect();
                // Six or seven words: a colour follows. Four: a weight.
                let used = if words.len() == 4 { 4 } else { 3 };
                let is_number = |word: &&str| word.parse::<f32>().is_ok();
                if words.len() < 3 || !words[..used].iter().all(is_number) {
                    return Err(format!("line {number}: a vertex needs three numbers"));
                }
                vertex_count += 1;
                writeln!(geometry, "v {}", words[..used].join(" ")).map_err(|e| e.to_string())?;
            }
            Some("f") => {
                geometry.push('f');
                let mut corners = 0;
                for word in words {
                    let index = obj_index(word, vertex_count)
                        .ok_or_else(|| format!("line {number}: \"{word}\" names no vertex"))?;
                    greatest = greatest.max((index, number));
                    corners += 1;
                    write!(geometry, " {index}").map_err(|e| e.to_string())?;
                }
                if corners < 3 {
                    return Err(format!("line {number}: a face needs three corners"));
                }
                geometry.push('\n');
            }
            _ => {}
        }
    }
    // Faces may stand before their vertices.
    if greatest.0 > vertex_count {
        let (index, number) = greatest;
        return Err(format!(
            "line {number}: the face refers to vertex {index}, but there are {vertex_count}"
        ));
    }
    let options = tobj::LoadOptions {
        single_index: true,
        triangulate: true,
        ignore_points: true,
        ignore_lines: true,
    };
    let (models, _) = tobj::load_obj_buf(&mut Cursor::new(geometry), &options, |_| {
        Err(tobj::LoadError::GenericFailure)
    })
    .map_err(|e| e.to_string())?;
    let mut raw: Raw = Default::default();
    for model in models {
        let base = raw.0.len() as u64;
        let place = |p: &[f32]| DVec3::new(p[0].into(), p[1].into(), p[2].into());
        raw.0
            .extend(model.mesh.positions.chunks_exact(3).map(place));
        let corners = |t: &[u32]| [t[0], t[1], t[2]].map(|i| base + u64::from(i));
        raw.1
            .extend(model.mesh.indices.chunks_exact(3).map(corners));
    }
    Ok(raw)
}

/// A face corner's vertex, counted from 1; negative ones count back from the vertices so far.
fn obj_index(word: &str, vertex_count: i64) -> Option<i64> {
    let index: i64 = word.split('/').next()?.parse().ok()?;
    let index = if index < 0 {
        vertex_count + 1 + index.max(-i64::from(u32::MAX))
    } else {
        index
    };
    (index > 0).then_some(index)
}

/// STL through stl_io.
fn read_stl(bytes: &[u8]) -> Result<Raw, String> {
    const HEADER: usize = 84;
    let mut bytes = bytes.to_vec();
    let promised = bytes
        .get(80..HEADER)
        .and_then(|b| b.try_into().ok())
        .map(|b| u64::from(u32::from_le_bytes(b)));
    let has_binary_size = promised.is_some_and(|n| bytes.len() as u64 == HEADER as u64 + 50 * n);
    if has_binary_size {
        // stl_io takes every file that starts with "solid " for text; some binary ones do.
        bytes[..80].fill(0);
    } else if bytes.starts_with(b"solid") {
        // stl_io asks for a space after "solid", which a nameless text file lacks.
        let end = bytes.iter().position(|&b| b == b'\n');
        bytes.splice(..end.unwrap_or(bytes.len()), *b"solid unnamed");
    } else {
        return Err(match promised {
            Some(n) => format!(
                "not an STL: no \"solid\" line, and {n} triangles need {} bytes of {}",
                HEADER as u64 + 50 * n,
                bytes.len()
            ),
            None => "not an STL: too short".into(),
        });
    }
    let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).map_err(|e| e.to_string())?;
    Ok((
        mesh.vertices
            .iter()
            .map(|v| DVec3::from_array(v.0.map(f64::from)))
            .collect(),
        mesh.faces
            .iter()
            .map(|f| f.vertices.map(|i| i as u64))
            .collect(),
    ))
}

/// A PLY element: of a vertex its place, of a face its corners, of anything else nothing.
#[derive(Default)]
struct PlyElement {
    place: [Option<f64>; 3],
    corners: Option<Vec<u64>>,
}

impl PropertyAccess for PlyElement {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        match name {
            "x" => self.place[0] = number(&property),
            "y" => self.place[1] = number(&property),
            "z" => self.place[2] = number(&property),
            "vertex_indices" | "vertex_index" => {
                self.corners = property
                    .to_u32_list()
                    .map(|list| list.into_iter().map(u64::from).collect());
            }
            _ => return PropertyAccessResult::Ignored,
        }
        PropertyAccessResult::Set
    }
}

fn number(property: &Property) -> Option<f64> {
    match property {
        Property::Double(v) => Some(*v),
        Property::Int(v) => Some(f64::from(*v)),
        Property::UInt(v) => Some(f64::from(*v)),
        // Exact for the small integers and float.
        other => other.to_f32_lossy().map(f64::from),
    }
}

/// PLY through ply-rs-bw, element by element.
fn read_ply(bytes: &[u8]) -> Result<Raw, String> {
    let parser = Parser::<PlyElement>::new();
    let mut reader = Reader::new(bytes);
    let header = parser.read_header(&mut reader).map_err(|e| e.to_string())?;
    let mut raw: Raw = Default::default();
    for element in header.elements.values() {
        check_promise(element, header.encoding, reader.get_ref().len())?;
        let payload = parser
            .read_payload_for_element(&mut reader, element, &header)
            .map_err(|e| e.to_string())?;
        match element.name.as_str() {
            "vertex" => {
                for (index, vertex) in payload.iter().enumerate() {
                    let [Some(x), Some(y), Some(z)] = vertex.place else {
                        return Err(format!("vertex {index} lacks one of x, y, z"));
                    };
                    raw.0.push(DVec3::new(x, y, z));
                }
            }
            "face" => {
                for (index, face) in payload.iter().enumerate() {
                    let corners = face.corners.as_deref().unwrap_or_default();
                    let [first, rest @ ..] = corners else {
                        return Err(format!("face {index} has no list vertex_indices"));
                    };
                    if rest.len() < 2 {
                        return Err(format!("face {index} has fewer than three corners"));
                    }
                    raw.1
                        .extend(rest.windows(2).map(|pair| [*first, pair[0], pair[1]]));
                }
            }
            _ => {}
        }
    }
    Ok(raw)
}

/// Holds an element's promised count against the bytes that are left. Without it a header that
/// promises 2⁶⁰ elements without properties keeps the reader busy for years.
fn check_promise(
    element: &ElementDef,
    encoding: Encoding,
    bytes_left: usize,
) -> Result<(), String> {
    use ply_rs_bw::ply::ScalarType as S;
    let size = |scalar: &S| match scalar {
        S::Char | S::UChar => 1,
        S::Short | S::UShort => 2,
        S::Int | S::UInt | S::Float => 4,
        S::Double => 8,
    };
    // A line holds two characters a property at the least: a digit and what ends it.
    let least: u128 = match encoding {
        Encoding::Ascii => element.properties.len() as u128 * 2,
        _ => element
            .properties
            .values()
            .map(|p| match &p.data_type {
                PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => size(scalar),
            })
            .sum(),
    };
    let needed = element.count as u128 * least.max(1);
    // The last line may end with the file.
    if needed > bytes_left as u128 + 1 {
        return Err(format!(
            "the header promises {} of element \"{}\", which need {needed} bytes, but {bytes_left} \
             are left",
            element.count, element.name
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests;
