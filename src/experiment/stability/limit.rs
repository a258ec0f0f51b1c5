//! How far a setting goes before a mark is missed, by bisection.

use swell_scene::study::stability::{Limit, Search, Trial};

use super::{
    super::{PointStatus, StudyError, engine::Bench, ledger::Ledger},
    Measured, Run, Verdict, point, report,
};

/// Where a limit was found.
#[derive(Default)]
pub(super) struct Found {
    /// Farthest value that passes; `None` where not even the first does.
    pub(super) passes: Option<f64>,
    /// Nearest value that fails, and what it fails by; `None` where not even the last does.
    pub(super) fails: Option<(f64, String)>,
    /// Runs that it took.
    pub(super) tries: usize,
}

/// Both ends first, and then the middle by ratio of a value that passes and one that fails, until they are near. `None` where
/// the runs are only looked for, and one is not there.
pub(super) fn find(
    bench: &mut Bench<'_>,
    ledger: &mut Ledger<Vec<Measured>>,
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
            // Beyond what a scene can say.
            Err(error) => (Some(error.to_string()), PointStatus::Done(0.0, Vec::new())),
            Ok(trial) => {
                let Some((run, stood)) = point(bench, ledger, &name, &trial)? else {
                    // Itself, and what may follow from it.
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
        bench.told(name, status);
    }
    Ok(Some(found))
}

/// Runs that a search takes where both ends are as they should be: each halves the ratio that is left, whichever way it comes out.
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

/// The first mark that a run misses, in words.
fn missed(run: &Run, trial: &Trial) -> Option<String> {
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

/// The next value to try; `None` where the limit is found.
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
    /// In words.
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
