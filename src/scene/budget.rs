//! `[budget]`: limits on a bake, which stops where one is exceeded.

use serde::{Deserialize, Deserializer};

use super::{Method, Scene, Shot, Solver, document::Document, error::SceneError, words::shown};
use swell_domain::{
    budget::{Breach, Watched},
    solver::StepReport,
};

/// Limits of a bake; `None` disables a limit. None of them affects the physics.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Budget {
    /// Largest speed of a particle at the end of a frame, m/s.
    pub speed: Option<f64>,
    /// Largest ratio of the fastest particle's speed after a frame to the speed that gravity,
    /// effects and moving boundaries explain.
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
    /// Increase of the total energy within a frame beyond the work of walls and solids, relative to
    /// the total: kinetic energy plus potential energy above the lowest point of the domain.
    pub energy: Option<f64>,
    /// Number of particles at the end of a frame.
    pub particles: Option<f64>,
}

/// Defaults that depend on the scene; the others are in the table of keys.
const SPEED: f64 = 4.0;
const RESIDUAL: f64 = 1e-2;
/// Boundary work misses what a wall does to the drops that it overtakes without pressure: 6 % of a
/// frame in the small box of tests/hard_cases/24-leaving.toml, 0.1 % in the quickstart.
const FLIP_ENERGY: f64 = 0.1;
/// With few corrections and long frames PBF creates energy: 4 % per frame in the quickstart, 7 %
/// with Chebyshev's iteration.
const PBF_ENERGY: f64 = 0.25;

/// Default with FLIP. Splashes of the shipped scenes reach 0.9, water that leaked along a wall 24.
const DENSITY_ERROR_MAX: f64 = 4.0;

/// Default with FLIP. A breaking dam and a wave that hits a wall reach 2, a leak in still
/// water 20 or more.
const SPEED_JUMP: f64 = 8.0;

/// Least default speed limit, spacings per frame, for scenes without gravity or moving walls.
const LEAST_SPEED: f64 = 10.0;

/// Speed whose kinetic energy is added to the total, spacings per frame, so that water
/// at rest may stir.
const LEAST_ENERGY_SPEED: f64 = 0.1;

/// Describes the default of `budget.speed`.
pub(super) fn speed_words() -> String {
    format!(
        "{SPEED} (√(2 g × the domain's diagonal) + the fastest wall or moving solid), at least \
         {LEAST_SPEED} spacings a frame"
    )
}

pub(super) fn speed_jump_words() -> String {
    format!("false with pbf, {SPEED_JUMP:?} with flip")
}

pub(super) fn density_error_max_words() -> String {
    format!("false with pbf, {DENSITY_ERROR_MAX:?} with flip")
}

pub(super) fn residual_words() -> String {
    format!("{RESIDUAL}, or the tolerance where that is larger")
}

pub(super) fn energy_words() -> String {
    format!(
        "{PBF_ENERGY} with pbf, {FLIP_ENERGY} with flip, false in a wind or with surface tension"
    )
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BudgetSpec {
    speed: Option<Limit>,
    speed_jump: Option<Limit>,
    density_error_mean: Limit,
    density_error_p99: Limit,
    density_error_max: Option<Limit>,
    capped: Limit,
    residual: Option<Limit>,
    divergence: Limit,
    volume: Limit,
    energy: Option<Limit>,
    particles: Limit,
}

#[derive(Clone, Copy)]
struct Limit(Option<f64>);

impl<'de> Deserialize<'de> for Limit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Written {
            Off(#[expect(dead_code, reason = "only `false` is allowed")] bool),
            Limit(f64),
        }
        Ok(Self(match Written::deserialize(deserializer)? {
            Written::Off(_) => None,
            Written::Limit(limit) => Some(limit),
        }))
    }
}

/// Speeds that a scene causes by itself, m/s, and its particle spacing, metres.
pub(super) struct Scales {
    pub(super) fall: f64,
    pub(super) push: f64,
    /// Wind and other effects whose work is not counted.
    pub(super) wind: f64,
    pub(super) spacing: f64,
}

