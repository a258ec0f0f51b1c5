//! What emitters bring, predicted before a bake.

use swell_domain::sources::PredictedInflow;
use swell_scene::{Scene, four_digits};

use crate::prepare::Start;

/// Fraction by which whole rows of particles may change an emitter's flow.
const ROUNDED: f64 = 0.02;

/// What an emitter adds, with solids in their start position; both parts are `None` where it keeps
/// a level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inflow {
    /// Its flow rate, and what solids cover of it.
    pub predicted: Option<PredictedInflow>,
    /// Greatest number of particles that it adds until the end of the shot.
    pub most: Option<u64>,
}

impl Inflow {
    /// Predicts the inflow of each emitter.
    pub(super) fn of(scene: &Scene, start: &Start) -> Vec<Self> {
        let (sources, still) = (&start.sources, start.boundary.distance.as_ref());
        let predicted = sources.predicted_inflows(still).into_iter();
        let most = sources.most_entering(scene.shot.duration());
        predicted
            .zip(most)
            .map(|(predicted, most)| Self { predicted, most })
            .collect()
    }

    /// Lint of the emitter `index`, whose flow differs from velocity times area.
    pub(super) fn lint(&self, scene: &Scene, index: usize) -> Option<String> {
        let seconds = scene.emitters[index].window.length(scene.shot.duration());
        if self.most == Some(0) && seconds > 0.0 {
            return Some(format!(
                "emitter[{index}]: nothing enters: no layer of particles comes in within its {} s",
                four_digits(seconds)
            ));
        }
        let predicted = self.predicted.filter(|it| it.open > 0.0)?;
        let (made, asked) = (predicted.rate / predicted.open, predicted.asked?);
        let part = made / asked - 1.0;
        (part.abs() > ROUNDED).then(|| {
            format!(
                "emitter[{index}]: its box and velocity ask for {} m³/s, and {} m³/s enter, {:.1} \
                 % {}: across the flow there are whole rows of particles {} m apart",
                four_digits(asked),
                four_digits(made),
                100.0 * part.abs(),
                if part < 0.0 { "less" } else { "more" },
                scene.particle_spacing()
            )
        })
    }

    /// Warning if solids cover a part of the emitter `index`.
    pub(super) fn covered(&self, index: usize) -> Option<String> {
        let predicted = self.predicted.filter(|it| it.covered > 0.0)?;
        Some(format!(
            "emitter[{index}]: solids cover {:.1} % of its cross-section all along its volume, and \
             nothing enters there: it brings {:.4} m³/s",
            100.0 * predicted.covered,
            predicted.rate
        ))
    }
}
