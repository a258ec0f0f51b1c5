//! Numbers of the waves behind a body in a current.

use std::f64::consts::TAU;

use glam::DVec2;

use swell_domain::{particles::Particles, probe};
use swell_study::ship_waves;

use super::{
    BenchmarkMeasurements,
    numbers::{GRAVITY, mean},
    record::Record,
};

/// Where stations are, wave lengths behind the body and from its path: beyond the waves that die
/// out near it, and beside the water that it has stirred.
const BEHIND: [f64; 2] = [1.0, 4.25];
const BESIDE: [f64; 2] = [0.25, 1.4];

/// Distance of the stations, wave lengths.
const STATION: f64 = 1.0 / 12.0;

/// Distance from the path of the stations of the curve, wave lengths.
const CURVE: f64 = 0.5;

/// Length of waves on deep water at the current's speed, 2πU²/g, metres.
fn wave_length(record: &Record<'_>) -> f64 {
    TAU * record.benchmark.scale.speed.powi(2) / GRAVITY
}

/// Stations, in wave lengths.
fn stations() -> impl Iterator<Item = DVec2> {
    let steps = |[from, until]: [f64; 2]| {
        let count = ((until - from) / STATION).round() as usize;
        (0..=count).map(move |k| from + k as f64 * STATION)
    };
    steps(BEHIND).flat_map(move |x| steps(BESIDE).map(move |z| DVec2::new(x, z)))
}

/// Returns elevations above still water at the stations, metres, or nothing before the waves stand.
/// One without water is not a number.
pub(super) fn elevations(record: &Record<'_>, time: f64, particles: &Particles) -> Vec<f64> {
    let (domain, scale) = (&record.scene.domain, record.benchmark.scale);
    if time < scale.after {
        return Vec::new();
    }
    let body = DVec2::new(domain.min.x + scale.length, domain.min.z);
    let at = stations().map(|it| body + wave_length(record) * it);
    let spacing = record.scene.particle_spacing();
    let found = probe::elevations(particles, spacing, domain, &at.collect::<Vec<_>>());
    let above = |level: Option<f64>| level.map_or(f64::NAN, |it| it - domain.min.y - scale.depth);
    found.into_iter().map(above).collect()
}

pub(super) fn of(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let rows = record.rows.iter().map(|row| &row.of_water);
    let rows: Vec<_> = rows.filter(|row| !row.is_empty()).collect();
    let unit = wave_length(record);
    let of_station = |(k, at): (usize, DVec2)| {
        let elevation = mean(rows.iter().map(|row| row[k])).unwrap_or(f64::NAN);
        [at.x * unit, at.y * unit, elevation]
    };
    let stations: Vec<[f64; 3]> = stations().enumerate().map(of_station).collect();
    let beside = stations
        .iter()
        .filter(|it| (it[1] / unit - CURVE).abs() < 0.5 * STATION);
    out.draw(
        "elevation",
        beside.map(|it| (it[0] / unit, it[2])).collect(),
    );
    if let Some(found) = ship_waves::fit(&stations, record.benchmark.scale.depth, unit) {
        out.put("length_ratio", Some(found.length / unit));
        out.put("half_angle", Some(found.half_angle));
        out.put("misfit", Some(found.misfit));
    }
}
