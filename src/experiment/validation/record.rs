//! What a benchmark keeps of each frame.

use glam::{DVec2, Vec3};

use swell_cache::ProbeValues;
use swell_domain::{
    particles::Particles,
    probe::{elevation, front, volume as volume_of},
};
use swell_scene::{
    Scene,
    probe::ProbeKind,
    study::validation::{Benchmark, Measure},
};
use swell_stage::drive::Step;

/// Part of the water that a front leaves behind: single particles that run ahead are none.
const FRONT: f64 = 0.995;

/// Width of the bins that a depth over a dry bed is taken from, over the depth of the reservoir. Where the profile has its
/// kink, a mean over it is 0.4 % of that depth off at T = 6.
const BIN: f64 = 0.25;

/// A frame.
#[derive(Clone, Debug, Default)]
pub(super) struct Row {
    /// Seconds of the shot.
    pub(super) time: f64,
    /// Largest speed of a particle, m/s.
    pub(super) speed: f64,
    /// At the probes of elevation, metres above the domain's floor.
    pub(super) levels: Vec<Option<f64>>,
    /// At the probes of pressure, Pa.
    pub(super) pressures: Vec<Option<f64>>,
    /// Along x at the probe of force, N; the start has none.
    pub(super) force: Option<f64>,
    /// What the measure takes from the particles.
    pub(super) of_water: Vec<f64>,
}

/// Frames of a run.
pub(super) struct Record<'a> {
    pub(super) benchmark: &'a Benchmark,
    pub(super) scene: &'a Scene,
    /// The start first.
    pub(super) rows: Vec<Row>,
    /// Of all frames.
    pub(super) substeps: u32,
}

impl<'a> Record<'a> {
    pub(super) fn new(benchmark: &'a Benchmark, scene: &'a Scene, start: &Particles) -> Self {
        let mut record = Self {
            benchmark,
            scene,
            rows: Vec::new(),
            substeps: 0,
        };
        let row = Row {
            levels: record.levels(start),
            pressures: vec![None; scene.pressure_points().len()],
            of_water: record.of_water(start),
            ..Row::default()
        };
        record.rows.push(row);
        record
    }

    /// After each frame.
    pub(super) fn look(&mut self, step: &Step) {
        self.substeps += step.report.substeps;
        self.rows.push(Row {
            time: f64::from(step.frame) * self.scene.shot.frame_seconds(),
            speed: step.report.max_speed,
            levels: self.levels(&step.particles),
            pressures: step.pressures.clone(),
            force: self.force(&step.looks),
            of_water: self.of_water(&step.particles),
        });
    }

    /// Places of the probes of elevation, metres from the domain's least corner.
    pub(super) fn gauges(&self) -> Vec<DVec2> {
        let corner = DVec2::new(self.scene.domain.min.x, self.scene.domain.min.z);
        let probes = self.scene.probes.iter();
        let gauges = probes.filter_map(|probe| match probe.kind {
            ProbeKind::Elevation { at } => Some(at - corner),
            _ => None,
        });
        gauges.collect()
    }

    fn levels(&self, particles: &Particles) -> Vec<Option<f64>> {
        let (domain, spacing) = (&self.scene.domain, self.scene.particle_spacing());
        let probes = self.scene.probes.iter();
        let levels = probes.filter_map(|probe| match probe.kind {
            ProbeKind::Elevation { at } => Some(elevation(particles, spacing, domain, at)),
            _ => None,
        });
        levels.map(|level| Some(level? - domain.min.y)).collect()
    }

    fn force(&self, looks: &ProbeValues) -> Option<f64> {
        let mut probes = self.scene.probes.iter();
        let probe = probes.position(|probe| matches!(probe.kind, ProbeKind::Force { .. }))?;
        *looks.get(probe)?.first()?
    }

    /// Frames of a tenth of a second.
    fn every(&self) -> usize {
        ((0.1 * self.scene.shot.frames_per_second).round() as usize).max(1)
    }

    fn of_water(&self, particles: &Particles) -> Vec<f64> {
        let (domain, scale) = (&self.scene.domain, self.benchmark.scale);
        let along = || {
            particles
                .position
                .iter()
                .map(|p| f64::from(p[0]) - domain.min.x)
        };
        let volume = self.scene.particle_spacing().powi(3);
        match self.benchmark.measure {
            // The largest speed between the paddle and the last gauge: at the far wall waves double as they turn.
            Measure::RegularWaves => {
                let last = self.gauges().iter().map(|at| at.x).fold(0.0, f64::max);
                let speed = |v: &[f32; 3]| Vec3::from_array(*v).as_dvec3().length();
                let both = along().zip(&particles.velocity);
                let seen = both.filter(|(x, _)| *x <= last);
                vec![seen.map(|(_, v)| speed(v)).fold(0.0, f64::max)]
            }
            // The front.
            Measure::DamBreak => {
                let spacing = self.scene.particle_spacing();
                let front = front(particles, spacing, 0, 1.0, FRONT);
                front.map(|x| x - domain.min.x).into_iter().collect()
            }
            // Depths of bins along x, from particles' volumes; narrower bins see the rows of particles.
            Measure::DryBed => {
                let bins = (domain.size().x / (BIN * scale.depth)).round();
                let area = domain.size().x / bins * domain.size().z;
                let mut depths = vec![0.0; bins as usize];
                for x in along() {
                    // Shared by the two bins about it, so that a row of particles does not go over at once.
                    let place = (x / domain.size().x * bins - 0.5).clamp(0.0, bins - 1.0);
                    let (bin, part) = (place as usize, place.fract());
                    depths[bin] += (1.0 - part) * volume / area;
                    if let Some(next) = depths.get_mut(bin + 1) {
                        *next += part * volume / area;
                    }
                }
                depths
            }
            // The volume, which takes as long as a frame: ten times a second.
            Measure::BlockImpact if self.rows.len().is_multiple_of(self.every()) => {
                vec![volume_of(particles, self.scene.particle_spacing(), domain)]
            }
            // 2/L ∫ η cos kx dx: of water that keeps its volume ∫ η cos kx dx is that of cos kx over all of it.
            Measure::StandingWave => {
                let k = std::f64::consts::TAU / scale.length;
                let sum: f64 = along().map(|x| (k * x).cos()).sum();
                vec![2.0 * sum * volume / (scale.length * domain.size().z)]
            }
            Measure::TaylorGreen => {
                let square = |v: &[f32; 3]| v.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
                vec![particles.velocity.iter().map(square).sum()]
            }
            _ => Vec::new(),
        }
    }
}
