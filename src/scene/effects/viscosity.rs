//! Viscosity: Newtonian, in Pa s, or XSPH.

use serde::{Deserialize, Serialize};

use super::{Effect, Grain};
use crate::words::shown;
use swell_domain::relaxation::Relaxation;

/// Reynolds number √(g Δx) Δx / ν of a cell above which a viscosity ν has no visible effect. The
/// transfer to the grid and back has one of 36 with PBF's projection (a viscosity of 0.028 √(g
/// Δx³)) and about 50 with FLIP's `pic_blend` of 0.05, cells of 0.1 m and 24 frames per second.
const MOST_REYNOLDS: f64 = 1000.0;

/// Default of `tolerance`.
pub const TOLERANCE: f64 = 1e-3;

/// `viscosity = { coefficient = 10.0 }`, or `viscosity = { xsph = 0.01 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, from = "Given")]
pub struct Settings {
    /// μ, Pa s; solved implicitly on the grid between two projections (Batty and Bridson 2008).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coefficient: Option<f64>,
    /// Factor by which the solve of a substep reduces the error of the velocities; only
    /// with a coefficient.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// c from 0 to 1: the part of the neighbours' mean relative velocity that a substep of PBF, or
    /// a frame of FLIP, adopts (Schechter and Bridson 2012; Macklin and Müller 2013, eq. 17).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub xsph: Option<f64>,
}

/// Settings as written in a scene, before the default tolerance is filled in.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    coefficient: Option<f64>,
    tolerance: Option<f64>,
    xsph: Option<f64>,
}

impl From<Given> for Settings {
    fn from(given: Given) -> Self {
        let default = given.coefficient.map(|_| TOLERANCE);
        Self {
            coefficient: given.coefficient,
            tolerance: given.tolerance.or(default),
            xsph: given.xsph,
        }
    }
}

impl Settings {
    /// Creates a Newtonian viscosity of `coefficient` Pa s with the default tolerance.
    pub fn newtonian(coefficient: f64) -> Self {
        Self {
            coefficient: Some(coefficient),
            tolerance: Some(TOLERANCE),
            xsph: None,
        }
    }

    /// Creates an XSPH viscosity with coefficient `c`.
    pub fn xsph(c: f64) -> Self {
        Self {
            coefficient: None,
            tolerance: None,
            xsph: Some(c),
        }
    }

    /// Returns the relaxation that solves a step of `time_step` seconds on cells of `cell_size`
    /// metres for water of `density`, kg/m³; `None` without a coefficient.
    pub fn relaxation(&self, time_step: f64, cell_size: f64, density: f64) -> Option<Relaxation> {
        let (coefficient, tolerance) = self.coefficient.zip(self.tolerance)?;
        Some(Relaxation::new(
            coefficient / density,
            time_step,
            cell_size,
            tolerance,
        ))
    }
}

impl Effect for Settings {
    /// The grid already holds XSPH's mean of the neighbours' velocities, so c adds to the PIC blend
    /// and needs no pass of its own.
    fn blend(&self) -> f64 {
        self.xsph.unwrap_or(0.0)
    }

    fn lint(&self, grain: Grain) -> Option<String> {
        let viscosity = self.coefficient? / grain.density;
        let reynolds = (grain.gravity * grain.cell).sqrt() * grain.cell / viscosity;
        (reynolds > MOST_REYNOLDS).then(|| {
            format!(
                "effects.viscosity.coefficient: the Reynolds number √(g Δx) Δx / ν of a cell of {} \
                 m is {reynolds:.0}; above {MOST_REYNOLDS} the transfer to the grid and back is \
                 more viscous",
                shown(grain.cell)
            )
        })
    }

    fn on_projection(&self) -> Option<Self> {
        self.coefficient.map(|_| self.clone())
    }

    fn looks_at_neighbors(&self) -> bool {
        self.xsph.is_some()
    }

    fn acts_between_projections(&self) -> bool {
        self.coefficient.is_some()
    }
}
