//! Vorticity confinement (Macklin and Müller 2013, eqs. 15 and 16; on the grid Fedkiw et al. 2001).

use serde::{Deserialize, Serialize};

use super::super::key::Key;
use crate::gpu::{
    program::{BufferSpec, PassSpec},
    sort::storage,
};

/// What it is, for the page of keys.
pub(super) const ABOUT: &str = "Vorticity confinement (Macklin and Müller 2013; on the grid Fedkiw et al. 2001)";

/// Its keys.
pub(super) const KEYS: &[Key] = &[
    // A millionth is what a frame of 32-bit velocities hardly shows.
    Key::number("strength", 1e-6..=100.0)
        .about("ε, metres per second squared for each 1/s of vorticity and metre of support radius (PBF) or cell (FLIP)"),
];

/// `vorticity_confinement = { strength = 0.1 }`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// ε: metres per second squared for each 1/s of vorticity and metre of support radius (PBF) or cell (FLIP).
    pub strength: f64,
}

impl Settings {
    pub(super) fn plan(&self, particles: usize) -> (Vec<PassSpec>, Vec<BufferSpec>) {
        let curl = PassSpec { name: "effects/vorticity_curl", defines: Vec::new(), constants: Vec::new() };
        let force = PassSpec {
            name: "effects/vorticity_force",
            defines: Vec::new(),
            constants: vec![("STRENGTH", self.strength)],
        };
        (vec![curl, force], vec![storage("vorticity", 16 * particles as u64)])
    }

    pub(super) fn flip_plan(&self, cells: usize) -> (Vec<PassSpec>, Vec<BufferSpec>, f64) {
        let curl = PassSpec { name: "effects/grid_curl", defines: Vec::new(), constants: Vec::new() };
        let force = PassSpec {
            name: "effects/grid_confinement",
            defines: Vec::new(),
            constants: vec![("STRENGTH", self.strength)],
        };
        (vec![curl, force], vec![storage("vorticity", 16 * cells as u64)], 0.0)
    }
}
