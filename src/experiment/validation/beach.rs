//! Numbers of a solitary wave on a plane beach.

use glam::DVec2;

use swell_domain::{particles::Particles, probe::elevation};
use swell_study::waves;

use super::{BenchmarkMeasurements, numbers, record::Record};

/// Times of the profiles, √(d/g), and the names of their curves and errors: those at which
/// Synolakis 1987 measured a wave of H/d = 0.3, which begins with its crest half a wave length
/// before the toe of the beach.
const PROFILES: [(f64, &str, &str); 4] = [
    (15.0, "profile_15", "profile_error_15"),
    (20.0, "profile_20", "profile_error_20"),
    (25.0, "profile_25", "profile_error_25"),
    (30.0, "profile_30", "profile_error_30"),
];

/// Where a profile begins and ends, depths from the shoreline of still water towards the sea.
const STATIONS: [f64; 2] = [-12.0, 20.0];

/// Distance of its stations, depths.
const STATION: f64 = 0.1;

/// Largest distance of a point from a station with water, depths. A profile with a hole there is
/// not compared.
const HOLE: f64 = 0.3;

/// Returns elevations over the depth at the stations of a profile if this frame is the nearest to
/// its time, nothing otherwise.
///
/// A station without water is not a number at sea. On the beach it has the elevation of still
/// water, which is below the beach and all points there.
pub(super) fn profile(record: &Record<'_>, time: f64, particles: &Particles) -> Vec<f64> {
    let shot = &record.scene.shot;
    let half = 0.5 * shot.frame_seconds() / unit(record);
    let time = time / unit(record);
    let is_nearest = |at: f64| (time - half..time + half).contains(&at);
    if !PROFILES.iter().any(|(at, ..)| is_nearest(*at)) {
        return Vec::new();
    }
    let (domain, scale) = (&record.scene.domain, record.benchmark.scale);
    let middle = 0.5 * (domain.min.z + domain.max.z);
    let above = |x: f64| {
        let at = DVec2::new(domain.min.x + scale.length - x * scale.depth, middle);
        let dry = if x < 0.0 { 0.0 } else { f64::NAN };
        let level = elevation(particles, record.scene.particle_spacing(), domain, at);
        level.map_or(dry, |level| (level - domain.min.y) / scale.depth - 1.0)
    };
    stations().map(above).collect()
}

pub(super) fn of(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    numbers::run_up(record, out);
    let looked_at = record.rows.iter().filter(|row| !row.of_water.is_empty());
    for row in looked_at {
        let off = |at: f64| (row.time / unit(record) - at).abs();
        let nearest = PROFILES.iter().min_by(|a, b| off(a.0).total_cmp(&off(b.0)));
        let Some((_, curve, error)) = nearest else {
            continue;
        };
        let all = stations().zip(row.of_water.iter().copied());
        let found: Vec<_> = all.filter(|(_, level)| level.is_finite()).collect();
        let mut points = record.benchmark.points.iter();
        if let Some(points) = points.find(|points| points.of == *curve) {
            out.put(error, profile_error(&found, &points.at));
        }
        out.draw(curve, found);
    }
}

/// Returns the root mean square of the difference from the points over the highest of them; `None`
/// if a point is beyond the profile's ends or in a hole of it.
fn profile_error(profile: &[(f64, f64)], points: &[[f64; 2]]) -> Option<f64> {
    let mut sum = 0.0;
    let mut highest = 0.0_f64;
    for [x, y] in points {
        let is_covered = profile.iter().any(|(at, _)| (at - x).abs() <= HOLE);
        let level = waves::value_at(profile, *x).filter(|_| is_covered)?;
        sum += (level - y).powi(2);
        highest = highest.max(*y);
    }
    (highest > 0.0).then(|| (sum / points.len() as f64).sqrt() / highest)
}

fn stations() -> impl Iterator<Item = f64> {
    let count = ((STATIONS[1] - STATIONS[0]) / STATION).round() as usize;
    (0..=count).map(|k| STATIONS[0] + STATION * k as f64)
}

/// √(d/g), seconds.
fn unit(record: &Record<'_>) -> f64 {
    (record.benchmark.scale.depth / numbers::GRAVITY).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_a_part_of_the_highest_point() {
        let profile: Vec<_> = stations().map(|x| (x, 0.1 * x)).collect();
        let points = [[-1.0, -0.1], [0.0, 0.0], [4.05, 0.405]];
        assert!(profile_error(&profile, &points).unwrap() < 1e-12);
        let lower = points.map(|[x, y]| [x, y - 0.1]);
        let error = profile_error(&profile, &lower).unwrap();
        assert!((error - 0.1 / 0.305).abs() < 1e-12, "{error}");
        assert_eq!(profile_error(&profile, &[[20.5, 1.0]]), None);
        assert_eq!(profile_error(&profile, &[[1.0, -0.1]]), None);
        // Half a depth without water, and a whole one.
        let without = |from: f64, to: f64| -> Vec<_> {
            let wet = profile.iter().filter(|(x, _)| *x < from || *x > to);
            wet.copied().collect()
        };
        assert!(profile_error(&without(3.8, 4.2), &points).unwrap() < 1e-12);
        assert_eq!(profile_error(&without(3.5, 4.5), &points), None);
    }
}
