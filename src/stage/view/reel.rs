//! Reads the frames one after another and builds sheet, movie and page from them.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::atomic::{AtomicBool, Ordering},
};

use rayon::prelude::*;

use super::{
    MOST, PAGE_WIDTH, Placing, RATE, ViewError, ViewEvent, ViewOutcome, ViewRequest, check_place,
    curves::Curves,
    movie::{self, Movie},
    player::{Player, Set},
    sheet::{SheetPicture, sheet},
    store::Store,
    strip::{Label, Strip},
};
use swell_domain::output::{self, create_folder};
use swell_study::rgb::Rgb;

/// A view that is ready to run.
pub(super) struct Reel<'a> {
    request: &'a ViewRequest,
    strips: Vec<Strip>,
    labels: Vec<Label>,
    curves: Curves,
    directory: PathBuf,
    title: String,
    notes: Vec<String>,
    rate: f64,
}

/// One frame, read and reduced to the forms that are needed.
struct Framed {
    joined: Option<Rgb>,
    cell: Option<SheetPicture>,
    /// One PNG per strip.
    page: Vec<Vec<u8>>,
}

/// Software name in our PNG files.
pub(super) const SOFTWARE: &str = "swell view";
/// Width of a picture on a sheet, pixels, and pictures per row; half as many if two are side by
/// side.
pub(super) const THUMB: usize = 320;
pub(super) const COLUMNS: usize = 6;

impl<'a> Reel<'a> {
    /// Takes strips of the same shape that all have the `labels`.
    pub(super) fn of(
        request: &'a ViewRequest,
        strips: Vec<Strip>,
        labels: Vec<Label>,
        curves: Curves,
        tell: &mut dyn FnMut(ViewEvent),
    ) -> Result<Self, ViewError> {
        let names = names(&strips);
        let default = || Path::new("views").join(names.join("-vs-").replace(['/', '\\', ' '], "-"));
        let directory = request.directory.clone().unwrap_or_else(default);
        for file in [Some(&directory), request.movie.as_ref()]
            .into_iter()
            .flatten()
        {
            check_place(file)?;
        }
        if let Some(movie) = &request.movie {
            movie::MovieFormat::of(movie)?;
        }
        let mut notes: Vec<String> = strips.iter().map(Strip::said).collect();
        notes.retain(|note| !note.is_empty());
        notes.dedup();
        for note in &notes {
            tell(ViewEvent::Note(note.clone()));
        }
        let known = strips.iter().find_map(|strip| strip.frames_per_second);
        let known = request
            .frames_per_second
            .or(curves.frames_per_second)
            .or(known);
        if known.is_none() && labels.len() > 1 && (request.player || request.movie.is_some()) {
            tell(ViewEvent::AssumedRate);
        }
        for strip in &strips {
            if let Some(warning) = curves.stranger(strip, &labels) {
                tell(ViewEvent::Warning(warning));
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

    /// Indices of the frames on the sheet: all, or evenly spaced ones if there are too many.
    fn on_sheet(&self) -> Vec<usize> {
        let count = self.labels.len();
        let most = self.request.sheet.unwrap_or(0).min(count);
        let place = |k: usize| k * (count - 1) / (most - 1).max(1);
        (0..most).map(place).collect()
    }

    /// Size of the movie in pixels: of one picture, or of two side by side.
    fn movie_size(&self) -> [usize; 2] {
        let most = self.request.width.unwrap_or(usize::MAX);
        let [width, height] = Rgb::within(self.strips[0].size, most);
        [width * self.strips.len(), height]
    }

    /// Reads every frame once and makes everything from it.
    pub(super) fn run(
        self,
        stop: &AtomicBool,
        tell: &mut dyn FnMut(ViewEvent),
    ) -> Result<ViewOutcome, ViewError> {
        let request = self.request;
        tell(ViewEvent::Ready {
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
            create_folder(&self.directory)?;
        }
        let store = || Store::begin(&self.directory, request.placing, MOST);
        let mut store = request.player.then(store).transpose()?;
        let mut movie = request.movie.as_ref().map(begin).transpose()?;
        let on_sheet = self.on_sheet();
        let mut cells = Vec::new();
        let numbers: Vec<usize> = (0..self.labels.len()).collect();
        for part in numbers.chunks(2 * rayon::current_num_threads()) {
            if stop.load(Ordering::Relaxed) {
                return Ok(ViewOutcome {
                    interrupted: true,
                    ..ViewOutcome::default()
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
                tell(ViewEvent::Frame(self.labels[*k].words()));
            }
        }
        let mut outcome = ViewOutcome::default();
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

    /// `a.0012.png`.
    fn file_name(&self, strip: usize, k: usize) -> String {
        let set = ["a", "b"][strip];
        match &self.labels[k] {
            Label::Frame(frame) => format!("{set}.{frame:04}.png"),
            Label::Name(name) => format!("{set}.{name}.png"),
        }
    }

    /// Reads a frame and converts it to the forms that are needed.
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
            cell: is_on_sheet.then(|| SheetPicture {
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

    fn write_sheet(&self, file: &Path, cells: &[SheetPicture]) -> Result<u64, ViewError> {
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
        output::write(file, &png)?;
        Ok(png.len() as u64)
    }

    fn write_page(
        &self,
        store: Store,
        tell: &mut dyn FnMut(ViewEvent),
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
        let (bytes, is_beside) = store.summary();
        if is_beside && self.request.placing == Placing::Auto {
            tell(ViewEvent::PicturesBeside(bytes));
        }
        store.finish(&player.to_html())
    }
}

/// Short names, or whole paths if the short names are equal.
pub(super) fn names(strips: &[Strip]) -> Vec<String> {
    let short: Vec<String> = strips.iter().map(|strip| strip.title.clone()).collect();
    match &short[..] {
        [a, b] if a == b => strips
            .iter()
            .map(|strip| strip.path.display().to_string())
            .collect(),
        _ => short,
    }
}

/// Refuses to overwrite a sheet that swell did not make.
pub(super) fn check_sheet(file: &Path) -> Result<(), ViewError> {
    let Ok(bytes) = fs::read(file) else {
        return Ok(());
    };
    let begin = &bytes[..bytes.len().min(512)];
    match begin
        .windows(SOFTWARE.len())
        .any(|part| part == SOFTWARE.as_bytes())
    {
        true => Ok(()),
        false => Err(ViewError::Foreign(file.to_owned())),
    }
}
