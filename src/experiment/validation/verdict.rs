//! Judges the gates of a benchmark.

use swell_files::study::validation::{Benchmark, Bound, Gate, Trial};
use swell_study::waves;

use super::{super::stability::Verdict, BenchmarkRun};

/// A gate with its verdict on one or several runs.
#[derive(Clone, Debug)]
pub struct Judged<'a> {
    /// The gate.
    pub gate: &'a Gate,
    /// Run that the gate judges; `None` where it judges all runs of its solver.
    pub run: Option<&'a Trial>,
    /// Measured number, order of convergence or spread; `None` where it could not be determined.
    pub measured: Option<f64>,
    /// Relative error: measured / published − 1.
    pub error: Option<f64>,
    /// Verdict on the gate.
    pub verdict: Verdict,
}

/// Judges each gate with each of its runs, in the order of the file. A run that ended early passes
/// no gate.
pub fn judge<'a>(benchmark: &'a Benchmark, runs: &[BenchmarkRun]) -> Vec<Judged<'a>> {
    let mut judged = Vec::new();
    for gate in &benchmark.gates {
        let all = benchmark.runs.iter().zip(runs);
        let all: Vec<_> = all.filter(|(trial, _)| gate.judges(trial)).collect();
        let number = |run: &BenchmarkRun| match run.ended {
            Some(_) => None,
            None => run.measured.numbers.get(&gate.of).copied(),
        };
        if gate.bound.is_of_all() {
            let numbers = all
                .iter()
                .map(|(trial, run)| Some((trial.resolution, number(run)?)));
            let numbers: Option<Vec<_>> = numbers.collect();
            let measured = numbers.and_then(|numbers| over_all(gate, &numbers));
            judged.push(Judged::new(gate, None, measured));
        } else {
            let of_run = |(trial, run): (&'a Trial, &BenchmarkRun)| {
                Judged::new(gate, Some(trial), number(run))
            };
            judged.extend(all.into_iter().map(of_run));
        }
    }
    judged
}

/// Order of convergence or spread over pairs of resolution and number.
fn over_all(gate: &Gate, numbers: &[(f64, f64)]) -> Option<f64> {
    match gate.bound {
        Bound::OrderAtLeast(_) => match gate.published {
            Some(published) => {
                let error = |(r, n): &(f64, f64)| (*r, n / published - 1.0);
                waves::order(&numbers.iter().map(error).collect::<Vec<_>>())
            }
            None => waves::order_of_changes(numbers),
        },
        _ => {
            let values = || numbers.iter().map(|(_, n)| *n);
            let mean = values().sum::<f64>() / numbers.len() as f64;
            let most = values().fold(f64::NEG_INFINITY, f64::max);
            let least = values().fold(f64::INFINITY, f64::min);
            Some((most - least) / mean)
        }
    }
}

