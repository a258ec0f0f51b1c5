//! How a benchmark's gates come out.

use crate::{
    scene::study::validation::{Benchmark, Bound, Gate, Trial},
    study::waves,
};

use super::{super::stability::Verdict, Run};

/// A gate with what it judges, and how that came out.
#[derive(Clone, Debug)]
pub struct Judged<'a> {
    /// What it has to be.
    pub gate: &'a Gate,
    /// The run; `None` where it judges all of its solver's.
    pub run: Option<&'a Trial>,
    /// What was measured: the number, the order, or by how much runs differ. `None` where it is no number.
    pub measured: Option<f64>,
    /// measured / published − 1.
    pub error: Option<f64>,
    /// How it came out.
    pub verdict: Verdict,
}

/// Each gate with each run that it judges, in the order of the file. A run that ended early passes none.
pub fn judge<'a>(benchmark: &'a Benchmark, runs: &[Run]) -> Vec<Judged<'a>> {
    let mut judged = Vec::new();
    for gate in &benchmark.gates {
        let all = benchmark.runs.iter().zip(runs);
        let all: Vec<_> = all.filter(|(trial, _)| gate.judges(trial)).collect();
        let number = |run: &Run| match run.ended {
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
            let of_run =
                |(trial, run): (&'a Trial, &Run)| Judged::new(gate, Some(trial), number(run));
            judged.extend(all.into_iter().map(of_run));
        }
    }
    judged
}

/// Order of the error, or spread of the numbers, of (resolution, number).
fn over_all(gate: &Gate, numbers: &[(f64, f64)]) -> Option<f64> {
    match gate.bound {
        Bound::OrderAtLeast(_) => {
            let published = gate.published?;
            let error = |(r, n): &(f64, f64)| (*r, n / published - 1.0);
            waves::order(&numbers.iter().map(error).collect::<Vec<_>>())
        }
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
        Self {
            gate,
            run,
            measured,
            error,
            verdict: Verdict::of(holds, gate.known_failure.is_some()),
        }
    }
}
