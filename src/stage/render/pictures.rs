//! The pictures of a frame: their names, their metadata, whether they exist.

use std::path::Path;

use super::{RenderRequest, streams::Streams};
use crate::{device::shaders_note, numbering::Numbering};
use swell_cache::{CacheError, CacheReader, Manifest};
use swell_render::{
    Attributes, Image, REACH, RenderError, frames_around,
    image::{read_exr_attributes, read_png_attributes, write_exr, write_png_with_attributes},
};
use swell_scene::look::{FormatSpec, Look};

/// The complete metadata of a frame's pictures, including all inputs.
pub(super) fn whole_attributes(
    cache: &CacheReader,
    request: &RenderRequest,
    streams: &Streams,
    frame: u32,
) -> Result<Attributes, CacheError> {
    let mut attributes = attributes(cache, request, frame)?;
    attributes.cache_hash += &around(cache, &request.look, frame)?;
    attributes.cache_hash += &streams.frame_hashes(frame)?;
    Ok(attributes)
}

/// Metadata about the surrounding frames that a picture is drawn from: a hash of theirs, so that
/// the picture is drawn again once the cache has more of them. Empty if the look uses none.
fn around(cache: &CacheReader, look: &Look, frame: u32) -> Result<String, CacheError> {
    let reach = frames_around(look);
    if reach == 0 {
        return Ok(String::new());
    }
    let mut hasher = blake3::Hasher::new();
    for (side, other) in others(frame) {
        if other.abs_diff(frame) <= reach && cache.has_particles(other) {
            let hash = cache.frame_hash(other)?;
            hasher.update(format!("{side} {hash}\n").as_bytes());
        }
    }
    Ok(format!(" around {}", hasher.finalize().to_hex()))
}

/// The frames around a frame with their indices, in the order of [`FrameInputs::around`].
pub(super) fn others(frame: u32) -> impl Iterator<Item = (usize, u32)> {
    let reach = i64::from(REACH);
    let offsets = (-reach..=reach).filter(|&offset| offset != 0);
    let frames = offsets.map(move |offset| u32::try_from(i64::from(frame) + offset).ok());
    let placed = frames.enumerate();
    placed.filter_map(|(side, frame)| Some((side, frame?)))
}

/// Metadata of a frame's pictures without the inputs other than the frame itself.
pub(super) fn attributes(
    cache: &CacheReader,
    request: &RenderRequest,
    frame: u32,
) -> Result<Attributes, CacheError> {
    let manifest = cache.manifest();
    Ok(Attributes {
        frame,
        shot: manifest.shot.clone(),
        software: format!(
            "{} {}{}{}",
            swell_domain::PROGRAM,
            swell_domain::VERSION,
            shaders_note(request.gpu.shaders.edited()),
            baked_note(manifest)
        ),
        scene_hash: manifest.scene_hash.clone(),
        cache_hash: cache.frame_hash(frame)?.to_owned(),
        look_hash: request.look.hash(),
    })
}

/// Note about the shaders of a cache that follows the program's name; empty for built-in shaders.
pub(super) fn baked_note(manifest: &Manifest) -> String {
    let note = shaders_note(manifest.edited_shaders());
    match note.is_empty() {
        true => note,
        false => format!(", of a cache baked{note}"),
    }
}

/// `SHOT.0001`, with as many digits as the last cached frame needs, at least four.
pub(super) fn name(shot: &str, frame: u32, last_frame: u32, numbering: Numbering) -> String {
    let digits = numbering.of(last_frame).to_string().len().max(4);
    let number = numbering.of(frame);
    format!("{shot}.{number:0digits$}")
}

fn ending(format: FormatSpec) -> &'static str {
    match format {
        FormatSpec::Png => "png",
        FormatSpec::Exr => "exr",
    }
}

/// Name and format of each of a frame's pictures.
pub(super) fn pictures(
    cache: &CacheReader,
    look: &Look,
    frame: u32,
    numbering: Numbering,
) -> Vec<(String, FormatSpec)> {
    let name = name(&cache.manifest().shot, frame, cache.last_frame(), numbering);
    let formats = look.spec().output.formats.iter();
    formats
        .map(|&format| (format!("{name}.{}", ending(format)), format))
        .collect()
}

/// Name of a frame's PNG, with the cache's own frame number.
pub fn picture_name(cache: &CacheReader, frame: u32) -> String {
    let shot = &cache.manifest().shot;
    let name = name(shot, frame, cache.last_frame(), Numbering::default());
    format!("{name}.{}", ending(FormatSpec::Png))
}

pub(super) fn is_current(file: &Path, format: FormatSpec, attributes: &Attributes) -> bool {
    let found = match format {
        FormatSpec::Png => read_png_attributes(file),
        FormatSpec::Exr => read_exr_attributes(file),
    };
    found.is_ok_and(|found| found == *attributes)
}

pub(super) fn write(
    file: &Path,
    format: FormatSpec,
    image: &Image,
    attributes: &Attributes,
    look: &Look,
) -> Result<(), RenderError> {
    match format {
        FormatSpec::Png => write_png_with_attributes(file, image, &look.spec().view, attributes),
        FormatSpec::Exr => write_exr(file, image, attributes),
    }
}
