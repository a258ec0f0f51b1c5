//! Reads rendered pictures as a screen shows them.

use std::{
    collections::BTreeMap,
    fs::File,
    io::BufReader,
    path::{Path, PathBuf},
};

use exr::meta::MetaData;
use glam::{DMat3, DVec3};

use super::{
    ViewError,
    strip::{Label, PictureSource, Strip, name_of},
};
use swell_domain::output::{self, AtPath as _};
use swell_render::{
    Attributes, RenderError,
    colour::{REC_709, Space},
    image::{read_exr, read_header, read_png},
    view::apply,
};
use swell_scene::look::ViewSpec;
use swell_study::rgb::Rgb;

/// PNG before EXR: if a frame has both, the PNG shows what its look intends.
const ENDINGS: [&str; 2] = ["png", "exr"];

fn ending(path: &Path) -> Option<usize> {
    let ending = path.extension()?.to_str()?.to_ascii_lowercase();
    ENDINGS.iter().position(|known| *known == ending)
}

/// `("shot", 12)` for `shot.0012.png`.
fn numbered(path: &Path) -> Option<(String, u32)> {
    let stem = path.file_stem()?.to_str()?;
    let (name, digits) = stem.rsplit_once('.').unwrap_or(("", stem));
    let is_number = !digits.is_empty() && digits.bytes().all(|b| b.is_ascii_digit());
    Some((name.to_owned(), digits.parse().ok().filter(|_| is_number)?))
}

/// Pictures of a folder, sorted by name.
pub(super) fn in_folder(folder: &Path) -> Result<Vec<PathBuf>, ViewError> {
    let mut found = output::paths(folder)?;
    found.retain(|path| ending(path).is_some() && path.is_file());
    Ok(found)
}

/// Opens a folder of pictures; `None` if it has none. Checks that all pictures have the same size.
pub(super) fn open(folder: &Path, view: Option<&ViewSpec>) -> Result<Option<Strip>, ViewError> {
    let found = in_folder(folder)?;
    let files = match found.iter().any(|path| numbered(path).is_some()) {
        true => by_number(folder, &found)?,
        false => by_name(&found),
    };
    let Some(first) = files.values().next() else {
        return Ok(None);
    };
    let mut rate = None;
    let head = head(first)?;
    for file in files.values() {
        let other = self::head(file)?;
        if other.size != head.size {
            let [a, b] = [head.size, other.size].map(|[w, h]| format!("{w} × {h}"));
            return Err(ViewError::Asked(format!(
                "{} is {a} and {} is {b}: pictures of one sequence need the same size",
                first.display(),
                file.display()
            )));
        }
        rate = rate.or(other.frames_per_second);
    }
    let is_light = files.values().any(|file| ending(file) == Some(1));
    let note = match (is_light, view) {
        (false, _) => "",
        (true, None) => "The EXR files are shown through the view of a look that does not set one.",
        (true, Some(_)) => "The EXR files are shown through the view of the look.",
    };
    Ok(Some(Strip {
        path: folder.to_owned(),
        title: name_of(folder),
        note: note.to_owned(),
        labels: files.keys().cloned().collect(),
        size: head.size,
        frames_per_second: rate,
        source: PictureSource::Files(files, Box::new(view.cloned().unwrap_or_default())),
    }))
}

/// Pictures with a number, one per frame.
fn by_number(folder: &Path, found: &[PathBuf]) -> Result<BTreeMap<Label, PathBuf>, ViewError> {
    let mut files: BTreeMap<Label, PathBuf> = BTreeMap::new();
    let mut shot: Option<String> = None;
    for path in found {
        let Some((name, frame)) = numbered(path) else {
            continue;
        };
        let shot = shot.get_or_insert_with(|| name.clone());
        if *shot != name {
            return Err(ViewError::Asked(format!(
                "{} has pictures of two sequences, {shot}.* and {name}.*: put each into its own \
                 folder",
                folder.display()
            )));
        }
        let label = Label::Frame(frame);
        match files.get(&label) {
            Some(other) if ending(other) == ending(path) => {
                return Err(ViewError::Asked(format!(
                    "{} and {} are both frame {frame}",
                    other.display(),
                    path.display()
                )));
            }
            Some(other) if ending(other) < ending(path) => {}
            _ => {
                files.insert(label, path.clone());
            }
        }
    }
    Ok(files)
}

fn by_name(found: &[PathBuf]) -> BTreeMap<Label, PathBuf> {
    let mut files: BTreeMap<Label, PathBuf> = BTreeMap::new();
    for path in found {
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let place = files
            .entry(Label::Name(stem.into_owned()))
            .or_insert_with(|| path.clone());
        if ending(path) < ending(place) {
            place.clone_from(path);
        }
    }
    files
}

/// Contents of a picture's header.
struct Head {
    /// Size of the displayed image.
    size: [usize; 2],
    frames_per_second: Option<f64>,
}

fn damaged(file: &Path, message: impl ToString) -> ViewError {
    ViewError::Picture(RenderError::Format {
        file: file.to_owned(),
        message: message.to_string(),
    })
}

