//! Surface tension: at a surface of curvature κ the pressure in water exceeds that
//! of the air by σ κ.

use std::f64::consts::{PI, TAU};

use serde::{Deserialize, Serialize};

use super::{Effect, Grain};
use crate::words::shown;

/// Bond number ρ g d² / σ of a particle spacing d above which surface tension has no visible
/// effect: the features that it shapes, about a capillary length wide, are smaller than a particle.
const MOST_BOND: f64 = 1.0;

/// `surface_tension = { coefficient = 0.0728 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// σ, N/m.
    pub coefficient: f64,
}

impl Effect for Settings {
    fn on_projection(&self) -> Option<Self> {
        Some(self.clone())
    }

    fn lint(&self, grain: Grain) -> Option<String> {
        let bond = grain.density * grain.gravity * grain.spacing.powi(2) / self.coefficient;
        (bond > MOST_BOND).then(|| {
            format!(
                "effects.surface_tension.coefficient: the Bond number ρ g d² / σ of a particle \
                 spacing of {} m is {bond:.1}; above {MOST_BOND} it changes nothing that is seen",
                shown(grain.spacing)
            )
        })
    }

    /// Speed of a particle if the surface energy of an isolated drop all became kinetic energy.
    fn frees(&self, grain: Grain) -> f64 {
        let radius = grain.spacing * (3.0 / (4.0 * PI)).cbrt();
        (6.0 * self.coefficient / (grain.density * radius)).sqrt()
    }

    /// Capillary waves of two cells must not outrun the grid (Denner and van Wachem 2015, eq. 20,
    /// for massless air).
    fn longest_step(&self, grain: Grain) -> f64 {
        (grain.density * grain.cell.powi(3) / (TAU * self.coefficient)).sqrt()
    }
}
