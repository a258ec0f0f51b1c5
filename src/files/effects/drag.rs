//! Keys of air drag.

use swell_scene::effects::drag::Settings;

use super::Declared;
use crate::declare::keys;

keys! { fields of Settings {
    drop_radius: f64 = number(1e-6..=10.0)
        .unit("metres")
        .about(
            "of the drops that a particle stands for which flies alone; the \
             air slows small ones more",
        ),
    wind: [f64; 3] = vector(3, -1e3..=1e3)
        .unit("m/s")
        .default("[0.0, 0.0, 0.0]")
        .about("velocity of the air"),
} }

impl Declared for Settings {
    const ABOUT: &'static str = "Drag of air on drops and thin sheets (Schiller and Naumann 1933)";
}
