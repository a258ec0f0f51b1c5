//! Table, curves and page of a sweep.

use std::collections::BTreeMap;
use swell_files::scene_to_toml;

use swell_files::study::sweep::{ErrorMeasure, Line, Measure, Point, Sweep};
use swell_scene::{Iteration, Method, Scene, Stop, asset_path};
use swell_study::{
    chart::{Chart, Dot, Mark, Series},
    convergence_point::{Reading, TABLE_1, convergence_point},
    knee::{self, BEST_THAT_WAS_RUN, Knee, OF_NO_ACCOUNT, TOO_FEW},
    page::Part,
};

use super::{
    super::{
        Devices,
        engine::Bench,
        report::{Report, what_was_run},
    },
    digits::{shortened, significant},
    measured::{self, SweepRun},
};

/// Results to draw.
pub(super) struct SweepResults<'a> {
    pub(super) sweep: &'a Sweep,
    devices: &'a Devices,
    /// Runs of each line in the order of its points, then of its coarser point if it has one.
    runs: &'a [Vec<SweepRun>],
    /// Whether costs are per frame rather than per run, which requires that all runs have the same
    /// number of frames.
    is_per_frame: bool,
}

/// Quantity of the x axis.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Cost {
    /// Median time, with a bar from the minimum to the maximum.
    Time,
    Work,
}

pub(super) fn draw(sweep: &Sweep, bench: &Bench<'_>, runs: &[Vec<SweepRun>]) -> Report {
    let frames = || sweep.points().map(|point| point.frames);
    let results = SweepResults {
        sweep,
        devices: bench.devices,
        runs,
        is_per_frame: frames().max() == frames().min(),
    };
    let rivals = results.rivals();
    let mut findings = Vec::new();
    for (error, index, line, discretisation) in results.each() {
        let of = format!("{}, {}", error.name(), line.name);
        findings.push(format!("{of}: {}", knee::words(&line, discretisation)));
        let told = rivals.iter().filter(|r| (r.0, r.1) == (error, index));
        let words: Vec<String> = told.map(|(_, _, rivalry)| rivalry.words()).collect();
        if !words.is_empty() {
            findings.push(format!("{of} at equal time: {}", words.join("; ")));
        }
    }
    let mut table = vec![results.titles()];
    table.extend(results.rows());
    Report {
        answer: results.answer(),
        curves: results.charts(),
        parts: results.parts(bench, &table, &rivals),
        table,
        findings,
        missed: Vec::new(),
    }
}

