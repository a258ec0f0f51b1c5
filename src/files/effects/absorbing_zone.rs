//! Keys and checks of absorbing zones.

use swell_scene::{SceneError, Wall, effects::absorbing_zone::Settings};

use super::{Declared, Surroundings, zone};
use crate::{declare::keys, document::Document, key::words};

keys! { fields of Settings {
    walls: Vec<Wall> = choices(&words(&Wall::NAMED))
        .also(", each once, none of them periodic or a wave maker's")
        .about("the walls, whose wave is not turned back"),
    length: f64 = number(1e-7..=1e6)
        .unit("metres")
        .also(", at least two particle spacings and no longer than the domain is")
        .about(
            "of each zone from its wall; one and a half wave lengths turn back less than \
             5 % of a wave's height",
        ),
    period: f64 = number(1e-6..=1e6).unit("s").about(
        "of the longest waves that have to die out: velocities fall by 5π/period at the \
         wall, and by the square of the way into the zone before it",
    ),
} }

impl Declared for Settings {
    const ABOUT: &'static str =
        "Zones before walls in which waves die out (a sponge layer, Israeli and Orszag 1981)";

    fn check(&self, doc: &Document<'_>, around: &Surroundings<'_>) -> Result<(), SceneError> {
        zone::check(&self.zone(), doc, "effects.absorbing_zone", around)
    }
}
