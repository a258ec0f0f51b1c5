//! Table and page of a validation study.

use swell_files::study::{
    RunsOn,
    validation::{Benchmark, Bound, Gate, Trial, Validation},
};
use swell_study::{
    chart::{Chart, Series},
    page::{Part, Tone},
    waves,
};

use super::{
    super::{
        engine::Bench,
        report::{Report, what_was_run},
        stability::{Verdict, number},
    },
    BenchmarkRun, Judged,
};

/// A benchmark with its runs and the verdicts on its gates.
type Result<'a> = (&'a Benchmark, Vec<BenchmarkRun>, Vec<Judged<'a>>);

pub(super) fn draw(validation: &Validation, bench: &Bench<'_>, results: &[Result<'_>]) -> Report {
    let all = || {
        results
            .iter()
            .flat_map(|(benchmark, _, judged)| judged.iter().map(move |j| (*benchmark, j)))
    };
    let names = |verdict: Verdict| -> Vec<String> {
        let own = all().filter(|(_, judged)| judged.verdict == verdict);
        own.map(|(benchmark, judged)| {
            format!(
                "{}, {}, {}",
                benchmark.name,
                of_run(judged),
                quantity(judged.gate)
            )
        })
        .collect()
    };
    let holds = |verdict| matches!(verdict, Verdict::Passes | Verdict::PassesUnexpectedly);
    let held = all().filter(|(_, judged)| holds(judged.verdict)).count();
    let gates = format!("{held} of {} hold", all().count());
    let mut findings = vec![format!("gates: {gates}")];
    for (what, verdict) in [
        ("missed", Verdict::Misses),
        ("known failures", Verdict::KnownFailure),
        ("no failures any more", Verdict::PassesUnexpectedly),
    ] {
        let names = names(verdict);
        if !names.is_empty() {
            findings.push(format!("{what}: {}", names.join("; ")));
        }
    }
    let [missed, known] = [Verdict::Misses, Verdict::KnownFailure].map(|v| names(v).len());
    Report {
        answer: format!(
            "Of the gates that theory and experiments set {gates}; {known} are known failures \
             and {missed} are missed."
        ),
        parts: parts(validation, bench, results),
        table: table(results),
        missed: names(Verdict::Misses),
        findings,
        ..Report::default()
    }
}

fn strings<'a>(cells: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    cells.into_iter().map(str::to_owned).collect()
}

/// Solver and resolution, or a note that the gate judges all runs.
fn of_run(judged: &Judged<'_>) -> String {
    match (judged.run, judged.gate.method) {
        (Some(run), _) => run.name(),
        (None, Some(method)) => format!("{}, all", method.name()),
        (None, None) => "all".to_owned(),
    }
}

fn percent(part: f64) -> String {
    format!("{} %", number(100.0 * part))
}

fn bound(gate: &Gate) -> String {
    match gate.bound {
        Bound::Within(part) => format!("± {}", percent(part)),
        Bound::OffBy(most) => format!("± {}", number(most)),
        Bound::AtMost(most) => format!("≤ {}", number(most)),
        Bound::AtLeast(least) => format!("≥ {}", number(least)),
        Bound::OrderAtLeast(least) => format!("order ≥ {}", number(least)),
        Bound::AgreeWithin(part) => format!("agree within {}", percent(part)),
    }
}

fn measured(judged: &Judged<'_>, run: Option<&BenchmarkRun>) -> String {
    let ended = run.and_then(|run| run.ended.as_ref());
    match (ended, judged.measured, judged.gate.bound) {
        (Some(message), ..) => format!("ended: {message}"),
        (None, None, _) => "no number".to_owned(),
        (None, Some(value), Bound::AgreeWithin(_)) => percent(value),
        (None, Some(value), _) => number(value),
    }
}

/// Title of a number of the benchmark.
fn title(benchmark: &Benchmark, of: &str) -> &'static str {
    let numbers = benchmark.measure.numbers().iter();
    let mut named = numbers.filter(|(name, _)| *name == of);
    named.next().map_or("", |(_, title)| title)
}

fn run_of<'a>((benchmark, runs, _): &'a Result<'_>, trial: &Trial) -> Option<&'a BenchmarkRun> {
    let place = benchmark
        .runs
        .iter()
        .position(|other| std::ptr::eq(other, trial))?;
    runs.get(place)
}

fn parts(validation: &Validation, bench: &Bench<'_>, results: &[Result<'_>]) -> Vec<Part> {
    let mut parts = vec![verdicts(results)];
    parts.extend(validation.about.iter().cloned().map(Part::Text));
    for result in results {
        parts.extend(of_benchmark(result));
    }
    let mut run = what_was_run(bench.request);
    run.push(Part::Text(where_run(bench)));
    parts.push(Part::Folded("What was run".into(), run));
    parts.push(Part::Folded(
        "How it was measured".into(),
        vec![Part::Text(MEASURED.into())],
    ));
    parts
}

