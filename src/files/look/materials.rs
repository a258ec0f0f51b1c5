//! Reads the materials of solids, from the look and from a material library.

use std::{
    io::Cursor,
    path::{Path, PathBuf},
};

use swell_scene::{
    SceneError,
    look::{LookSpec, Material, MaterialSpec, Materials, Picture, Texture, TextureSpec},
};

use super::mtl::{self, Entry};
use crate::document::Document;

const LIBRARY: &str = "solids.materials";

/// Largest size of a library or a picture, bytes.
const MOST_BYTES: u64 = 256 << 20;
/// Largest side of a picture, and largest total of all pictures of a look, texels: with mipmaps
/// these are 256 MiB.
const MOST_SIDE: u32 = 8192;
const MOST_TEXELS: u64 = 24_000_000;

/// Reads the materials that the look `file` names; `None` if it names none.
pub(super) fn read(
    doc: &Document<'_>,
    spec: &LookSpec,
    file: &Path,
) -> Result<Option<Materials>, SceneError> {
    let solids = &spec.solids;
    let walls = spec.basin.as_ref();
    let on_walls = walls.and_then(|it| Some((it.laid.as_ref()?, it.colour)));
    let is_named = solids.materials.is_some() || !solids.material.is_empty();
    if !is_named && solids.laid.is_none() && on_walls.is_none() {
        return Ok(None);
    }
    let folder = file.parent().unwrap_or(Path::new("."));
    let mut reader = Reader {
        doc,
        folder,
        all: Materials::default(),
    };
    for (index, material) in solids.material.iter().enumerate() {
        let key = format!("solids.material[{index}]");
        let is_same = |it: &Material| it.name.as_ref() == Some(&material.name);
        if reader.all.list.iter().any(is_same) {
            let problem = format!("{:?} is defined twice", material.name);
            return Err(doc.fault_of(&format!("{key}.name"), problem));
        }
        reader.own(&key, material, solids.colour)?;
    }
    if let Some(name) = &solids.materials {
        reader.library(name)?;
    }
    if let Some(texture) = &solids.laid {
        reader.all.solids = Some(reader.laid("solids", texture, solids.colour, true)?);
    }
    if let Some((texture, colour)) = on_walls {
        let colour = colour.unwrap_or([1.0; 3]);
        reader.all.basin = Some(reader.laid("basin", texture, colour, false)?);
    }
    Ok(Some(reader.all))
}

struct Reader<'d, 'a> {
    doc: &'d Document<'a>,
    folder: &'d Path,
    all: Materials,
}

impl Reader<'_, '_> {
    /// Adds a material of the look. Its default colour is white under a texture, and otherwise
    /// that of all solids.
    fn own(
        &mut self,
        key: &str,
        material: &MaterialSpec,
        solids: [f64; 3],
    ) -> Result<(), SceneError> {
        let texture = match &material.texture {
            Some(spec) => Some(self.texture(key, spec)?),
            None => None,
        };
        let default = if texture.is_some() { [1.0; 3] } else { solids };
        self.all.list.push(Material {
            name: Some(material.name.clone()),
            colour: material.colour.unwrap_or(default),
            texture,
            windows: material.windows,
            is_own: true,
            place: self.doc.place_of(&format!("{key}.name")),
        });
        Ok(())
    }

    fn texture(&mut self, key: &str, spec: &TextureSpec) -> Result<Texture, SceneError> {
        Ok(Texture {
            picture: self.picture(&format!("{key}.texture.file"), &spec.file, "")?,
            metres: spec.metres,
            scale: [1.0; 2],
            offset: [0.0; 2],
        })
    }

    /// Adds the material of everything in a table that has no other, and returns its index.
    fn laid(
        &mut self,
        key: &str,
        spec: &TextureSpec,
        colour: [f64; 3],
        windows: bool,
    ) -> Result<usize, SceneError> {
        let texture = Some(self.texture(key, spec)?);
        self.all.list.push(Material {
            name: None,
            colour,
            texture,
            windows,
            is_own: true,
            place: self.doc.place_of(&format!("{key}.texture")),
        });
        Ok(self.all.list.len() - 1)
    }

