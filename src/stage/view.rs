//! `view`: what is there, to look at: a contact sheet, a movie, a page that plays the frames. Nothing that is looked at is changed.

mod curves;
mod error;
mod movie;
mod pictures;
mod store;
mod strip;

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering},
};

use rayon::prelude::*;

use crate::{
    cache::{self, CacheReader},
    domain::frame_range::FrameRange,
    scene::look::Look,
    study::{
        player::{Player, Set},
        rgb::Rgb,
        sheet::{Cell, sheet},
    },
};

use self::{
    curves::Curves,
    movie::Movie,
    store::{Store, write},
    strip::{Label, Strip},
};

pub use self::{
    error::ViewError,
    store::{MOST, Placing},
};

/// What to look at, and by what.
#[derive(Clone, Debug)]
pub struct Request {
    /// One folder of pictures, or two that are held against each other.
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
    /// Cache whose probes and ledger are drawn below the pictures.
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
    let strips = open(request)?;
    let curves = Curves::of(request.curves.as_deref())?;
    let labels = chosen(&strips, request.frames.as_ref(), tell)?;
    let reel = Reel::of(request, strips, labels, curves, tell)?;
    reel.run(stop, tell)
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
                "{} is no folder: name the folder of its pictures",
                path.display()
            )));
        }
        let nothing = || {
            ViewError::Asked(format!(
                "nothing to see in {}: it has no pictures (PNG, EXR)",
                path.display()
            ))
        };
        pictures::open(path, view)?.ok_or_else(nothing)
    };
    let strips: Vec<Strip> = request
        .subjects
        .iter()
        .map(open)
        .collect::<Result<_, _>>()?;
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
    for strip in strips {
        let alone = strip.labels.len() - labels.len();
        if labels.is_empty() {
            return Err(ViewError::Asked(format!(
                "{} and {} have no frame in common",
                strips[0].path.display(),
                strip.path.display()
            )));
        }
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

/// A view that is ready to go.
struct Reel<'a> {
    request: &'a Request,
    strips: Vec<Strip>,
    labels: Vec<Label>,
    curves: Curves,
    directory: PathBuf,
    title: String,
    notes: Vec<String>,
    rate: f64,
}

/// One frame, read, and reduced to what is made of it.
struct Framed {
    joined: Option<Rgb>,
    cell: Option<Cell>,
    /// One PNG a strip.
    page: Vec<Vec<u8>>,
}

/// In PNG files of ours.
const SOFTWARE: &str = "swell view";
/// Pixels that a picture of a sheet is wide, and pictures in a row; of two side by side half as many.
const THUMB: usize = 320;
const COLUMNS: usize = 6;

impl<'a> Reel<'a> {
    fn of(
        request: &'a Request,
        strips: Vec<Strip>,
        labels: Vec<Label>,
        curves: Curves,
        tell: &mut dyn FnMut(Event),
    ) -> Result<Self, ViewError> {
        let names = names(&strips);
        let default = || Path::new("views").join(names.join("-vs-").replace(['/', '\\'], "-"));
        let directory = request.directory.clone().unwrap_or_else(default);
        for file in [Some(&directory), request.movie.as_ref()]
            .into_iter()
            .flatten()
        {
            if let Some(cache) = cache::around(file) {
                return Err(ViewError::IntoCache {
                    file: file.clone(),
                    cache,
                });
            }
        }
        if let Some(movie) = &request.movie {
            movie::Kind::of(movie)?;
        }
        let mut notes: Vec<String> = strips.iter().map(|strip| strip.note.clone()).collect();
        notes.retain(|note| !note.is_empty());
        notes.dedup();
        for note in &notes {
            tell(Event::Note(note.clone()));
        }
        let known = strips.iter().find_map(|strip| strip.frames_per_second);
        let known = request
            .frames_per_second
            .or(curves.frames_per_second)
            .or(known);
        if known.is_none() && labels.len() > 1 && (request.player || request.movie.is_some()) {
            tell(Event::Note(format!(
                "{RATE} frames a second, since nothing says another rate: --fps, or --curves with the cache"
            )));
        }
        for strip in &strips {
            if let Some(warning) = curves.stranger(strip, &labels) {
                tell(Event::Warning(warning));
            }
        }
        Ok(Self {
            request,
            title: names.join(" | "),
            strips,
            labels,
            curves,
            directory,
            notes,
            rate: known.unwrap_or(RATE),
        })
    }

