//! Data of each frame that a benchmark needs.

use glam::{DVec2, DVec3, Vec3};

use swell_cache::ProbeValues;
use swell_domain::{
    body::BodyState,
    particles::Particles,
    probe::{elevation, front, run_up_across, volume as volume_of},
};
use swell_files::study::validation::{Benchmark, Measure};
use swell_scene::{Scene, probe::ProbeKind};
use swell_stage::drive::ComputedFrame;

use super::{beach, ship_waves};

/// Fraction of the water behind the front, so that single particles running ahead do not count.
const FRONT: f64 = 0.995;

/// Width of the bins in which depths over a dry bed are measured, over the depth of the reservoir.
/// At the kink of the profile, the mean over a bin is off by 0.4 % of that depth at T = 6.
const BIN: f64 = 0.25;

/// Data of a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct FrameRecord {
    /// Time in seconds of the shot.
    pub(super) time: f64,
    /// Largest speed of a particle, m/s.
    pub(super) speed: f64,
    /// Readings of the elevation probes, metres above the domain's floor.
    pub(super) levels: Vec<Option<f64>>,
    /// Readings of the pressure probes, Pa.
    pub(super) pressures: Vec<Option<f64>>,
    /// Force along x at the force probe, N; `None` at the start.
    pub(super) force: Option<f64>,
    /// Highest water connected to the body, metres above the domain's floor; `None` without a
    /// run-up probe.
    pub(super) run_up: Option<f64>,
    /// Values that the measure takes from the particles.
    pub(super) of_water: Vec<f64>,
    /// States of the bodies.
    pub(super) bodies: Vec<BodyState>,
}

/// Data of all frames of a run.
pub(super) struct Record<'a> {
    pub(super) benchmark: &'a Benchmark,
    pub(super) scene: &'a Scene,
    /// Frames, beginning with the initial state.
    pub(super) rows: Vec<FrameRecord>,
    /// Number of substeps over all frames.
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
        let row = FrameRecord {
            levels: record.levels(start),
            pressures: vec![None; scene.pressure_points().len()],
            of_water: record.of_water(0.0, start),
            bodies: start.bodies.clone(),
            ..FrameRecord::default()
        };
        record.rows.push(row);
        record
    }

    /// Adds a frame.
    pub(super) fn look(&mut self, step: &ComputedFrame) {
        self.substeps += step.report.substeps;
        let water = step.particles.water();
        let time = f64::from(step.frame) * self.scene.shot.frame_seconds();
        self.rows.push(FrameRecord {
            time,
            speed: step.report.max_speed,
            levels: self.levels(&water),
            pressures: step.pressures.clone(),
            force: self.force(&step.looks),
            run_up: self.run_up(&water),
            of_water: self.of_water(time, &water),
            bodies: step.particles.bodies.clone(),
        });
    }

    /// Positions of the elevation probes, metres from the domain's least corner.
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

    /// Returns how high the water reaches that is connected to the body: over half of the flume's
    /// width, which is along z.
    fn run_up(&self, particles: &Particles) -> Option<f64> {
        let mut probes = self.scene.probes.iter();
        probes.find(|probe| matches!(probe.kind, ProbeKind::RunUp { .. }))?;
        let (domain, spacing) = (&self.scene.domain, self.scene.particle_spacing());
        let sides = [domain.min.z, domain.max.z];
        Some(run_up_across(particles, spacing, sides)? - domain.min.y)
    }

    /// Number of frames in a tenth of a second.
    fn every(&self) -> usize {
        ((0.1 * self.scene.shot.frames_per_second).round() as usize).max(1)
    }

    fn of_water(&self, time: f64, particles: &Particles) -> Vec<f64> {
        let (domain, scale) = (&self.scene.domain, self.benchmark.scale);
        let along = || {
            particles
                .position
                .iter()
                .map(|p| f64::from(p[0]) - domain.min.x)
        };
        let volume = self.scene.particle_spacing().powi(3);
        match self.benchmark.measure {
            // Largest speed between the paddle and the last gauge, because waves double when they
            // reflect at the far wall.
            Measure::RegularWaves => {
                let last = self.gauges().iter().map(|at| at.x).fold(0.0, f64::max);
                let speed = |v: &[f32; 3]| Vec3::from_array(*v).as_dvec3().length();
                let both = along().zip(&particles.velocity);
                let seen = both.filter(|(x, _)| *x <= last);
                vec![seen.map(|(_, v)| speed(v)).fold(0.0, f64::max)]
            }
            Measure::SolitaryBeach => beach::profile(self, time, particles),
            Measure::ShipWaves if self.rows.len().is_multiple_of(self.every()) => {
                ship_waves::elevations(self, time, particles)
            }
            // Position of the front.
            Measure::DamBreak => {
                let spacing = self.scene.particle_spacing();
                let front = front(particles, spacing, 0, 1.0, FRONT);
                front.map(|x| x - domain.min.x).into_iter().collect()
            }
            // Depths of bins along x from the particles' volumes; narrower bins would resolve the
            // rows of particles.
            Measure::DryBed => {
                let bins = (domain.size().x / (BIN * scale.depth)).round();
                let area = domain.size().x / bins * domain.size().z;
                let mut depths = vec![0.0; bins as usize];
                for x in along() {
                    // Divided between the two nearest bins, so that a row of particles does not
                    // cross a boundary at once.
                    let place = (x / domain.size().x * bins - 0.5).clamp(0.0, bins - 1.0);
                    let (bin, part) = (place as usize, place.fract());
                    depths[bin] += (1.0 - part) * volume / area;
                    if let Some(next) = depths.get_mut(bin + 1) {
                        *next += part * volume / area;
                    }
                }
                depths
            }
            // The volume, ten times per second because it takes as long as a frame.
            Measure::BlockImpact if self.rows.len().is_multiple_of(self.every()) => {
                vec![volume_of(particles, self.scene.particle_spacing(), domain)]
            }
            // 2/L ∫ η cos kx dx. As water keeps its volume, ∫ η cos kx dx is the integral of cos kx
            // over all of it.
            Measure::StandingWave => {
                let k = std::f64::consts::TAU / scale.length;
                let sum: f64 = along().map(|x| (k * x).cos()).sum();
                vec![2.0 * sum * volume / (scale.length * domain.size().z)]
            }
            Measure::TaylorGreen => {
                let square = |v: &[f32; 3]| v.iter().map(|v| f64::from(*v).powi(2)).sum::<f64>();
                vec![particles.velocity.iter().map(square).sum()]
            }
            // The momentum of the water, kg m/s, or its mean velocity, m/s.
            Measure::Body | Measure::Slide => {
                let all = particles.velocity.iter();
                let sum: DVec3 = all.map(|v| Vec3::from_array(*v).as_dvec3()).sum();
                let of_sum = match self.benchmark.measure {
                    Measure::Body => self.scene.water.rest_density * volume,
                    _ => 1.0 / particles.len() as f64,
                };
                (of_sum * sum).to_array().into()
            }
            _ => Vec::new(),
        }
    }
}
