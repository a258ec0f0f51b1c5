//! `[budget]`: limits on a bake, which stops where one is exceeded.

use super::{Scene, words::shown};
use swell_domain::{
    absorber::AbsorberStates,
    budget::{Breach, Watched},
    solver::StepReport,
};

/// Limits of a bake; `None` disables a limit. None of them affects the physics.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Budget {
    /// Largest speed of a particle at the end of a frame, m/s.
    pub speed: Option<f64>,
    /// Largest ratio of the fastest particle's speed after a frame to the speed that gravity,
    /// forces, effects and moving boundaries explain.
    pub speed_jump: Option<f64>,
    /// Mean of max(0, ρ/ρ0 − 1) at the end of a frame.
    pub density_error_mean: Option<f64>,
    /// 99th percentile of the same.
    pub density_error_p99: Option<f64>,
    /// Maximum of the same.
    pub density_error_max: Option<f64>,
    /// Fraction of particle updates, over all substeps, that were clamped to the displacement cap.
    pub capped: Option<f64>,
    /// Relative true residual of a projection; checked for FLIP only, like `divergence`.
    pub residual: Option<f64>,
    /// Largest |∇·u| Δt in a water cell after a projection.
    pub divergence: Option<f64>,
    /// |V/V0 − 1|, where V0 is the volume at the start.
    pub volume: Option<f64>,
    /// Increase of the total energy within a frame beyond the work of walls, solids and forces,
    /// relative to the total: kinetic energy plus potential energy above the lowest point of the
    /// domain.
    pub energy: Option<f64>,
    /// Number of particles at the end of a frame.
    pub particles: Option<f64>,
}

/// Default with FLIP. A breaking dam and a wave that hits a wall reach 2, a leak in still
/// water 20 or more.
pub const SPEED_JUMP: f64 = 8.0;

/// Speed of the front of a column that is let go over that of a fall from its top: 2 √(g h) over
/// √(2 g h) (Ritter 1892).
const THROWN_OVER_FALLEN: f64 = std::f64::consts::SQRT_2;

/// Speed whose kinetic energy is added to the total, spacings per frame, so that water
/// at rest may stir.
const LEAST_ENERGY_SPEED: f64 = 0.1;

/// State before a frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Before {
    /// Total energy as returned by [`Scene::total_energy`], J.
    pub energy: f64,
    /// Speed of the fastest particle, m/s.
    pub speed: f64,
    /// Volume at the start of the bake, m³, if the volume is watched.
    pub start_volume: Option<f64>,
}

impl Budget {
    /// Compares the number of particles after frame `frame` with its limit.
    ///
    /// # Errors
    /// If it is exceeded.
    pub fn check_count(&self, frame: u32, particles: usize) -> Result<(), Breach> {
        Breach::check(frame, Watched::Count, particles as f64, self.particles)
    }

    /// Compares a projection over `length` seconds with its limits; `divergence` is the largest
    /// |∇·u| after it, 1/s.
    ///
    /// # Errors
    /// For the first limit exceeded. NaN exceeds every limit.
    pub fn check_projection(
        &self,
        frame: u32,
        substep: u32,
        residual: f64,
        divergence: f64,
        length: f64,
    ) -> Result<(), Breach> {
        Breach::check(frame, Watched::Residual, residual, self.residual)
            .and_then(|()| {
                let change = divergence * length;
                Breach::check(frame, Watched::Divergence, change, self.divergence)
            })
            .map_err(|breach| breach.in_substep(substep))
    }

