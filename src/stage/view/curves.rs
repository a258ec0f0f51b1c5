//! What a cache knows of its frames: their times, what probes saw, what the ledger says of the solve.

use std::path::Path;

use super::{
    ViewError, reader,
    strip::{Label, Strip},
};
use crate::{
    cache::{CacheReader, Entry},
    domain::solver::StepReport,
    stage::probes,
    study::chart::{Chart, Series},
};

/// Times and curves of a cache; none of either where none is named.
#[derive(Default)]
pub(super) struct Curves {
    pub(super) charts: Vec<Chart>,
    pub(super) frames_per_second: Option<f64>,
    cache: Option<CacheReader>,
}

impl Curves {
    pub(super) fn of(cache: Option<&Path>) -> Result<Self, ViewError> {
        let Some(path) = cache else {
            return Ok(Self::default());
        };
        let cache = reader(path)?;
        let manifest = cache.manifest();
        let records = manifest.probes.iter().enumerate();
        let probes = records
            .map(|(index, record)| probes::chart(&manifest.shot, record, index, cache.entries()));
        Ok(Self {
            charts: probes
                .chain(of_ledger(&manifest.shot, cache.entries()))
                .collect(),
            frames_per_second: Some(manifest.frames_per_second),
            cache: Some(cache),
        })
    }

    /// When a frame ends, seconds; `None` where the cache has no such frame.
    pub(super) fn time(&self, label: &Label) -> Option<f64> {
        let Label::Frame(frame) = label else {
            return None;
        };
        Some(self.cache.as_ref()?.entry(*frame).ok()?.clock.time)
    }

    /// A sentence where pictures say that they are of another cache; those that say nothing are believed.
    pub(super) fn stranger(&self, strip: &Strip, labels: &[Label]) -> Option<String> {
        let cache = self.cache.as_ref()?;
        let Some(label @ Label::Frame(frame)) = labels.first() else {
            return None;
        };
        let found = strip.attributes(label)?;
        let is_of = |hash: &str| found.cache_hash.starts_with(hash);
        if cache.frame_hash(*frame).is_ok_and(is_of) {
            return None;
        }
        Some(format!(
            "frame {frame} of {} was not drawn from {}: times and curves may not be those of the pictures",
            strip.path.display(),
            cache.dir().display()
        ))
    }
}

/// Curves of a quantity of the solver's reports, with their name.
type Line = (&'static str, fn(&StepReport) -> f64);

/// What the ledger says of every frame, whether or not the scene has probes.
fn of_ledger(shot: &str, entries: &[Entry]) -> Vec<Chart> {
    const CHARTS: [(&str, &str, &[Line]); 3] = [
        (
            "energy",
            "J",
            &[
                ("kinetic", |r| r.kinetic_energy),
                ("potential", |r| r.potential_energy),
            ],
        ),
        ("top speed", "m/s", &[("top speed", |r| r.max_speed)]),
        (
            "density error",
            "parts of rest density",
            &[
                ("mean", |r| r.density_error_mean),
                ("99 % are below", |r| r.density_error_p99),
            ],
        ),
    ];
    let read = |entry: &Entry| -> (f64, Option<StepReport>) {
        (
            entry.clock.time,
            serde_json::from_value(entry.report.clone()).ok(),
        )
    };
    let reports: Vec<_> = entries.iter().map(read).collect();
    if reports.iter().all(|(_, report)| report.is_none()) {
        return Vec::new();
    }
    let series = |(name, of): &Line| {
        let points = reports
            .iter()
            .map(|(time, report)| (*time, report.as_ref().map(of)));
        Series::curve(name, points)
    };
    let chart = |(title, unit, lines): &(&str, &str, &[Line])| Chart {
        title: format!("{shot}: {title}"),
        x_label: "time, s".to_owned(),
        y_label: (*unit).to_owned(),
        series: lines.iter().map(series).collect(),
        ..Chart::default()
    };
    CHARTS.iter().map(chart).collect()
}
