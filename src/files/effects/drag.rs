//! Keys of air drag.

use swell_scene::effects::drag::Settings;

use super::Declared;
use crate::key::Key;

impl Declared for Settings {
    const ABOUT: &'static str = "Drag of air on drops and thin sheets (Schiller and Naumann 1933)";

    const KEYS: &'static [Key] = &[
        Key::number("drop_radius", 1e-6..=10.0)
            .unit("metres")
            .about(
                "of the drops that a particle stands for which flies alone; the \
                    air slows small ones more",
            ),
        Key::vector("wind", 3, -1e3..=1e3)
            .unit("m/s")
            .default("[0.0, 0.0, 0.0]")
            .about("velocity of the air"),
    ];
}
