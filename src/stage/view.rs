//! `view`: shows pictures, a cache or a study as a contact sheet, a movie, or a page that plays the
//! frames. The subjects are only read.

mod apng;
mod curves;
mod error;
mod movie;
mod particles;
mod pictures;
mod player;
mod points;
mod reel;
mod sheet;
mod store;
mod strip;
mod study;

use std::{
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
};

use swell_cache::{CacheReader, refuse_inside};
use swell_domain::frame_range::FrameRange;
use swell_scene::look::Look;
use swell_study::raster::{self, RasterError};

use self::{
    curves::Curves,
    reel::{Reel, names},
    strip::{Label, PictureSource, Strip},
};

pub use self::{
    error::ViewError,
    store::{MOST, Placing},
};
pub use points::Aspect;

/// What to view, and in which form.
#[derive(Clone, Debug)]
pub struct ViewRequest {
    /// A folder of pictures, a cache, or the folder of a study; or two to compare, each a folder of
    /// pictures or a cache.
    pub subjects: Vec<PathBuf>,
    /// Output folder of sheet and page; `views/NAME` if `None`.
    pub directory: Option<PathBuf>,
    /// Frames to view; all if `None`.
    pub frames: Option<FrameRange>,
    /// Most frames of a contact sheet; `None` for no sheet.
    pub sheet: Option<usize>,
    /// Movie file to write: APNG, MP4 or WebM depending on its extension.
    pub movie: Option<PathBuf>,
    /// Whether to make a page.
    pub player: bool,
    /// Where the page stores its pictures.
    pub placing: Placing,
    /// Greatest width of the pictures of page and movie, pixels. If `None`, [`PAGE_WIDTH`] for a
    /// page and the full width for a movie.
    pub width: Option<usize>,
    /// Frames per second; if `None`, those of the cache or the pictures, else [`RATE`].
    pub frames_per_second: Option<f64>,
    /// The look whose view transform is applied to EXR files.
    pub look: Option<Look>,
    /// Viewing direction for the particles of a cache.
    pub aspect: Aspect,
    /// Cache whose probes and ledger are plotted below the pictures; a viewed cache provides its
    /// own.
    pub curves: Option<PathBuf>,
    /// Program that encodes MP4 and WebM.
    pub ffmpeg: String,
}

/// Default for the most frames of a contact sheet.
pub const SHEET: usize = 60;
/// Default for the greatest width of a page's pictures, pixels: about that of a window.
pub const PAGE_WIDTH: usize = 1280;
/// Frames per second of pictures that do not specify them.
pub const RATE: f64 = 24.0;

/// Progress of a running view.
#[derive(Clone, Debug)]
pub enum ViewEvent {
    /// The subjects are open.
    Ready {
        /// Number of frames.
        frames: usize,
        /// Columns and rows of each.
        size: [usize; 2],
    },
    /// Information for the user.
    Note(String),
    /// [`RATE`] is assumed, as nothing tells the frames per second.
    AssumedRate,
    /// The page's pictures, of this many bytes, are too large for it and are beside it.
    PicturesBeside(u64),
    /// Warning for the user.
    Warning(String),
    /// A frame's pictures were read.
    Frame(String),
}

/// Result of a view.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct ViewOutcome {
    /// Kind, path and bytes of each file made.
    pub files: Vec<(&'static str, PathBuf, u64)>,
    /// The file to open in a browser.
    pub page: Option<PathBuf>,
    /// Whether a signal ended it; then nothing was made.
    pub interrupted: bool,
}

/// Makes what a request asks for.
///
/// # Errors
/// [`ViewError`]; then no incomplete file is left.
pub fn view(
    request: &ViewRequest,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(ViewEvent),
) -> Result<ViewOutcome, ViewError> {
    if request.sheet.is_none() && request.movie.is_none() && !request.player {
        return Err(ViewError::Nothing);
    }
    if request.sheet.is_some() {
        raster::require().map_err(RasterError::from)?;
    }
    if let [folder] = &request.subjects[..]
        && study::is_one(folder)
    {
        return study::view(request, folder, tell);
    }
    let strips = open(request)?;
    let labels = chosen(&strips, request.frames.as_ref(), tell)?;
    let curves = Curves::of(&caches(request, &strips))?;
    let reel = Reel::of(request, strips, labels, curves, tell)?;
    reel.run(stop, tell)
}

