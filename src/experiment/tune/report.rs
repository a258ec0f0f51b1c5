//! Table, curves and page of a tuned shot.

use std::path::PathBuf;

use swell_files::study::{
    RunsOn,
    tune::{Bound, Limit, Quantity, Setting},
};
use swell_study::{
    chart::{Chart, Dot, Mark, Series},
    page::{Part, Tone},
};

use super::{
    super::{
        engine::Bench,
        report::{Report, what_was_run},
        sweep::digits::{shortened, significant},
    },
    Role, Trial, TuneResults,
};

/// Draws the report; `written` is the path of the scene with the chosen settings.
pub(super) fn draw(
    results: &TuneResults<'_>,
    bench: &Bench<'_>,
    written: Option<PathBuf>,
) -> Report {
    let answer = results.answer();
    let mut findings = vec![answer.clone()];
    findings.extend(results.at_the_end());
    findings.extend(results.against_own());
    findings.extend(results.not_promised());
    if let Some(file) = &written {
        findings.push(format!("scene with these settings: {}", file.display()));
    }
    let missed = match results.choice {
        Some((_, true)) => Vec::new(),
        _ => vec![results.limits_in_words()],
    };
    let table = results.table();
    let limits = results.tune.request.limits.iter().enumerate();
    let device = bench.devices.of(RunsOn::Gpu).identity();
    Report {
        answer,
        curves: limits
            .map(|(k, limit)| {
                let chart = results.chart(k, limit, &device.name);
                (limit.quantity.name().to_owned(), chart.to_svg())
            })
            .collect(),
        parts: results.parts(bench, &table, &device.to_string()),
        table,
        findings,
        missed,
    }
}

