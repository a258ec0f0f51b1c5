//! XSPH viscosity (Schechter and Bridson 2012; Macklin and Müller 2013, eq. 17).

use serde::{Deserialize, Serialize};

use super::{super::key::Key, Effect};

/// `viscosity = { xsph = 0.01 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// c: the part of the neighbours' mean relative velocity that a substep of PBF, or a frame of FLIP, takes
    /// over, 0 to 1.
    pub xsph: f64,
}

impl Effect for Settings {
    const ABOUT: &'static str = "XSPH viscosity (Schechter and Bridson 2012)";

    const KEYS: &'static [Key] = &[
        // A millionth is what a frame of 32-bit velocities hardly shows.
        Key::number("xsph", 1e-6..=1.0)
            .about("c, the part of the neighbours' mean relative velocity that a substep of PBF, or a frame of FLIP, takes over"),
    ];

    /// XSPH's mean of the neighbours' velocities is what the grid holds: c is a further part taken from it, without a
    /// pass of its own.
    fn blend(&self) -> f64 {
        self.xsph
    }
}
