//! Verdicts on the marks of a run.

use serde::{Deserialize, Serialize};

use swell_files::study::stability::{Mark, Trial};

use super::{super::PointStatus, report};

/// Largest number of points of a stored curve.
const CURVE: usize = 160;

/// Run with the measurement for each mark, in the order of [`Trial::marks`]; or an attempt that
/// should be refused.
pub type StabilityRun = super::super::Run<Vec<MarkMeasurement>>;

/// Measurement for a mark.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(expecting = "struct Measured")]
pub struct MarkMeasurement {
    /// Value compared with the bound; `None` where it is not finite.
    pub value: Option<f64>,
    /// Time in seconds of the shot and value; the worst of several frames where there are many.
    pub curve: Vec<(f64, Option<f64>)>,
}

/// Verdict on a mark.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// The bound is met.
    Passes,
    /// The bound is missed.
    Misses,
    /// The bound is missed, and the study lists that as a known failure.
    KnownFailure,
    /// The bound is met, but the study lists it as a known failure.
    PassesUnexpectedly,
}

impl Verdict {
    /// Returns the verdict as shown in tables.
    pub fn words(self) -> &'static str {
        match self {
            Self::Passes => "passes",
            Self::Misses => "MISSED",
            Self::KnownFailure => "known failure",
            Self::PassesUnexpectedly => "passes, listed as known failure",
        }
    }

    pub(in super::super) fn of(holds: bool, is_known: bool) -> Self {
        match (holds, is_known) {
            (true, false) => Self::Passes,
            (false, false) => Self::Misses,
            (false, true) => Self::KnownFailure,
            (true, true) => Self::PassesUnexpectedly,
        }
    }
}

impl MarkMeasurement {
    pub(super) fn new(value: Option<f64>, curve: &[[f64; 2]], mark: &Mark) -> Self {
        let bin = curve.len().div_ceil(CURVE).max(1);
        let worst = |points: &[[f64; 2]]| {
            let first = points[0][1];
            let number = points.iter().fold(first, |a, p| mark.bound.worse(a, p[1]));
            (points[0][0], Some(number).filter(|n| n.is_finite()))
        };
        Self {
            value,
            curve: curve.chunks(bin).map(worst).collect(),
        }
    }

    /// Formats the value for readers.
    pub(super) fn words(&self) -> String {
        self.value.map_or("no number".to_owned(), report::number)
    }

    /// Whether the value meets the bound of its mark; the run must not have ended early.
    fn holds(&self, mark: &Mark) -> bool {
        self.value.is_some_and(|value| mark.bound.holds(value))
    }
}

impl StabilityRun {
    /// Returns the verdict on each mark. A run that ended early meets none.
    pub fn verdicts(&self, trial: &Trial) -> Vec<Verdict> {
        let none = MarkMeasurement::default();
        let marks = trial.marks.iter().enumerate();
        marks
            .map(|(k, mark)| {
                let measured = self.measured.get(k).unwrap_or(&none);
                let holds = self.ended.is_none() && measured.holds(mark);
                Verdict::of(holds, mark.known_failure.is_some())
            })
            .collect()
    }

    /// Returns whether every mark is met.
    pub fn passes(&self, trial: &Trial) -> bool {
        let is_held = |v: &Verdict| matches!(v, Verdict::Passes | Verdict::PassesUnexpectedly);
        self.verdicts(trial).iter().all(is_held)
    }

    /// Outcome as reported to the user.
    pub(super) fn status(&self, trial: &Trial, stood: bool) -> PointStatus {
        let marks = trial
            .marks
            .iter()
            .zip(self.verdicts(trial))
            .zip(&self.measured);
        let missed = marks.filter(|((_, verdict), _)| *verdict == Verdict::Misses);
        let told = missed.map(|((mark, _), m)| format!("{} is {}", mark.of.name(), m.words()));
        match (&self.ended, told.collect::<Vec<_>>().join(", ")) {
            (Some(message), _) => PointStatus::Failed(message.clone()),
            (None, missed) if !missed.is_empty() => PointStatus::Failed(missed),
            (None, _) if stood => PointStatus::Stands,
            (None, _) => PointStatus::Done(1e3 * self.per_frame()[1], Vec::new()),
        }
    }
}
