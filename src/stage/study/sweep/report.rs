//! A sweep's table, curves and page.

use std::{collections::BTreeMap, fs};

use crate::{
    scene::{
        Method, asset_path,
        study::sweep::{ErrorMeasure, FRAME_RATE, Measure, SAMPLES, Sweep},
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
    super::{Outcome, Request, StudyError, csv, write},
    errors,
    ledger::{Record, Run, Verdict},
};

/// What the report is made from.
struct Results<'a> {
    sweep: &'a Sweep,
    /// Each line's, with its driver.
    devices: &'a [String],
    /// As [`Sweep::lines`].
    records: &'a [Vec<Record>],
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
    devices: &[String],
    records: &[Vec<Record>],
) -> Result<Outcome, StudyError> {
    let results = Results {
        sweep,
        devices,
        records,
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
        let records = &self.records[line];
        let (run, reference) = match self.sweep.lines[line].against {
            Some(other) => (&records[index], &self.records[other][index]),
            None => (&records[index], records.last()?),
        };
        let is_itself = error.measure() == Measure::Finest && std::ptr::eq(run, reference);
        let run = run.run().filter(|_| !is_itself)?;
        errors::of(error, run, reference.run())
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
        let of = |(k, line): (usize, &crate::scene::study::sweep::Line)| Line {
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
        self.records.iter().flatten().filter_map(failed).collect()
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
                    title: error.title().to_owned(),
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
                    knee::words(line),
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
        for (line, records) in self.records.iter().enumerate() {
            rows.extend((0..records.len()).map(|index| self.row(line, index)));
        }
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

    fn row(&self, line: usize, index: usize) -> Vec<String> {
        let record = &self.records[line][index];
        let mut row = vec![
            record.method.clone(),
            self.sweep.lines[line].device.name().to_owned(),
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
        let errors = self.sweep.errors.iter().map(|&error| {
            let value = self.error(line, index, error);
            value.map_or(String::new(), |value| format!("{value:.4e}"))
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
        let rows = self.records.iter().enumerate();
        let rows =
            rows.flat_map(|(line, records)| (0..records.len()).map(move |index| (line, index)));
        let rows = rows.map(|(line, index)| self.row(line, index));
        parts.push(Part::Table(
            [self.titles()].into_iter().chain(rows).collect(),
        ));
        parts.push(Part::Heading("What was run".into()));
        parts.push(Part::Code(request.command.clone()));
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
        let mut methods: BTreeMap<&str, Vec<&str>> = BTreeMap::new();
        for (line, device) in self.sweep.lines.iter().zip(self.devices) {
            methods.entry(device).or_default().push(&line.name);
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

    fn measured(&self) -> Vec<String> {
        let mut texts = vec![KNEE.to_owned(), EQUAL_TIME.to_owned(), WORK.to_owned()];
        texts.push(match self.sweep.errors[0].measure() {
            Measure::Report => "A density error is max(0, ρ/ρ0 − 1) at a frame's end, over the particles (with FLIP over the \
                cells of water); its mean, 99th percentile or maximum is averaged over all frames."
                .to_owned(),
            Measure::Finest => format!(
                "Errors are differences from the same method's finest run, the last of its values, at {SAMPLES} equally \
                 spaced times, averaged. The crest, the front and the elevation along the wave's way are measured from the \
                 particles with the same cubes for all runs; energy is ½ v² + g h a mass. Such a reference knows nothing of \
                 an error that all runs share, and the run next to it looks better than it is. After the impact particles \
                 are chaotic: only such sums are compared."
            ),
            Measure::Converged => "The distance from converged is that of the last frame's end: the RMS over the particles, \
                in spacings, of the way to where Newton's method in f64 takes them until none is compressed by more than \
                1e-6. It is what further iterations would still have to move; its time is not in the run's."
                .to_owned(),
            Measure::Projection => {
                let rows = self.records.iter().flatten().filter_map(|r| r.run()?.projection);
                let rows: Vec<_> = rows.collect();
                let most = rows.iter().map(|p| p.rows).max().unwrap_or(0);
                let worst = rows.iter().fold(0.0, |worst: f64, p| worst.max(p.exact_residual));
                let by = if rows.iter().all(|p| p.has_factor) {
                    "a sparse Cholesky factor"
                } else {
                    "a sparse Cholesky factor where memory holds it, else conjugate gradients"
                };
                format!(
                    "One state of the scene is carried to the grid and projected once. The system is read back as the \
                     device has it (up to {most} rows) and solved in f64 by {by}, to a relative residual of {worst:.1e}: p64 \
                     is that solution, u64 the velocities that it leaves on the faces which a projection changes. An error is \
                     solver error alone: the system is the same, so that what the grid or the surface's treatment gets wrong \
                     is not in it. A solve that missed its tolerance is counted under missed."
                )
            }
        });
        texts.extend(self.sweep.lines.iter().filter_map(|line| {
            let other = &self.sweep.lines[line.against?];
            Some(format!(
                "{} is held, value by value, against {}, not against its own finest run.",
                line.name, other.name
            ))
        }));
        let is_swept = self.sweep.lines.iter().any(|line| line.key == FRAME_RATE);
        if is_swept {
            texts.push(PIC_BLEND.to_owned());
        }
        texts
    }

    /// Ours and the paper's, a row for each number of iterations.
    fn convergence_table(&self) -> Vec<Vec<String>> {
        let mut titles = vec!["method".into(), "setting".into(), "ms".into()];
        titles.extend(Reading::ALL.map(|reading| format!("point: {}", reading.text())));
        titles.extend(["the paper's ms".into(), "the paper's point".into()]);
        let mut table = vec![titles];
        for (line, records) in self.sweep.lines.iter().zip(self.records) {
            for (point, record) in line.points.iter().zip(records) {
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

const KNEE: &str = "The knee of a line is the setting with the least product of error and time: up to it x times the time buys \
    more than x times the accuracy, beyond it less. Settings that another of the same line beats in both are left out of the \
    account.";

const EQUAL_TIME: &str = "At equal time: another line's error at a point's time is read off between its own settings, by \
    straight lines in the logarithmic chart; the ratio is that error over the point's own. Only times between two settings of \
    the other line are compared.";

const WORK: &str = "The cost that no machine changes: with PBF neighbour visits, particles × mean neighbours (at the run's end) \
    × passes over them, which are two an iteration and one search a substep; with FLIP products with the matrix of the finest \
    grid, of which an iteration of conjugate gradients takes one, IPP one more, as the incomplete Cholesky of the f64 reference, a V-cycle 2.3 more.";

const CONVERGENCE: &str = "The paper calls a run converged from the step on at which \"the relative error of the current \
    iteration and the 50 before is less than 0.5 %\", for good. It does not say what the error is, nor whether the 50 are what \
    the current step is compared with. The first column reads it so: the mean density, 1 + the mean of max(0, ρ/ρ0 − 1), \
    differs from each of the 50 steps before by less than 0.5 %. The others show what the point would be if the density error \
    itself had to stay below 0.5 %, and if it had to differ from each of the 50 by less than 0.5 % of itself. The paper's scene is \
    not known beyond its 500 000 particles and 16 ms, so that its points can be compared in their order and trend alone; its \
    times are of a GTX 1650.";

const PIC_BLEND: &str = "FLIP takes a part pic_blend of the grid's velocity a frame. Where the frame rate is swept that part is \
    tied to it, α = 1 − (1 − α_ref)^(Δt / Δt_ref) with the scene's own rate as reference, so that the same part is taken a \
    second; at a fixed α halving Δt would double the dissipation.";