/// Builds the limits for the chosen solver.
pub(super) fn build(
    doc: &Document<'_>,
    spec: &BudgetSpec,
    shot: &Shot,
    solver: &Solver,
    scales: &Scales,
) -> Result<Budget, SceneError> {
    let tolerance = (solver.flip.as_ref()).map_or(0.0, |flip| flip.pressure.tolerance);
    let slowest = LEAST_SPEED * scales.spacing * shot.frames_per_second;
    let speed = (SPEED * (scales.fall + scales.push + scales.wind)).max(slowest);
    let energy = match solver.method {
        Method::Pbf => PBF_ENERGY,
        Method::Flip => FLIP_ENERGY,
    };
    let energy = (scales.wind == 0.0).then_some(energy);
    let of_flip = |limit: f64| (solver.method == Method::Flip).then_some(limit);
    let residual = match spec.residual {
        Some(Limit(Some(limit))) if limit < tolerance => {
            let problem = format!("{} is out of range", shown(limit));
            return Err(doc.fault_of("budget.residual", problem));
        }
        Some(Limit(limit)) => limit,
        None => Some(RESIDUAL.max(tolerance)),
    };
    Ok(Budget {
        speed: spec.speed.map_or(Some(speed), |limit| limit.0),
        speed_jump: spec.speed_jump.map_or(of_flip(SPEED_JUMP), |limit| limit.0),
        density_error_mean: spec.density_error_mean.0,
        density_error_p99: spec.density_error_p99.0,
        density_error_max: (spec.density_error_max)
            .map_or(of_flip(DENSITY_ERROR_MAX), |limit| limit.0),
        capped: spec.capped.0,
        residual,
        divergence: spec.divergence.0,
        volume: spec.volume.0,
        energy: spec.energy.map_or(energy, |limit| limit.0),
        particles: spec.particles.0,
    })
}

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
    /// Returns each limit with its quantity, in the order of the table of keys.
    pub(super) fn rows(&self) -> [(Watched, Option<f64>); 11] {
        [
            (Watched::Speed, self.speed),
            (Watched::SpeedJump, self.speed_jump),
            (Watched::DensityErrorMean, self.density_error_mean),
            (Watched::DensityErrorP99, self.density_error_p99),
            (Watched::DensityErrorMax, self.density_error_max),
            (Watched::Capped, self.capped),
            (Watched::Residual, self.residual),
            (Watched::Divergence, self.divergence),
            (Watched::Volume, self.volume),
            (Watched::Energy, self.energy),
            (Watched::Count, self.particles),
        ]
    }

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
            let limit = times * reached.max(fallen / SPEED_JUMP);
            check(Watched::SpeedJump, report.max_speed, Some(limit)).map_err(|breach| {
                let detail = format!(
                    "{} times the larger of {reached:.4} m/s, which gravity, effects and walls can \
                     bring {speed:.4} m/s of the fastest before to, and {:.4} m/s, an eighth of \
                     the speed after a fall from twice the water's mean height",
                    shown(times),
                    fallen / SPEED_JUMP
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
    /// Bounds the speed that gravity, effects and moving boundaries give in frame `frame` to a
    /// particle of `speed`, m/s; at least a tenth of a spacing per frame. What absorbing walls add
    /// to their own motion is included as far as the scene has their states.
    pub fn reached_speed(&self, frame: u32, speed: f64) -> f64 {
        let length = self.shot.frame_seconds();
        let start = f64::from(frame.saturating_sub(1)) * length;
        let push = self.peak_boundary_speed(start, start + length);
        let least = LEAST_ENERGY_SPEED * self.particle_spacing() / length;
        let gained = self.water.gravity.length() * length + self.effects.push().gained(length);
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// Ten particles of 1 kg, 50 frames per second, d = 0.1 m: the least energy is that of
    /// 0.5 m/s, 1.25 J.
    fn scene(method: &str) -> Scene {
        let text = r#"
            [shot]
            name = "budget"
            frames = 1
            frames_per_second = 50
            [domain]
            min = [0.0, 0.0, 0.0]
            max = [2.0, 3.0, 6.0]
            [water]
            gravity = [0.0, -10.0, 0.0]
            [[water.block]]
            min = [0.0, 0.0, 0.0]
            max = [0.5, 0.5, 0.5]
            [[wave_maker]]
            wall = "-x"
            motion = { kind = "constant_velocity", velocity = 1.5, until = 0.01 }
            [solver]
            [solver.pbf]
            particle_spacing = 0.1
            [solver.flip]
            cell_size = 0.2
        "#;
        let method = [format!("solver.method={method}")];
        Scene::parse(text, Path::new("budget.toml"), Path::new("."), &method).expect("a scene")
    }

    /// A limit a millionth below the measured value fails, one a millionth above passes.
    fn measured(budget: impl Fn(&mut Budget, f64), report: &StepReport, expected: f64) {
        let scene = scene("pbf");
        let look = |limit: f64| {
            let mut held = Budget::default();
            budget(&mut held, limit);
            let before = Before {
                energy: 100.0,
                speed: 3.0,
                start_volume: Some(2.0),
            };
            held.check_frame(&scene, 3, 10, report, &before)
        };
        assert_eq!(look(expected * (1.0 + 1e-6)), Ok(()));
        let breach = look(expected * (1.0 - 1e-6)).unwrap_err();
        assert!((breach.measured / expected - 1.0).abs() < 1e-12, "{breach}");
    }

    fn report() -> StepReport {
        let scene = scene("pbf");
        StepReport {
            substeps: 4,
            capped: 3,
            kinetic_energy: 130.0,
            potential_energy: 20.0,
            boundary_work: 20.0,
            volume: Some(1.9),
            max_speed: 7.0,
            density_error_mean: 0.02,
            density_error_p99: 0.3,
            density_error_max: 0.9,
            ..scene.report(&Default::default(), [].into_iter())
        }
    }

    /// By hand: 3 clamped of 10 particles in 4 substeps; 1.9 m³ of 2. 150 J after 100 J and 20
    /// J of work are 30 J too many, relative to 100 + 20 + 1.25; with −20 J of work 70 J,
    /// relative to the same.
    #[test]
    fn frames_are_held_to_what_a_hand_counts() {
        let report = report();
        measured(|b, limit| b.capped = Some(limit), &report, 3.0 / 40.0);
        measured(|b, limit| b.volume = Some(limit), &report, 0.05);
        measured(|b, limit| b.speed = Some(limit), &report, 7.0);
        // 3 m/s, and 0.2 m/s from gravity in a fiftieth of a second; the wall has stopped by then.
        // The limit is a factor.
        let jump = |times: f64| {
            let held = Budget {
                speed_jump: Some(times),
                ..Budget::default()
            };
            let before = Before {
                speed: 3.0,
                ..Before::default()
            };
            held.check_frame(&scene("flip"), 3, 0, &report, &before)
        };
        assert_eq!(jump(7.0 / 3.2 * (1.0 + 1e-6)), Ok(()));
        let breach = jump(7.0 / 3.2 * (1.0 - 1e-6)).unwrap_err();
        assert_eq!(breach.watched, Watched::SpeedJump);
        assert!(
            breach.to_string().contains("budget.speed_jump allows"),
            "{breach}"
        );
        // From rest, 8 times 0.2 m/s is less than a fall of 3 m, √60 m/s: the top of 10 kg
        // with 150 J. Control: a jet as fast in shallow water with a tenth of that energy, in
        // a domain as high.
        let fall = |max_speed: f64, energy: f64| {
            let held = Budget {
                speed_jump: Some(SPEED_JUMP),
                ..Budget::default()
            };
            let report = StepReport {
                max_speed,
                ..report.clone()
            };
            let before = Before {
                energy,
                ..Before::default()
            };
            held.check_frame(&scene("flip"), 3, 10, &report, &before)
        };
        let jumps = |found: Result<(), Breach>| {
            found.is_err_and(|breach| breach.watched == Watched::SpeedJump)
        };
        assert!(!jumps(fall(60.0_f64.sqrt() * (1.0 - 1e-6), 150.0)));
        assert!(jumps(fall(60.0_f64.sqrt() * (1.0 + 1e-6), 150.0)));
        assert!(jumps(fall(60.0_f64.sqrt() * (1.0 - 1e-6), 15.0)));
        measured(|b, limit| b.density_error_mean = Some(limit), &report, 0.02);
        measured(|b, limit| b.density_error_p99 = Some(limit), &report, 0.3);
        measured(|b, limit| b.density_error_max = Some(limit), &report, 0.9);
        measured(|b, limit| b.energy = Some(limit), &report, 30.0 / 121.25);
        let against = StepReport {
            boundary_work: -20.0,
            ..report
        };
        measured(|b, limit| b.energy = Some(limit), &against, 70.0 / 121.25);
        let allowed = scene("pbf").allowed_energy(10, 100.0, 20.0, 0.2);
        assert!((allowed - (120.0 + 0.2 * 121.25)).abs() < 1e-12);
    }

    /// The divergence limit applies to the relative change of a cell's volume in a substep.
    #[test]
    fn projections_are_held_to_residual_and_divergence() {
        let budget = Budget {
            residual: Some(0.01),
            divergence: Some(0.1),
            ..Budget::default()
        };
        let look = |residual, divergence| budget.check_projection(1, 2, residual, divergence, 0.02);
        assert_eq!(look(0.01, 4.999), Ok(()));
        assert_eq!(look(0.010_001, 0.0).unwrap_err().substep, Some(2));
        let breach = look(0.0, 5.001).unwrap_err();
        assert_eq!(breach.watched, Watched::Divergence);
        assert!((breach.measured - 0.100_02).abs() < 1e-12);
    }

    /// Four times the speed of a fall through the box's diagonal of 7 m plus that of the wall: 4
    /// (√140 + 1.5) m/s.
    #[test]
    fn the_speed_is_that_of_a_fall_and_a_push() {
        for (method, energy) in [("pbf", 0.25), ("flip", 0.1)] {
            let budget = scene(method).budget;
            let expected = 4.0 * (140.0f64.sqrt() + 1.5);
            let speed = budget.speed.expect("by default");
            // Ten spacings per frame are only 50 m/s.
            assert!((speed - expected).abs() < 1e-9 && speed > 50.0, "{speed}");
            assert_eq!(budget.energy, Some(energy));
            assert_eq!(budget.speed_jump, (method == "flip").then_some(8.0));
            assert_eq!(budget.density_error_max, (method == "flip").then_some(4.0));
            assert_eq!((budget.capped, budget.volume), (Some(0.01), None));
        }
    }
}
