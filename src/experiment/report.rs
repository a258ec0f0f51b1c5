//! What a study leaves: `results.csv`, its curves, and the page.

use std::{fs, path::Path};

use swell_study::{
    page::{self, Part},
    raster,
};

use super::{Outcome, Request, StudyError};

/// What a kind of study draws.
#[derive(Default)]
pub(super) struct Report {
    /// The page's first words: one sentence.
    pub(super) answer: String,
    /// Names of files in `curves/`, and SVG; the first stands below the answer, the others are folded.
    pub(super) curves: Vec<(String, String)>,
    /// The page from there on.
    pub(super) parts: Vec<Part>,
    /// For `results.csv`; the first row are titles.
    pub(super) table: Vec<Vec<String>>,
    /// What was found, in words.
    pub(super) findings: Vec<String>,
    /// Marks that are missed and not known to be.
    pub(super) missed: Vec<String>,
}

impl Report {
    /// Writes all of it. `shares` is what a reader of times has to know of shares that ran points.
    pub(super) fn write(
        self,
        request: &Request,
        shares: Option<String>,
    ) -> Result<Outcome, StudyError> {
        let directory = &request.directory;
        write(&directory.join("results.csv"), csv(&self.table))?;
        let folder = directory.join("curves");
        if !self.curves.is_empty() {
            fs::create_dir_all(&folder).map_err(|source| StudyError::File {
                file: folder.clone(),
                source,
            })?;
        }
        for (name, svg) in &self.curves {
            write(&folder.join(format!("{name}.svg")), svg)?;
            write(&folder.join(format!("{name}.png")), raster::png(svg)?)?;
        }
        let mut curves = self.curves.into_iter().map(|(_, svg)| svg);
        let mut parts = vec![Part::Answer(self.answer)];
        parts.extend(curves.next().map(|first| Part::Curves(vec![first])));
        parts.extend(shares.map(Part::Text));
        let others: Vec<String> = curves.collect();
        if !others.is_empty() {
            let title = format!("{} more curves", others.len());
            parts.push(Part::Folded(title, vec![Part::Curves(others)]));
        }
        parts.extend(self.parts);
        let page = directory.join("index.html");
        write(&page, page::html(&request.name, &parts))?;
        Ok(Outcome {
            page: Some(page),
            share: None,
            findings: self.findings,
            missed: self.missed,
        })
    }
}

/// What was typed, and what was told of the scenes.
pub(super) fn what_was_run(request: &Request) -> Vec<Part> {
    let warnings = request.study.warnings().into_iter();
    let told = warnings.map(|warning| Part::Text(format!("Warning: {warning}")));
    let command = Part::Code(request.command.clone());
    [command].into_iter().chain(told).collect()
}

fn write(file: &Path, text: impl AsRef<[u8]>) -> Result<(), StudyError> {
    fs::write(file, text).map_err(|source| StudyError::File {
        file: file.to_owned(),
        source,
    })
}

/// Rows with commas between cells, quoted where they have to be.
fn csv(rows: &[Vec<String>]) -> String {
    let quoted = |cell: &String| match cell.contains([',', '"', '\n']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.clone(),
    };
    let cells = |row: &Vec<String>| row.iter().map(quoted).collect::<Vec<_>>();
    rows.iter().map(|row| cells(row).join(",") + "\n").collect()
}
