//! The table and the page of a stability study.

use crate::{
    scene::{
        Method,
        study::stability::{Bound, Case, CaseDevice, Held, Mark, Quantity, Trial},
    },
    study::{
        chart::{Chart, Series},
        page::{self, Part, Tone},
    },
};

use super::{
    super::{Outcome, Request, StudyError, csv, what_was_run, write},
    Record, Results, Verdict,
};

/// A mark of a solver in a case, on each device.
struct Row<'a> {
    case: &'a Case,
    method: Method,
    mark: &'a Mark,
    /// Device, run and how it came out.
    on: Vec<(CaseDevice, &'a Trial, &'a Record, usize)>,
}

impl Row<'_> {
    fn verdict(&self) -> Verdict {
        let verdicts = self.on.iter();
        let of = |(_, trial, record, place): &(_, &Trial, &Record, usize)| {
            record.run.verdicts(trial)[*place]
        };
        let order = |v: &Verdict| match v {
            Verdict::Misses => 0,
            Verdict::KnownFailure => 1,
            Verdict::PassesUnexpectedly => 2,
            Verdict::Passes => 3,
        };
        // Of two devices the worse: a failure that one of them has is a failure still.
        verdicts
            .map(of)
            .min_by_key(order)
            .unwrap_or(Verdict::Misses)
    }

    fn value(&self, device: CaseDevice) -> String {
        let found = self.on.iter().find(|(on, ..)| *on == device);
        let Some((_, _, record, place)) = found else {
            return "–".to_owned();
        };
        let measured = record.run.measured.get(*place);
        match (measured.and_then(|m| m.value), &record.run.ended) {
            (_, Some(message)) => format!("ended: {message}"),
            (Some(value), None) => number(value),
            (None, None) => "no number".to_owned(),
        }
    }

    fn name(&self) -> String {
        format!(
            "{} {}, {}, {}",
            self.case.number,
            self.case.name,
            self.method.name(),
            self.mark.of.name()
        )
    }
}

/// Three digits.
pub(super) fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if !(1e-3..1e5).contains(&size) => format!("{value:.2e}"),
        size if size >= 100.0 => format!("{value:.0}"),
        size => {
            let digits = (2.0 - size.log10().floor()).max(0.0) as usize;
            let text = format!("{value:.digits$}");
            match text.contains('.') {
                true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
                false => text,
            }
        }
    }
}

/// With its sign.
pub(super) fn bound(bound: Bound) -> String {
    match bound {
        Bound::AtMost(most) => format!("≤ {}", number(most)),
        Bound::AtLeast(least) => format!("≥ {}", number(least)),
    }
}

/// Writes `results.csv` and the page.
pub(super) fn write_all(request: &Request, results: &Results<'_>) -> Result<Outcome, StudyError> {
    let directory = &request.directory;
    write(&directory.join("results.csv"), csv(&results.table()))?;
    let name = directory.file_name().unwrap_or_default();
    let title = format!("{}: stability", name.to_string_lossy());
    let file = directory.join("index.html");
    let findings = results.findings();
    write(
        &file,
        page::html(&title, &results.parts(request, &findings)),
    )?;
    let told = findings
        .into_iter()
        .map(|(what, words)| format!("{what}: {words}"));
    Ok(Outcome {
        page: Some(file),
        findings: told.collect(),
        missed: results.missed(),
    })
}

