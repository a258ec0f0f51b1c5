//! Measurements of a sweep's points, and the errors derived from them.

use serde::{Deserialize, Serialize};

use swell_files::study::sweep::ErrorMeasure;

/// Results of a point of a sweep.
pub(super) type SweepRun = super::super::Run<SweepMeasurements>;

/// Measurements besides the time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(expecting = "struct Measured")]
pub(super) struct SweepMeasurements {
    /// Number of substeps over all frames.
    pub(super) substeps: u64,
    /// Number of iterations over all frames.
    pub(super) iterations: u64,
    /// Machine-independent cost over all frames: neighbour visits or matrix-vector products.
    pub(super) work: f64,
    /// Number of pressure solves that missed their tolerance.
    pub(super) missed: u32,
    /// Mean, 99th percentile and maximum of max(0, ρ/ρ0 − 1) at the end of each frame.
    pub(super) density: Vec<[f64; 3]>,
    /// Speed of the fastest particle in each frame, m/s.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) speed: Vec<f64>,
    /// Mean of |p / (ρ g depth) − 1| over the probes with a reading, for each frame, where
    /// requested.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub(super) weight: Vec<Option<f64>>,
    /// Samples at equally spaced times, where runs are compared with the finest one.
    pub(super) samples: Vec<Sample>,
    /// RMS displacement of the particles from the end to converged constraints, in spacings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) distance: Option<f64>,
    /// Errors of a projection.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) projection: Option<ProjectionErrors>,
}

/// Quantities of a frame that are compared between runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sample {
    /// Height of the crest above the still level, metres.
    pub(super) crest: f64,
    /// Position of the front along the wave's path, metres.
    pub(super) front: Option<f64>,
    /// Energy per mass, m²/s².
    pub(super) energy: f64,
    /// Elevation along the wave's path, metres.
    pub(super) profile: Vec<f64>,
}

/// Errors of a projection compared with the exact solution of its system.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct ProjectionErrors {
    /// ‖p − p64‖ / ‖p64‖.
    pub(super) pressure: f64,
    /// ‖u − u64‖ / ‖u64‖.
    pub(super) velocity: f64,
    /// Largest |∇·u| Δt.
    pub(super) divergence: f64,
    /// ‖b − Ap‖ / ‖b‖ as the device reports it.
    pub(super) residual: f64,
    /// Number of rows of the system.
    pub(super) rows: usize,
    /// ‖b − Ap64‖ / ‖b‖ of the exact solution.
    pub(super) exact_residual: f64,
    /// Whether the exact solution comes from a sparse Cholesky factor rather than conjugate
    /// gradients.
    pub(super) has_factor: bool,
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (mut sum, mut count) = (0.0, 0);
    for value in values {
        sum += value;
        count += 1;
    }
    (count > 0).then(|| sum / f64::from(count))
}

/// Error of a run, compared with `finest` where the measure needs it; `None` where it was not
/// measured.
pub(super) fn error(
    of: ErrorMeasure,
    run: &SweepMeasurements,
    finest: Option<&SweepMeasurements>,
) -> Option<f64> {
    let density = |k: usize| mean(run.density.iter().map(move |frame| frame[k]));
    let against = |difference: fn(&Sample, &Sample) -> Option<f64>| {
        let pairs = run.samples.iter().zip(&finest?.samples);
        mean(pairs.filter_map(|(sample, fine)| difference(sample, fine)))
    };
    let late = |frames: usize| frames.div_ceil(2);
    match of {
        ErrorMeasure::TopSpeed => {
            let speeds = run.speed[late(run.speed.len())..].iter().copied();
            speeds.reduce(f64::max)
        }
        // Without a reading in every frame there is no mean.
        ErrorMeasure::Weight => {
            let weights = &run.weight[late(run.weight.len())..];
            let all: Option<Vec<f64>> = weights.iter().copied().collect();
            mean(all?.into_iter())
        }
        ErrorMeasure::DensityMean => density(0),
        ErrorMeasure::DensityP99 => density(1),
        ErrorMeasure::DensityMax => density(2),
        ErrorMeasure::Crest => against(|a, b| Some((a.crest - b.crest).abs())),
        ErrorMeasure::Front => against(|a, b| Some((a.front? - b.front?).abs())),
        ErrorMeasure::Energy => against(|a, b| Some((a.energy / b.energy - 1.0).abs())),
        ErrorMeasure::Profile => against(|a, b| {
            let pairs = a.profile.iter().zip(&b.profile);
            mean(pairs.map(|(a, b)| (a - b).powi(2))).map(f64::sqrt)
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
        let run = SweepMeasurements {
            samples: vec![
                sample(Some(1.0), 0.5, 9.0, 1.0),
                sample(None, 0.7, 8.0, 1.5),
            ],
            density: vec![[0.01, 0.02, 0.3], [0.03, 0.04, 0.5]],
            speed: vec![9.0, 5.0, 1.0, 2.0],
            weight: vec![Some(0.9), None, Some(0.1), Some(0.3)],
            ..SweepMeasurements::default()
        };
        let finest = SweepMeasurements {
            samples: vec![
                sample(Some(1.5), 0.4, 10.0, 1.2),
                sample(Some(2.0), 0.4, 10.0, 1.2),
            ],
            ..SweepMeasurements::default()
        };
        let against = |of| error(of, &run, Some(&finest)).expect("measured");
        assert!((against(ErrorMeasure::Front) - 0.5).abs() < 1e-12);
        assert!((against(ErrorMeasure::Crest) - 0.2).abs() < 1e-12);
        assert!((against(ErrorMeasure::Energy) - 0.15).abs() < 1e-12);
        assert!((against(ErrorMeasure::Profile) - 0.25).abs() < 1e-12);
        assert!((against(ErrorMeasure::DensityP99) - 0.03).abs() < 1e-12);
        assert_eq!(error(ErrorMeasure::TopSpeed, &run, None), Some(2.0));
        let weight = error(ErrorMeasure::Weight, &run, None).expect("measured");
        assert!((weight - 0.2).abs() < 1e-12);
        assert_eq!(error(ErrorMeasure::Weight, &finest, None), None);
        assert_eq!(error(ErrorMeasure::Crest, &run, None), None);
        assert_eq!(error(ErrorMeasure::Pressure, &run, None), None);
        // Compared with itself, a run has no error.
        assert_eq!(error(ErrorMeasure::Crest, &run, Some(&run)), Some(0.0));
    }
}