    /// Compares the report of a frame with `particles` particles with the limits and with the
    /// state before it.
    ///
    /// # Errors
    /// For the first limit exceeded.
    pub fn check_frame(
        &self,
        scene: &Scene,
        frame: u32,
        particles: usize,
        report: &StepReport,
        before: &Before,
    ) -> Result<(), Breach> {
        let &Before {
            energy,
            speed,
            start_volume,
        } = before;
        let check = |watched, measured, limit| Breach::check(frame, watched, measured, limit);
        check(Watched::Speed, report.max_speed, self.speed)?;
        if let Some(times) = self.speed_jump {
            let reached = scene.reached_speed(frame, speed);
            let fallen = scene.fallen_speed(speed, energy, particles);
            let of_fall = THROWN_OVER_FALLEN * fallen / SPEED_JUMP;
            let limit = times * reached.max(of_fall);
            check(Watched::SpeedJump, report.max_speed, Some(limit)).map_err(|breach| {
                let detail = format!(
                    "{} times the larger of {reached:.4} m/s, which gravity, effects and walls can \
                     bring {speed:.4} m/s of the fastest before to, and {of_fall:.4} m/s, an \
                     eighth of the front's of a column twice as high as the water's mean",
                    shown(times),
                );
                Breach {
                    detail: Some(detail),
                    ..breach
                }
            })?;
        }
        check(
            Watched::DensityErrorMean,
            report.density_error_mean,
            self.density_error_mean,
        )?;
        check(
            Watched::DensityErrorP99,
            report.density_error_p99,
            self.density_error_p99,
        )?;
        check(
            Watched::DensityErrorMax,
            report.density_error_max,
            self.density_error_max,
        )?;
        let runs = particles.max(1) as f64 * f64::from(report.substeps.max(1));
        check(Watched::Capped, report.capped as f64 / runs, self.capped)?;
        if let (Some(volume), Some(start)) = (report.volume, start_volume)
            && start > 0.0
        {
            check(Watched::Volume, (volume / start - 1.0).abs(), self.volume)?;
        }
        if particles == 0 {
            return Ok(());
        }
        let rise = scene.total_energy(particles, report) - energy - report.boundary_work;
        let scale = scene.energy_scale(particles, energy, report.boundary_work);
        check(Watched::Energy, rise / scale, self.energy)
    }
}

impl Scene {
    /// Bounds the speed that gravity, forces, effects and moving boundaries give in frame `frame`
    /// to a particle of `speed`, m/s; at least a tenth of a spacing per frame. What absorbing walls
    /// add to their own motion is not included; bodies count as they are at the start.
    pub fn reached_speed(&self, frame: u32, speed: f64) -> f64 {
        let length = self.shot.frame_seconds();
        let start = f64::from(frame.saturating_sub(1)) * length;
        let push = self.peak_boundary_speed(&AbsorberStates::default(), &[], start, start + length);
        let least = LEAST_ENERGY_SPEED * self.particle_spacing() / length;
        // The first substep also has what acted in the second half of the one before.
        let pull = self.most_acceleration(start - 0.5 * length, start + length);
        let jump = self.jump_of_domain(start - 0.5 * length, start + length);
        let gained = pull * length + jump + self.effects.push().gained(length);
        (speed + push + gained + self.effects.frees(self.grain())).max(least)
    }

    /// Bounds the speed of a particle of `speed` after a fall from twice the water's mean height,
    /// which is the top of a column, m/s. In a long frame or a high column its foot reaches that
    /// speed within a frame. `energy` is kinetic and potential, J.
    fn fallen_speed(&self, speed: f64, energy: f64, particles: usize) -> f64 {
        let mass = self.particle_mass() * particles.max(1) as f64;
        (speed * speed + 4.0 * energy.max(0.0) / mass).sqrt()
    }

    /// Returns the kinetic and potential energy of `particles` particles, J; the potential energy
    /// is relative to the lowest point of the domain.
    pub fn total_energy(&self, particles: usize, report: &StepReport) -> f64 {
        let mass = self.particle_mass() * particles as f64;
        let (gravity, size) = (self.water.gravity, self.domain.size());
        let lowest: f64 = (0..3).map(|k| (-gravity[k] * size[k]).min(0.0)).sum();
        report.kinetic_energy + report.potential_energy - mass * lowest
    }

    /// Returns the largest energy allowed at the end of a frame that begins with `energy` and in
    /// which `work` is done, J; `limit` is the budget.
    pub fn allowed_energy(&self, particles: usize, energy: f64, work: f64, limit: f64) -> f64 {
        energy + work + limit * self.energy_scale(particles, energy, work)
    }

    /// Scale of a relative increase of energy, J. A small term is added so that water at rest on
    /// the floor may stir.
    fn energy_scale(&self, particles: usize, energy: f64, work: f64) -> f64 {
        let speed = LEAST_ENERGY_SPEED * self.particle_spacing() * self.shot.frames_per_second;
        let least = 0.5 * self.particle_mass() * particles as f64 * speed * speed;
        energy + work.abs() + least
    }

    /// Returns the mass of a particle, kg.
    pub fn particle_mass(&self) -> f64 {
        self.water.rest_density * self.particle_spacing().powi(3)
    }
}