impl Results<'_> {
    /// Marks of each case and solver, devices side by side.
    fn rows(&self) -> Vec<Row<'_>> {
        let mut rows = Vec::new();
        for (case, records) in self.stability.cases.iter().zip(&self.cases) {
            let Held::Runs(trials) = &case.held else {
                continue;
            };
            for method in [Method::Pbf, Method::Flip] {
                let mut of_case: Vec<Row<'_>> = Vec::new();
                for (trial, record) in trials.iter().zip(records) {
                    if trial.scene.solver.method != method {
                        continue;
                    }
                    for (place, mark) in trial.marks.iter().enumerate() {
                        let on = (trial.device, trial, record, place);
                        match of_case.iter_mut().find(|row| row.mark == mark) {
                            Some(row) => row.on.push(on),
                            None => of_case.push(Row {
                                case,
                                method,
                                mark,
                                on: vec![on],
                            }),
                        }
                    }
                }
                rows.extend(of_case);
            }
        }
        rows
    }

    /// Refusals that did not come, or came with other words.
    fn not_refused(&self) -> Vec<String> {
        let mut wrong = Vec::new();
        for (case, records) in self.stability.cases.iter().zip(&self.cases) {
            if let Held::Refusal { words, .. } = &case.held {
                let is_wrong = |record: &&Record| !is_refused(record, words);
                wrong.extend(records.iter().filter(is_wrong).map(|r| r.name.clone()));
            }
        }
        wrong
    }

    /// What is missed and not known to be.
    fn missed(&self) -> Vec<String> {
        let rows = self.rows();
        let missed = rows.iter().filter(|row| row.verdict() == Verdict::Misses);
        let missed = missed.map(Row::name);
        missed.chain(self.not_refused()).collect()
    }

    fn findings(&self) -> Vec<(String, String)> {
        let rows = self.rows();
        let of = |wanted: Verdict| rows.iter().filter(move |row| row.verdict() == wanted);
        let passed = of(Verdict::Passes).count();
        let refusals: usize = (self.stability.cases.iter().zip(&self.cases))
            .filter(|(case, _)| matches!(case.held, Held::Refusal { .. }))
            .map(|(_, records)| records.len())
            .sum();
        let refused = refusals - self.not_refused().len();
        let mut findings = vec![(
            "marks".to_owned(),
            format!(
                "{} of {} hold",
                passed + refused + of(Verdict::PassesUnexpectedly).count(),
                rows.len() + refusals
            ),
        )];
        let list = |names: Vec<String>| names.join("; ");
        let missed = self.missed();
        if !missed.is_empty() {
            findings.push(("missed".to_owned(), list(missed)));
        }
        for (what, verdict) in [
            ("known failures", Verdict::KnownFailure),
            ("no failures any more", Verdict::PassesUnexpectedly),
        ] {
            let names: Vec<_> = of(verdict).map(Row::name).collect();
            if !names.is_empty() {
                findings.push((what.to_owned(), list(names)));
            }
        }
        for (limit, found) in self.stability.limits.iter().zip(&self.limits) {
            for (search, found) in limit.searches.iter().zip(found) {
                let what = format!("{}, {}", limit.name, search.method.name());
                findings.push((what, found.words(&limit.unit)));
            }
        }
        findings
    }

    /// A line a mark and device.
    fn table(&self) -> Vec<Vec<String>> {
        let titles = [
            "number",
            "case",
            "solver",
            "device",
            "quantity",
            "value",
            "mark",
            "verdict",
            "particles",
            "frames",
            "seconds",
            "ended",
        ];
        let mut table = vec![titles.map(str::to_owned).to_vec()];
        for row in self.rows() {
            for (device, trial, record, place) in &row.on {
                let run = &record.run;
                let value = run.measured.get(*place).and_then(|m| m.value);
                table.push(vec![
                    row.case.number.to_string(),
                    row.case.name.clone(),
                    row.method.name().to_owned(),
                    device.name().to_owned(),
                    row.mark.of.name().to_owned(),
                    value.map_or(String::new(), |value| format!("{value:.6e}")),
                    bound(row.mark.bound),
                    run.verdicts(trial)[*place].words().to_owned(),
                    run.particles.to_string(),
                    run.frames.to_string(),
                    format!("{:.3}", run.seconds),
                    run.ended.clone().unwrap_or_default(),
                ]);
            }
        }
        for (case, records) in self.stability.cases.iter().zip(&self.cases) {
            let Held::Refusal { words, attempts } = &case.held else {
                continue;
            };
            for (attempt, record) in attempts.iter().zip(records) {
                let verdict = refusal_verdict(record, words);
                let mut row = vec![
                    case.number.to_string(),
                    case.name.clone(),
                    attempt.method.name().to_owned(),
                    attempt.device.name().to_owned(),
                    "refused".to_owned(),
                    String::new(),
                    words.join(" … "),
                    verdict.words().to_owned(),
                ];
                row.resize(titles.len() - 1, String::new());
                row.push(record.run.ended.clone().unwrap_or_default());
                table.push(row);
            }
        }
        for (limit, found) in self.stability.limits.iter().zip(&self.limits) {
            for (search, found) in limit.searches.iter().zip(found) {
                let mut row = vec![
                    "limit".to_owned(),
                    limit.name.clone(),
                    search.method.name().to_owned(),
                    CaseDevice::Gpu.name().to_owned(),
                    limit.unit.clone(),
                    found.passes.map_or(String::new(), |v| format!("{v:.6e}")),
                ];
                row.resize(titles.len() - 1, String::new());
                row.push(found.words(&limit.unit));
                table.push(row);
            }
        }
        table
    }

    fn parts(&self, request: &Request, findings: &[(String, String)]) -> Vec<Part> {
        let mut parts: Vec<Part> = self
            .stability
            .about
            .iter()
            .cloned()
            .map(Part::Text)
            .collect();
        parts.push(Part::Answers(findings.to_vec()));
        parts.push(Part::Heading("Cases".into()));
        parts.push(self.verdicts());
        if let Some(tests) = self.tests() {
            parts.push(Part::Subheading("Held by tests".into()));
            parts.push(tests);
        }
        if !self.limits.is_empty() {
            parts.push(Part::Heading("Limits".into()));
            parts.push(Part::Table(self.limit_table()));
            parts.extend(self.stability.limits.iter().filter_map(|limit| {
                let note = limit.note.as_ref()?;
                Some(Part::Text(format!("{}: {note}", limit.name)))
            }));
            parts.push(Part::Text(LIMITS.into()));
        }
        parts.push(Part::Heading("Curves".into()));
        parts.extend(self.curves());
        parts.push(Part::Heading("What was run".into()));
        parts.extend(what_was_run(request));
        parts.push(Part::Text(self.where_run()));
        parts.push(Part::Table(self.runs()));
        parts.push(Part::Heading("How it was measured".into()));
        parts.extend([EVERYWHERE, MEASURED].map(|text| Part::Text(text.into())));
        parts
    }

    /// Case by case: marks and refusals.
    fn verdicts(&self) -> Part {
        let rows = self.rows();
        let mut out = Vec::new();
        for (case, records) in self.stability.cases.iter().zip(&self.cases) {
            let head = [case.number.to_string(), case.name.clone()];
            let line = |cells: [String; 6]| head.iter().cloned().chain(cells).collect::<Vec<_>>();
            match &case.held {
                Held::Test(_) => {}
                Held::Refusal { words, attempts } => {
                    for (attempt, record) in attempts.iter().zip(records) {
                        let verdict = refusal_verdict(record, words);
                        let said = record.run.ended.clone();
                        let of = |device| match (attempt.device == device, &said) {
                            (false, _) => String::new(),
                            (true, Some(_)) => "yes".to_owned(),
                            (true, None) => "no".to_owned(),
                        };
                        let cells = [
                            attempt.method.name().to_owned(),
                            "refused".to_owned(),
                            of(CaseDevice::Gpu),
                            of(CaseDevice::Cpu),
                            "refused".to_owned(),
                            format!("{}: {}", verdict.words(), said.unwrap_or_default()),
                        ];
                        out.push((tone(verdict), line(cells)));
                    }
                }
                Held::Runs(_) => {
                    let own = rows.iter().filter(|row| std::ptr::eq(row.case, case));
                    for row in own {
                        let verdict = row.verdict();
                        // What holds of every run is told once, below the table.
                        if Quantity::ALWAYS.contains(&row.mark.of) && verdict == Verdict::Passes {
                            continue;
                        }
                        let why = row.mark.known_failure.as_ref();
                        let why = why.map_or(String::new(), |why| format!(": {why}"));
                        let cells = [
                            row.method.name().to_owned(),
                            format!("{}{}", row.mark.of.about().title, when(row.mark)),
                            row.value(CaseDevice::Gpu),
                            row.value(CaseDevice::Cpu),
                            bound(row.mark.bound),
                            format!("{}{why}", verdict.words()),
                        ];
                        out.push((tone(verdict), line(cells)));
                    }
                }
            }
        }
        let titles = [
            "", "case", "solver", "measured", "GPU", "CPU, f64", "mark", "verdict",
        ];
        // A case's name stands once, over its rows.
        for k in (1..out.len()).rev() {
            let same = out[k].1[..2] == out[k - 1].1[..2];
            out[k].1[..2]
                .iter_mut()
                .filter(|_| same)
                .for_each(String::clear);
        }
        Part::Verdicts {
            titles: titles.map(str::to_owned).to_vec(),
            rows: out,
        }
    }

    /// Cases that tests hold, with the command that runs each.
    fn tests(&self) -> Option<Part> {
        let mut table = vec![["", "case", "held by"].map(str::to_owned).to_vec()];
        for case in &self.stability.cases {
            if let Held::Test(command) = &case.held {
                let number = case.number.to_string();
                table.push(vec![number, case.name.clone(), command.clone()]);
            }
        }
        let rows = table.split_off(1);
        let rows: Vec<_> = rows.into_iter().map(|row| (Tone::Plain, row)).collect();
        (!rows.is_empty()).then(|| Part::Verdicts {
            titles: table.remove(0),
            rows,
        })
    }

    fn limit_table(&self) -> Vec<Vec<String>> {
        let titles = ["limit", "solver", "passes up to", "fails at", "by", "runs"];
        let mut table = vec![titles.map(str::to_owned).to_vec()];
        for (limit, found) in self.stability.limits.iter().zip(&self.limits) {
            for (search, found) in limit.searches.iter().zip(found) {
                let told = |value: f64| format!("{} {}", number(value), limit.unit);
                let fails = found.fails.as_ref();
                table.push(vec![
                    limit.name.clone(),
                    search.method.name().to_owned(),
                    found.passes.map_or("not even the first value".into(), told),
                    fails.map_or("nothing that was tried".into(), |(value, _)| told(*value)),
                    fails.map_or(String::new(), |(_, words)| words.clone()),
                    found.tries.to_string(),
                ]);
            }
        }
        table
    }

    /// A chart a mark whose number changes over time, one line a solver and device.
    fn curves(&self) -> Vec<Part> {
        let rows = self.rows();
        let mut parts = Vec::new();
        for case in &self.stability.cases {
            let own = || rows.iter().filter(|row| std::ptr::eq(row.case, case));
            // One chart each, and one more of what is held against a later state.
            let of = |row: &Row<'_>| (row.mark.of, row.mark.since.map(f64::to_bits));
            let mut quantities: Vec<_> = own().map(of).collect();
            quantities.sort_unstable();
            quantities.dedup();
            let charts: Vec<String> = quantities
                .into_iter()
                .filter_map(|which| chart(which.0, own().filter(|row| of(row) == which)))
                .collect();
            if charts.is_empty() && case.note.is_none() {
                continue;
            }
            parts.push(Part::Subheading(format!("{} {}", case.number, case.name)));
            parts.extend(case.note.clone().map(Part::Text));
            parts.push(Part::Curves(charts));
        }
        parts
    }

    fn where_run(&self) -> String {
        let gpu = self.devices.gpu.as_ref();
        let gpu = gpu.map_or(String::new(), |gpu| format!("GPU: {}. ", gpu.identity()));
        format!(
            "{gpu}CPU: {}. By {} {}. Limits are those of the GPU's solvers.",
            self.devices.cpu.identity(),
            env!("CARGO_PKG_NAME"),
            env!("CARGO_PKG_VERSION")
        )
    }

    fn runs(&self) -> Vec<Vec<String>> {
        let titles = [
            "case",
            "solver",
            "device",
            "particles",
            "frames",
            "frames a second",
            "s",
        ];
        let mut table = vec![titles.map(str::to_owned).to_vec()];
        for (case, records) in self.stability.cases.iter().zip(&self.cases) {
            let Held::Runs(trials) = &case.held else {
                continue;
            };
            for (trial, record) in trials.iter().zip(records) {
                table.push(vec![
                    format!("{} {}", case.number, case.name),
                    trial.scene.solver.method.name().to_owned(),
                    trial.device.name().to_owned(),
                    record.run.particles.to_string(),
                    record.run.frames.to_string(),
                    number(trial.scene.shot.frames_per_second),
                    format!("{:.2}", record.run.seconds),
                ]);
            }
        }
        table
    }
}

