//! Runs a variant of the scene (variant) and measures its difference from another.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use swell_domain::probe::run_up;
use swell_files::study::{
    RunsOn,
    tune::{Quantity, Tune, Variant},
};
use swell_scene::Scene;
use swell_stage::{
    drive::{ComputedFrame, Drive},
    prepare::Start,
};
use swell_study::measure::Gauge;

use super::super::{
    StudyError,
    engine::{Bench, until_done},
};

/// Approximate number of measured frames.
const SAMPLES: u32 = 24;

/// Least number of runs of a variant at the coarsest spacing: they are cheap, and the times of
/// settings depend on them.
const COARSE_REPEATS: u32 = 3;

/// Results of a variant.
pub(super) type TuneRun = super::super::run::Run<TuneMeasurements>;

/// Measurements besides the time.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(expecting = "struct Measured")]
pub(super) struct TuneMeasurements {
    /// Number of substeps over all frames.
    pub(super) substeps: u64,
    /// Number of iterations over all frames.
    pub(super) iterations: u64,
    /// Number of pressure solves that missed their tolerance.
    pub(super) missed: u32,
    /// Mean of max(0, ρ/ρ0 − 1) over particles and frames.
    pub(super) density: f64,
    /// Samples at equally spaced frames.
    pub(super) samples: Vec<Sample>,
}

/// Quantities of a frame that are compared between runs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Sample {
    /// Height of the crest above the still level, metres.
    crest: f64,
    /// Position of the front along the wave's path, metres.
    front: Option<f64>,
    /// Run-up height above the world's y = 0, metres.
    run_up: Option<f64>,
    /// Energy per mass, m²/s².
    energy: f64,
    /// Pressures at the probes, Pa; empty where not requested.
    pressures: Vec<Option<f64>>,
}

impl Sample {
    fn values(&self, of: Quantity) -> Vec<Option<f64>> {
        match of {
            Quantity::Crest => vec![Some(self.crest)],
            Quantity::Front => vec![self.front],
            Quantity::RunUp => vec![self.run_up],
            Quantity::Energy => vec![Some(self.energy)],
            Quantity::Pressure => self.pressures.clone(),
            Quantity::Density => Vec::new(),
        }
    }
}

impl TuneMeasurements {
    fn values(&self, of: Quantity) -> impl Iterator<Item = Option<f64>> {
        self.samples.iter().flat_map(move |s| s.values(of))
    }

    /// Value that 100 % of a quantity stands for: its greatest absolute value, and rest density for
    /// the density.
    pub(super) fn whole(&self, of: Quantity) -> Option<f64> {
        match of {
            Quantity::Density => Some(1.0),
            _ => self.values(of).flatten().map(f64::abs).reduce(f64::max),
        }
    }

    /// Error of a run: the mean difference from another run over the values that both have; the
    /// density error is by itself the difference from rest. Returns `None` where the run lacks more
    /// than half of the values of the other.
    pub(super) fn off(&self, of: Quantity, from: &Self) -> Option<f64> {
        if of == Quantity::Density {
            return Some(self.density);
        }
        let pairs = self.values(of).zip(from.values(of));
        let (sum, count) = pairs
            .filter_map(|(a, b)| Some((a? - b?).abs()))
            .fold((0.0, 0.0), |(sum, count), off| (sum + off, count + 1.0));
        let told = from.values(of).flatten().count();
        (told > 0 && 2.0 * count >= told as f64).then(|| sum / count)
    }
}

/// Number of runs of a variant.
pub(super) fn repeats(tune: &Tune, variant: &Variant) -> u32 {
    match variant.spacing() >= tune.ladder[0].spacing() {
        true => tune.request.repeats.max(COARSE_REPEATS),
        false => tune.request.repeats,
    }
}

/// Number of frames from one measured frame to the next.
pub(super) fn stride(frames: u32) -> u32 {
    (frames / SAMPLES).max(1)
}

