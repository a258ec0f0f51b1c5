//! Vorticity confinement (Macklin and Müller 2013, eqs. 15 and 16; on the grid Fedkiw et al. 2001).

use serde::{Deserialize, Serialize};

use super::Effect;

/// `vorticity_confinement = { strength = 0.1 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// ε: metres per second squared for each 1/s of vorticity and metre of support radius (PBF) or cell (FLIP).
    pub strength: f64,
}

impl Effect for Settings {
    /// A millionth is what a frame of 32-bit velocities hardly shows.
    fn fault(&self) -> Option<(&'static str, f64, &'static str)> {
        (!(1e-6..=100.0).contains(&self.strength)).then_some((
            "strength",
            self.strength,
            "a number from 1e-6 to 100",
        ))
    }
}
