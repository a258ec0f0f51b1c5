//! Describes one file: a frame of particles, a mesh, a VDB, a picture, USD or glTF.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use exr::meta::{
    MetaData,
    attribute::{Compression, SampleType},
};
use glam::Vec3;

use crate::Blame;
use swell_cache::{CacheError, frame};
use swell_domain::{
    bounds::Bounds,
    mesh::TriangleMesh,
    mesh_file::{MeshError, MeshFormat, read_bytes},
    particles::Particles,
    vdb,
};
use swell_render::{
    RenderError,
    image::{Attributes, png_header, read_exr_attributes, read_png_attributes},
};

pub use swell_domain::vdb::GridFile;
pub use swell_files::rig::Rig;

/// Content of a file that `inspect` recognises by its extension.
#[derive(Debug)]
pub enum FileContents {
    /// A frame of a cache or of whitewater.
    Frame(FrameFile),
    /// A triangle mesh.
    Mesh(MeshFile),
    /// The grids of an OpenVDB file.
    Grids(Vec<GridFile>),
    /// A PNG or an EXR.
    Picture(PictureFile),
    /// Cameras and animations of USD or glTF.
    Rig(Rig),
}

/// Particles of one frame.
#[derive(Debug)]
#[non_exhaustive]
pub struct FrameFile {
    /// Comments of its header: program, shot, frame, time, and the origin if the scene has one.
    pub comments: Vec<String>,
    /// Number of particles.
    pub particles: usize,
    /// Names of the columns besides position, velocity and id.
    pub attributes: Vec<String>,
    /// Bounding box of the particles relative to the scene's origin, metres; `None` without
    /// particles.
    pub bounds: Option<Bounds>,
    /// Speed of the fastest particle, m/s.
    pub fastest: f64,
}

/// A mesh as a scene would load it, in the file's own frame and unit.
#[derive(Debug)]
#[non_exhaustive]
pub struct MeshFile {
    /// Number of distinct vertices.
    pub vertices: usize,
    /// Number of triangles with a nonzero area.
    pub triangles: usize,
    /// Bounding box.
    pub bounds: Option<Bounds>,
    /// Number of edges with a triangle on only one side; 0 for a closed mesh.
    pub open_edges: usize,
}

/// A picture.
#[derive(Debug)]
#[non_exhaustive]
pub struct PictureFile {
    /// `png` or `exr`.
    pub format: &'static str,
    /// Width and height of the displayed image, pixels.
    pub size: [usize; 2],
    /// Size of the stored pixels, and the position of their upper left corner in the image.
    pub data: ([usize; 2], [i32; 2]),
    /// Name and type of each channel.
    pub channels: Vec<(String, &'static str)>,
    /// Compression of the pixels.
    pub compression: String,
    /// Metadata about its origin; empty if the picture has none.
    pub attributes: Attributes,
}

/// Why a file could not be described.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FileError {
    /// The file cannot be read.
    #[error("cannot read {}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// The system's error.
        source: io::Error,
    },
    /// A PLY that is neither one of our frames nor a mesh.
    #[error("{}: neither a frame ({frame}) nor a mesh ({mesh})", file.display())]
    Ply {
        /// The file.
        file: PathBuf,
        /// Why it is not a frame.
        frame: String,
        /// Why it is not a mesh.
        mesh: String,
    },
    /// A compressed frame cannot be read.
    #[error(transparent)]
    Frame(#[from] CacheError),
    /// A VDB, USD or glTF file that is invalid, damaged or unsupported.
    #[error("{}: {detail}", file.display())]
    Other {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        detail: String,
    },
    /// A mesh cannot be read.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A picture cannot be read.
    #[error(transparent)]
    Picture(#[from] RenderError),
}

impl From<&FileError> for Blame {
    fn from(_: &FileError) -> Self {
        Self::Files
    }
}

/// Extensions that [`describe`] knows, in lower case.
const ENDINGS: [&str; 13] = [
    "ply", "zst", "obj", "stl", "vdb", "png", "exr", "usd", "usda", "usdc", "usdz", "glb", "gltf",
];

/// The file's extension if `describe` knows it.
fn ending(file: &Path) -> Option<&'static str> {
    let found = file.extension()?.to_string_lossy().to_ascii_lowercase();
    ENDINGS.into_iter().find(|known| *known == found)
}

/// Whether [`describe`] recognises files of this name.
pub fn is_known(file: &Path) -> bool {
    ending(file).is_some() && !file.is_dir()
}

