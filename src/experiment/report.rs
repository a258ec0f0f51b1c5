//! Output of a study: `results.csv`, its curves, and the page.

use swell_domain::output::{create_folder, write};
use swell_study::{
    page::{self, Part},
    raster,
};

use super::{StudyError, StudyOutcome, StudyRequest};

/// Content that a kind of study draws.
#[derive(Default)]
pub(super) struct Report {
    /// First sentence of the page.
    pub(super) answer: String,
    /// File names in `curves/` with their SVG. The first curve is below the answer, the others are
    /// folded.
    pub(super) curves: Vec<(String, String)>,
    /// The rest of the page.
    pub(super) parts: Vec<Part>,
    /// Rows of `results.csv`, the titles first.
    pub(super) table: Vec<Vec<String>>,
    /// Findings, as sentences.
    pub(super) findings: Vec<String>,
    /// Missed marks that are not listed as known failures.
    pub(super) missed: Vec<String>,
}

impl Report {
    /// Writes all files. `shares` is a note for readers about the times of points that shares ran.
    pub(super) fn write(
        self,
        request: &StudyRequest,
        shares: Option<String>,
    ) -> Result<StudyOutcome, StudyError> {
        let directory = &request.directory;
        write(&directory.join("results.csv"), csv(&self.table))?;
        let folder = directory.join("curves");
        if !self.curves.is_empty() {
            create_folder(&folder)?;
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
        Ok(StudyOutcome {
            page: Some(page),
            share: None,
            findings: self.findings,
            missed: self.missed,
        })
    }
}

/// Parts of the page with the command as typed and the study's warnings.
pub(super) fn what_was_run(request: &StudyRequest) -> Vec<Part> {
    let warnings = request.study.warnings().into_iter();
    let told = warnings.map(|warning| Part::Text(format!("Warning: {warning}")));
    let command = Part::Code(request.command.clone());
    [command].into_iter().chain(told).collect()
}

/// Formats rows as CSV, with quotes where needed.
fn csv(rows: &[Vec<String>]) -> String {
    let quoted = |cell: &String| match cell.contains([',', '"', '\n']) {
        true => format!("\"{}\"", cell.replace('"', "\"\"")),
        false => cell.clone(),
    };
    let cells = |row: &Vec<String>| row.iter().map(quoted).collect::<Vec<_>>();
    rows.iter().map(|row| cells(row).join(",") + "\n").collect()
}