/// Caches whose curves are drawn, with their names: the requested one, or those that are viewed.
fn caches(request: &ViewRequest, strips: &[Strip]) -> Vec<(String, PathBuf)> {
    if let Some(cache) = &request.curves {
        return vec![(String::new(), cache.clone())];
    }
    let named = names(strips).into_iter().zip(strips);
    named
        .filter(|(_, strip)| matches!(strip.source, PictureSource::Cache(_)))
        .map(|(name, strip)| (name, strip.path.clone()))
        .collect()
}

/// Opens the subjects.
fn open(request: &ViewRequest) -> Result<Vec<Strip>, ViewError> {
    let view = request.look.as_ref().map(|look| &look.spec().view);
    let open = |path: &PathBuf| {
        if !path.exists() {
            return Err(ViewError::Missing(path.clone()));
        }
        if !path.is_dir() {
            return Err(ViewError::Asked(format!(
                "{} is not a folder: name a folder of pictures, a cache, or the folder of a study",
                path.display()
            )));
        }
        if swell_cache::exists(path) {
            return particles::open(path, request.aspect, request.frames.as_ref());
        }
        let nothing = || {
            let is_one = |path: &Path| {
                let has_pictures = || pictures::in_folder(path).is_ok_and(|it| !it.is_empty());
                swell_cache::exists(path) || study::is_one(path) || has_pictures()
            };
            let within = match &swell_cache::within(path, &is_one)[..] {
                [] => String::new(),
                found => format!("; within it there are {}", found.join(", ")),
            };
            ViewError::Asked(format!(
                "nothing to view in {}: it is neither a cache nor a study, and has no pictures \
                 (PNG, EXR){within}",
                path.display()
            ))
        };
        pictures::open(path, view)?.ok_or_else(nothing)
    };
    let mut strips: Vec<Strip> = request
        .subjects
        .iter()
        .map(open)
        .collect::<Result<_, _>>()?;
    if let [a, b] = &mut strips[..]
        && let (PictureSource::Cache(first), PictureSource::Cache(second)) =
            (&mut a.source, &mut b.source)
    {
        first.top = first.top.max(second.top);
        second.like(first);
        b.size = a.size;
    }
    if let [a, b] = &strips[..] {
        let [wide, high] = [a.size[0] * b.size[1], a.size[1] * b.size[0]];
        // The same shape up to the rounding of a side to whole pixels.
        if wide.abs_diff(high) > a.size[0].max(b.size[0]) {
            return Err(ViewError::Asked(format!(
                "{} is {} × {} and {} is {} × {}: pictures that are compared need the same shape",
                a.path.display(),
                a.size[0],
                a.size[1],
                b.path.display(),
                b.size[0],
                b.size[1],
            )));
        }
    }
    Ok(strips)
}

/// Frames to view: the requested ones, or those that all subjects have.
fn chosen(
    strips: &[Strip],
    frames: Option<&FrameRange>,
    tell: &mut dyn FnMut(ViewEvent),
) -> Result<Vec<Label>, ViewError> {
    if let Some(frames) = frames {
        let labels: Vec<Label> = frames.iter().map(Label::Frame).collect();
        for strip in strips {
            if let Some(label) = labels.iter().find(|label| !strip.has(label)) {
                return Err(strip.lacks(label));
            }
        }
        return Ok(labels);
    }
    let has = |label: &&Label| strips.iter().all(|strip| strip.has(label));
    let labels: Vec<Label> = strips[0].labels.iter().filter(has).cloned().collect();
    if let ([a, b], []) = (strips, &labels[..]) {
        return Err(ViewError::Asked(format!(
            "{} and {} have no frame in common",
            a.path.display(),
            b.path.display()
        )));
    }
    for strip in strips {
        let alone = strip.labels.len() - labels.len();
        if alone > 0 {
            tell(ViewEvent::Note(format!(
                "{alone} of the {} frames of {} are omitted: the other one does not have them",
                strip.labels.len(),
                strip.path.display()
            )));
        }
    }
    Ok(labels)
}

/// Refuses an output inside a cache.
fn check_place(file: &Path) -> Result<(), ViewError> {
    Ok(refuse_inside(file, "name")?)
}

/// Opens a cache that must exist.
fn reader(path: &Path) -> Result<CacheReader, ViewError> {
    match path.exists() {
        true => Ok(CacheReader::open(path)?),
        false => Err(ViewError::Missing(path.to_owned())),
    }
}
