//! A sweep's table, curves and page.

mod measured;

use std::{collections::BTreeMap, fs};

use crate::{
    scene::{
        Method, asset_path,
        study::sweep::{self, ErrorMeasure, Measure, Sweep},
    },
    study::{
        convergence_point::{Reading, TABLE_1, convergence_point},
        knee,
        page::{self, Part},
        raster,
        work_precision::{Cost, Line, LogChart, Point},
    },
};

use super::{
    super::{Outcome, Request, StudyError, csv, what_was_run, write},
    Devices, errors,
    ledger::{Record, Run, Verdict},
};

/// What the report is made from.
struct Results<'a> {
    sweep: &'a Sweep,
    devices: &'a Devices,
    /// As [`Sweep::lines`], without what is coarser.
    records: Vec<&'a [Record]>,
    /// Of each line, where it has one.
    coarser: Vec<Option<&'a Record>>,
    units: Units,
}

/// How costs are told.
struct Units {
    /// Of the time, for an axis.
    time: &'static str,
    /// Seconds of a frame to that.
    per_frame: bool,
    /// Of the work.
    work: &'static str,
}

/// Writes `results.csv`, the curves and the page.
pub(super) fn write_all(
    request: &Request,
    sweep: &Sweep,
    devices: &Devices,
    records: &[Vec<Record>],
) -> Result<Outcome, StudyError> {
    let parts = || sweep.lines.iter().zip(records);
    let results = Results {
        sweep,
        devices,
        records: parts()
            .map(|(line, all)| &all[..line.points.len()])
            .collect(),
        coarser: parts()
            .map(|(line, all)| all.get(line.points.len()))
            .collect(),
        units: units(sweep),
    };
    let directory = &request.directory;
    write(&directory.join("results.csv"), results.csv())?;
    let folder = directory.join("curves");
    fs::create_dir_all(&folder).map_err(|source| StudyError::File {
        file: folder.clone(),
        source,
    })?;
    let mut curves = Vec::new();
    for (name, chart) in results.charts() {
        let svg = chart.to_svg();
        write(&folder.join(format!("{name}.svg")), &svg)?;
        write(&folder.join(format!("{name}.png")), raster::png(&svg)?)?;
        curves.push(svg);
    }
    let findings = results.findings();
    let file = directory.join("index.html");
    let title = title(request);
    let parts = results.parts(request, &findings, curves);
    write(&file, page::html(&title, &parts))?;
    let told = findings
        .into_iter()
        .map(|(what, words)| format!("{what}: {words}"));
    Ok(Outcome {
        page: Some(file),
        findings: told.collect(),
        missed: Vec::new(),
    })
}

fn title(request: &Request) -> String {
    let name = request.directory.file_name().unwrap_or_default();
    format!("{}: error against time", name.to_string_lossy())
}

fn units(sweep: &Sweep) -> Units {
    let frames = || sweep.lines.iter().flat_map(|line| &line.points);
    let first = frames().next().map(|point| point.frames);
    let per_frame = frames().all(|point| Some(point.frames) == first);
    let methods = || frames().map(|point| point.scene.solver.method);
    let is_projection = sweep.state.is_some();
    Units {
        time: match (is_projection, per_frame) {
            (true, _) => "time of a projection, ms",
            (false, true) => "time a frame, ms",
            (false, false) => "time of the whole run, ms",
        },
        per_frame,
        work: match (
            methods().all(|m| m == Method::Pbf),
            methods().all(|m| m == Method::Flip),
        ) {
            (true, _) => "neighbour visits",
            (_, true) => "matrix-vector products",
            _ => "neighbour visits (pbf), matrix-vector products (flip)",
        },
    }
}

impl Record {
    fn run(&self) -> Option<&Run> {
        match &self.verdict {
            Verdict::Done(run) => Some(run),
            Verdict::Failed(_) => None,
        }
    }
}

