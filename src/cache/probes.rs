//! What probes measure, as a cache keeps it: named columns, a row of values a frame.

use serde::{Deserialize, Serialize};

use super::record::is_file_stem;
use swell_domain::probe::Rate;

/// A probe, as the manifest has it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeRecord {
    /// Name of its file, without the ending.
    pub name: String,
    /// As scenes name it: `elevation`, `pressure`, `energy`, …
    pub kind: String,
    /// World coordinates that it looks at, metres.
    pub at: Vec<f64>,
    /// `-x` to `+z`: which way is ahead, or positive; only of kinds that have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<String>,
    /// Part of the water that lies behind; only of kinds that have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantile: Option<f64>,
    /// A solid's number or a wall's name; only of forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid: Option<String>,
    /// How often it looks, where not at each frame's end.
    #[serde(default, skip_serializing_if = "is_by_frame")]
    pub rate_hz: Rate,
    /// Seconds up to each look over which its file has the mean, the least and the greatest value as well.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<f64>,
    /// Columns of a row, after frame and time; each name ends with its unit.
    pub columns: Vec<String>,
}

fn is_by_frame(rate: &Rate) -> bool {
    *rate == Rate::Frame
}

/// One look of a probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look<'a> {
    /// Seconds from the shot's start.
    pub time: f64,
    /// By column; `None` where there is nothing to measure.
    pub values: &'a [Option<f64>],
}

/// One frame's values by probe; `None` where there is nothing to measure. Of a probe that looks at frames' ends a value a
/// column. Of one with a rate of its own as many looks as there were, one after the other, each its time in seconds and then a
/// value a column: so all that a frame saw stands in the frame's line, and goes with it where a bake is cut short.
pub type ProbeValues = Vec<Vec<Option<f64>>>;

impl ProbeRecord {
    /// The looks in one frame's values, where the frame ended at `time`.
    pub fn looks<'a>(
        &self,
        values: &'a [Option<f64>],
        time: f64,
    ) -> impl Iterator<Item = Look<'a>> + use<'a> {
        let by_frame = is_by_frame(&self.rate_hz);
        let width = self.columns.len() + usize::from(!by_frame);
        values.chunks(width).map(move |look| match look {
            [at, values @ ..] if !by_frame => Look {
                time: at.unwrap_or(time),
                values,
            },
            values => Look { time, values },
        })
    }

    /// Why these cannot be one frame's values.
    pub(super) fn misfit(&self, values: &[Option<f64>]) -> Option<&'static str> {
        if is_by_frame(&self.rate_hz) {
            return (values.len() != self.columns.len()).then_some("another number of columns");
        }
        let looks = values.chunks(self.columns.len() + 1);
        let times: Option<Vec<f64>> = looks.clone().map(|look| look[0]).collect();
        let are_whole = looks
            .clone()
            .all(|look| look.len() == self.columns.len() + 1);
        match times {
            Some(times) if are_whole && times.is_sorted() => None,
            _ => Some("looks that are no times with their columns"),
        }
    }

    /// Columns of its file, after frame and time: of a window `elevation_mean_m`, `elevation_min_m` and
    /// `elevation_max_m` behind `elevation_m`, and so of each.
    pub(super) fn file_columns(&self) -> Vec<String> {
        let of = |column: &String| {
            let mut all = vec![column.clone()];
            if self.window.is_some() {
                let (name, unit) = column.rsplit_once('_').unwrap_or((column, ""));
                all.extend(["mean", "min", "max"].map(|what| format!("{name}_{what}_{unit}")));
            }
            all
        };
        self.columns.iter().flat_map(of).collect()
    }

    /// No name may lead out of the folder, and none may meet another on any file system.
    pub(super) fn check_all(records: &[Self]) -> Result<(), String> {
        for (k, record) in records.iter().enumerate() {
            if !is_file_stem(&record.name) {
                return Err(format!("probe name `{}` is no file name", record.name));
            }
            let mut before = records[..k].iter();
            if before.any(|other| other.name.eq_ignore_ascii_case(&record.name)) {
                return Err(format!("two probes are called `{}`", record.name));
            }
            let is_bad = |column: &String| column.is_empty() || column.contains([',', '"', '\n']);
            if record.columns.is_empty() || record.columns.iter().any(is_bad) {
                return Err(format!("columns of probe `{}`", record.name));
            }
        }
        Ok(())
    }

    /// All of them in words.
    pub(super) fn list(records: &[Self]) -> String {
        let words = |record: &Self| {
            let mut words = record.kind.clone();
            if !record.at.is_empty() {
                words += &format!(" at {:?}", record.at);
            }
            let settings = [
                record.axis.as_ref().map(|axis| format!(" towards {axis}")),
                record.solid.as_ref().map(|solid| format!(" on {solid}")),
                record.quantile.map(|part| format!(" of quantile {part}")),
                match record.rate_hz {
                    Rate::Frame => None,
                    Rate::Substep => Some(" at each substep".to_owned()),
                    Rate::Hertz(rate) => Some(format!(" at {rate} Hz")),
                },
                record.window.map(|window| format!(" over {window} s")),
            ];
            words.extend(settings.into_iter().flatten());
            match words == record.kind {
                true => record.name.clone(),
                false => format!("{} ({words})", record.name),
            }
        };
        match records {
            [] => "no probes".to_owned(),
            _ => records.iter().map(words).collect::<Vec<_>>().join(", "),
        }
    }
}
