//! Table and page of a stability study.

use swell_files::study::{
    RunsOn,
    stability::{Bound, Case, Held, Limit, Mark, Quantity, Search, Stability},
};
use swell_scene::Method;
use swell_study::{
    chart::{self, Chart, Series},
    page::{Part, Tone},
};

use super::{
    super::{
        Devices, StudyRequest,
        report::{Report, what_was_run},
    },
    StabilityRun, Verdict,
    limit::Found,
};

/// All results of a study.
pub(super) struct StabilityResults<'a> {
    pub(super) stability: &'a Stability,
    pub(super) devices: &'a Devices,
    /// Runs of each case, one per trial or attempt.
    pub(super) runs: Vec<Vec<StabilityRun>>,
    pub(super) limits: Vec<(&'a Limit, &'a Search, Found)>,
}

/// Requirement on a solver in a case.
#[derive(Clone, Copy, PartialEq)]
enum To<'a> {
    Mark(&'a Mark),
    /// A refusal whose message contains these words.
    Refusal(&'a [String]),
}

/// Outcome of a requirement on one device.
struct On<'a> {
    device: RunsOn,
    run: &'a StabilityRun,
    verdict: Verdict,
    /// Index of the mark in the trial.
    place: usize,
}

/// Requirement on a solver in a case, with its outcome on each device.
struct RequirementRow<'a> {
    case: &'a Case,
    method: Method,
    to: To<'a>,
    on: Vec<On<'a>>,
}

impl On<'_> {
    fn value(&self) -> Option<f64> {
        self.run.measured.get(self.place)?.value
    }
}

impl RequirementRow<'_> {
    /// The worse verdict of both devices: a failure on one of them remains a failure.
    fn verdict(&self) -> Verdict {
        let order = [
            Verdict::Misses,
            Verdict::KnownFailure,
            Verdict::PassesUnexpectedly,
        ];
        let has = |verdict: &Verdict| self.on.iter().any(|on| on.verdict == *verdict);
        order.into_iter().find(has).unwrap_or(Verdict::Passes)
    }

    fn value(&self, device: RunsOn) -> String {
        let Some(on) = self.on.iter().find(|on| on.device == device) else {
            return "–".to_owned();
        };
        match (self.to, &on.run.ended, on.value()) {
            (To::Refusal(_), Some(_), _) => "yes".to_owned(),
            (To::Refusal(_), None, _) => "no".to_owned(),
            (To::Mark(_), Some(message), _) => format!("ended: {message}"),
            (To::Mark(_), None, Some(value)) => number(value),
            (To::Mark(_), None, None) => "no number".to_owned(),
        }
    }

    fn of(&self) -> &'static str {
        match self.to {
            To::Mark(mark) => mark.of.name(),
            To::Refusal(_) => "refused",
        }
    }

    fn name(&self) -> String {
        let (case, method) = (self.case, self.method.name());
        format!("{} {}, {method}, {}", case.number, case.name, self.of())
    }
}

