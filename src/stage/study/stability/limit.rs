//! How far a setting goes before a mark is missed, by bisection.

use crate::scene::study::stability::{Limit, Search, Trial};

use super::{
    super::{PointStatus, StudyError},
    Bench, Verdict, report,
};

/// Where a limit was found.
pub(super) struct Found {
    /// Farthest value that passes; `None` where not even the first does.
    pub(super) passes: Option<f64>,
    /// Nearest value that fails, and what it fails by; `None` where not even the last does.
    pub(super) fails: Option<(f64, String)>,
    /// Runs that it took.
    pub(super) tries: usize,
}

impl Bench<'_> {
    /// Both ends first, and then the middle by ratio of a value that passes and one that fails, until they are near.
    /// `None` where `stop` came before.
    pub(super) fn search(
        &mut self,
        limit: &Limit,
        search: &Search,
    ) -> Result<Option<Found>, StudyError> {
        let title = format!("{}, {}", limit.name, search.method.name());
        let mut found = Found {
            passes: None,
            fails: None,
            tries: 0,
        };
        let mut next = Some(limit.passes);
        while let Some(value) = next {
            let Some(fault) = self.fault(&title, search, value)? else {
                return Ok(None);
            };
            found.tries += 1;
            match fault {
                None => found.passes = Some(value),
                Some(words) => found.fails = Some((value, words)),
            }
            next = following(limit, &found);
        }
        let words = found.words(&limit.unit);
        self.told(
            format!("{title}: {words}"),
            PointStatus::Done(0.0, Vec::new()),
        );
        Ok(Some(found))
    }

    /// What a value fails by; `Some(None)` where it passes, `None` where `stop` came before.
    #[expect(clippy::option_option, reason = "stopped, passes, fails by")]
    fn fault(
        &mut self,
        title: &str,
        search: &Search,
        value: f64,
    ) -> Result<Option<Option<String>>, StudyError> {
        let trial = match search.trial(value) {
            Ok(trial) => trial,
            // Beyond what a scene can say.
            Err(error) => return Ok(Some(Some(error.to_string()))),
        };
        let name = format!("{title} = {value}");
        let Some((record, _)) = self.trial(&name, &trial)? else {
            return Ok(None);
        };
        Ok(Some(missed(&record.run, &trial)))
    }
}

/// The first mark that a run misses, in words.
fn missed(run: &super::Run, trial: &Trial) -> Option<String> {
    if let Some(message) = &run.ended {
        return Some(message.clone());
    }
    let verdicts = run.verdicts(trial);
    let place = verdicts.iter().position(|v| *v == Verdict::Misses)?;
    let value = run.measured[place].value;
    let mark = &trial.marks[place];
    Some(format!(
        "{} is {}, the mark {}",
        mark.of.about().title,
        value.map_or("no number".into(), report::number),
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
        match (self.passes, &self.fails) {
            (Some(passes), Some((fails, _))) => format!(
                "passes at {} {unit}, fails at {} {unit}",
                report::number(passes),
                report::number(*fails)
            ),
            (Some(passes), None) => {
                format!(
                    "passes at {} {unit}, as far as was tried",
                    report::number(passes)
                )
            }
            (None, _) => "fails at the first value".to_owned(),
        }
    }
}