/// Reads all of `file`, so that a truncated one is detected.
///
/// # Errors
/// [`FileError`].
pub fn describe(file: &Path) -> Result<FileContents, FileError> {
    match ending(file) {
        Some("ply") => ply(file),
        Some("zst") => {
            let bytes = read(file)?;
            let particles = frame::planes::decode(&bytes, file)?;
            let comments = frame::planes::comments(&bytes);
            Ok(FileContents::Frame(frame_file(&particles, comments)))
        }
        Some("vdb") => {
            let bytes = read(file)?;
            let grids = vdb::grids(&bytes).map_err(|detail| FileError::Other {
                file: file.to_owned(),
                detail,
            })?;
            Ok(FileContents::Grids(grids))
        }
        Some("usd" | "usda" | "usdc" | "usdz" | "glb" | "gltf") => {
            let rig = Rig::read(&read(file)?).map_err(|detail| FileError::Other {
                file: file.to_owned(),
                detail,
            })?;
            Ok(FileContents::Rig(rig))
        }
        Some("png") => Ok(FileContents::Picture(png(file)?)),
        Some("exr") => Ok(FileContents::Picture(exr(file)?)),
        _ => Ok(FileContents::Mesh(mesh(&TriangleMesh::load(file)?))),
    }
}

fn read(file: &Path) -> Result<Vec<u8>, FileError> {
    fs::read(file).map_err(|source| FileError::Read {
        file: file.to_owned(),
        source,
    })
}

/// A frame if its header is one of ours, otherwise a mesh.
fn ply(file: &Path) -> Result<FileContents, FileError> {
    let bytes = read(file)?;
    let no_frame = match frame::decode(&bytes, file) {
        Ok(particles) => {
            let comments = frame::comments(&bytes);
            return Ok(FileContents::Frame(frame_file(&particles, comments)));
        }
        Err(error) => error,
    };
    match TriangleMesh::from_bytes(&read_bytes(file)?, MeshFormat::Ply, file) {
        Ok(found) => Ok(FileContents::Mesh(mesh(&found))),
        Err(MeshError::Malformed { detail, .. }) => Err(FileError::Ply {
            file: file.to_owned(),
            frame: words(&no_frame),
            mesh: detail,
        }),
        Err(error) => Err(error.into()),
    }
}

/// The fault without the file's name.
fn words(error: &CacheError) -> String {
    match error {
        CacheError::Damaged { what, .. } => what.clone(),
        other => other.to_string(),
    }
}

fn frame_file(particles: &Particles, comments: Vec<String>) -> FrameFile {
    let places = particles.position.iter().map(|p| Vec3::from_array(*p));
    let around = places.fold(None, |around: Option<(Vec3, Vec3)>, p| match around {
        None => Some((p, p)),
        Some((min, max)) => Some((min.min(p), max.max(p))),
    });
    FrameFile {
        comments,
        particles: particles.len(),
        attributes: particles.attributes.keys().cloned().collect(),
        bounds: around.map(|(min, max)| Bounds {
            min: min.as_dvec3(),
            max: max.as_dvec3(),
        }),
        fastest: particles.max_speed(),
    }
}

fn mesh(mesh: &TriangleMesh) -> MeshFile {
    MeshFile {
        vertices: mesh.vertices.len(),
        triangles: mesh.triangles.len(),
        bounds: mesh.bounds(),
        open_edges: mesh.open_edges().len(),
    }
}

fn png(file: &Path) -> Result<PictureFile, FileError> {
    let (size, channels, bits) = png_header(file)?;
    let attributes = read_png_attributes(file)?;
    let kind = match bits {
        16 => "16 bits",
        8 => "8 bits",
        _ => "fewer than 8 bits",
    };
    Ok(PictureFile {
        format: "png",
        size,
        data: (size, [0, 0]),
        channels: channels.iter().map(|it| ((*it).to_owned(), kind)).collect(),
        compression: "deflate".to_owned(),
        attributes,
    })
}

fn exr(file: &Path) -> Result<PictureFile, FileError> {
    // Decodes the whole file.
    let attributes = read_exr_attributes(file)?;
    let fault = |message: String| RenderError::Format {
        file: file.to_owned(),
        message,
    };
    let meta = MetaData::read_from_file(file, true).map_err(|error| fault(error.to_string()))?;
    let Some(first) = meta.headers.first() else {
        return Err(fault("it has no layer".to_owned()).into());
    };
    let (shown, begins) = (
        first.shared_attributes.display_window,
        first.own_attributes.layer_position,
    );
    let name =
        |layer: &exr::meta::header::Header, channel: String| match &layer.own_attributes.layer_name
        {
            Some(name) if meta.headers.len() > 1 => format!("{name}.{channel}"),
            _ => channel,
        };
    let channels = meta.headers.iter().flat_map(|layer| {
        let all = layer.channels.list.iter();
        all.map(|it| (name(layer, it.name.to_string()), sample(it.sample_type)))
    });
    Ok(PictureFile {
        format: "exr",
        size: [shown.size.0, shown.size.1],
        data: (
            [first.layer_size.0, first.layer_size.1],
            [begins.0 - shown.position.0, begins.1 - shown.position.1],
        ),
        channels: channels.collect(),
        compression: compression(first.compression),
        attributes,
    })
}

fn sample(kind: SampleType) -> &'static str {
    match kind {
        SampleType::F16 => "half",
        SampleType::F32 => "float",
        SampleType::U32 => "uint",
    }
}

fn compression(kind: Compression) -> String {
    kind.to_string().replace(" compression", "")
}
