//! Effects' passes against their twins: a file an effect.

use glam::DVec3;
use rayon::prelude::*;

use crate::{
    compare::check::Pair,
    scene::effects::with_effects,
    solve::{SolveError, trace::Traced},
};

use super::{Checker, bounds::Bounds, pair, wide};

macro_rules! checks {
    ($($name:ident),+ $(,)?) => {
        $(mod $name;)+

        /// Compares a pass of an effect that the scene names.
        pub(super) fn compare(checker: &mut Checker<'_>, traced: Traced<'_>) -> Result<(), SolveError> {
            let named = &checker.scene.effects;
            $(
                if let Some(settings) = &named.$name {
                    $name::compare(settings, checker, traced)?;
                }
            )+
            Ok(())
        }
    };
}

with_effects!(checks);

impl Checker<'_> {
    /// Positions with the samples behind them, as effects see them.
    fn moved(&self) -> Vec<DVec3> {
        let mut points = self.wide("position");
        points.extend(&self.model.samples);
        points
    }
}

/// Speed between a particle and its neighbour, of which samples have none.
fn relative_speed(velocity: &[DVec3], i: usize) -> impl Fn(usize) -> f64 + '_ {
    move |j| velocity.get(j).map_or(0.0, |v| v.distance(velocity[i]))
}

fn vectors(
    found: &[[f32; 4]],
    twin: &[DVec3],
    tolerance: impl Fn(usize) -> f64 + Sync,
) -> Vec<Pair<[f64; 3]>> {
    (0..twin.len())
        .into_par_iter()
        .map(|i| pair(i, wide(&found[i]), twin[i], tolerance(i)))
        .collect()
}
