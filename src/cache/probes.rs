//! What probes measure, as a cache keeps it: named columns, a row of values a frame.

use serde::{Deserialize, Serialize};

use super::record::is_file_stem;

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
    /// Columns of a row, after frame and time; each name ends with its unit.
    pub columns: Vec<String>,
}

/// One frame's values, by probe and column; `None` where there is nothing to measure.
pub type ProbeValues = Vec<Vec<Option<f64>>>;

impl ProbeRecord {
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
                record.quantile.map(|part| format!(" of quantile {part}")),
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