/// Runs a variant as often as its timing needs, each time from the scene's start, after one warm-up
/// frame that prepares the device's programs.
pub(super) fn measure(
    bench: &Bench<'_>,
    tune: &Tune,
    variant: &Variant,
    gauge: &Gauge,
) -> Result<TuneRun, StudyError> {
    let scene = &variant.scene;
    let start = Start::of(scene)?;
    let mut drive = Drive::new(bench.devices.of(RunsOn::Gpu), scene, &start, false)?;
    if tune.has_pressure() {
        drive = drive.with_pressures();
    }
    drive.advance()?;
    let mut run = TuneRun {
        particles: start.particles.len(),
        frames: tune.frames,
        ..TuneRun::default()
    };
    for repeat in 0..repeats(tune, variant) {
        drive.load(0, &start.particles)?;
        let mut seconds = 0.0;
        until_done(&mut drive, tune.frames, bench.stop, |step| {
            seconds += step.seconds;
            // Later repeats compute the same steps; only their times are new.
            if repeat == 0 {
                run.measured.look(scene, gauge, tune.frames, step);
            }
            Ok(())
        })?;
        run.seconds.push(seconds);
    }
    run.measured.density /= f64::from(tune.frames);
    Ok(run)
}

impl TuneMeasurements {
    fn look(&mut self, scene: &Scene, gauge: &Gauge, frames: u32, step: ComputedFrame) {
        self.substeps += u64::from(step.report.substeps);
        self.iterations += step.report.iterations;
        self.density += step.report.density_error_mean;
        self.missed += step.report.projection.map_or(0, |p| p.missed);
        if step.frame.is_multiple_of(stride(frames)) {
            self.samples.push(sample(scene, gauge, step));
        }
    }
}

fn sample(scene: &Scene, gauge: &Gauge, step: ComputedFrame) -> Sample {
    let (particles, spacing) = (&*step.particles.water(), scene.particle_spacing());
    // With a density of 1 and the lattice's particle masses, energy over volume is energy per mass.
    let gravity: DVec3 = scene.water.gravity;
    let sums = gauge.aggregates(particles, spacing, 1.0, gravity);
    let volume = particles.len().max(1) as f64 * spacing.powi(3);
    Sample {
        crest: sums.crest_height,
        front: sums.front,
        run_up: run_up(particles, spacing, 1.0),
        energy: (sums.kinetic_energy + sums.potential_energy) / volume,
        pressures: step.pressures,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(
        crest: [f64; 2],
        front: [Option<f64>; 2],
        pressures: [[Option<f64>; 2]; 2],
    ) -> TuneMeasurements {
        let sample = |k: usize| Sample {
            crest: crest[k],
            front: front[k],
            pressures: pressures[k].to_vec(),
            ..Sample::default()
        };
        TuneMeasurements {
            density: crest[0] / 100.0,
            samples: vec![sample(0), sample(1)],
            ..TuneMeasurements::default()
        }
    }

    #[test]
    fn runs_are_as_far_apart_as_by_hand() {
        let none = [[None; 2]; 2];
        let probes = [[Some(100.0), None], [Some(50.0), Some(20.0)]];
        let other = [[Some(110.0), Some(7.0)], [Some(70.0), Some(26.0)]];
        let a = run([1.0, 2.0], [Some(3.0), None], probes);
        let b = run([1.5, 1.9], [Some(2.0), Some(9.0)], other);
        let close = |value: Option<f64>, expected: f64| {
            assert!((value.expect("told") - expected).abs() < 1e-12, "{value:?}");
        };
        close(a.off(Quantity::Crest, &b), 0.3);
        close(a.off(Quantity::Front, &b), 1.0);
        let three = run(
            [1.0; 2],
            [Some(1.0); 2],
            [[Some(1.0), Some(1.0)], [Some(1.0), None]],
        );
        let one = run(
            [1.0; 2],
            [None, Some(1.0)],
            [[Some(1.0), None], [None, None]],
        );
        close(one.off(Quantity::Front, &three), 0.0);
        assert_eq!(one.off(Quantity::Pressure, &three), None, "one of three");
        // 10, 20 and 6; where one probe has no reading, the others count.
        close(a.off(Quantity::Pressure, &b), 12.0);
        close(a.off(Quantity::Density, &b), 0.01);
        close(b.whole(Quantity::Front), 9.0);
        close(b.whole(Quantity::Pressure), 110.0);
        close(b.whole(Quantity::Density), 1.0);
        let dry = run([1.0, 2.0], [None, None], none);
        assert_eq!(dry.off(Quantity::Front, &b), None);
        assert_eq!(dry.whole(Quantity::Front), None);
        assert_eq!(a.off(Quantity::Crest, &a), Some(0.0));
        assert_eq!((stride(7), stride(120)), (1, 5));
    }
}
