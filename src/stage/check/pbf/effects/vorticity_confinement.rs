//! Vorticity confinement.

use glam::DVec3;
use rayon::prelude::*;

use super::{Bounds, Checker, pair, relative_speed, vectors, wide};
use crate::{
    compare::{
        check::fields,
        rounding::{ROOT, U},
    },
    reference::pbf::effects::vorticity_confinement::{vorticity_curl, vorticity_force},
    scene::effects::vorticity_confinement::Settings,
    solve::{SolveError, trace::Traced},
    stage::check::pbf::pair_of,
};

fields! {
    CURL = "effects/vorticity_curl", "vorticity", "1/s",
        "scale u (22 Σ|Δv|s + (n + 16) Σ|Δv|s²), twice for the two products of a cross product";
    LENGTH = "effects/vorticity_curl", "its length", "1/s", "that of the vorticity + 12 u |ω|";
    VELOCITY = "effects/vorticity_force", "velocity", "m/s",
        "Δt ε h |ω| (2 the slope's error over the slope + 30 u) + u |v|; slope: scale u (22 Σ|Δω|s + (n + 16) Σ|Δω|s² + 12 \
         Σ(ω + ω)s²); a tie where that decides whether there is a slope at all";
}

pub(super) fn compare(
    settings: &Settings,
    checker: &mut Checker<'_>,
    traced: Traced<'_>,
) -> Result<(), SolveError> {
    match traced.pass {
        "effects/vorticity_curl" => curl(checker, traced),
        "effects/vorticity_force" => force(settings, checker, traced),
        _ => Ok(()),
    }
}

fn curl(checker: &mut Checker<'_>, traced: Traced<'_>) -> Result<(), SolveError> {
    let (points, velocity) = (checker.moved(), checker.wide("velocity"));
    let neighbors = checker.visited(traced, &points)?;
    let inputs = checker.inputs(&points, &neighbors);
    let twin = vorticity_curl(inputs, &velocity);
    let scale = 2.0 * inputs.model.calibration.gradient_scale;
    let found = traced.read::<[f32; 4]>("vorticity", checker.n())?;
    let pairs = vectors(&found, &twin, |i| {
        let speed = relative_speed(&velocity, i);
        scale * Bounds(inputs).sums(i, speed).gradient()
    });
    let lengths: Vec<_> = (pairs.iter().zip(&twin).zip(&found).enumerate())
        .map(|(i, ((pair, exact), value))| {
            let exact = exact.length();
            let tolerance = pair.tolerance + (ROOT + 3.0) * U * exact;
            pair_of(i, f64::from(value[3]), exact, tolerance)
        })
        .collect();
    checker.table.add(&CURL, &pairs, 0);
    checker.table.add(&LENGTH, &lengths, 0);
    Ok(())
}

fn force(
    settings: &Settings,
    checker: &mut Checker<'_>,
    traced: Traced<'_>,
) -> Result<(), SolveError> {
    let n = checker.n();
    let (points, velocity) = (checker.moved(), checker.wide("velocity"));
    let vorticity: Vec<DVec3> = (traced.read::<[f32; 4]>("vorticity", n)?.iter())
        .map(wide)
        .collect();
    let neighbors = checker.visited(traced, &points)?;
    let inputs = checker.inputs(&points, &neighbors);
    let twin = vorticity_force(inputs, settings.strength, &vorticity, &velocity);
    let strength: Vec<f64> = vorticity.iter().map(|w| w.length()).collect();
    let scale = inputs.model.calibration.gradient_scale;
    let h = inputs.model.calibration.support_radius;
    let found = traced.read::<[f32; 4]>("velocity", n)?;
    let one = |i: usize| {
        let bounds = Bounds(inputs);
        let other = |j: usize| strength.get(j).copied();
        let change = |j: usize| other(j).map_or(0.0, |w| (w - strength[i]).abs());
        let both = |j: usize| other(j).map_or(0.0, |w| w + strength[i]);
        let error =
            scale * (bounds.sums(i, change).gradient() + 12.0 * U * bounds.sums(i, both).s2);
        let slope = slope(&bounds, &strength, i);
        // Below this the direction is noise, and none is taken.
        let threshold = 1e-5 * strength[i] / h;
        if (slope - threshold).abs() <= 1.01 * error {
            return None;
        }
        let force = inputs.substep.time_step * settings.strength * h * strength[i];
        let part = if slope < threshold {
            0.0
        } else {
            2.0 * error / slope + 30.0 * U
        };
        let tolerance = force * part + 2.0 * U * (velocity[i].length() + force);
        Some(pair(i, wide(&found[i]), twin[i], tolerance))
    };
    let all: Vec<_> = (0..n).into_par_iter().map(one).collect();
    let ties = all.iter().filter(|pair| pair.is_none()).count();
    let pairs: Vec<_> = all.into_iter().flatten().collect();
    checker.table.add(&VELOCITY, &pairs, ties);
    Ok(())
}

/// |∇|ω|| by differences, as `vorticity_force` takes it.
fn slope(bounds: &Bounds<'_>, strength: &[f64], i: usize) -> f64 {
    let inputs = bounds.0;
    let calibration = &inputs.model.calibration;
    let term = |&j: &u32| {
        let d = inputs.points[i] - inputs.points[j as usize];
        let r = d.length();
        let s = (1.0 - r / calibration.support_radius).max(0.0);
        let along = d * (calibration.gradient_scale * s * s / r.max(1e-15));
        along * (strength[j as usize] - strength[i])
    };
    let sum: DVec3 = inputs.neighbors.fluid(i).iter().map(term).sum();
    sum.length()
}