impl SweepResults<'_> {
    /// Every run with its line and point; the coarser run is the last of its line.
    fn all(&self) -> impl Iterator<Item = (usize, &Line, &Point, &SweepRun)> {
        let lines = self.sweep.lines.iter().zip(self.runs).enumerate();
        lines.flat_map(|(k, (line, runs))| {
            let points = line.points.iter().chain(&line.coarser);
            points
                .zip(runs)
                .map(move |(point, run)| (k, line, point, run))
        })
    }

    /// Runs that reached their end.
    pub(super) fn done(&self) -> impl Iterator<Item = &SweepRun> {
        self.all()
            .map(|(.., run)| run)
            .filter(|run| run.ended.is_none())
    }

    fn coarser(&self, line: usize) -> Option<&SweepRun> {
        self.runs[line].get(self.sweep.lines[line].points.len())
    }

    /// Error of run `index` of a line, including the coarser one; `None` where the run failed, the
    /// error was not measured, or the run is its own reference.
    fn error(&self, line: usize, index: usize, error: ErrorMeasure) -> Option<f64> {
        let finest = self.sweep.lines[line].points.len() - 1;
        let (run, reference) = match self.sweep.lines[line].against {
            Some(other) => (&self.runs[line][index], &self.runs[other][index]),
            None => (&self.runs[line][index], &self.runs[line][finest]),
        };
        let is_itself = error.measure() == Measure::Finest && std::ptr::eq(run, reference);
        if run.ended.is_some() || is_itself {
            return None;
        }
        let reference = Some(&reference.measured).filter(|_| reference.ended.is_none());
        let value = measured::error(error, &run.measured, reference);
        // A discretisation error of 0 means that nothing was measured.
        value.filter(|value| index <= finest || *value > 0.0)
    }

    /// Discretisation error of a line's grid or step, where the study measured it.
    fn discretisation(&self, line: usize, error: ErrorMeasure) -> Option<f64> {
        self.coarser(line)?;
        self.error(line, self.sweep.lines[line].points.len(), error)
    }

    /// Minimum, median and maximum time, milliseconds.
    fn time(&self, run: &SweepRun) -> [f64; 3] {
        let frames = if self.is_per_frame {
            1.0
        } else {
            f64::from(run.frames)
        };
        run.per_frame().map(|seconds| 1e3 * seconds * frames)
    }

    fn work(&self, run: &SweepRun) -> f64 {
        let frames = if self.is_per_frame {
            f64::from(run.frames)
        } else {
            1.0
        };
        run.measured.work / frames
    }

    fn lines(&self, error: ErrorMeasure) -> Vec<knee::MethodCurve> {
        let lines = self.sweep.lines.iter().enumerate();
        let point = |k: usize, index: usize, point: &Point| {
            let run = &self.runs[k][index];
            Some(knee::CostPoint {
                label: point.label.clone(),
                error: self.error(k, index, error)?,
                time: self.time(run),
                work: self.work(run),
            })
        };
        let of = |(k, line): (usize, &Line)| knee::MethodCurve {
            name: line.name.clone(),
            points: (line.points.iter().enumerate())
                .filter_map(|(index, p)| point(k, index, p))
                .collect(),
        };
        lines.map(of).collect()
    }

    /// Each error of each line, with its discretisation error.
    fn each(&self) -> Vec<(ErrorMeasure, usize, knee::MethodCurve, Option<f64>)> {
        let errors = self.sweep.errors.iter();
        let of = |&error: &ErrorMeasure| {
            let lines = self.lines(error).into_iter().enumerate();
            lines.map(move |(k, line)| (error, k, line, self.discretisation(k, error)))
        };
        errors.flat_map(of).collect()
    }

    /// Each error of each line compared with each other line at equal times.
    fn rivals(&self) -> Vec<(ErrorMeasure, usize, knee::Rivalry)> {
        // Lines with references of their own cannot be compared.
        let errors = self.sweep.errors.iter();
        let errors = errors.filter(|error| error.measure() != Measure::Finest);
        let of = |&error: &ErrorMeasure| {
            let lines = self.lines(error);
            let each = (0..lines.len()).map(|k| (k, knee::rivalry(&lines, k)));
            let each: Vec<_> = each.collect();
            each.into_iter()
                .flat_map(move |(k, all)| all.into_iter().map(move |one| (error, k, one)))
        };
        errors.flat_map(of).collect()
    }

    /// The page's first sentence: the setting at the best knee of the first error, or the knee of
    /// each line where lines cannot be compared.
    fn answer(&self) -> String {
        let error = self.sweep.errors[0];
        let each = self.each();
        let of_error = each.iter().filter(|(of, ..)| *of == error);
        let mut knees: Vec<(&knee::MethodCurve, Knee<'_>, String)> = of_error
            .filter_map(|(_, k, line, discretisation)| {
                let knee = knee::knee(line, *discretisation)?;
                let key = &self.sweep.lines[*k].key;
                Some((
                    line,
                    knee,
                    format!("{key} = {} with {}", knee.point.label, line.name),
                ))
            })
            .collect();
        if error.measure() != Measure::Finest {
            let order = |knee: &Knee<'_>| match (knee.is_enough, knee.point) {
                (true, point) => (0, point.time[1]),
                (false, point) => (1, point.time[1] * point.error),
            };
            knees.sort_by(|(_, a, _), (_, b, _)| {
                let (a, b) = (order(a), order(b));
                a.0.cmp(&b.0).then(a.1.total_cmp(&b.1))
            });
            knees.truncate(1);
        }
        let told = knees.iter().map(|(line, knee, setting)| {
            let why = match (knee.is_enough, line.points.len(), knee.is_last) {
                (true, ..) => {
                    "the cheapest setting below a tenth of the discretisation error".to_owned()
                }
                (_, 1, _) => "the only setting that was measured".to_owned(),
                (_, _, false) => LEAST_PRODUCT.to_owned(),
                (_, _, true) => format!("{LEAST_PRODUCT}, {BEST_THAT_WAS_RUN}"),
            };
            let of = self.cost_of().trim_start_matches("of ");
            let (ms, value) = (knee.point.time[1], knee.point.error);
            let (ms, title) = (significant(ms), error.title());
            format!("{setting}: {ms} ms {of}, {title}: {value:.1e}; {why}")
        });
        match told.collect::<Vec<_>>().join("; ") {
            none if none.is_empty() => "Nothing was measured: no point finished.".to_owned(),
            told => format!("The knee is {told}."),
        }
    }

    fn failures(&self) -> Vec<String> {
        let failed = |(_, line, point, run): (usize, &Line, &Point, &SweepRun)| {
            let key = self.key(line, point);
            let message = run.ended.as_ref()?;
            Some(format!("{}, {key} = {}: {message}", line.name, point.label))
        };
        self.all().filter_map(failed).collect()
    }

    fn key<'a>(&self, line: &'a Line, point: &Point) -> &'a str {
        match &line.coarser {
            Some(coarser) if std::ptr::eq(coarser, point) => "coarser",
            _ => &line.key,
        }
    }

    /// Unit to which costs refer.
    fn cost_of(&self) -> &'static str {
        match (self.sweep.state.is_some(), self.is_per_frame) {
            (true, _) => "of a projection",
            (false, true) => "a frame",
            (false, false) => "of the whole run",
        }
    }

    /// Charts as SVG with their file names.
    fn charts(&self) -> Vec<(String, String)> {
        let costs = [(Cost::Time, "time"), (Cost::Work, "work")];
        let each = self.sweep.errors.iter();
        let each = each.flat_map(|error| costs.map(|(cost, name)| (*error, cost, name)));
        each.map(|(error, cost, name)| {
            let chart = self.chart(error, cost);
            (format!("{}-{name}", error.name()), chart.to_svg())
        })
        .collect()
    }

    fn chart(&self, error: ErrorMeasure, cost: Cost) -> Chart {
        let lines = self.lines(error);
        let zeros = lines.iter().flat_map(|line| {
            let zeros = line.points.iter().filter(|point| point.error == 0.0);
            zeros.map(|point| format!("{}, {}: an error of 0", line.name, point.label))
        });
        let failures = self.failures().into_iter();
        let notes = failures.map(|text| format!("failed: {text}")).chain(zeros);
        let series = |(k, line): (usize, &knee::MethodCurve)| {
            let knee = knee::knee(line, self.discretisation(k, error));
            let dot = |point: &knee::CostPoint| Dot {
                at: if cost == Cost::Time {
                    point.time[1]
                } else {
                    point.work
                },
                value: Some(point.error),
                label: point.label.clone(),
                bar: (cost == Cost::Time).then_some([point.time[0], point.time[2]]),
                is_knee: knee.is_some_and(|knee| std::ptr::eq(knee.point, point)),
            };
            Series {
                name: line.name.clone(),
                points: line.points.iter().map(dot).collect(),
            }
        };
        let mut levels: Vec<f64> = (0..lines.len())
            .filter_map(|k| Some(OF_NO_ACCOUNT * self.discretisation(k, error)?))
            .collect();
        levels.sort_by(f64::total_cmp);
        // Levels of nearly the same height are merged.
        levels.dedup_by(|a, b| *a < 1.2 * *b);
        let points = || self.sweep.points();
        let shots = unique(points().map(|point| point.scene.shot.name.as_str()));
        let keys = unique(self.sweep.lines.iter().map(|line| line.key.as_str()));
        Chart {
            title: format!("{} by {}", shots.join(", "), keys.join(", ")),
            subtitle: self.subtitle(cost),
            x_label: match cost {
                Cost::Time => format!("time {}, ms", self.cost_of()),
                Cost::Work => format!("{} {}", self.work_name(), self.cost_of()),
            },
            y_label: error.title().to_owned(),
            is_log: true,
            series: lines.iter().enumerate().map(series).collect(),
            // Only the topmost level is labelled.
            marks: (levels.iter().enumerate())
                .map(|(k, level)| {
                    let is_top = k + 1 == levels.len();
                    let text = if is_top { DISCRETISATION } else { "" };
                    Mark::Level(*level, text.to_owned())
                })
                .collect(),
            notes: notes.collect(),
            ..Chart::default()
        }
    }

    fn work_name(&self) -> &'static str {
        let has = |method| {
            self.sweep
                .points()
                .any(|p| p.scene.solver.method() == method)
        };
        match (has(Method::Pbf), has(Method::Flip)) {
            (_, false) => "neighbour visits",
            (false, true) => "matrix-vector products",
            (true, true) => "neighbour visits (pbf), matrix-vector products (flip)",
        }
    }

    /// Devices, and the meaning of the bars.
    fn subtitle(&self, cost: Cost) -> String {
        let devices = self.sweep.points().map(|p| self.devices.of(p.device));
        let names: Vec<_> = devices.map(|device| device.identity().name).collect();
        let on = unique(names.iter().map(String::as_str)).join(" and ");
        match (cost, self.sweep.repeats) {
            (Cost::Work, _) | (_, 1) => format!("on {on}"),
            (Cost::Time, repeats) => {
                format!("on {on}; bars from the least to the greatest of {repeats}")
            }
        }
    }

    fn titles(&self) -> Vec<String> {
        let fixed = "method,device,key,setting,particles,frames,repeats,ms,ms_least,ms_most,work,\
                     substeps,iterations,missed";
        let fixed = fixed.split(',').map(str::to_owned);
        let errors = self
            .sweep
            .errors
            .iter()
            .map(|error| error.name().to_owned());
        let name = |of: &Reading| format!("convergence_point_{of:?}").to_lowercase();
        let titles = fixed.chain(errors).chain(self.readings().iter().map(name));
        titles.chain(["failed".to_owned()]).collect()
    }

    fn readings(&self) -> &'static [Reading] {
        if self.sweep.has_convergence_point {
            &Reading::ALL
        } else {
            &[]
        }
    }

    fn rows(&self) -> Vec<Vec<String>> {
        let of_line = |k: usize| (0..self.runs[k].len()).map(move |index| (k, index));
        let places = (0..self.runs.len()).flat_map(of_line);
        let all = self.all().zip(places);
        all.map(|((_, line, point, run), (k, index))| {
            let head = [
                &line.name,
                point.device.name(),
                self.key(line, point),
                &point.label,
            ];
            let mut row: Vec<String> = head.map(str::to_owned).to_vec();
            if let Some(message) = &run.ended {
                row.resize(self.titles().len() - 1, String::new());
                row.push(message.clone());
                return row;
            }
            let ([least, middle, most], measured) = (self.time(run), &run.measured);
            row.extend([
                run.particles.to_string(),
                run.frames.to_string(),
                run.seconds.len().to_string(),
                format!("{middle:.3}"),
                format!("{least:.3}"),
                format!("{most:.3}"),
                format!("{:.4e}", self.work(run)),
                measured.substeps.to_string(),
                measured.iterations.to_string(),
                measured.missed.to_string(),
            ]);
            let told = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.4e}"));
            let errors = self.sweep.errors.iter();
            row.extend(errors.map(|&error| told(self.error(k, index, error))));
            let readings = self.readings().iter();
            row.extend(readings.map(|&reading| found(run, reading).unwrap_or_default()));
            row.push(String::new());
            row
        })
        .collect()
    }

    fn parts(
        &self,
        bench: &Bench<'_>,
        table: &[Vec<String>],
        rivals: &[(ErrorMeasure, usize, knee::Rivalry)],
    ) -> Vec<Part> {
        let mut parts: Vec<Part> = self.sweep.about.iter().cloned().map(Part::Text).collect();
        parts.push(Part::Heading("Knees".into()));
        let titled = |titles: &[&str]| vec![titles.iter().map(|&t| t.to_owned()).collect()];
        let mut knees: Vec<Vec<String>> = titled(&["error", "method", "knee"]);
        for (error, _, line, discretisation) in self.each() {
            let words = knee::words(&line, discretisation);
            knees.push(vec![error.title().to_owned(), line.name, words]);
        }
        parts.push(Part::Words(knees));
        if !rivals.is_empty() {
            let titles = [
                "error",
                "method",
                "against",
                "settings compared",
                "less error at",
                "not at",
            ];
            let mut pairs: Vec<Vec<String>> = titled(&titles);
            for (error, k, rivalry) in rivals {
                let (all, lost) = (rivalry.ratios.len(), rivalry.lost());
                let (won, lost) = match rivalry.has_verdict() {
                    true => ((all - lost.len()).to_string(), lost.join(", ")),
                    false => (TOO_FEW.to_owned(), String::new()),
                };
                pairs.push(vec![
                    error.title().to_owned(),
                    self.sweep.lines[*k].name.clone(),
                    rivalry.other.clone(),
                    all.to_string(),
                    won,
                    lost,
                ]);
            }
            let title = "Method against method in equal time";
            parts.push(Part::Folded(title.into(), vec![Part::Words(pairs)]));
        }
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
        parts.push(Part::Heading("Table".into()));
        parts.push(Part::Table(shortened(table)));
        let mut run = what_was_run(bench.request);
        run.push(Part::Text(format!(
            "{} By {} {}. {}",
            self.where_run(),
            swell_domain::PROGRAM,
            swell_domain::VERSION,
            self.policy()
        )));
        if let Some(point) = self.sweep.points().next() {
            let told = "The scene of the first point, every default written out:";
            run.push(Part::Text(told.into()));
            run.push(Part::Code(scene_to_toml(&point.scene, &asset_path)));
        }
        parts.push(Part::Folded("What was run".into(), run));
        let measured = self.measured().into_iter().map(Part::Text).collect();
        parts.push(Part::Folded("How it was measured".into(), measured));
        parts
    }

    /// Devices with the methods that ran on each.
    fn where_run(&self) -> String {
        let mut methods: BTreeMap<String, Vec<&str>> = BTreeMap::new();
        for (_, line, point, _) in self.all() {
            let device = self.devices.of(point.device).identity().to_string();
            let names = methods.entry(device).or_default();
            if names.last() != Some(&line.name.as_str()) {
                names.push(&line.name);
            }
        }
        let told = methods
            .iter()
            .map(|(device, names)| format!("On {device}: {}.", names.join(", ")));
        told.collect::<Vec<_>>().join(" ")
    }

    /// Convergence points beside the paper's, one row per number of iterations.
    fn convergence_table(&self) -> Vec<Vec<String>> {
        let mut titles = vec!["method".into(), "setting".into(), "ms".into()];
        titles.extend(Reading::ALL.map(|reading| format!("point: {}", reading.text())));
        titles.extend(["the paper's ms".into(), "the paper's point".into()]);
        let mut table = vec![titles];
        for (_, line, point, run) in self.all().filter(|(.., run)| run.ended.is_none()) {
            let ms = format!("{:.2}", self.time(run)[1]);
            let mut row = vec![line.name.clone(), point.label.clone(), ms];
            let not = || "not within the run".to_owned();
            row.extend(Reading::ALL.map(|reading| found(run, reading).unwrap_or_else(not)));
            row.extend(match paper(&point.scene) {
                Some((ms, point)) => [format!("{ms:.2}"), point.to_string()],
                None => [const { String::new() }; 2],
            });
            table.push(row);
        }
        table
    }
}