impl TuneResults<'_> {
    fn chosen(&self) -> Option<&Trial<'_>> {
        Some(&self.trials[self.choice?.0])
    }

    /// Chart of one error against time: the spacings, each setting at the coarsest spacing, and the
    /// proposals.
    fn chart(&self, k: usize, limit: &Limit, device: &str) -> Chart {
        let chosen = self.choice.map(|(place, _)| place);
        let dot = |(place, trial): (usize, &Trial<'_>)| {
            let error = self.errors(&trial.run)[k]?;
            let times = trial.run.per_frame().map(|seconds| 1e3 * seconds);
            Some(Dot {
                at: times[1],
                value: Some(self.in_unit(limit, error)),
                label: label(trial),
                bar: Some([times[0], times[2]]),
                is_knee: chosen == Some(place),
            })
        };
        let of = |name: &str, is_in: &dyn Fn(Role) -> bool| {
            let trials = self.trials.iter().enumerate();
            let trials = trials.filter(|(_, t)| is_in(t.role) && t.run.ended.is_none());
            Series {
                name: name.to_owned(),
                points: trials.filter_map(dot).collect(),
            }
        };
        let tune = self.tune;
        let first = self.tune.ladder[0].set[0].key;
        let mut series = vec![of(first, &|role| role == Role::Spacing)];
        for (at, knob) in tune.knobs.iter().enumerate() {
            series.push(of(
                knob.key,
                &|role| matches!(role, Role::Knob(k, _) if k == at),
            ));
        }
        series.push(of("finer settings", &|role| role == Role::Fine));
        series.push(of("proposed", &|role| role == Role::Proposal));
        series.retain(|series| !series.points.is_empty());
        let unit = match limit.bound {
            Bound::Part(_) => "%",
            Bound::Absolute(_) => limit.quantity.unit().unwrap_or(""),
        };
        let against = match limit.quantity {
            Quantity::Density => "against rest",
            _ => "against the finer run",
        };
        let allowed = self.in_unit(limit, self.limits.errors[k]);
        let knobs = format!("settings but the spacing at {} m", tune.ladder[0].spacing());
        Chart {
            title: format!("{}: {}", tune.scene.shot.name, limit.quantity.title()),
            subtitle: format!("on {device}; {knobs}"),
            x_label: "time a frame, ms".into(),
            y_label: format!("{} {against}, {unit}", limit.quantity.title()),
            is_log: true,
            series,
            marks: vec![Mark::Level(allowed, format!("limit {limit}"))],
            notes: self.failures(),
            ring: match self.choice {
                Some((_, true)) => "chosen",
                _ => "nearest",
            },
            ..Chart::default()
        }
    }

    fn failures(&self) -> Vec<String> {
        let failed = self.trials.iter().filter_map(|trial| {
            let message = trial.run.ended.as_ref()?;
            Some(format!("failed: {}: {message}", trial.variant.name()))
        });
        failed.collect()
    }

    /// Rows for every run with its cost, its errors, and the predictions of the models.
    fn table(&self) -> Vec<Vec<String>> {
        let fixed = "run,for,particles,frames,ms,shot_seconds,substeps,iterations,missed";
        let mut titles: Vec<String> = fixed.split(',').map(str::to_owned).collect();
        let limits = &self.tune.request.limits;
        for limit in limits {
            let name = limit.quantity.name();
            titles.extend([format!("{name}_error"), format!("{name}_by_the_laws")]);
        }
        titles.extend(["holds".to_owned(), "failed".to_owned()]);
        let mut table = vec![titles];
        table.extend(self.trials.iter().map(|trial| self.row(trial)));
        table
    }

    fn row(&self, trial: &Trial<'_>) -> Vec<String> {
        let (run, limits) = (&trial.run, &self.tune.request.limits);
        let mut row = vec![trial.variant.name(), trial.why.to_owned()];
        if let Some(message) = &run.ended {
            row.resize(9 + 2 * limits.len() + 1, String::new());
            row.push(message.clone());
            return row;
        }
        let seconds = run.per_frame()[1];
        row.extend([
            run.particles.to_string(),
            run.frames.to_string(),
            format!("{:.3}", 1e3 * seconds),
            format!("{:.3}", seconds * f64::from(self.tune.scene.shot.frames)),
            run.measured.substeps.to_string(),
            run.measured.iterations.to_string(),
            run.measured.missed.to_string(),
        ]);
        let predicted = self.predicted(trial);
        for (k, error) in self.errors(run).into_iter().enumerate() {
            let told = |value: Option<f64>| value.map_or(String::new(), |v| format!("{v:.6}"));
            let number = |value: f64| self.in_unit(&limits[k], value);
            let laws = predicted.as_ref().map(|p| p.errors[k]);
            row.extend([told(error.map(number)), told(laws.map(number))]);
        }
        let holds = trial.role.is_candidate() && self.candidate(trial).excess(&self.limits) <= 1.0;
        row.push(if holds { "yes".into() } else { String::new() });
        row.push(String::new());
        row
    }

    fn parts(&self, bench: &Bench<'_>, table: &[Vec<String>], device: &str) -> Vec<Part> {
        let beside = self.at_the_end().into_iter().chain(self.against_own());
        let mut parts: Vec<Part> = beside.map(Part::Text).collect();
        parts.push(Part::Heading("Settings".into()));
        parts.push(self.settings_table());
        parts.push(Part::Heading("What cannot be promised".into()));
        parts.extend(self.not_promised().into_iter().map(Part::Text));
        parts.push(Part::Heading("Laws".into()));
        parts.push(Part::Words(self.laws()));
        parts.push(Part::Text(LAWS.into()));
        parts.push(Part::Heading("What was not tried".into()));
        parts.extend(self.tune.untried.iter().cloned().map(Part::Text));
        parts.push(Part::Heading("Runs".into()));
        parts.push(Part::Table(shortened(table)));
        parts.push(Part::Text(self.units()));
        let mut run = what_was_run(bench.request);
        run.push(Part::Text(format!(
            "On {device}, by {} {}. Times are wall clock, in the program, without files: the \
             median of {} of each variant, of three at least at the coarsest spacing, after one \
             frame that does not count.",
            swell_domain::PROGRAM,
            swell_domain::VERSION,
            self.tune.request.repeats
        )));
        parts.push(Part::Folded("What was run".into(), run));
        parts
    }

    fn settings_table(&self) -> Part {
        let titles = ["setting", "value", "the scene's own", "why"].map(str::to_owned);
        let rows = self.chosen().map_or(Vec::new(), |trial| {
            let row = |(setting, own): (Setting, String)| {
                let reason = self.reason(trial, setting.key, &setting.value, &own);
                let is_changed = setting.value != own;
                let tone = if is_changed { Tone::Good } else { Tone::Plain };
                let cells = vec![setting.key.to_owned(), setting.value, own, reason];
                (tone, cells)
            };
            self.settings(trial).into_iter().map(row).collect()
        });
        Part::Verdicts {
            titles: titles.to_vec(),
            rows,
        }
    }

    /// Units of the errors in the table.
    fn units(&self) -> String {
        let limits = self.tune.request.limits.iter().zip(&self.limits.errors);
        let of = |(limit, allowed): (&Limit, &f64)| match limit.bound {
            Bound::Part(_) => {
                let unit = limit.quantity.unit().unwrap_or("of a mass");
                let is_density = limit.quantity == Quantity::Density;
                let whole = match is_density {
                    true => "rest density".to_owned(),
                    false => format!(
                        "the reference's greatest, {} {unit}",
                        significant(allowed / self.part(limit))
                    ),
                };
                format!("{}: per cent of {whole}", limit.quantity.name())
            }
            Bound::Absolute(_) => {
                let unit = limit.quantity.unit().unwrap_or_default();
                format!("{}: {unit}", limit.quantity.name())
            }
        };
        format!(
            "Errors are means over {} frames. {}.",
            self.reference().samples.len(),
            limits.map(of).collect::<Vec<_>>().join("; ")
        )
    }

    fn part(&self, limit: &Limit) -> f64 {
        match limit.bound {
            Bound::Part(part) => part,
            Bound::Absolute(_) => 1.0,
        }
    }
}

/// Label that distinguishes a run from the others of its curve.
fn label(trial: &Trial<'_>) -> String {
    let set = &trial.variant.set;
    match trial.role {
        Role::Knob(..) => set[1].value.trim_matches('"').to_owned(),
        Role::Proposal => {
            let values = set.iter().map(|s| s.value.trim_matches('"'));
            values.collect::<Vec<_>>().join(", ")
        }
        _ => set[0].value.clone(),
    }
}

const LAWS: &str = "A run at spacing d is taken to be C (dᵖ − rᵖ) off from the reference at r, and \
    to take C dᵖ seconds a frame; the scatter is how far the runs are from that, as a factor. What \
    another setting adds to the error and what it does to the time are taken from a run with it at \
    the coarsest spacing, against one with finer settings there. That errors add up and times \
    multiply is an assumption: each proposal is run, and corrects the laws before the next.";