impl<'a> Judged<'a> {
    fn new(gate: &'a Gate, run: Option<&'a Trial>, measured: Option<f64>) -> Self {
        let error = match gate.bound.is_of_all() {
            true => None,
            false => measured.zip(gate.published).map(|(m, p)| m / p - 1.0),
        };
        let holds = measured.is_some_and(|measured| match gate.bound {
            Bound::Within(part) => error.is_some_and(|error| error.abs() <= part),
            Bound::OffBy(most) => gate.published.is_some_and(|p| (measured - p).abs() <= most),
            Bound::AtMost(most) | Bound::AgreeWithin(most) => measured <= most,
            Bound::AtLeast(least) | Bound::OrderAtLeast(least) => measured >= least,
        });
        // Without a number the failure may have any cause, so it does not count as a known one.
        let is_known = gate.known_failure.is_some() && measured.is_some();
        Self {
            gate,
            run,
            measured,
            error,
            verdict: Verdict::of(holds, is_known),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::validation::BenchmarkMeasurements;
    use swell_files::study::Study;

    fn benchmark(name: &str) -> Benchmark {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/studies");
        let Ok(Study::Validation(study)) = Study::load(&folder.join("validation.toml")) else {
            panic!("the study that ships");
        };
        let mut all = study.benchmarks.into_iter();
        let found = all.find(|benchmark| benchmark.name == name);
        let mut found = found.expect("a benchmark");
        found
            .gates
            .iter_mut()
            .for_each(|gate| gate.known_failure = None);
        found
    }

    fn runs(numbers: &[f64], of: &str) -> Vec<BenchmarkRun> {
        let run = |number: &f64| BenchmarkRun {
            measured: BenchmarkMeasurements {
                numbers: [(of.to_owned(), *number)].into(),
                ..BenchmarkMeasurements::default()
            },
            ..BenchmarkRun::default()
        };
        numbers.iter().map(run).collect()
    }

    #[test]
    fn an_error_of_second_order_passes_and_one_of_first_order_misses() {
        let mut benchmark = benchmark("solitary wave, order");
        benchmark.gates[0].published = None;
        let c = 3.431;
        let of = |errors: [f64; 3]| {
            let runs = runs(&errors.map(|error| c * (1.0 - error)), "celerity");
            let judged = judge(&benchmark, &runs);
            assert_eq!((judged.len(), judged[0].error), (1, None));
            (judged[0].verdict, judged[0].measured.expect("an order"))
        };
        let (verdict, order) = of([0.04, 0.01, 0.0025]);
        assert_eq!(verdict, Verdict::Passes);
        assert!((order - 2.0).abs() < 1e-9, "{order}");
        // The order does not depend on the limit that the values converge to.
        let (verdict, order) = of([0.06, 0.03, 0.0225]);
        assert_eq!(verdict, Verdict::Passes);
        assert!((order - 2.0).abs() < 1e-9, "{order}");
        let (verdict, order) = of([0.04, 0.02, 0.01]);
        assert_eq!(verdict, Verdict::Misses);
        assert!((order - 1.0).abs() < 1e-9, "{order}");
        // With a published number, the order is that of the errors relative to it.
        let mut benchmark = benchmark.clone();
        benchmark.gates[0].published = Some(c);
        let runs = runs(
            &[0.06, 0.03, 0.0225].map(|error| c * (1.0 - error)),
            "celerity",
        );
        let judged = judge(&benchmark, &runs);
        assert_eq!(judged[0].verdict, Verdict::Misses);
    }

    #[test]
    fn a_gate_judges_its_solver_alone_and_a_run_that_ended_early_passes_none() {
        let mut benchmark = benchmark("solitary wave over 20 depths");
        benchmark.gates.retain(|gate| gate.of == "celerity");
        // FLIP's gate is 2 %, PBF's is 3 %, and both runs are 2.5 % slow.
        let mut runs = runs(&[3.431 * 0.975; 2], "celerity");
        let verdicts = |benchmark: &Benchmark, runs: &[BenchmarkRun]| -> Vec<Verdict> {
            judge(benchmark, runs)
                .iter()
                .map(|judged| judged.verdict)
                .collect()
        };
        assert_eq!(
            verdicts(&benchmark, &runs),
            [Verdict::Misses, Verdict::Passes]
        );
        runs[1].ended = Some("too fast".to_owned());
        benchmark.gates[0].known_failure = Some("because".to_owned());
        assert_eq!(
            verdicts(&benchmark, &runs),
            [Verdict::KnownFailure, Verdict::Misses]
        );
        runs[0]
            .measured
            .numbers
            .insert("celerity".to_owned(), 3.431);
        assert_eq!(verdicts(&benchmark, &runs)[0], Verdict::PassesUnexpectedly);
        // A missing number fails the gate even if a failure is known.
        runs[0].measured.numbers.clear();
        assert_eq!(verdicts(&benchmark, &runs)[0], Verdict::Misses);
        benchmark.gates[0].known_failure = None;
        assert_eq!(verdicts(&benchmark, &runs)[0], Verdict::Misses);
    }

    #[test]
    fn resolutions_agree_or_they_do_not() {
        let mut benchmark = benchmark("dam break of a column");
        benchmark.gates.retain(|gate| gate.of == "front_time");
        for (numbers, verdict) in [
            ([2.50, 2.52, 2.54, 9.0], Verdict::Passes),
            ([2.50, 2.52, 2.56, 2.5], Verdict::Misses),
        ] {
            let runs = runs(&numbers, "front_time");
            assert_eq!(judge(&benchmark, &runs)[0].verdict, verdict, "{numbers:?}");
        }
    }
}
