//! `[budget]`: what a bake is held to, and the end of it where it is not kept.

use std::fmt::{self, Write as _};

use serde::Deserialize;
use toml::Spanned;

use super::{
    Method, Scene, Shot, Solver, document::Document, error::SceneError, ranges::BUDGET,
    words::shown,
};
use crate::domain::{
    budget::{Breach, Watched},
    solver::StepReport,
};

/// Limits of a bake; `None` is one that the scene switched off. None of them is physics.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Budget {
    /// Largest speed of a particle at a frame's end, m/s.
    pub speed: Option<f64>,
    /// Mean of max(0, ρ/ρ0 − 1) at a frame's end.
    pub density_error_mean: Option<f64>,
    /// Its 99th percentile.
    pub density_error_p99: Option<f64>,
    /// Times that a particle was slowed to the displacement cap, over particles and substeps.
    pub capped: Option<f64>,
    /// Relative true residual of a projection; of FLIP alone, as the next one.
    pub residual: Option<f64>,
    /// Largest |∇·u| Δt in a cell of water after a projection.
    pub divergence: Option<f64>,
    /// |V/V0 − 1|, V0 the volume of the start.
    pub volume: Option<f64>,
    /// Rise of the total energy within a frame beyond the work done by walls and solids, over the total: kinetic, and
    /// potential against the lowest place of the domain.
    pub energy: Option<f64>,
}

/// Defaults: a few times what the shipped scenes come to, of which docs/scene.md has the largest.
const SPEED: f64 = 4.0;
const DENSITY_ERROR_MEAN: f64 = 0.5;
const DENSITY_ERROR_P99: f64 = 5.0;
const CAPPED: f64 = 0.01;
const RESIDUAL: f64 = 1e-2;
const DIVERGENCE: f64 = 0.1;
/// What a wall that overtakes drops does on them without pressure is not in the work: 6 % of a frame in the small box of
/// tests/hard_cases/24-leaving.toml, 0.1 % in the quickstart.
const FLIP_ENERGY: f64 = 0.1;
/// PBF's corrections make energy of their own where they are few and a frame is long: 4 % a frame in the quickstart, 7 %
/// with Chebyshev's.
const PBF_ENERGY: f64 = 0.25;

/// Where gravity and walls give no speed to go by: so many spacings a frame.
const LEAST_SPEED: f64 = 10.0;

/// Water with next to no energy: what moves a tenth of a spacing in a frame counts as the total.
const LEAST_ENERGY_SPEED: f64 = 0.1;

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BudgetSpec {
    speed: Option<Spanned<LimitSpec>>,
    density_error_mean: Option<Spanned<LimitSpec>>,
    density_error_p99: Option<Spanned<LimitSpec>>,
    capped: Option<Spanned<LimitSpec>>,
    residual: Option<Spanned<LimitSpec>>,
    divergence: Option<Spanned<LimitSpec>>,
    volume: Option<Spanned<LimitSpec>>,
    energy: Option<Spanned<LimitSpec>>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(untagged)]
enum LimitSpec {
    Switch(bool),
    Limit(f64),
}

/// A number of the budget's range and of at least `least`, or `false`.
fn limit(
    doc: &Document<'_>,
    value: &Option<Spanned<LimitSpec>>,
    default: Option<f64>,
    least: f64,
) -> Result<Option<f64>, SceneError> {
    let Some(value) = value else {
        return Ok(default);
    };
    match *value.get_ref() {
        LimitSpec::Switch(false) => Ok(None),
        LimitSpec::Switch(true) => Err(doc.fault_at(value.span(), "true is no limit")),
        LimitSpec::Limit(limit) if BUDGET.contains(&limit) && limit >= least => Ok(Some(limit)),
        LimitSpec::Limit(limit) => {
            Err(doc.fault_at(value.span(), format!("{} is out of range", shown(limit))))
        }
    }
}

/// Largest speed that a scene gives rise to by itself: of a fall through all of its domain, and of what pushes.
pub(super) struct Scales {
    pub(super) fall: f64,
    pub(super) push: f64,
    pub(super) spacing: f64,
}