    /// Adds the materials of a library.
    fn library(&mut self, name: &Path) -> Result<(), SceneError> {
        let (path, bytes) = self.bytes(LIBRARY, name, "")?;
        self.all.library = Some(blake3::hash(&bytes));
        let shown = path.display();
        let library = mtl::read(&bytes).map_err(|problem| {
            let message = format!("the library {shown}: {problem}");
            self.doc.fault_of_plain(LIBRARY, message)
        })?;
        let beside = name.parent().unwrap_or(Path::new(""));
        for entry in library.entries {
            self.entry(entry, beside, name)?;
        }
        self.all.unused = library.unused;
        Ok(())
    }

    fn entry(&mut self, entry: Entry, beside: &Path, library: &Path) -> Result<(), SceneError> {
        let mut texture = None;
        if let Some(map) = entry.map {
            let place = format!("{} line {}: ", library.display(), map.line);
            texture = Some(Texture {
                picture: self.picture(LIBRARY, &beside.join(&map.file), &place)?,
                metres: None,
                scale: map.scale,
                offset: map.offset,
            });
        }
        let mut place = self.doc.place_of(LIBRARY);
        place.message = format!("{} line {}", library.display(), entry.line);
        self.all.list.push(Material {
            name: Some(entry.name),
            colour: entry.colour,
            texture,
            windows: true,
            is_own: false,
            place,
        });
        Ok(())
    }

    /// Returns the index of a picture; `place` precedes the description of faults.
    fn picture(&mut self, key: &str, name: &Path, place: &str) -> Result<usize, SceneError> {
        let (path, bytes) = self.bytes(key, name, place)?;
        let hash = blake3::hash(&bytes);
        let same = |it: &Picture| it.hash == hash;
        if let Some(found) = self.all.pictures.iter().position(same) {
            return Ok(found);
        }
        let fault = |problem: String| {
            let message = format!("{place}the picture {}: {problem}", path.display());
            self.doc.fault_of_plain(key, message)
        };
        let (size, texels) = decoded(&bytes).map_err(&fault)?;
        let own = texels.len() as u64;
        let others = self.all.pictures.iter().map(|it| it.texels.len() as u64);
        if own + others.sum::<u64>() > MOST_TEXELS {
            return Err(fault(format!(
                "with it the look's pictures have more than {MOST_TEXELS} texels together"
            )));
        }
        self.all.pictures.push(Picture {
            size,
            texels,
            file: path,
            hash,
        });
        Ok(self.all.pictures.len() - 1)
    }

    fn bytes(&self, key: &str, name: &Path, place: &str) -> Result<(PathBuf, Vec<u8>), SceneError> {
        let path = self.doc.find(self.folder, key, &name.to_string_lossy())?;
        let fault = |problem: String| {
            let message = format!("{place}cannot read {}: {problem}", path.display());
            self.doc.fault_of_plain(key, message)
        };
        let about = path.metadata().map_err(|error| fault(error.to_string()))?;
        if !about.is_file() {
            return Err(fault("not a plain file".to_owned()));
        }
        if about.len() > MOST_BYTES {
            return Err(fault(format!("it is larger than {} MiB", MOST_BYTES >> 20)));
        }
        let bytes = std::fs::read(&path).map_err(|error| fault(error.to_string()))?;
        Ok((path, bytes))
    }
}

/// Decodes a PNG to its size and colours, ignoring alpha.
fn decoded(bytes: &[u8]) -> Result<([u32; 2], Vec<[u8; 3]>), String> {
    let fail = |error: png::DecodingError| format!("it is not a readable PNG: {error}");
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(fail)?;
    let size = [reader.info().width, reader.info().height];
    if size.into_iter().any(|side| side > MOST_SIDE) {
        return Err(format!(
            "it is {} × {}; allowed are up to {MOST_SIDE} texels a side",
            size[0], size[1]
        ));
    }
    let mut pixels = vec![0; reader.output_buffer_size().unwrap_or(0)];
    let frame = reader.next_frame(&mut pixels).map_err(fail)?;
    let channels = frame.color_type.samples();
    let colour = |texel: &[u8]| match *texel {
        [r, g, b] | [r, g, b, _] => [r, g, b],
        [grey, ..] => [grey; 3],
        [] => [0; 3],
    };
    let used = &pixels[..frame.buffer_size().min(pixels.len())];
    Ok((size, used.chunks_exact(channels).map(colour).collect()))
}
