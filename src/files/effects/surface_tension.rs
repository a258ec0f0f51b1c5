//! Keys and checks of surface tension.

use swell_scene::{SceneError, effects::surface_tension::Settings};

use super::{Declared, Surroundings};
use crate::{declare::keys, document::Document};

keys! { fields of Settings {
    coefficient: f64 = number(1e-9..=1e6).unit("N/m").about(
        "σ, of water in air 0.0728 at 20 °C; a substep is no longer than √(ρ Δx³ / (2π σ))",
    ),
} }

impl Declared for Settings {
    const ABOUT: &'static str =
        "Surface tension, as the jump of the pressure at the surface (Kang, Fedkiw and Liu 2000)";

    fn check(&self, doc: &Document<'_>, around: &Surroundings<'_>) -> Result<(), SceneError> {
        match around.has_projection {
            true => Ok(()),
            false => Err(doc.fault_of_plain(
                "effects.surface_tension",
                "is part of the projection, which solver.pbf.grid_projection = false turns off: \
                 set it to true",
            )),
        }
    }
}
