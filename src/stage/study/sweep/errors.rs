//! From what a point measured to its errors.

use crate::scene::study::sweep::ErrorMeasure;

use super::ledger::{Run, Sample};

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for value in values {
        sum += value;
        count += 1;
    }
    (count > 0).then(|| sum / f64::from(count))
}

/// An error of a run; against `finest` where the measure needs one. `None` where it cannot be told.
pub(super) fn of(error: ErrorMeasure, run: &Run, finest: Option<&Run>) -> Option<f64> {
    let density = |k: usize| mean(run.density.iter().map(move |frame| frame[k]));
    let against = |difference: fn(&Sample, &Sample) -> Option<f64>| {
        let pairs = run.samples.iter().zip(&finest?.samples);
        mean(pairs.filter_map(|(sample, fine)| difference(sample, fine)))
    };
    match error {
        ErrorMeasure::DensityMean => density(0),
        ErrorMeasure::DensityP99 => density(1),
        ErrorMeasure::DensityMax => density(2),
        ErrorMeasure::Crest => against(|a, b| Some((a.crest - b.crest).abs())),
        ErrorMeasure::Front => against(|a, b| Some((a.front? - b.front?).abs())),
        ErrorMeasure::Energy => against(|a, b| Some((a.energy / b.energy - 1.0).abs())),
        ErrorMeasure::Profile => against(|a, b| {
            let squares = a
                .profile
                .iter()
                .zip(&b.profile)
                .map(|(a, b)| (a - b).powi(2));
            mean(squares).map(f64::sqrt)
        }),
        ErrorMeasure::Pressure => run.projection.map(|p| p.pressure),
        ErrorMeasure::Velocity => run.projection.map(|p| p.velocity),
        ErrorMeasure::Divergence => run.projection.map(|p| p.divergence),
        ErrorMeasure::DistanceToConverged => run.distance,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn differences_are_means_over_the_times_that_both_know() {
        let sample = |front, crest, energy, level: f64| Sample {
            front,
            crest,
            energy,
            profile: vec![level; 4],
        };
        let run = Run {
            samples: vec![
                sample(Some(1.0), 0.5, 9.0, 1.0),
                sample(None, 0.7, 8.0, 1.5),
            ],
            density: vec![[0.01, 0.02, 0.3], [0.03, 0.04, 0.5]],
            ..Run::default()
        };
        let finest = Run {
            samples: vec![
                sample(Some(1.5), 0.4, 10.0, 1.2),
                sample(Some(2.0), 0.4, 10.0, 1.2),
            ],
            ..Run::default()
        };
        let against = |error| of(error, &run, Some(&finest)).expect("measured");
        assert!((against(ErrorMeasure::Front) - 0.5).abs() < 1e-12);
        assert!((against(ErrorMeasure::Crest) - 0.2).abs() < 1e-12);
        assert!((against(ErrorMeasure::Energy) - 0.15).abs() < 1e-12);
        assert!((against(ErrorMeasure::Profile) - 0.25).abs() < 1e-12);
        assert!((against(ErrorMeasure::DensityP99) - 0.03).abs() < 1e-12);
        assert_eq!(of(ErrorMeasure::Crest, &run, None), None);
        assert_eq!(of(ErrorMeasure::Pressure, &run, None), None);
        // Against itself a run is off by nothing.
        assert_eq!(of(ErrorMeasure::Crest, &run, Some(&run)), Some(0.0));
    }
}