impl Results<'_> {
    /// An error of point `index` of a line; `None` where it failed, cannot be told, or is its own reference.
    fn error(&self, line: usize, index: usize, error: ErrorMeasure) -> Option<f64> {
        let records = self.records[line];
        let (run, reference) = match self.sweep.lines[line].against {
            Some(other) => (&records[index], &self.records[other][index]),
            None => (&records[index], records.last()?),
        };
        let is_itself = error.measure() == Measure::Finest && std::ptr::eq(run, reference);
        let run = run.run().filter(|_| !is_itself)?;
        errors::of(error, run, reference.run())
    }

    /// The error that a line's grid or step itself has, where the study measured one.
    fn discretisation(&self, line: usize, error: ErrorMeasure) -> Option<f64> {
        let run = self.coarser[line]?.run()?;
        let finest = self.records[line].last()?.run();
        errors::of(error, run, finest).filter(|error| *error > 0.0)
    }

    /// Milliseconds: least, median and greatest.
    fn time(&self, run: &Run) -> [f64; 3] {
        let frames = if self.units.per_frame {
            1.0
        } else {
            f64::from(run.frames)
        };
        run.per_frame().map(|seconds| 1e3 * seconds * frames)
    }

    fn work(&self, run: &Run) -> f64 {
        if self.units.per_frame {
            run.work / f64::from(run.frames)
        } else {
            run.work
        }
    }

    fn lines(&self, error: ErrorMeasure) -> Vec<Line> {
        let point = |line: usize, index: usize| {
            let record = &self.records[line][index];
            let run = record.run()?;
            Some(Point {
                label: record.setting.clone(),
                time: self.time(run),
                work: self.work(run),
                error: self.error(line, index, error)?,
            })
        };
        let of = |(k, line): (usize, &sweep::Line)| Line {
            name: line.name.clone(),
            points: (0..line.points.len()).filter_map(|i| point(k, i)).collect(),
        };
        self.sweep.lines.iter().enumerate().map(of).collect()
    }

    fn failures(&self) -> Vec<String> {
        let failed = |record: &Record| match &record.verdict {
            Verdict::Failed(message) => Some(format!(
                "{}, {} = {}: {message}",
                record.method, record.key, record.setting
            )),
            Verdict::Done(_) => None,
        };
        self.all().filter_map(failed).collect()
    }

    /// Every record, what is coarser among them.
    fn all(&self) -> impl Iterator<Item = &Record> {
        let lines = self.records.iter().zip(&self.coarser);
        lines.flat_map(|(records, coarser)| records.iter().chain(*coarser))
    }

    /// With the names of their files.
    fn charts(&self) -> Vec<(String, LogChart)> {
        let mut charts = Vec::new();
        for &error in &self.sweep.errors {
            let lines = self.lines(error);
            let zeros = lines.iter().flat_map(|line| {
                let zeros = line.points.iter().filter(|point| point.error == 0.0);
                zeros.map(|point| format!("{}, {}: an error of 0", line.name, point.label))
            });
            let failed = self
                .failures()
                .into_iter()
                .map(|text| format!("failed: {text}"));
            let notes: Vec<String> = failed.chain(zeros).collect();
            for (cost, suffix, x_label) in [
                (Cost::Time, "time", self.units.time.to_owned()),
                (Cost::Work, "work", self.work_label()),
            ] {
                let chart = LogChart {
                    title: self.title(),
                    subtitle: self.subtitle(cost),
                    x_label,
                    y_label: error.title().to_owned(),
                    cost,
                    lines: lines.clone(),
                    notes: notes.clone(),
                };
                charts.push((format!("{}-{suffix}", error.name()), chart));
            }
        }
        charts
    }

    /// The shot and what is swept.
    fn title(&self) -> String {
        let points = self.sweep.lines.iter().flat_map(|line| &line.points);
        let shots = unique(points.map(|point| point.scene.shot.name.as_str()));
        let keys = unique(self.sweep.lines.iter().map(|line| line.key.as_str()));
        format!("{} by {}", shots.join(", "), keys.join(", "))
    }

    /// What it ran on, and what the bars are.
    fn subtitle(&self, cost: Cost) -> String {
        let points = self.sweep.lines.iter().flat_map(|line| &line.points);
        let names: Vec<_> = points
            .map(|point| self.devices.of(point).identity().name)
            .collect();
        let on = unique(names.iter().map(String::as_str)).join(" and ");
        match (cost, self.sweep.repeats) {
            (Cost::Work, _) | (_, 1) => format!("on {on}"),
            (Cost::Time, repeats) => {
                format!("on {on}; bars from the least to the greatest of {repeats}")
            }
        }
    }

    fn work_label(&self) -> String {
        let of = match (self.sweep.state.is_some(), self.units.per_frame) {
            (true, _) => "of a projection",
            (false, true) => "a frame",
            (false, false) => "of the whole run",
        };
        format!("{} {of}", self.units.work)
    }

    /// What was found, as question and answer.
    fn findings(&self) -> Vec<(String, String)> {
        let mut findings = Vec::new();
        for &error in &self.sweep.errors {
            let lines = self.lines(error);
            for (index, line) in lines.iter().enumerate() {
                findings.push((
                    format!("{}, {}", error.name(), line.name),
                    knee::words(line, self.discretisation(index, error)),
                ));
                // Lines that are measured against references of their own are no rivals.
                if lines.len() > 1 && error.measure() != Measure::Finest {
                    findings.push((
                        format!("{}, {} at equal time", error.name(), line.name),
                        knee::rivalry_words(&lines, index),
                    ));
                }
            }
        }
        findings
    }

    fn csv(&self) -> String {
        let mut rows = vec![self.titles()];
        rows.extend(self.rows());
        csv(&rows)
    }

    fn titles(&self) -> Vec<String> {
        let fixed = [
            "method",
            "device",
            "key",
            "setting",
            "particles",
            "frames",
            "repeats",
            "ms",
            "ms_least",
            "ms_most",
            "work",
            "substeps",
            "iterations",
            "missed",
        ];
        let errors = self.sweep.errors.iter().map(|error| error.name());
        let mut titles: Vec<String> = fixed.into_iter().chain(errors).map(str::to_owned).collect();
        if self.sweep.has_convergence_point {
            titles.extend(
                Reading::ALL.map(|reading| format!("convergence_point_{reading:?}").to_lowercase()),
            );
        }
        titles.push("failed".into());
        titles
    }

    /// Line by line, what is coarser last.
    fn rows(&self) -> Vec<Vec<String>> {
        let mut rows = Vec::new();
        for (k, line) in self.sweep.lines.iter().enumerate() {
            for (index, (point, record)) in line.points.iter().zip(self.records[k]).enumerate() {
                rows.push(self.row(point, record, |error| self.error(k, index, error)));
            }
            if let (Some(point), Some(record)) = (&line.coarser, self.coarser[k]) {
                rows.push(self.row(point, record, |error| self.discretisation(k, error)));
            }
        }
        rows
    }

    fn row(
        &self,
        point: &sweep::Point,
        record: &Record,
        error_of: impl Fn(ErrorMeasure) -> Option<f64>,
    ) -> Vec<String> {
        let mut row = vec![
            record.method.clone(),
            point.device.name().to_owned(),
            record.key.clone(),
            record.setting.clone(),
        ];
        let Some(run) = record.run() else {
            row.resize(self.titles().len() - 1, String::new());
            row.extend(self.failure(record));
            return row;
        };
        let [least, middle, most] = self.time(run);
        row.extend([
            run.particles.to_string(),
            run.frames.to_string(),
            run.seconds.len().to_string(),
            format!("{middle:.3}"),
            format!("{least:.3}"),
            format!("{most:.3}"),
            format!("{:.4e}", self.work(run)),
            run.substeps.to_string(),
            run.iterations.to_string(),
            run.missed.to_string(),
        ]);
        let errors =
            self.sweep.errors.iter().map(|&error| {
                error_of(error).map_or(String::new(), |value| format!("{value:.4e}"))
            });
        row.extend(errors);
        if self.sweep.has_convergence_point {
            row.extend(Reading::ALL.map(|reading| found(run, reading).unwrap_or_default()));
        }
        row.push(String::new());
        row
    }

    fn failure(&self, record: &Record) -> Option<String> {
        match &record.verdict {
            Verdict::Failed(message) => Some(message.clone()),
            Verdict::Done(_) => None,
        }
    }

    fn parts(
        &self,
        request: &Request,
        findings: &[(String, String)],
        curves: Vec<String>,
    ) -> Vec<Part> {
        let mut parts: Vec<Part> = self.sweep.about.iter().cloned().map(Part::Text).collect();
        parts.push(Part::Answers(findings.to_vec()));
        let failures = self.failures();
        if !failures.is_empty() {
            parts.push(Part::Heading("Failed".into()));
            parts.extend(failures.into_iter().map(Part::Text));
        }
        if self.sweep.has_convergence_point {
            parts.push(Part::Heading("Convergence point".into()));
            parts.push(Part::Table(self.convergence_table()));
            parts.push(Part::Text(CONVERGENCE.into()));
        }
        parts.push(Part::Heading("Curves".into()));
        parts.push(Part::Curves(curves));
        parts.push(Part::Heading("Table".into()));
        parts.push(Part::Table(
            [self.titles()].into_iter().chain(self.rows()).collect(),
        ));
        parts.push(Part::Heading("What was run".into()));
        parts.extend(what_was_run(request));
        parts.push(Part::Text(format!(
            "{} By {} {}. {}",
            self.where_run(),
            env!("CARGO_PKG_NAME"),
            env!("CARGO_PKG_VERSION"),
            self.policy()
        )));
        if let Some(point) = self
            .sweep
            .lines
            .first()
            .and_then(|line| line.points.first())
        {
            parts.push(Part::Text(
                "The scene of the first point, every default written out:".into(),
            ));
            parts.push(Part::Code(point.scene.to_toml(&asset_path)));
        }
        parts.push(Part::Heading("How it was measured".into()));
        parts.extend(self.measured().into_iter().map(Part::Text));
        parts
    }

    /// Which methods ran on what.
    fn where_run(&self) -> String {
        let mut methods: BTreeMap<String, Vec<&str>> = BTreeMap::new();
        for line in &self.sweep.lines {
            for point in &line.points {
                let device = self.devices.of(point).identity().to_string();
                let names = methods.entry(device).or_default();
                if names.last() != Some(&line.name.as_str()) {
                    names.push(&line.name);
                }
            }
        }
        let told = methods
            .iter()
            .map(|(device, names)| format!("On {device}: {}.", names.join(", ")));
        told.collect::<Vec<_>>().join(" ")
    }

    fn policy(&self) -> String {
        let (repeats, warm) = match self.sweep.state {
            Some(_) => ("projections", "one projection"),
            None => ("runs", "one frame"),
        };
        format!(
            "Times are wall clock, in the program, without files; a point is timed over {} {repeats}, and the median stands \
             with the least and the greatest. Each point warms up with {warm} that does not count.",
            self.sweep.repeats
        )
    }

    /// Ours and the paper's, a row for each number of iterations.
    fn convergence_table(&self) -> Vec<Vec<String>> {
        let mut titles = vec!["method".into(), "setting".into(), "ms".into()];
        titles.extend(Reading::ALL.map(|reading| format!("point: {}", reading.text())));
        titles.extend(["the paper's ms".into(), "the paper's point".into()]);
        let mut table = vec![titles];
        for (line, records) in self.sweep.lines.iter().zip(&self.records) {
            for (point, record) in line.points.iter().zip(*records) {
                let Some(run) = record.run() else { continue };
                let mut row = vec![
                    record.method.clone(),
                    record.setting.clone(),
                    format!("{:.2}", self.time(run)[1]),
                ];
                let not = || "not within the run".to_owned();
                row.extend(Reading::ALL.map(|reading| found(run, reading).unwrap_or_else(not)));
                let paper =
                    paper(&point.scene).map(|(ms, point)| [format!("{ms:.2}"), point.to_string()]);
                row.extend(paper.unwrap_or_default());
                table.push(row);
            }
        }
        table
    }
}