fn head(file: &Path) -> Result<Head, ViewError> {
    if ending(file) == Some(1) {
        let header = exr_header(file)?;
        let window = header.shared_attributes.display_window.size;
        let rate = header.own_attributes.frames_per_second;
        return Ok(Head {
            size: [window.0, window.1],
            frames_per_second: rate.map(|(many, of)| f64::from(many) / f64::from(of)),
        });
    }
    let opened = File::open(file).at(file)?;
    let reader = png::Decoder::new(BufReader::new(opened)).read_info();
    let reader = reader.map_err(|error| damaged(file, error))?;
    let info = reader.info();
    Ok(Head {
        size: [info.width as usize, info.height as usize],
        frames_per_second: None,
    })
}

fn exr_header(file: &Path) -> Result<exr::meta::header::Header, ViewError> {
    let meta = MetaData::read_from_file(file, true).map_err(|error| damaged(file, error))?;
    let first = meta.headers.into_iter().next();
    first.ok_or_else(|| damaged(file, "it has no layer"))
}

/// The recorded origin of a picture; `None` if it records none or is unreadable.
pub(super) fn attributes(file: &Path) -> Option<Attributes> {
    read_header(file)
        .ok()
        .flatten()
        .filter(|it| !it.cache_hash.is_empty())
}

/// A picture as a screen shows it, over black.
pub(super) fn read(file: &Path, view: &ViewSpec) -> Result<Rgb, ViewError> {
    if ending(file) == Some(1) {
        return read_light(file, view);
    }
    let (width, height, pixels) = read_png(file)?;
    let byte = |value: f32| (value * 255.0).round() as u8;
    let pixels = pixels
        .iter()
        .map(|&[r, g, b, a]| [r, g, b].map(|x| byte(x * a)));
    Ok(Rgb {
        size: [width, height],
        pixels: pixels.collect(),
    })
}

/// The displayed image of an EXR: black outside the rendered window.
fn read_light(file: &Path, view: &ViewSpec) -> Result<Rgb, ViewError> {
    let header = exr_header(file)?;
    let window = header.shared_attributes.display_window.size;
    let ((width, height, pixels), corner) = read_exr(file)?;
    let to_709 = header.shared_attributes.chromaticities.and_then(|found| {
        let xy = |v: exr::math::Vec2<f32>| [v.0, v.1].map(f64::from);
        let space = Space {
            primaries: [found.red, found.green, found.blue].map(xy),
            white: xy(found.white),
        };
        is_other(&space).then(|| space.to(REC_709))
    });
    let mut shown = Rgb::filled([window.0, window.1], [0; 3]);
    for row in 0..height {
        for column in 0..width {
            let at = [
                column as i64 + i64::from(corner[0]),
                row as i64 + i64::from(corner[1]),
            ];
            let [Ok(x), Ok(y)] = at.map(usize::try_from) else {
                continue;
            };
            if x < window.0 && y < window.1 {
                let [r, g, b, _] = pixels[row * width + column];
                shown.pixels[y * window.0 + x] = on_screen(view, to_709.as_ref(), [r, g, b]);
            }
        }
    }
    Ok(shown)
}

/// Whether the primaries are not Rec. 709. Files store chromaticities as 32-bit floats, so even
/// those of Rec. 709 differ by rounding.
fn is_other(space: &Space) -> bool {
    let all = |space: &Space| [space.primaries.as_flattened(), &space.white[..]].concat();
    let both = all(space).into_iter().zip(all(&REC_709));
    both.into_iter()
        .any(|(a, b)| (a - b).abs() > f64::from(f32::EPSILON))
}

/// Converts premultiplied light, over black.
fn on_screen(view: &ViewSpec, to_709: Option<&DMat3>, light: [f32; 3]) -> [u8; 3] {
    let light = match to_709 {
        Some(matrix) => (*matrix * DVec3::from(light.map(f64::from)))
            .as_vec3()
            .to_array(),
        None => light,
    };
    apply(view, light).map(|x| (x * 255.0).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_before_the_ending() {
        let of = |name: &str| numbered(Path::new(name));
        assert_eq!(
            of("a/wave-city.v2.0068.png"),
            Some(("wave-city.v2".to_owned(), 68))
        );
        assert_eq!(of("0007.exr"), Some((String::new(), 7)));
        assert_eq!(of("sheet.png"), None);
        assert_eq!(of("a.+7.png"), None);
        assert_eq!(ending(Path::new("A.PNG")), Some(0));
        assert_eq!(ending(Path::new("a.jpg")), None);
    }

    #[test]
    fn light_of_other_primaries_is_shown_alike() {
        let view = ViewSpec::default();
        let space = swell_render::colour::ACES_CG;
        assert!(is_other(&space) && !is_other(&REC_709));
        let light = DVec3::new(0.4, 0.2, 0.1);
        let as_aces = (REC_709.to(space) * light).as_vec3().to_array();
        let wanted = on_screen(&view, None, light.as_vec3().to_array());
        assert_eq!(on_screen(&view, Some(&space.to(REC_709)), as_aces), wanted);
        assert_ne!(on_screen(&view, None, as_aces), wanted, "the control");
    }
}