    /// Frames of the sheet: all, or as many evenly spread ones as it has at most.
    fn on_sheet(&self) -> Vec<usize> {
        let count = self.labels.len();
        let most = self.request.sheet.unwrap_or(0).min(count);
        let place = |k: usize| k * (count - 1) / (most - 1).max(1);
        (0..most).map(place).collect()
    }

    /// Pixels of the movie: of one picture, or of two side by side.
    fn movie_size(&self) -> [usize; 2] {
        let most = self.request.width.unwrap_or(usize::MAX);
        let [width, height] = Rgb::within(self.strips[0].size, most);
        [width * self.strips.len(), height]
    }

    fn run(self, stop: &AtomicBool, tell: &mut dyn FnMut(Event)) -> Result<Outcome, ViewError> {
        let request = self.request;
        tell(Event::Ready {
            frames: self.labels.len(),
            size: self.strips[0].size,
        });
        let begin = |file: &PathBuf| {
            let (size, count) = (self.movie_size(), self.labels.len());
            Movie::begin(file, size, count, self.rate, &request.ffmpeg)
        };
        let sheet_file = self.directory.join("sheet.png");
        if request.sheet.is_some() {
            check_sheet(&sheet_file)?;
        }
        if request.sheet.is_some() || request.player {
            fs::create_dir_all(&self.directory).map_err(ViewError::at(&self.directory))?;
        }
        let store = || Store::begin(&self.directory, request.placing, MOST);
        let mut store = request.player.then(store).transpose()?;
        let mut movie = request.movie.as_ref().map(begin).transpose()?;
        let on_sheet = self.on_sheet();
        let mut cells = Vec::new();
        let numbers: Vec<usize> = (0..self.labels.len()).collect();
        for part in numbers.chunks(2 * rayon::current_num_threads()) {
            if stop.load(Ordering::Relaxed) {
                return Ok(Outcome {
                    interrupted: true,
                    ..Outcome::default()
                });
            }
            let read = |&k: &usize| self.framed(k, on_sheet.binary_search(&k).is_ok());
            let read: Vec<Framed> = part.par_iter().map(read).collect::<Result<_, _>>()?;
            for (k, framed) in part.iter().zip(read) {
                if let (Some(movie), Some(joined)) = (&mut movie, &framed.joined) {
                    movie.push(joined)?;
                }
                cells.extend(framed.cell);
                if let Some(store) = &mut store {
                    for (strip, png) in framed.page.into_iter().enumerate() {
                        store.push(self.file_name(strip, *k), png)?;
                    }
                }
                tell(Event::Frame(self.labels[*k].words()));
            }
        }
        let mut outcome = Outcome::default();
        if let (Some(movie), Some(file)) = (movie, &request.movie) {
            outcome.files.push(("movie", file.clone(), movie.finish()?));
        }
        if request.sheet.is_some() {
            let bytes = self.write_sheet(&sheet_file, &cells)?;
            outcome.page = Some(sheet_file.clone());
            outcome.files.push(("contact sheet", sheet_file, bytes));
        }
        if let Some(store) = store {
            let (page, bytes) = self.write_page(store, tell)?;
            outcome.page = Some(page.clone());
            outcome.files.push(("player", page, bytes));
        }
        Ok(outcome)
    }

    /// `a.0012.png`
    fn file_name(&self, strip: usize, k: usize) -> String {
        let set = ["a", "b"][strip];
        match &self.labels[k] {
            Label::Frame(frame) => format!("{set}.{frame:04}.png"),
            Label::Name(name) => format!("{set}.{name}.png"),
        }
    }

