//! XSPH viscosity (Schechter and Bridson 2012; Macklin and Müller 2013, eq. 17).

use serde::{Deserialize, Serialize};

use super::super::key::Key;
use crate::gpu::{
    program::{BufferSpec, PassSpec},
    sort::storage,
};

/// What it is, for the page of keys.
pub(super) const ABOUT: &str = "XSPH viscosity (Schechter and Bridson 2012)";

/// Its keys.
pub(super) const KEYS: &[Key] = &[
    // A millionth is what a frame of 32-bit velocities hardly shows.
    Key::number("xsph", 1e-6..=1.0)
        .about("c, the part of the neighbours' mean relative velocity that a substep of PBF, or a frame of FLIP, takes over"),
];

/// `viscosity = { xsph = 0.01 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// c: the part of the neighbours' mean relative velocity that a substep of PBF, or a frame of FLIP, takes
    /// over, 0 to 1.
    pub xsph: f64,
}

impl Settings {
    pub(super) fn plan(&self, particles: usize) -> (Vec<PassSpec>, Vec<BufferSpec>) {
        let gather = PassSpec {
            name: "effects/viscosity_gather",
            defines: Vec::new(),
            constants: vec![("XSPH", self.xsph)],
        };
        let apply = PassSpec { name: "effects/viscosity_apply", defines: Vec::new(), constants: Vec::new() };
        (vec![gather, apply], vec![storage("viscosity_change", 16 * particles as u64)])
    }

    /// XSPH's mean of the neighbours' velocities is what the grid holds: c is a further part taken from it,
    /// without a pass of its own.
    pub(super) fn flip_plan(&self, _cells: usize) -> (Vec<PassSpec>, Vec<BufferSpec>, f64) {
        (Vec::new(), Vec::new(), self.xsph)
    }
}