fn is_refused(record: &Record, words: &[String]) -> bool {
    let said = record.run.ended.as_ref();
    said.is_some_and(|said| words.iter().all(|word| said.contains(word)))
}

fn refusal_verdict(record: &Record, words: &[String]) -> Verdict {
    match is_refused(record, words) {
        true => Verdict::Passes,
        false => Verdict::Misses,
    }
}

fn tone(verdict: Verdict) -> Tone {
    match verdict {
        Verdict::Passes => Tone::Good,
        Verdict::Misses => Tone::Bad,
        Verdict::KnownFailure | Verdict::PassesUnexpectedly => Tone::Known,
    }
}

/// The frames that count, where not all do.
fn when(mark: &Mark) -> String {
    match mark.since {
        Some(since) => format!(", against that at {} s", number(since)),
        None if mark.after > 0.0 => format!(", after {} s", number(mark.after)),
        None => String::new(),
    }
}

/// `None` where nothing changes.
fn chart<'a>(of: Quantity, rows: impl Iterator<Item = &'a Row<'a>>) -> Option<String> {
    let mut series = Vec::new();
    let mut marks: Vec<f64> = Vec::new();
    let mut span = String::new();
    for row in rows {
        span = when(row.mark);
        for (device, _, record, place) in &row.on {
            let points = record.run.measured.get(*place)?.curve.clone();
            series.push(Series {
                name: format!("{} {}", row.method.name(), device.name()),
                points,
            });
        }
        marks.push(row.mark.bound.value());
    }
    let values = || {
        series
            .iter()
            .flat_map(|s| s.points.iter().filter_map(|p| p.1))
    };
    let first = values().next()?;
    let longest = series.iter().map(|s| s.points.len()).max()?;
    if longest < 3 || values().all(|value| value == first) {
        return None;
    }
    // A mark that is far beyond what was measured would flatten the curves.
    let most = values().fold(0.0f64, |a, v| a.max(v.abs()));
    marks.dedup();
    let ends = || series.iter().flat_map(|s| s.points.iter().map(|p| p.0));
    let (from, to) = ends().fold((f64::MAX, f64::MIN), |(a, b), t| (a.min(t), b.max(t)));
    for mark in marks.into_iter().filter(|mark| mark.abs() <= 4.0 * most) {
        series.push(Series {
            name: "mark".into(),
            points: vec![(from, Some(mark)), (to, Some(mark))],
        });
    }
    let chart = Chart {
        title: format!("{}{span}", of.name()),
        x_label: "time, s".into(),
        y_label: of.about().title.to_owned(),
        series,
        marks: Vec::new(),
    };
    Some(chart.to_svg())
}

/// For the reader of the page.
const EVERYWHERE: &str = "Every run is also held to no value that is not finite, no particle outside of the domain, and the \
    particles of the start, each once; these have a row only where they are missed. A run that ends early misses all of its \
    marks.";

const MEASURED: &str = "A run is measured after each output frame, from its particles and the solver's report; the number \
    that is held against the mark is the worst of the frames, of means and ratios over time the last. d is the particle \
    spacing, Δx the cell size; d or Δx is d with PBF and Δx with FLIP. A run beside another goes frame by frame with it, and \
    particles are matched by where they start. Energy is that of motion and of height over the domain's floor. The \
    definitions stand at swell::scene::study::stability::Quantity.";

const LIMITS: &str = "Found by bisection by ratio between a value that passes and one that fails, on the GPU; a limit is that \
    of one scene, and no promise for others.";
