//! Compares two renders: pictures matched by name.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use rayon::prelude::*;

use super::{DiffError, DiffRequest, Images};
use swell_compare::pictures::{self, Encoding, PairDiff, Picture, PicturesDiff, difference_image};
use swell_domain::{
    frame_range::FrameRange,
    output::{create_folder, paths},
    tolerance::PictureLimits,
};
use swell_render::{
    RenderError,
    image::{read_exr, read_png, write_rgb_png},
};

fn encoding(path: &Path) -> Option<Encoding> {
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    match extension.as_str() {
        "png" => Some(Encoding::Srgb),
        "exr" => Some(Encoding::Linear),
        _ => None,
    }
}

/// Judged by the extension.
pub(super) fn is_picture(path: &Path) -> bool {
    encoding(path).is_some()
}

/// Frame number of `NAME.0001.png`.
fn frame_of(path: &Path) -> Option<u32> {
    let stem = path.file_stem()?.to_str()?;
    stem.rsplit('.').next()?.parse().ok()
}

/// Pictures of a folder by name.
pub(super) fn in_folder(
    folder: &Path,
    frames: Option<&FrameRange>,
) -> Result<BTreeMap<String, PathBuf>, DiffError> {
    let mut found = BTreeMap::new();
    for path in paths(folder)? {
        let is_wanted = |frames: &FrameRange| frame_of(&path).is_some_and(|f| frames.contains(f));
        if is_picture(&path) && path.is_file() && frames.is_none_or(is_wanted) {
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            found.insert(name.into_owned(), path);
        }
    }
    Ok(found)
}

/// [`in_folder`] that requires a picture of every frame requested by number.
fn wanted(
    folder: &Path,
    frames: Option<&FrameRange>,
) -> Result<BTreeMap<String, PathBuf>, DiffError> {
    let found = in_folder(folder, frames)?;
    let numbers: Vec<u32> = found.values().filter_map(|path| frame_of(path)).collect();
    let mut asked = frames.into_iter().flat_map(FrameRange::iter);
    match asked.find(|frame| !numbers.contains(frame)) {
        None => Ok(found),
        Some(frame) => Err(DiffError::usage(format!(
            "frames {}: {} has no picture of frame {frame}",
            frames.map(ToString::to_string).unwrap_or_default(),
            folder.display()
        ))),
    }
}

pub(super) fn compare_folders(request: &DiffRequest) -> Result<PicturesDiff, DiffError> {
    let [a, b] = [&request.a, &request.b].map(|folder| wanted(folder, request.frames.as_ref()));
    let (a, b) = (a?, b?);
    if let Some(images) = &request.images {
        for folder in [&request.a, &request.b] {
            refuse_same(&images.path, folder)?;
        }
        create_folder(&images.path)?;
    }
    let lone = |x: &BTreeMap<String, PathBuf>, y: &BTreeMap<String, PathBuf>| {
        let names = x.keys().filter(|name| !y.contains_key(*name));
        names.cloned().collect()
    };
    let both: Vec<_> = a
        .iter()
        .filter_map(|(name, file)| Some((name, file, b.get(name)?)))
        .collect();
    let pair = |&(name, a, b): &(&String, &PathBuf, &PathBuf)| {
        let images = request.images.as_ref().map(|images| Images {
            // The name keeps its extension, because an EXR and a PNG of one frame share a folder.
            path: images.path.join(format!("{name}.difference.png")),
            gain: images.gain,
        });
        compare_pair(name, [a, b], limits(request), images.as_ref())
    };
    Ok(PicturesDiff {
        only_a: lone(&a, &b),
        only_b: lone(&b, &a),
        pairs: both.par_iter().map(pair).collect::<Result<_, _>>()?,
    })
}

pub(super) fn compare_files(request: &DiffRequest) -> Result<PicturesDiff, DiffError> {
    if let Some(frames) = &request.frames {
        return Err(DiffError::usage(format!(
            "frames {frames}: two pictures have no frames to choose from"
        )));
    }
    if encoding(&request.a) != encoding(&request.b) {
        return Err(DiffError::usage(
            "a PNG has gone through the look's view transform, an EXR has not: they do not compare",
        ));
    }
    if let Some(images) = &request.images {
        if encoding(&images.path) != Some(Encoding::Srgb) {
            let path = images.path.display();
            return Err(DiffError::usage(format!(
                "the difference image {path} has to end in .png"
            )));
        }
        for file in [&request.a, &request.b] {
            refuse_same(&images.path, file)?;
        }
    }
    let name = request.a.file_name().unwrap_or_default().to_string_lossy();
    let files = [request.a.as_path(), &request.b];
    let pair = compare_pair(&name, files, limits(request), request.images.as_ref())?;
    Ok(PicturesDiff {
        only_a: Vec::new(),
        only_b: Vec::new(),
        pairs: vec![pair],
    })
}

fn limits(request: &DiffRequest) -> Option<&PictureLimits> {
    request.tolerance.as_ref().map(|t| &t.pictures)
}

fn refuse_same(output: &Path, input: &Path) -> Result<(), DiffError> {
    match (output.canonicalize(), input.canonicalize()) {
        (Ok(output), Ok(input)) if output == input => Err(DiffError::usage(format!(
            "the difference image {} is one of the compared pictures: choose another",
            input.display()
        ))),
        _ => Ok(()),
    }
}

fn compare_pair(
    name: &str,
    files: [&Path; 2],
    limits: Option<&PictureLimits>,
    images: Option<&Images>,
) -> Result<PairDiff, DiffError> {
    let [a, b] = [load(files[0])?, load(files[1])?];
    let diff = pictures::compare(&a, &b)?;
    let image = match (&diff, images) {
        (Some(_), Some(images)) => {
            let pixels = difference_image(&a, &b, images.gain);
            let comment = format!("|a - b| of {name} times {}", images.gain);
            write_rgb_png(&images.path, [a.width, a.height], &pixels, &comment)?;
            Some(images.path.clone())
        }
        _ => None,
    };
    Ok(PairDiff {
        name: name.to_owned(),
        sizes: [[a.width, a.height], [b.width, b.height]],
        corners: [a.corner, b.corner],
        faults: diff.map_or(Vec::new(), |diff| diff.faults(limits)),
        diff,
        image,
    })
}

fn load(path: &Path) -> Result<Picture, RenderError> {
    let (encoding, ((width, height, pixels), corner)) = match encoding(path) {
        Some(Encoding::Linear) => (Encoding::Linear, read_exr(path)?),
        _ => (Encoding::Srgb, (read_png(path)?, [0, 0])),
    };
    Ok(Picture {
        width,
        height,
        corner,
        pixels,
        encoding,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_numbers_stand_before_the_extension() {
        assert_eq!(frame_of(Path::new("a/wave-city.v2.0068.png")), Some(68));
        assert_eq!(frame_of(Path::new("0007.exr")), Some(7));
        assert_eq!(frame_of(Path::new("still.png")), None);
        assert!(is_picture(Path::new("A.PNG")) && !is_picture(Path::new("a.jpg")));
    }
}