/// Builds the table for the chosen solver.
pub(super) fn build(
    doc: &Document<'_>,
    spec: &BudgetSpec,
    shot: &Shot,
    solver: &Solver,
    scales: &Scales,
) -> Result<Budget, SceneError> {
    let tolerance = (solver.flip.as_ref()).map_or(0.0, |flip| flip.pressure.tolerance);
    let slowest = LEAST_SPEED * scales.spacing * shot.frames_per_second;
    let speed = (SPEED * (scales.fall + scales.push)).max(slowest);
    let energy = match solver.method {
        Method::Pbf => PBF_ENERGY,
        Method::Flip => FLIP_ENERGY,
    };
    let plain = |value, default| limit(doc, value, default, 0.0);
    Ok(Budget {
        speed: plain(&spec.speed, Some(speed))?,
        density_error_mean: plain(&spec.density_error_mean, Some(DENSITY_ERROR_MEAN))?,
        density_error_p99: plain(&spec.density_error_p99, Some(DENSITY_ERROR_P99))?,
        capped: plain(&spec.capped, Some(CAPPED))?,
        residual: limit(
            doc,
            &spec.residual,
            Some(RESIDUAL.max(tolerance)),
            tolerance,
        )?,
        divergence: plain(&spec.divergence, Some(DIVERGENCE))?,
        volume: plain(&spec.volume, None)?,
        energy: plain(&spec.energy, Some(energy))?,
    })
}

impl Budget {
    /// As [`Scene::to_toml`] writes it.
    pub(super) fn write(&self, out: &mut String) -> fmt::Result {
        writeln!(out, "\n[budget]")?;
        for (watched, limit) in self.rows() {
            match limit {
                Some(limit) => writeln!(out, "{} = {limit:?}", watched.name())?,
                None => writeln!(out, "{} = false", watched.name())?,
            }
        }
        Ok(())
    }

    fn rows(&self) -> [(Watched, Option<f64>); 8] {
        [
            (Watched::Speed, self.speed),
            (Watched::DensityErrorMean, self.density_error_mean),
            (Watched::DensityErrorP99, self.density_error_p99),
            (Watched::Capped, self.capped),
            (Watched::Residual, self.residual),
            (Watched::Divergence, self.divergence),
            (Watched::Volume, self.volume),
            (Watched::Energy, self.energy),
        ]
    }

    /// Holds a projection of `length` seconds to its limits; `divergence` is the largest |∇·u| after it, 1/s.
    ///
    /// # Errors
    /// The first breach; one that is no number breaches every limit.
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

    /// Holds a frame of so many particles to what its report says. `energy` is what [`Scene::total_energy`] gave for the
    /// frame before, joule; `start_volume` that of the bake's start, m³.
    ///
    /// # Errors
    /// The first breach.
    pub fn check_frame(
        &self,
        scene: &Scene,
        frame: u32,
        particles: usize,
        report: &StepReport,
        energy: f64,
        start_volume: Option<f64>,
    ) -> Result<(), Breach> {
        let check = |watched, measured, limit| Breach::check(frame, watched, measured, limit);
        check(Watched::Speed, report.max_speed, self.speed)?;
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
    /// Kinetic and potential energy of a state of so many particles, the latter against the domain's lowest place,
    /// joule.
    pub fn total_energy(&self, particles: usize, report: &StepReport) -> f64 {
        let mass = self.particle_mass() * particles as f64;
        let (gravity, size) = (self.water.gravity, self.domain.size());
        let lowest: f64 = (0..3).map(|k| (-gravity[k] * size[k]).min(0.0)).sum();
        report.kinetic_energy + report.potential_energy - mass * lowest
    }

    /// The most that a frame may end with where it began with `energy`, `work` was done in it, and `limit` is the
    /// budget, joule.
    pub fn allowed_energy(&self, particles: usize, energy: f64, work: f64, limit: f64) -> f64 {
        energy + work + limit * self.energy_scale(particles, energy, work)
    }

    /// The total that a rise is a part of. Something is added to it, so that water at rest on the floor may stir.
    fn energy_scale(&self, particles: usize, energy: f64, work: f64) -> f64 {
        let speed = LEAST_ENERGY_SPEED * self.particle_spacing() * self.shot.frames_per_second;
        let least = 0.5 * self.particle_mass() * particles as f64 * speed * speed;
        energy + work.abs() + least
    }

    /// kg.
    pub fn particle_mass(&self) -> f64 {
        self.water.rest_density * self.particle_spacing().powi(3)
    }
}
