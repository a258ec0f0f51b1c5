//! Keys of vorticity confinement.

use swell_scene::effects::vorticity_confinement::Settings;

use super::Declared;
use crate::declare::keys;

keys! { fields of Settings {
    // Below a millionth, a frame of 32-bit velocities hardly changes.
    strength: f64 = number(1e-6..=100.0).about(
        "ε, metres per second squared for each 1/s of vorticity and metre of support \
         radius (PBF) or cell (FLIP)",
    ),
} }

impl Declared for Settings {
    const ABOUT: &'static str =
        "Vorticity confinement (Macklin and Müller 2013; on the grid Fedkiw et al. 2001)";
}