/// Formats a number with three significant digits.
pub(in super::super) fn number(value: f64) -> String {
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

/// Formats a bound with its relation.
pub(super) fn bound(bound: Bound) -> String {
    match bound {
        Bound::AtMost(most) => format!("≤ {}", number(most)),
        Bound::AtLeast(least) => format!("≥ {}", number(least)),
    }
}

impl StabilityResults<'_> {
    pub(super) fn draw(&self, request: &StudyRequest) -> Report {
        let rows = self.rows();
        let findings = self.findings(&rows);
        let (_, marks) = &findings[0];
        let count = |wanted: Verdict| rows.iter().filter(|row| row.verdict() == wanted).count();
        Report {
            answer: format!(
                "Of the marks and refusals {marks}; {} are known failures and {} are missed.",
                count(Verdict::KnownFailure),
                count(Verdict::Misses)
            ),
            curves: Vec::new(),
            parts: self.parts(request, &rows, &findings),
            table: self.table(&rows),
            missed: names(&rows, Verdict::Misses),
            findings: (findings.iter())
                .map(|(what, words)| format!("{what}: {words}"))
                .collect(),
        }
    }

    /// Requirements case by case, with the outcomes of devices side by side.
    fn rows(&self) -> Vec<RequirementRow<'_>> {
        let mut rows = Vec::new();
        for (case, runs) in self.stability.cases.iter().zip(&self.runs) {
            match &case.held {
                Held::Test(_) => {}
                Held::Refusal { attempts, words } => {
                    for (attempt, run) in attempts.iter().zip(runs) {
                        let said = run.ended.as_deref().unwrap_or_default();
                        let is_refused =
                            run.ended.is_some() && words.iter().all(|word| said.contains(word));
                        let on = On {
                            device: attempt.device,
                            run,
                            verdict: if is_refused {
                                Verdict::Passes
                            } else {
                                Verdict::Misses
                            },
                            place: 0,
                        };
                        rows.push(RequirementRow {
                            case,
                            method: attempt.method,
                            to: To::Refusal(words),
                            on: vec![on],
                        });
                    }
                }
                Held::Runs(trials) => {
                    let mut of_case: Vec<RequirementRow<'_>> = Vec::new();
                    for (trial, run) in trials.iter().zip(runs) {
                        let method = trial.scene.solver.method();
                        let verdicts = trial.marks.iter().zip(run.verdicts(trial));
                        for (place, (mark, verdict)) in verdicts.enumerate() {
                            let on = On {
                                device: trial.device,
                                run,
                                verdict,
                                place,
                            };
                            let to = To::Mark(mark);
                            let same = |row: &&mut RequirementRow<'_>| {
                                row.method == method && row.to == to
                            };
                            match of_case.iter_mut().find(same) {
                                Some(row) => row.on.push(on),
                                None => of_case.push(RequirementRow {
                                    case,
                                    method,
                                    to,
                                    on: vec![on],
                                }),
                            }
                        }
                    }
                    of_case.sort_by_key(|row| row.method != Method::Pbf);
                    rows.extend(of_case);
                }
            }
        }
        rows
    }

    fn findings(&self, rows: &[RequirementRow<'_>]) -> Vec<(String, String)> {
        let holds = |row: &&RequirementRow<'_>| {
            matches!(row.verdict(), Verdict::Passes | Verdict::PassesUnexpectedly)
        };
        let held = rows.iter().filter(holds).count();
        let mut findings = vec![("marks".to_owned(), format!("{held} of {} hold", rows.len()))];
        for (what, verdict) in [
            ("missed", Verdict::Misses),
            ("known failures", Verdict::KnownFailure),
            ("no failures any more", Verdict::PassesUnexpectedly),
        ] {
            let names = names(rows, verdict);
            if !names.is_empty() {
                findings.push((what.to_owned(), names.join("; ")));
            }
        }
        findings.extend(self.limits.iter().map(|(limit, search, found)| {
            let what = format!("{}, {}", limit.name, search.method.name());
            (what, found.words(&limit.unit))
        }));
        findings
    }

    /// Rows of `results.csv`: one per mark and device, then one per limit.
    fn table(&self, rows: &[RequirementRow<'_>]) -> Vec<Vec<String>> {
        let titles =
            "number,case,solver,device,quantity,value,mark,verdict,particles,frames,seconds,ended";
        let mut table = vec![strings(titles.split(','))];
        for row in rows {
            for on in &row.on {
                let run = on.run;
                let [particles, frames, seconds] = match row.to {
                    To::Refusal(_) => [const { String::new() }; 3],
                    To::Mark(_) => [
                        run.particles.to_string(),
                        run.frames.to_string(),
                        format!("{:.3}", run.seconds.iter().sum::<f64>()),
                    ],
                };
                table.push(vec![
                    row.case.number.to_string(),
                    row.case.name.clone(),
                    row.method.name().to_owned(),
                    on.device.name().to_owned(),
                    row.of().to_owned(),
                    exact(on.value()),
                    match row.to {
                        To::Mark(mark) => bound(mark.bound),
                        To::Refusal(words) => words.join(" … "),
                    },
                    on.verdict.words().to_owned(),
                    particles,
                    frames,
                    seconds,
                    run.ended.clone().unwrap_or_default(),
                ]);
            }
        }
        for (limit, search, found) in &self.limits {
            let (method, device) = (search.method.name(), RunsOn::Gpu.name());
            let mut row = strings(["limit", &limit.name, method, device, &limit.unit]);
            row.push(exact(found.passes));
            row.resize(table[0].len() - 1, String::new());
            row.push(found.words(&limit.unit));
            table.push(row);
        }
        table
    }

    fn parts(
        &self,
        request: &StudyRequest,
        rows: &[RequirementRow<'_>],
        findings: &[(String, String)],
    ) -> Vec<Part> {
        let text = |text: &String| Part::Text(text.clone());
        let mut parts: Vec<Part> = self.stability.about.iter().map(text).collect();
        let mut told = vec![strings(["", "found"])];
        told.extend(
            findings
                .iter()
                .map(|(what, words)| strings([what.as_str(), words])),
        );
        parts.push(Part::Words(told));
        parts.push(Part::Heading("Cases".into()));
        parts.push(verdicts(rows));
        parts.extend(self.tests());
        if !self.limits.is_empty() {
            parts.push(Part::Heading("Limits".into()));
            parts.push(Part::Words(self.limit_table()));
            let notes = self.stability.limits.iter();
            let note = |limit: &Limit| Some(format!("{}: {}", limit.name, limit.note.as_ref()?));
            parts.extend(notes.filter_map(note).map(Part::Text));
            parts.push(Part::Text(LIMITS.into()));
        }
        parts.push(Part::Heading("Curves".into()));
        for case in &self.stability.cases {
            parts.extend(curves(case, rows));
        }
        let mut run = what_was_run(request);
        run.push(Part::Text(self.where_run()));
        parts.push(Part::Folded("What was run".into(), run));
        let measured = [EVERYWHERE, MEASURED].map(|text| Part::Text(text.into()));
        parts.push(Part::Folded("How it was measured".into(), measured.into()));
        parts
    }

    /// Table of the cases that tests cover, with the command that runs each.
    fn tests(&self) -> Vec<Part> {
        let mut table = vec![strings(["", "case", "held by"])];
        for case in &self.stability.cases {
            if let Held::Test(command) = &case.held {
                table.push(strings([
                    case.number.to_string().as_str(),
                    &case.name,
                    command,
                ]));
            }
        }
        match table.len() {
            1 => Vec::new(),
            _ => vec![Part::Subheading("Held by tests".into()), Part::Words(table)],
        }
    }

    fn limit_table(&self) -> Vec<Vec<String>> {
        let titles = ["limit", "solver", "passes up to", "fails at", "by", "runs"];
        let mut table = vec![strings(titles)];
        for (limit, search, found) in &self.limits {
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
        table
    }

    fn where_run(&self) -> String {
        let gpu = self.devices.gpu.as_ref();
        let gpu = gpu.map_or(String::new(), |gpu| format!("GPU: {}. ", gpu.identity()));
        format!(
            "{gpu}CPU: {}. By {} {}. Limits are those of the GPU's solvers. Particles, frames and \
             seconds of each run are in results.csv.",
            self.devices.cpu.identity(),
            swell_domain::PROGRAM,
            swell_domain::VERSION
        )
    }
}

fn strings<'a>(cells: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    cells.into_iter().map(str::to_owned).collect()
}

fn names(rows: &[RequirementRow<'_>], verdict: Verdict) -> Vec<String> {
    let rows = rows.iter().filter(|row| row.verdict() == verdict);
    rows.map(RequirementRow::name).collect()
}

/// Formats a value for `results.csv`.
fn exact(value: Option<f64>) -> String {
    value.map_or(String::new(), |value| format!("{value:.6e}"))
}

/// Table of all marks and refusals, case by case.
fn verdicts(rows: &[RequirementRow<'_>]) -> Part {
    let mut out: Vec<(Tone, Vec<String>)> = Vec::new();
    let mut before = None;
    for row in rows {
        let verdict = row.verdict();
        let (what, wanted, why) = match row.to {
            // Marks that apply to every run are mentioned once below the table, unless missed.
            To::Mark(mark) if Quantity::ALWAYS.contains(&mark.of) && verdict == Verdict::Passes => {
                continue;
            }
            To::Mark(mark) => {
                let what = format!("{}{}", mark.of.about().title, when(mark));
                (what, bound(mark.bound), mark.known_failure.clone())
            }
            To::Refusal(_) => {
                let said = row.on[0].run.ended.clone();
                ("refused".to_owned(), "refused".to_owned(), said)
            }
        };
        // Only the first row of a case shows its name.
        let is_new = before
            .replace(row.case)
            .is_none_or(|before| !std::ptr::eq(before, row.case));
        let name = |text: String| if is_new { text } else { String::new() };
        let why = why.map_or(String::new(), |why| format!(": {why}"));
        let cells = vec![
            name(row.case.number.to_string()),
            name(row.case.name.clone()),
            row.method.name().to_owned(),
            what,
            row.value(RunsOn::Gpu),
            row.value(RunsOn::Cpu),
            wanted,
            format!("{}{why}", verdict.words()),
        ];
        out.push((tone(verdict), cells));
    }
    let titles = ",case,solver,measured,GPU,CPU f64,mark,verdict";
    Part::Verdicts {
        titles: strings(titles.split(',')),
        rows: out,
    }
}

/// One chart per mark whose value changes over time, with one curve per solver and device.
fn curves(case: &Case, rows: &[RequirementRow<'_>]) -> Vec<Part> {
    let own = rows.iter().filter(|row| std::ptr::eq(row.case, case));
    let own: Vec<(&RequirementRow<'_>, &Mark)> = own
        .filter_map(|row| match row.to {
            To::Mark(mark) => Some((row, mark)),
            To::Refusal(_) => None,
        })
        .collect();
    // One chart per quantity, and another one where a mark refers to a later state.
    let of = |mark: &Mark| (mark.of, mark.since.map(f64::to_bits));
    let mut quantities: Vec<_> = own.iter().map(|(_, mark)| of(mark)).collect();
    quantities.sort_unstable();
    quantities.dedup();
    let charts = quantities.into_iter().filter_map(|which| {
        let same = own.iter().filter(|(_, mark)| of(mark) == which);
        chart(&same.copied().collect::<Vec<_>>())
    });
    let charts: Vec<String> = charts.collect();
    if charts.is_empty() && case.note.is_none() {
        return Vec::new();
    }
    let mut parts = vec![Part::Subheading(format!("{} {}", case.number, case.name))];
    parts.extend(case.note.clone().map(Part::Text));
    parts.push(Part::Curves(charts));
    parts
}

fn tone(verdict: Verdict) -> Tone {
    match verdict {
        Verdict::Passes => Tone::Good,
        Verdict::Misses => Tone::Bad,
        Verdict::KnownFailure | Verdict::PassesUnexpectedly => Tone::Known,
    }
}

/// The frames that a mark covers, where these are not all.
fn when(mark: &Mark) -> String {
    match mark.since {
        Some(since) => format!(", against that at {} s", number(since)),
        None if mark.after > 0.0 => format!(", after {} s", number(mark.after)),
        None => String::new(),
    }
}

/// Returns `None` where the values are constant.
fn chart(rows: &[(&RequirementRow<'_>, &Mark)]) -> Option<String> {
    let (_, mark) = rows.first()?;
    let runs = rows
        .iter()
        .flat_map(|(row, _)| row.on.iter().map(move |on| (row, on)));
    let curve = |(row, on): (&&RequirementRow<'_>, &On<'_>)| {
        let name = format!("{} {}", row.method.name(), on.device.name());
        let measured = on.run.measured.get(on.place)?;
        Some(Series::curve(&name, measured.curve.iter().copied()))
    };
    let series: Vec<Series> = runs.map(curve).collect::<Option<_>>()?;
    let mut values = series
        .iter()
        .flat_map(|s| s.points.iter().filter_map(|p| p.value));
    let first = values.next()?;
    let longest = series.iter().map(|s| s.points.len()).max()?;
    if longest < 3 || values.all(|value| value == first) {
        return None;
    }
    let mut levels: Vec<f64> = rows.iter().map(|(_, mark)| mark.bound.value()).collect();
    levels.dedup();
    let chart = Chart {
        title: format!("{}{}", mark.of.name(), when(mark)),
        x_label: "time, s".into(),
        y_label: mark.of.about().title.to_owned(),
        series,
        marks: levels
            .into_iter()
            .map(|level| chart::Mark::Level(level, "mark".into()))
            .collect(),
        ..Chart::default()
    };
    Some(chart.to_svg())
}

/// Explanations for readers of the page.
const EVERYWHERE: &str = "Every run is also held to no value that is not finite, no particle \
    outside of the domain, and the particles of the start, each once; these have a row only where \
    they are missed. A run that ends early misses all of its marks.";

const MEASURED: &str = "A run is measured after each output frame, from its particles and the \
    solver's report; the number that is compared with the mark is the worst of the frames, of \
    means and ratios over time the last. d is the particle spacing, Δx the cell size; d or Δx is d \
    with PBF and Δx with FLIP. A run beside another goes frame by frame with it, and particles are \
    matched by where they start. Energy is that of motion and of height over the domain's floor. \
    The definitions are at swell::files::study::stability::Quantity.";

const LIMITS: &str = "Found by bisection by ratio between a value that passes and one that fails, \
    on the GPU; a limit is that of one scene, and no promise for others.";
