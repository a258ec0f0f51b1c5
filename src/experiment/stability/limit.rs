//! Finds by bisection how far a setting can go before a mark is missed.

use swell_files::study::stability::{Limit, Search, Trial};

use super::{
    super::{PointStatus, StudyError, engine::Bench, ledger::Ledger},
    MarkMeasurement, StabilityRun, Verdict, point, report,
};

/// Result of a search for a limit.
#[derive(Default)]
pub(super) struct Found {
    /// Farthest value that passes; `None` if the first one fails.
    pub(super) passes: Option<f64>,
    /// Nearest value that fails, with the reason; `None` if the last one passes.
    pub(super) fails: Option<(f64, String)>,
    /// Number of runs.
    pub(super) tries: usize,
}

/// Searches for a limit: tries both ends, then bisects geometrically between a passing and a
/// failing value until their ratio is small enough. Returns `None` where runs are only looked up
/// and one is missing.
pub(super) fn find(
    bench: &mut Bench<'_>,
    ledger: &mut Ledger<Vec<MarkMeasurement>>,
    limit: &Limit,
    search: &Search,
) -> Result<Option<Found>, StudyError> {
    let title = format!("{}, {}", limit.name, search.method.name());
    let most = most_tries(limit);
    let mut found = Found::default();
    let mut next = Some(limit.passes);
    while let Some(value) = next {
        let mut name = format!("{title} = {value}");
        let (fault, status) = match search.trial(value) {
            // The value is outside the range that a scene accepts.
            Err(error) => (Some(error.to_string()), PointStatus::Done(0.0, Vec::new())),
            Ok(trial) => {
                let Some((run, stood)) = point(bench, ledger, &name, &trial)? else {
                    // This run and those that may follow it.
                    let rest = most.saturating_sub(found.tries + 1);
                    bench.left.set(bench.left.get() + rest);
                    bench.is_left_at_most.set(true);
                    return Ok(None);
                };
                let status = match stood {
                    true => PointStatus::Stands,
                    false => PointStatus::Done(1e3 * run.per_frame()[1], Vec::new()),
                };
                (missed(&run, &trial), status)
            }
        };
        found.tries += 1;
        match fault {
            None => found.passes = Some(value),
            Some(words) => found.fails = Some((value, words)),
        }
        next = following(limit, &found);
        if next.is_none() {
            name = format!("{name}: {}", found.words(&limit.unit));
            bench.count = (bench.count + found.tries).saturating_sub(most);
        }
        bench.report_point(name, status);
    }
    Ok(Some(found))
}

/// Number of runs of a search where both ends come out as expected: each run halves the logarithm
/// of the remaining ratio, whatever its outcome.
pub(super) fn most_tries(limit: &Limit) -> usize {
    let mut found = Found::default();
    let mut next = Some(limit.passes);
    while let Some(value) = next {
        found.tries += 1;
        match found.tries {
            2 => found.fails = Some((value, String::new())),
            _ => found.passes = Some(value),
        }
        next = following(limit, &found);
    }
    found.tries
}

/// Describes the first mark that a run misses.
fn missed(run: &StabilityRun, trial: &Trial) -> Option<String> {
    if let Some(message) = &run.ended {
        return Some(message.clone());
    }
    let verdicts = run.verdicts(trial);
    let place = verdicts.iter().position(|v| *v == Verdict::Misses)?;
    let mark = &trial.marks[place];
    Some(format!(
        "{} is {}, the mark {}",
        mark.of.about().title,
        run.measured[place].words(),
        report::bound(mark.bound)
    ))
}

/// Next value to try; `None` once the limit is found.
fn following(limit: &Limit, found: &Found) -> Option<f64> {
    match (found.passes, &found.fails) {
        (Some(_), None) if found.tries == 1 => Some(limit.fails),
        (Some(passes), Some((fails, _))) => {
            let ratio = (fails / passes).max(passes / fails);
            (ratio > limit.ratio).then(|| (passes * fails).sqrt())
        }
        _ => None,
    }
}

impl Found {
    /// Describes the limit.
    pub(super) fn words(&self, unit: &str) -> String {
        let told = |value: f64| format!("{} {unit}", report::number(value));
        match (self.passes, &self.fails) {
            (Some(passes), Some((fails, _))) => {
                format!("passes at {}, fails at {}", told(passes), told(*fails))
            }
            (Some(passes), None) => format!("passes at {}, as far as was tried", told(passes)),
            (None, _) => "fails at the first value".to_owned(),
        }
    }
}
