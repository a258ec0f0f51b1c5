//! Materials of solids.

use std::path::PathBuf;

use super::{Look, LookError};
use crate::{Fault, SceneError};

/// Materials of a look in the order in which names are looked up, and the pictures
/// of their textures.
#[derive(Clone, Debug, Default)]
pub struct Materials {
    /// Materials of `[[solids.material]]`, then those of the library.
    pub list: Vec<Material>,
    /// Index in `list` of the material of solids that have none; `None` for a plain colour.
    pub solids: Option<usize>,
    /// Index in `list` of the material of the `[basin]` walls; `None` for a plain colour.
    pub basin: Option<usize>,
    /// Pictures, each once even if several materials use it.
    pub pictures: Vec<Picture>,
    /// BLAKE3 hash of the library, if there is one.
    pub library: Option<blake3::Hash>,
    /// Statements of the library that are ignored.
    pub unused: Vec<String>,
}

/// Material of a part of a solid.
#[derive(Clone, Debug)]
pub struct Material {
    /// Name of the parts, or of the mesh file without extension; `None` for the material of
    /// everything that has no other.
    pub name: Option<String>,
    /// Reflectance, linear red, green, blue; multiplies the texture.
    pub colour: [f64; 3],
    /// Texture; `None` for a plain colour.
    pub texture: Option<Texture>,
    /// Whether the look's windows may appear on it.
    pub windows: bool,
    /// Whether the look defines it. A material of a library may be unused in a scene.
    pub is_own: bool,
    /// Location of its name in the look.
    pub place: Fault,
}

/// A texture on a solid.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Index into [`Materials::pictures`].
    pub picture: usize,
    /// Side length that the picture covers, metres, projected along the axes; `None` to use the
    /// mesh's texture coordinates.
    pub metres: Option<f64>,
    /// Factor on the texture coordinates.
    pub scale: [f64; 2],
    /// Offset added to the scaled texture coordinates.
    pub offset: [f64; 2],
}

/// A decoded picture.
#[derive(Clone)]
pub struct Picture {
    /// Width and height, texels.
    pub size: [u32; 2],
    /// sRGB texels, row by row from the top.
    pub texels: Vec<[u8; 3]>,
    /// File that it was read from.
    pub file: PathBuf,
    /// BLAKE3 hash of the file.
    pub hash: blake3::Hash,
}

impl std::fmt::Debug for Picture {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} {:?}", self.file.display(), self.size)
    }
}

impl Look {
    /// Returns the materials of the look; `None` if it names none.
    pub fn materials(&self) -> Option<&Materials> {
        self.materials.as_deref()
    }

    /// Returns an error that reports `problem` with a material of a scene; `None` if there is
    /// no such material.
    pub fn material_fault(&self, index: usize, problem: &str) -> Option<LookError> {
        let material = self.materials()?.list.get(index)?;
        let fault = Fault {
            message: match material.place.message.as_str() {
                "" => problem.to_owned(),
                place => format!("{place}: {problem}"),
            },
            ..material.place.clone()
        };
        Some(LookError(SceneError::Fault(Box::new(fault))))
    }

    /// Warns about statements of the library that are ignored.
    pub(super) fn lint_library(&self) -> Option<String> {
        let unused = &self.materials()?.unused;
        (!unused.is_empty()).then(|| {
            format!(
                "solids.materials: only Kd and map_Kd of a library are used; this one also has {}",
                unused.join(", ")
            )
        })
    }
}

impl Materials {
    /// Hashes the library and the pictures.
    pub(super) fn hash(&self, hasher: &mut blake3::Hasher) {
        let pictures = self.pictures.iter().map(|picture| &picture.hash);
        for hash in self.library.iter().chain(pictures) {
            hasher.update(b"material").update(hash.as_bytes());
        }
    }
}
