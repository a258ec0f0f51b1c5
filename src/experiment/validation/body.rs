//! Numbers of a body in water.

use glam::DVec3;

use swell_domain::body::BodyState;
use swell_scene::moving_solid::MovingSolid;
use swell_study::waves;

use super::{
    BenchmarkMeasurements,
    numbers::{Curve, mean},
    record::{FrameRecord, Record},
};

/// Least swing of a heave or a roll, of the first, that counts for its period.
const LEAST_SWING: f64 = 0.05;

pub(super) fn of(record: &Record<'_>, out: &mut BenchmarkMeasurements) {
    let solids = &record.scene.moving_solids;
    let Some(solid) = solids.iter().find(|solid| solid.body.is_some()) else {
        return;
    };
    let from = record.benchmark.scale.after;
    let counted = || record.rows.iter().filter(|row| row.time >= from);
    let draft = |row: &FrameRecord| {
        let level = mean(row.levels.iter().copied().flatten())?;
        let floor = record.scene.domain.min.y;
        Some(level - (lowest(solid, row.bodies.first()?) - floor))
    };
    out.put("draft", mean(counted().filter_map(draft)));

    let curve = |of: &dyn Fn(&BodyState) -> f64| -> Curve {
        let rows = record.rows.iter();
        rows.filter_map(|row| Some((row.time, of(row.bodies.first()?))))
            .collect()
    };
    // Relative to the mean of time.
    let swing = |of: &dyn Fn(&BodyState) -> f64| -> Curve {
        let all = curve(of);
        let late = all.iter().filter(|(t, _)| *t >= from);
        let rest = mean(late.map(|(_, x)| *x)).unwrap_or(f64::NAN);
        all.into_iter().map(|(t, x)| (t, x - rest)).collect()
    };
    let heave = swing(&|body| body.centre.y);
    let roll = swing(&|body| {
        let up = body.turn * DVec3::Y;
        (-up.x).atan2(up.y)
    });
    for (name, curve) in [("heave_period", &heave), ("roll_period", &roll)] {
        let first = curve.first().map_or(f64::NAN, |(_, x)| x.abs());
        out.put(name, waves::period(curve, LEAST_SWING * first));
    }
    out.put("heave_left", heave_left(&heave));
    if let [start, first, ..] = &record.rows[..]
        && let (Some(before), Some(after)) = (start.bodies.first(), first.bodies.first())
    {
        out.put("acceleration", Some(after.velocity.y / first.time));
        out.put("speed_left", Some(after.velocity.x / before.velocity.x));
    }
    out.put("momentum_error", momentum_error(record));
    out.draw("heave", heave);
    out.draw("roll", roll);
}

/// Height of a solid's lowest vertex, metres.
fn lowest(solid: &MovingSolid, state: &BodyState) -> f64 {
    let pose = solid.pose(&vec![*state; 1 + index(solid)], state.time);
    let heights = (solid.placed.mesh.vertices.iter()).map(|x| pose.place(*x).y);
    heights.fold(f64::INFINITY, f64::min)
}

fn index(solid: &MovingSolid) -> usize {
    solid.body.as_ref().map_or(0, |body| body.index)
}

/// The first maximum after the first minimum, over the value at the start.
fn heave_left(heave: &Curve) -> Option<f64> {
    let values: Vec<f64> = heave.iter().map(|(_, y)| *y).collect();
    let first = *values.first()?;
    let falls = values.iter().position(|y| *y * first < 0.0)?;
    let rises = falls + values[falls..].iter().position(|y| *y * first > 0.0)?;
    let end = values[rises..].iter().position(|y| *y * first < 0.0)?;
    let most = values[rises..rises + end].iter().map(|y| y / first);
    Some(most.fold(0.0, f64::max))
}

/// Largest change of the momentum of water and bodies, over that of the start; none if it is at
/// rest.
fn momentum_error(record: &Record<'_>) -> Option<f64> {
    let of_row = |row: &FrameRecord| {
        let water = DVec3::from_slice(row.of_water.get(..3)?);
        let bodies = record.scene.bodies().zip(&row.bodies);
        let bodies: DVec3 = bodies
            .map(|(it, state)| it.body.mass.mass * state.velocity)
            .sum();
        Some(water + bodies)
    };
    let all: Option<Vec<DVec3>> = record.rows.iter().map(of_row).collect();
    let (first, rest) = all.as_ref()?.split_first()?;
    let off = rest.iter().map(|p| (*p - *first).length());
    (first.length() > 0.0).then(|| off.fold(0.0, f64::max) / first.length())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is left of a damped cosine after a period; of one that is over sooner there is none.
    #[test]
    fn what_is_left_of_a_heave_is_its_next_maximum() {
        let decayed = |periods: f64| -> Curve {
            let at = |k: u32| {
                let t = f64::from(k) / 200.0;
                let phase = std::f64::consts::TAU * t;
                (t, -0.3 * (-0.5 * t).exp() * phase.cos())
            };
            (0..(200.0 * periods) as u32).map(at).collect()
        };
        // The maximum comes before the whole period, by 0.5 / (2 π)² of it.
        let left = heave_left(&decayed(2.0)).unwrap();
        assert!((left / (-0.5f64).exp() - 1.0).abs() < 0.01, "{left}");
        assert_eq!(heave_left(&decayed(0.9)), None);
    }
}