    /// Reads a frame, and makes of it what is wanted.
    fn framed(&self, k: usize, is_on_sheet: bool) -> Result<Framed, ViewError> {
        let request = self.request;
        let label = &self.labels[k];
        let pictures = self.strips.iter().map(|strip| strip.picture(label));
        let pictures: Vec<Rgb> = pictures.collect::<Result<_, _>>()?;
        let first = pictures[0].size;
        let joined = |most: usize| {
            let size = Rgb::within(first, most);
            let mut parts = pictures.iter().map(|picture| picture.resized(size));
            let joined = parts.next().unwrap_or_else(|| Rgb::filled(size, [0; 3]));
            parts.fold(joined, |all, part| all.beside(&part))
        };
        let page = |picture: &Rgb| {
            let size = Rgb::within(picture.size, request.width.unwrap_or(PAGE_WIDTH));
            picture
                .resized(size)
                .to_png(SOFTWARE)
                .map_err(|source| ViewError::Encode {
                    file: self.directory.clone(),
                    source,
                })
        };
        let pages = match request.player {
            true => pictures.iter().map(page).collect::<Result<_, _>>()?,
            false => Vec::new(),
        };
        let time = self
            .curves
            .time(label)
            .map_or_else(String::new, |time| format!(", {time:.2} s"));
        Ok(Framed {
            cell: is_on_sheet.then(|| Cell {
                label: label.words() + &time,
                picture: joined(THUMB),
            }),
            joined: request
                .movie
                .as_ref()
                .map(|_| joined(request.width.unwrap_or(usize::MAX))),
            page: pages,
        })
    }

    fn write_sheet(&self, file: &Path, cells: &[Cell]) -> Result<u64, ViewError> {
        let columns = COLUMNS / self.strips.len();
        let shown = match (cells.len(), self.labels.len()) {
            (some, all) if some < all => format!("{some} of {all} frames. "),
            (_, 1) => String::new(),
            (_, all) => format!("{all} frames. "),
        };
        let note = shown + &self.notes.join(" ");
        let picture = sheet(&self.title, &note, cells, columns)?;
        let png = picture
            .to_png(SOFTWARE)
            .map_err(|source| ViewError::Encode {
                file: file.to_owned(),
                source,
            })?;
        write(file, &png)?;
        Ok(png.len() as u64)
    }

    fn write_page(
        &self,
        store: Store,
        tell: &mut dyn FnMut(Event),
    ) -> Result<(PathBuf, u64), ViewError> {
        let addresses = store.addresses();
        let count = self.strips.len();
        let set = |(index, name): (usize, String)| {
            let strip = &self.strips[index];
            let most = self.request.width.unwrap_or(PAGE_WIDTH);
            Set {
                name,
                size: Rgb::within(strip.size, most),
                pictures: addresses
                    .iter()
                    .skip(index)
                    .step_by(count)
                    .cloned()
                    .collect(),
            }
        };
        let player = Player {
            title: self.title.clone(),
            notes: self.notes.clone(),
            sets: names(&self.strips)
                .into_iter()
                .enumerate()
                .map(set)
                .collect(),
            labels: self.labels.iter().map(Label::to_string).collect(),
            times: self
                .labels
                .iter()
                .map(|label| self.curves.time(label))
                .collect(),
            frames_per_second: self.rate,
            curves: self.curves.charts.clone(),
        };
        let (bytes, is_beside) = store.told();
        if is_beside && self.request.placing == Placing::Auto {
            tell(Event::Note(format!(
                "the page's pictures are {} MB and stand beside it in pictures/: move both together, or take fewer (--frames), smaller \
                 (--width) or --pictures within",
                bytes / 1_000_000
            )));
        }
        store.finish(&player.to_html())
    }
}

/// Short names, or whole paths where these are the same.
fn names(strips: &[Strip]) -> Vec<String> {
    let short: Vec<String> = strips.iter().map(Strip::name).collect();
    match &short[..] {
        [a, b] if a == b => strips
            .iter()
            .map(|strip| strip.path.display().to_string())
            .collect(),
        _ => short,
    }
}

/// Refuses a picture that is none of ours.
fn check_sheet(file: &Path) -> Result<(), ViewError> {
    let Ok(bytes) = fs::read(file) else {
        return Ok(());
    };
    let begin = &bytes[..bytes.len().min(512)];
    match begin
        .windows(SOFTWARE.len())
        .any(|part| part == SOFTWARE.as_bytes())
    {
        true => Ok(()),
        false => Err(ViewError::Asked(format!(
            "{} is not from swell view: choose another -o",
            file.display()
        ))),
    }
}

/// Frames and time of a cache.
fn reader(path: &Path) -> Result<CacheReader, ViewError> {
    match path.exists() {
        true => Ok(CacheReader::open(path)?),
        false => Err(ViewError::Missing(path.to_owned())),
    }
}