const LEAST_PRODUCT: &str = "the setting with the least error × time";

/// Distinct names in order of their first occurrence.
fn unique<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut known = Vec::new();
    for name in names {
        if !known.contains(&name) {
            known.push(name);
        }
    }
    known
}

fn found(run: &SweepRun, reading: Reading) -> Option<String> {
    let errors: Vec<f64> = run.measured.density.iter().map(|frame| frame[0]).collect();
    convergence_point(&errors, reading).map(|step| step.to_string())
}

/// Milliseconds and convergence point in the paper for a scene's iteration.
fn paper(scene: &Scene) -> Option<(f64, u32)> {
    let pbf = scene.solver.pbf()?;
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

const DISCRETISATION: &str = "a tenth of the discretisation error";

const CONVERGENCE: &str = "The paper calls a run converged from the step on at which \"the \
    relative error of the current iteration and the 50 before is less than 0.5 %\", for good. It \
    does not say what the error is, nor whether the 50 are what the current step is compared \
    with. The first column reads it so: the mean density, 1 + the mean of max(0, ρ/ρ0 − 1), \
    differs from each of the 50 steps before by less than 0.5 %. The others show what the point \
    would be if the density error itself had to stay below 0.5 %, and if it had to differ from \
    each of the 50 by less than 0.5 % of itself. The paper's scene is not known beyond its 500 \
    000 particles and 16 ms, so that its points can be compared in their order and trend alone; \
    its times are of a GTX 1650.";
