//! How a run's marks came out.

use serde::{Deserialize, Serialize};

use swell_scene::study::stability::{Mark, Trial};

use super::{super::PointStatus, report};

/// Most points of a curve that a line keeps.
const CURVE: usize = 160;

/// A run with what each of its marks was measured at, in the order of [`Trial::marks`]; or an attempt that was to be refused.
pub type Run = super::super::Run<Vec<Measured>>;

/// What a mark was measured at.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    /// `None` where it is no number.
    pub value: Option<f64>,
    /// Seconds of the shot and number, the worst of several frames where there are many.
    pub curve: Vec<(f64, Option<f64>)>,
}

/// How a mark came out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Held.
    Passes,
    /// Not held.
    Misses,
    /// Not held, as the study says.
    KnownFailure,
    /// Held, where the study says that it is not.
    PassesUnexpectedly,
}

impl Verdict {
    /// For a table.
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

impl Measured {
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

    /// For a reader.
    pub(super) fn words(&self) -> String {
        self.value.map_or("no number".to_owned(), report::number)
    }

    /// Against its mark, in a run that did not end early.
    fn holds(&self, mark: &Mark) -> bool {
        self.value.is_some_and(|value| mark.bound.holds(value))
    }
}

impl Run {
    /// How each mark came out. A run that ended early holds none.
    pub fn verdicts(&self, trial: &Trial) -> Vec<Verdict> {
        let none = Measured::default();
        let marks = trial.marks.iter().enumerate();
        marks
            .map(|(k, mark)| {
                let measured = self.measured.get(k).unwrap_or(&none);
                let holds = self.ended.is_none() && measured.holds(mark);
                Verdict::of(holds, mark.known_failure.is_some())
            })
            .collect()
    }

    /// Whether every mark is held.
    pub fn passes(&self, trial: &Trial) -> bool {
        let is_held = |v: &Verdict| matches!(v, Verdict::Passes | Verdict::PassesUnexpectedly);
        self.verdicts(trial).iter().all(is_held)
    }

    /// What a user is told of it.
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
