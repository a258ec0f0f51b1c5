//! Probe measurements as a cache stores them: named columns, a row of values per frame.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::record::is_file_stem;
use swell_domain::probe::Rate;

/// A table of values over time as recorded in the manifest: a probe, or the states of a body.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ProbeRecord {
    /// Name of its file, without the extension.
    pub name: String,
    /// Kind as scenes name it: `elevation`, `pressure`, `energy`, …; `body` for a body.
    pub kind: String,
    /// World coordinates of the measurement, metres.
    pub at: Vec<f64>,
    /// `-x` to `+z`: the direction that counts as ahead or positive; only for kinds that have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<String>,
    /// Fraction of the water that lies behind; only for kinds that have one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quantile: Option<f64>,
    /// Number of the solid or name of the wall; only for forces.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solid: Option<String>,
    /// How often the probe samples; absent if at the end of each frame.
    #[serde(default, skip_serializing_if = "is_by_frame")]
    pub rate_hz: Rate,
    /// Length in seconds of the window before each sample whose mean, minimum and maximum its file
    /// has too.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub window: Option<f64>,
    /// Columns of a row, after frame and time; each name ends with its unit, if it has one.
    pub columns: Vec<String>,
}

fn is_by_frame(rate: &Rate) -> bool {
    *rate == Rate::Frame
}

/// One sample of a probe.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look<'a> {
    /// Time since the shot's start, seconds.
    pub time: f64,
    /// Value of each column; `None` where there is nothing to measure.
    pub values: &'a [Option<f64>],
}

/// One frame's values by probe; `None` where there is nothing to measure.
///
/// A probe that samples at the end of each frame has one value per column. A probe with its own
/// rate has all its samples one after another, each as its time in seconds followed by one value
/// per column. All samples of a frame are thus in the frame's ledger line and are dropped with it
/// when a bake is cut.
pub type ProbeValues = Vec<Vec<Option<f64>>>;

/// Values of a frame by the name of their stream, then by table and column; `None` where there is
/// nothing to measure.
pub type Rows = BTreeMap<String, ProbeValues>;

impl ProbeRecord {
    /// The samples in one frame's values; the frame ended at `time`, seconds.
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
            return (values.len() != self.columns.len()).then_some("a different number of columns");
        }
        let looks = values.chunks(self.columns.len() + 1);
        let times: Option<Vec<f64>> = looks.clone().map(|look| look[0]).collect();
        let are_whole = looks
            .clone()
            .all(|look| look.len() == self.columns.len() + 1);
        match times {
            Some(times) if are_whole && times.is_sorted() => None,
            _ => Some("samples that are not a time with its columns"),
        }
    }

    /// Columns of the probe's file after frame and time. With a window, `elevation_m` is followed
    /// by `elevation_mean_m`, `elevation_min_m` and `elevation_max_m`, and so on for each column.
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

    /// Refuses names that lead out of the folder or that collide on a case-insensitive file system.
    /// `what` is the noun for messages.
    pub(super) fn check_all(records: &[Self], what: &str) -> Result<(), String> {
        for (k, record) in records.iter().enumerate() {
            if !is_file_stem(&record.name) {
                return Err(format!("{what} name `{}` is not a file name", record.name));
            }
            let mut before = records[..k].iter();
            if before.any(|other| other.name.eq_ignore_ascii_case(&record.name)) {
                return Err(format!("{what} name `{}` is taken twice", record.name));
            }
            let is_bad = |column: &String| column.is_empty() || column.contains([',', '"', '\n']);
            if record.columns.is_empty() || record.columns.iter().any(is_bad) {
                return Err(format!("columns of {what} `{}`", record.name));
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
