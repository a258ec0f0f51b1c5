//! Keys of the effects that a scene may name under `[effects]`, and checks of their settings.

mod zone;

use glam::DVec3;

use swell_domain::bounds::Bounds;
use swell_scene::{Effects, SceneError, WaveMaker, effects::with_effects};

use crate::{declare::Keyed, document::Document, key::Key};

/// Parts of a scene that an effect is checked against.
pub(super) struct Surroundings<'a> {
    pub(super) domain: &'a Bounds,
    pub(super) periodic: [bool; 3],
    pub(super) wave_makers: &'a [WaveMaker],
    /// Gravitational acceleration, m/s².
    pub(super) gravity: DVec3,
    /// Velocity of the undisturbed water, m/s.
    pub(super) current: DVec3,
    /// Least length of a zone, metres: two particle spacings.
    pub(super) least_length: f64,
    /// Whether the solver projects velocities on a grid.
    pub(super) has_projection: bool,
}

/// Settings of an effect with their keys.
trait Declared: Keyed {
    /// Description for the page of keys.
    const ABOUT: &'static str;

    /// Rejects settings that do not fit the scene.
    fn check(&self, _: &Document<'_>, _: &Surroundings<'_>) -> Result<(), SceneError> {
        Ok(())
    }
}

macro_rules! declared {
    ($($name:ident),+ $(,)?) => {
        $(mod $name;)+

        /// Keys of each effect in a table of its own.
        impl Keyed for Effects {
            const KEYS: &'static [Key] = &[$(
                Key::inline(
                    stringify!($name),
                    <swell_scene::effects::$name::Settings as Keyed>::KEYS,
                )
                .absent()
                .about(<swell_scene::effects::$name::Settings as Declared>::ABOUT)
            ),+];
        }

        /// Rejects settings that do not fit the scene.
        pub(super) fn check(
            effects: &Effects,
            doc: &Document<'_>,
            around: &Surroundings<'_>,
        ) -> Result<(), SceneError> {
            $(effects.$name.iter().try_for_each(|settings| settings.check(doc, around))?;)+
            Ok(())
        }
    };
}

with_effects!(declared);
