//! `view`: what is there, to look at: a contact sheet, a movie, a page that plays the frames. Nothing that is looked at is changed.

mod curves;
mod error;
mod movie;
mod particles;
mod pictures;
mod reel;
mod store;
mod strip;
mod study;

use std::{
    path::{Path, PathBuf},
    sync::atomic::AtomicBool,
};

use swell_cache::CacheReader;
use swell_domain::frame_range::FrameRange;
use swell_scene::look::Look;

use self::{
    curves::Curves,
    reel::{Reel, names},
    strip::{Label, Source, Strip},
};

pub use self::{
    error::ViewError,
    store::{MOST, Placing},
};
pub use swell_study::points::Aspect;

/// What to look at, and by what.
#[derive(Clone, Debug)]
pub struct Request {
    /// A folder of pictures, a cache or the folder of a study; or two of the first two that are held against each other.
    pub subjects: Vec<PathBuf>,
    /// Where sheet and page go; `views/NAME` where `None`.
    pub directory: Option<PathBuf>,
    /// Frames to look at; all where `None`.
    pub frames: Option<FrameRange>,
    /// A contact sheet of at most so many frames; `None` for none.
    pub sheet: Option<usize>,
    /// A movie: APNG, MP4 or WebM by its ending.
    pub movie: Option<PathBuf>,
    /// Whether a page is made.
    pub player: bool,
    /// Where the page has its pictures.
    pub placing: Placing,
    /// Pixels that pictures of page and movie are at most wide; where `None`, those of a page [`PAGE_WIDTH`], those of a movie as they are.
    pub width: Option<usize>,
    /// Frames a second; where `None`, those of the cache or the pictures, else [`RATE`].
    pub frames_per_second: Option<f64>,
    /// The look through whose view EXR files are shown.
    pub look: Option<Look>,
    /// From where particles of a cache are looked at.
    pub aspect: Aspect,
    /// Cache whose probes and ledger are drawn below the pictures; a cache that is looked at has its own.
    pub curves: Option<PathBuf>,
    /// The program that encodes MP4 and WebM.
    pub ffmpeg: String,
}

/// Frames of a contact sheet at most, unless more are asked for.
pub const SHEET: usize = 60;
/// Pixels that pictures of a page are at most wide: as wide as a window is.
pub const PAGE_WIDTH: usize = 1280;
/// Frames a second of pictures that do not say it.
pub const RATE: f64 = 24.0;

/// What a view has to tell while it goes on.
#[derive(Clone, Debug)]
pub enum Event {
    /// What is looked at is open.
    Ready {
        /// Frames.
        frames: usize,
        /// Pixels of each.
        size: [usize; 2],
    },
    /// What a user may want to know.
    Note(String),
    /// What a user has to know.
    Warning(String),
    /// A frame's pictures are read.
    Frame(String),
}

/// What there is to look at now.
#[derive(Clone, Debug, Default)]
pub struct Outcome {
    /// What each is, the file, and its bytes.
    pub files: Vec<(&'static str, PathBuf, u64)>,
    /// What a browser would show.
    pub page: Option<PathBuf>,
    /// Whether a signal ended it; then nothing was made.
    pub interrupted: bool,
}

/// Makes what a request asks for.
///
/// # Errors
/// [`ViewError`]; then nothing is left half made.
pub fn view(
    request: &Request,
    stop: &AtomicBool,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome, ViewError> {
    if request.sheet.is_none() && request.movie.is_none() && !request.player {
        return Err(ViewError::Asked(
            "nothing to make: --sheet, --movie or --player".to_owned(),
        ));
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

/// Caches whose curves are drawn, with their names: the one that is asked for, or those that are looked at.
fn caches(request: &Request, strips: &[Strip]) -> Vec<(String, PathBuf)> {
    if let Some(cache) = &request.curves {
        return vec![(String::new(), cache.clone())];
    }
    let named = names(strips).into_iter().zip(strips);
    named
        .filter(|(_, strip)| matches!(strip.source, Source::Cache(_)))
        .map(|(name, strip)| (name, strip.path.clone()))
        .collect()
}

/// What is looked at.
fn open(request: &Request) -> Result<Vec<Strip>, ViewError> {
    let view = request.look.as_ref().map(|look| &look.spec().view);
    let open = |path: &PathBuf| {
        if !path.exists() {
            return Err(ViewError::Missing(path.clone()));
        }
        if !path.is_dir() {
            return Err(ViewError::Asked(format!(
                "{} is no folder: name a folder of pictures, a cache, or the folder of a study",
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
                "nothing to see in {}: it is no cache and no study, and has no pictures (PNG, EXR){within}",
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
        && let (Source::Cache(first), Source::Cache(second)) = (&mut a.source, &mut b.source)
    {
        first.top = first.top.max(second.top);
        second.like(first);
        b.size = a.size;
    }
    if let [a, b] = &strips[..] {
        let [wide, high] = [a.size[0] * b.size[1], a.size[1] * b.size[0]];
        // The same shape, but for the rounding of a side to a whole pixel.
        if wide.abs_diff(high) > a.size[0].max(b.size[0]) {
            return Err(ViewError::Asked(format!(
                "{} is {} × {} and {} is {} × {}: pictures that are held against each other have one shape",
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

/// Frames to look at: those that are asked for, or those that all have.
fn chosen(
    strips: &[Strip],
    frames: Option<&FrameRange>,
    tell: &mut dyn FnMut(Event),
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
            tell(Event::Note(format!(
                "{alone} of the {} frames of {} are left out: the other one has none of these",
                strip.labels.len(),
                strip.path.display()
            )));
        }
    }
    Ok(labels)
}

/// Nothing goes into a cache.
fn check_place(file: &Path) -> Result<(), ViewError> {
    match swell_cache::around(file) {
        None => Ok(()),
        Some(cache) => Err(ViewError::IntoCache {
            file: file.to_owned(),
            cache,
        }),
    }
}

/// A cache that has to be there.
fn reader(path: &Path) -> Result<CacheReader, ViewError> {
    match path.exists() {
        true => Ok(CacheReader::open(path)?),
        false => Err(ViewError::Missing(path.to_owned())),
    }
}
