//! Vorticity confinement (Macklin and Müller 2013, eqs. 15 and 16; on the grid Fedkiw et al. 2001).

use serde::{Deserialize, Serialize};

use super::{super::key::Key, Effect};

/// `vorticity_confinement = { strength = 0.1 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// ε, m/s² per 1/s of vorticity and per metre of support radius (PBF) or cell size (FLIP).
    pub strength: f64,
}

impl Effect for Settings {
    const ABOUT: &'static str =
        "Vorticity confinement (Macklin and Müller 2013; on the grid Fedkiw et al. 2001)";

    const KEYS: &'static [Key] = &[
        // Below a millionth, a frame of 32-bit velocities hardly changes.
        Key::number("strength", 1e-6..=100.0).about(
            "ε, metres per second squared for each 1/s of vorticity and metre of support \
                    radius (PBF) or cell (FLIP)",
        ),
    ];

    fn looks_at_neighbors(&self) -> bool {
        true
    }
}