/// Each once, in the order in which they come.
fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut known = Vec::new();
    for name in names {
        if !known.contains(&name) {
            known.push(name);
        }
    }
    known
}

fn found(run: &Run, reading: Reading) -> Option<String> {
    let errors: Vec<f64> = run.density.iter().map(|frame| frame[0]).collect();
    convergence_point(&errors, reading).map(|step| step.to_string())
}

/// The paper's milliseconds and convergence point for a scene's iteration.
fn paper(scene: &crate::scene::Scene) -> Option<(f64, u32)> {
    use crate::scene::{Iteration, Stop};
    let pbf = scene.solver.pbf.as_ref()?;
    let Stop::Iterations(count) = pbf.stop else {
        return None;
    };
    let row = TABLE_1.iter().find(|row| row.iterations == count)?;
    match pbf.iteration {
        Iteration::Jacobi => Some(row.jacobi),
        Iteration::RedBlack => Some(row.red_black),
        Iteration::Chebyshev => None,
    }
}

const CONVERGENCE: &str = "The paper calls a run converged from the step on at which \"the relative error of the current \
    iteration and the 50 before is less than 0.5 %\", for good. It does not say what the error is, nor whether the 50 are what \
    the current step is compared with. The first column reads it so: the mean density, 1 + the mean of max(0, ρ/ρ0 − 1), \
    differs from each of the 50 steps before by less than 0.5 %. The others show what the point would be if the density error \
    itself had to stay below 0.5 %, and if it had to differ from each of the 50 by less than 0.5 % of itself. The paper's scene is \
    not known beyond its 500 000 particles and 16 ms, so that its points can be compared in their order and trend alone; its \
    times are of a GTX 1650.";
