//! Vorticity confinement (Macklin and Müller 2013, eqs. 15 and 16; on the grid Fedkiw et al. 2001).

use serde::{Deserialize, Serialize};

use super::Effect;

/// `vorticity_confinement = { strength = 0.1 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// ε, m/s² per 1/s of vorticity and per metre of support radius (PBF) or cell size (FLIP).
    pub strength: f64,
}

impl Effect for Settings {
    fn looks_at_neighbors(&self) -> bool {
        true
    }
}
