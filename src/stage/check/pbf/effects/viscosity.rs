//! XSPH viscosity.

use super::{Bounds, Checker, relative_speed, vectors, wide};
use crate::{
    compare::rounding::U,
    reference::pbf::effects::viscosity::{viscosity_apply, viscosity_gather},
    scene::effects::viscosity::Settings,
    solve::{SolveError, trace::Traced},
    compare::check::fields,
};

fields! {
    CHANGE = "effects/viscosity_gather", "change of velocity", "m/s",
        "c scale u (30 Σ|Δv|p² + (n + 6) Σ|Δv|p³)";
    VELOCITY = "effects/viscosity_apply", "velocity", "m/s", "one sum: u |v|";
}

pub(super) fn compare(
    settings: &Settings,
    checker: &mut Checker<'_>,
    traced: Traced<'_>,
) -> Result<(), SolveError> {
    let n = checker.n();
    let velocity = checker.wide("velocity");
    match traced.pass {
        "effects/viscosity_gather" => {
            let points = checker.moved();
            let neighbors = checker.visited(traced, &points)?;
            let inputs = checker.inputs(&points, &neighbors);
            let twin = viscosity_gather(inputs, settings.xsph, &velocity);
            let scale = settings.xsph * inputs.model.calibration.density_scale;
            let found = traced.read("viscosity_change", n)?;
            let pairs = vectors(&found, &twin, |i| {
                scale * Bounds(inputs).sums(i, relative_speed(&velocity, i)).kernel()
            });
            checker.table.add(&CHANGE, &pairs, 0);
        }
        "effects/viscosity_apply" => {
            let change: Vec<_> = (traced.read::<[f32; 4]>("viscosity_change", n)?.iter())
                .map(wide)
                .collect();
            let twin = viscosity_apply(&change, &velocity);
            let found = traced.read("velocity", n)?;
            let pairs = vectors(&found, &twin, |i| U * twin[i].length());
            checker.table.add(&VELOCITY, &pairs, 0);
        }
        _ => {}
    }
    Ok(())
}
