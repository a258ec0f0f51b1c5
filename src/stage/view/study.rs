//! Views a study: a finished one has a page of its own, and its pictures get a contact sheet.

use std::{
    fs,
    path::{Path, PathBuf},
};

use rayon::prelude::*;

use super::{
    ViewError, ViewEvent, ViewOutcome, ViewRequest, check_place, pictures,
    reel::{COLUMNS, SOFTWARE, THUMB, check_sheet},
    sheet::{SheetPicture, sheet},
    strip::name_of,
};
use swell_domain::output::{self, AtPath as _};
use swell_scene::look::ViewSpec;
use swell_study::{
    folder::{CLAIM, Claim, is_ledger, is_share},
    rgb::Rgb,
};

/// File that a finished study leaves besides its ledgers.
const RESULTS: &str = "results.csv";
/// Name of its page, and the folders of its pictures.
const PAGE: &str = "index.html";
const FOLDERS: [&str; 2] = ["pictures", "curves"];

/// Whether a folder is that of a study.
pub(super) fn is_one(folder: &Path) -> bool {
    let names = output::names(folder).unwrap_or_default();
    names.iter().any(|name| name == RESULTS || is_ledger(name))
}

/// Why there is no page yet, and how to make it.
fn unfinished(folder: &Path) -> Result<ViewError, ViewError> {
    let mut names = output::names(folder)?;
    names.retain(|name| is_share(name));
    let claim = fs::read(folder.join(CLAIM)).ok();
    let claim = claim.and_then(|text| serde_json::from_slice::<Claim>(&text).ok());
    let command = claim.and_then(|claim| claim.command);
    let command = command.map_or("the command of the study".to_owned(), |it| {
        format!("`{it}`")
    });
    let what = match &names[..] {
        [] => format!("the study is not finished; {command} resumes it"),
        shares => format!(
            "shares of the study are not joined ({}); {command}, with the shares' other options, \
             joins them",
            shares.join(", ")
        ),
    };
    Ok(ViewError::Unfinished {
        page: folder.join(PAGE),
        what,
    })
}

/// Returns the study's page, and makes a sheet of its pictures if requested and if there are any.
pub(super) fn view(
    request: &ViewRequest,
    folder: &Path,
    tell: &mut dyn FnMut(ViewEvent),
) -> Result<ViewOutcome, ViewError> {
    let page = folder.join(PAGE);
    if !page.is_file() {
        return Err(unfinished(folder)?);
    }
    let asked = [
        (request.movie.is_some(), "movie"),
        (request.frames.is_some(), "frames"),
        (request.curves.is_some(), "curves"),
    ];
    if let Some((_, what)) = asked.iter().find(|(is_asked, _)| *is_asked) {
        return Err(ViewError::Asked(format!(
            "{what}: {} is a study, which has a page and no frames",
            folder.display()
        )));
    }
    let mut outcome = ViewOutcome::default();
    if let Some(most) = request.sheet {
        let default = || Path::new("views").join(name_of(folder));
        let directory = request.directory.clone().unwrap_or_else(default);
        let bytes = sheet_of(folder, &directory, most, tell)?;
        outcome
            .files
            .extend(bytes.map(|bytes| ("contact sheet", directory.join("sheet.png"), bytes)));
    }
    let bytes = fs::metadata(&page).at(&page)?.len();
    outcome
        .files
        .push(("the study's page", page.clone(), bytes));
    outcome.page = Some(page);
    Ok(outcome)
}

/// Makes the sheet and returns its size in bytes; `None` if the study has no pictures.
fn sheet_of(
    folder: &Path,
    directory: &Path,
    most: usize,
    tell: &mut dyn FnMut(ViewEvent),
) -> Result<Option<u64>, ViewError> {
    let mut files = Vec::new();
    for name in FOLDERS {
        pictures_in(&folder.join(name), &mut files)?;
    }
    let all = files.len();
    files.truncate(most);
    if files.is_empty() {
        tell(ViewEvent::Note(format!(
            "{} has no pictures for a sheet",
            folder.display()
        )));
        return Ok(None);
    }
    let file = directory.join("sheet.png");
    check_place(directory)?;
    check_sheet(&file)?;
    let cell = |path: &PathBuf| -> Result<SheetPicture, ViewError> {
        let picture = pictures::read(path, &ViewSpec::default())?;
        let name = path.strip_prefix(folder).unwrap_or(path).with_extension("");
        Ok(SheetPicture {
            label: name.display().to_string(),
            picture: picture.resized(Rgb::within(picture.size, THUMB)),
        })
    };
    let cells: Vec<SheetPicture> = files.par_iter().map(cell).collect::<Result<_, _>>()?;
    let note = match cells.len() {
        some if some < all => format!("{some} of {all} pictures of the study."),
        all => format!("{all} pictures of the study."),
    };
    let png = sheet(&name_of(folder), &note, &cells, COLUMNS)?.to_png(SOFTWARE);
    let png = png.map_err(|source| ViewError::Encode {
        file: file.clone(),
        source,
    })?;
    output::create_folder(directory)?;
    output::write(&file, &png)?;
    Ok(Some(png.len() as u64))
}

/// Collects PNG files below a folder, sorted by name; none if it does not exist.
fn pictures_in(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), ViewError> {
    if !folder.is_dir() {
        return Ok(());
    }
    for path in output::paths(folder)? {
        let ending = path.extension().and_then(|ending| ending.to_str());
        if path.is_dir() {
            pictures_in(&path, files)?;
        } else if ending.is_some_and(|ending| ending.eq_ignore_ascii_case("png")) {
            files.push(path);
        }
    }
    Ok(())
}
