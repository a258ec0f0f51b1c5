//! What a cache knows about its frames: times, probe values, and the ledger's reports of the
//! solver.

use std::path::PathBuf;

use super::{
    ViewError, reader,
    strip::{Label, Strip},
};
use crate::probes;
use swell_cache::{CacheReader, LedgerEntry};
use swell_domain::solver::StepReport;
use swell_study::chart::{Chart, Series};

/// Times and curves of caches; empty if none is given.
#[derive(Default)]
pub(super) struct Curves {
    pub(super) charts: Vec<Chart>,
    pub(super) frames_per_second: Option<f64>,
    /// The first one provides the times.
    caches: Vec<CacheReader>,
}

impl Curves {
    /// Curves of these caches, which have names if there are two; curves of one quantity share a
    /// chart.
    pub(super) fn of(named: &[(String, PathBuf)]) -> Result<Self, ViewError> {
        let open = |(_, path): &(String, PathBuf)| reader(path);
        let caches: Vec<CacheReader> = named.iter().map(open).collect::<Result<_, _>>()?;
        let mut charts: Vec<Chart> = Vec::new();
        for ((name, _), cache) in named.iter().zip(&caches) {
            for chart in of_cache(cache) {
                let chart = match named.len() {
                    1 => chart,
                    _ => of_two(name, chart),
                };
                match charts.iter_mut().find(|known| known.title == chart.title) {
                    Some(known) => known.series.extend(chart.series),
                    None => charts.push(chart),
                }
            }
        }
        Ok(Self {
            charts,
            frames_per_second: caches
                .first()
                .map(|cache| cache.manifest().frames_per_second),
            caches,
        })
    }

    /// Time at the end of a frame, seconds; `None` if the cache does not have the frame.
    pub(super) fn time(&self, label: &Label) -> Option<f64> {
        let Label::Frame(frame) = label else {
            return None;
        };
        Some(self.caches.first()?.entry(*frame).ok()?.clock.time)
    }

    /// A warning if the pictures' metadata names another cache; pictures without metadata are
    /// trusted.
    pub(super) fn stranger(&self, strip: &Strip, labels: &[Label]) -> Option<String> {
        let cache = self.caches.first()?;
        let Some(label @ Label::Frame(frame)) = labels.first() else {
            return None;
        };
        let found = strip.attributes(label)?;
        let is_of = |hash: &str| found.cache_hash.starts_with(hash);
        if cache.frame_hash(*frame).is_ok_and(is_of) {
            return None;
        }
        Some(format!(
            "frame {frame} of {} was not drawn from {}: times and curves may not \
             be those of the pictures",
            strip.path.display(),
            cache.dir().display()
        ))
    }
}

/// All charts of a cache: those of its probes and of its ledger.
fn of_cache(cache: &CacheReader) -> Vec<Chart> {
    let shot = &cache.manifest().shot;
    let records = cache.manifest().probes.iter().enumerate();
    let probes = records.map(|(index, record)| probes::chart(shot, record, index, cache.entries()));
    probes.chain(of_ledger(shot, cache.entries())).collect()
}

/// A chart with the owner in the names of its curves instead of its title.
fn of_two(name: &str, mut chart: Chart) -> Chart {
    if let Some((_, title)) = chart.title.split_once(": ") {
        chart.title = title.to_owned();
    }
    for series in &mut chart.series {
        series.name = format!("{name} {}", series.name);
    }
    chart
}

/// Name of a curve, and the quantity of the solver's report that it shows.
type ReportCurve = (&'static str, fn(&StepReport) -> f64);

/// Charts of the ledger's reports, independent of probes.
fn of_ledger(shot: &str, entries: &[LedgerEntry]) -> Vec<Chart> {
    const CHARTS: [(&str, &str, &[ReportCurve]); 3] = [
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
    let read = |entry: &LedgerEntry| -> (f64, Option<StepReport>) {
        (
            entry.clock.time,
            serde_json::from_value(entry.report.clone()).ok(),
        )
    };
    let reports: Vec<_> = entries.iter().map(read).collect();
    if reports.iter().all(|(_, report)| report.is_none()) {
        return Vec::new();
    }
    let series = |(name, of): &ReportCurve| {
        let points = reports
            .iter()
            .map(|(time, report)| (*time, report.as_ref().map(of)));
        Series::curve(name, points)
    };
    let chart = |(title, unit, lines): &(&str, &str, &[ReportCurve])| Chart {
        title: format!("{shot}: {title}"),
        x_label: "time, s".to_owned(),
        y_label: (*unit).to_owned(),
        series: lines.iter().map(series).collect(),
        ..Chart::default()
    };
    CHARTS.iter().map(chart).collect()
}