/// Table of all verdicts.
fn verdicts(results: &[Result<'_>]) -> Part {
    let mut rows = Vec::new();
    for result in results {
        let (benchmark, _, judged) = result;
        for (k, judged) in judged.iter().enumerate() {
            let gate = judged.gate;
            let run = judged.run.and_then(|trial| run_of(result, trial));
            let why = gate
                .known_failure
                .as_ref()
                .filter(|_| judged.verdict == Verdict::KnownFailure);
            let word = match judged.verdict {
                Verdict::Passes => "pass".to_owned(),
                Verdict::Misses => "FAIL".to_owned(),
                other => other.words().to_owned(),
            };
            let cells = vec![
                // Only the first row of a benchmark shows its name.
                if k == 0 {
                    benchmark.name.clone()
                } else {
                    String::new()
                },
                of_run(judged),
                match gate.bound {
                    Bound::OrderAtLeast(_) => format!("order of: {}", title(benchmark, &gate.of)),
                    Bound::AgreeWithin(_) => format!("spread of: {}", title(benchmark, &gate.of)),
                    _ => title(benchmark, &gate.of).to_owned(),
                },
                measured(judged, run),
                gate.published
                    .filter(|_| !gate.bound.is_of_all())
                    .map_or(String::new(), number),
                judged
                    .error
                    .map_or(String::new(), |error| format!("{:+.1} %", 100.0 * error)),
                bound(gate),
                gate.source.clone(),
                why.map_or(word.clone(), |why| format!("{word}: {why}")),
            ];
            rows.push((tone(judged.verdict), cells));
        }
    }
    let titles = [
        "benchmark",
        "solver, resolution",
        "measured",
        "is",
        "published",
        "error",
        "gate",
        "source",
        "verdict",
    ];
    Part::Verdicts {
        titles: strings(titles),
        rows,
    }
}

fn tone(verdict: Verdict) -> Tone {
    match verdict {
        Verdict::Passes => Tone::Good,
        Verdict::Misses => Tone::Bad,
        Verdict::KnownFailure | Verdict::PassesUnexpectedly => Tone::Known,
    }
}

/// Curves of a benchmark beside published points, and all numbers of all runs.
fn of_benchmark(result: &Result<'_>) -> Vec<Part> {
    let (benchmark, runs, _) = result;
    let mut parts = vec![Part::Heading(benchmark.name.clone())];
    parts.extend(benchmark.note.clone().map(Part::Text));
    let curves = benchmark.measure.curves().iter();
    let charts = curves.filter_map(|curve| chart(benchmark, runs, curve));
    parts.push(Part::Curves(charts.collect()));
    for points in &benchmark.points {
        parts.push(Part::Text(format!(
            "Points of {}: {}.",
            points.of, points.source
        )));
    }
    let names = benchmark.runs.iter().map(Trial::name);
    let mut table = vec![
        [String::new()]
            .into_iter()
            .chain(names)
            .chain(["order".to_owned()])
            .collect(),
    ];
    for (name, title) in benchmark.measure.numbers() {
        let value = |run: &BenchmarkRun| run.measured.numbers.get(*name).copied();
        let mut row = vec![(*title).to_owned()];
        row.extend(
            runs.iter()
                .map(|run| value(run).map_or("–".to_owned(), number)),
        );
        row.push(orders(benchmark, runs, name));
        table.push(row);
    }
    let mut seconds = vec!["seconds that the run took".to_owned()];
    seconds.extend(runs.iter().map(|run| number(run.seconds.iter().sum())));
    seconds.push(String::new());
    table.push(seconds);
    parts.push(Part::Table(table));
    parts
}

/// Order of convergence of a number by solver, where it is published and there are at least two
/// resolutions.
fn orders(benchmark: &Benchmark, runs: &[BenchmarkRun], name: &str) -> String {
    let published = benchmark
        .gates
        .iter()
        .find(|gate| gate.of == name && gate.published.is_some());
    let Some(published) = published.and_then(|gate| gate.published) else {
        return String::new();
    };
    let mut methods: Vec<_> = benchmark
        .runs
        .iter()
        .map(|run| run.scene.solver.method())
        .collect();
    methods.dedup();
    let of_method = |method| {
        let all = benchmark.runs.iter().zip(runs);
        let own = all.filter(|(trial, _)| trial.scene.solver.method() == method);
        let errors = own.map(|(trial, run)| {
            Some((
                trial.resolution,
                run.measured.numbers.get(name)? / published - 1.0,
            ))
        });
        let order = waves::order(&errors.collect::<Option<Vec<_>>>()?)?;
        Some(format!("{} {order:.1}", method.name()))
    };
    methods
        .into_iter()
        .filter_map(of_method)
        .collect::<Vec<_>>()
        .join(", ")
}

fn chart(
    benchmark: &Benchmark,
    runs: &[BenchmarkRun],
    (name, [title, x, y]): &(&str, [&str; 3]),
) -> Option<String> {
    let series = benchmark.runs.iter().zip(runs).filter_map(|(trial, run)| {
        let curve = run.measured.curves.get(*name)?.iter();
        Some(Series::curve(
            &trial.name(),
            curve.map(|(x, y)| (*x, Some(*y))),
        ))
    });
    let series: Vec<_> = series.collect();
    let points = benchmark.points.iter().filter(|points| points.of == *name);
    let dots = points.map(|points| {
        let at = points.at.iter().map(|[x, y]| (*x, Some(*y)));
        Series::curve(&points.source, at)
    });
    let chart = Chart {
        title: format!("{}: {title}", benchmark.name),
        x_label: (*x).to_owned(),
        y_label: (*y).to_owned(),
        dots: dots.collect(),
        series,
        ..Chart::default()
    };
    (!chart.series.is_empty()).then(|| chart.to_svg())
}

/// Quantity that a gate judges: a number, or an order or spread over several runs.
fn quantity(gate: &Gate) -> String {
    match gate.bound {
        Bound::OrderAtLeast(_) => format!("order of {}", gate.of),
        Bound::AgreeWithin(_) => format!("spread of {}", gate.of),
        _ => gate.of.clone(),
    }
}

/// Rows of `results.csv`: one for each gate of each run, and one for each number that no gate
/// judges.
fn table(results: &[Result<'_>]) -> Vec<Vec<String>> {
    let titles = "benchmark,solver,resolution,device,quantity,measured,published,error,gate,\
                  verdict,source,known_failure,particles,frames,seconds,ended";
    let mut table = vec![strings(titles.split(','))];
    let exact = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.6e}"));
    for result in results {
        let (benchmark, runs, judged) = result;
        let tail = |run: Option<&BenchmarkRun>| {
            run.map_or(vec![String::new(); 4], |run| {
                vec![
                    run.particles.to_string(),
                    run.frames.to_string(),
                    format!("{:.3}", run.seconds.iter().sum::<f64>()),
                    run.ended.clone().unwrap_or_default(),
                ]
            })
        };
        let head = |trial: &Trial| {
            let method = trial.scene.solver.method().name();
            vec![
                benchmark.name.clone(),
                method.to_owned(),
                trial.resolution.to_string(),
                trial.device.name().to_owned(),
            ]
        };
        for judged in judged {
            let gate = judged.gate;
            let mut row = judged.run.map_or_else(
                || {
                    let method = gate.method.map_or("all", |method| method.name());
                    strings([&benchmark.name, method, "all", ""])
                },
                head,
            );
            row.extend([
                quantity(gate),
                exact(judged.measured),
                exact(gate.published.filter(|_| !gate.bound.is_of_all())),
                exact(judged.error),
                bound(gate),
                judged.verdict.words().to_owned(),
                gate.source.clone(),
                gate.known_failure.clone().unwrap_or_default(),
            ]);
            row.extend(tail(judged.run.and_then(|trial| run_of(result, trial))));
            table.push(row);
        }
        for (trial, run) in benchmark.runs.iter().zip(runs) {
            for (name, value) in &run.measured.numbers {
                let is_judged = benchmark
                    .gates
                    .iter()
                    .filter(|gate| !gate.bound.is_of_all())
                    .any(|gate| gate.of == *name && gate.judges(trial));
                if !is_judged {
                    let mut row = head(trial);
                    row.extend([name.clone(), exact(Some(*value))]);
                    row.extend(vec![String::new(); 6]);
                    row.extend(tail(Some(run)));
                    table.push(row);
                }
            }
        }
    }
    table
}

fn where_run(bench: &Bench<'_>) -> String {
    let gpu = bench.devices.gpu.as_ref();
    let gpu = gpu.map_or(String::new(), |gpu| format!("GPU: {}. ", gpu.identity()));
    let cpu = bench.devices.of(RunsOn::Cpu).identity();
    let (name, version) = (swell_domain::PROGRAM, swell_domain::VERSION);
    format!(
        "{gpu}CPU: {cpu}. By {name} {version}. Particles, frames and seconds of each run are in \
         results.csv."
    )
}

const MEASURED: &str = "Published numbers are those at 9.81 m/s² and 1000 kg/m³ and of the lengths \
    that the study names, whatever the scene has: a scene with other gravity or another stroke \
    misses them. Heights are those of elevation probes, pressures those of pressure probes at the \
    end of each frame. A wave's height and phase are those of one harmonic by least squares over \
    whole periods, without a trend. A crest is the parabola through what is above 0.8 of it, a \
    celerity the straight line through arrivals at all gauges. A front is where 99.5 % of the \
    water is behind. Depths over a dry bed are the volumes of particles in bins of a quarter of \
    h0. The resolution is cells with FLIP and particle spacings with PBF of the length that a \
    benchmark names. The order is the slope of log error over log resolution by least squares.";
