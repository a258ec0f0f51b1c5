//! Effects that a scene may name under `[effects]`: one word in a list, and a file in each room.
//!
//! An effect's file here holds its settings and their keys. What it adds to each solver stands in a file of the
//! same name in `solve::effects`, its f64 twins in `reference`, and what holds the two against each other in `check`.

pub mod zone;

use glam::DVec3;

use super::{WaveMaker, document::Document, error::SceneError, key::Key, lint::Made};
use crate::domain::{bounds::Bounds, open_waves::OpenWaves};
use zone::Zone;

/// What of a scene an effect has to fit into.
pub(super) struct Surroundings<'a> {
    pub(super) domain: &'a Bounds,
    pub(super) periodic: [bool; 3],
    pub(super) wave_makers: &'a [WaveMaker],
    /// m/s².
    pub(super) gravity: DVec3,
    /// Two particle spacings, metres: shorter than that, nothing lies in a zone.
    pub(super) least_length: f64,
}

/// What an effect's settings say of themselves.
pub(super) trait Effect {
    /// What it is, for the page of keys.
    const ABOUT: &'static str;
    /// Its keys, each with its range.
    const KEYS: &'static [Key];

    /// Refuses settings that do not fit into the scene.
    fn check(&self, _: &Document<'_>, _: &Surroundings<'_>) -> Result<(), SceneError> {
        Ok(())
    }

    /// Its key that is solved on the grid, on velocities that are free of divergence, between two projections; it holds water to no-slip walls.
    fn between_projections(&self) -> Option<&'static str> {
        None
    }

    /// Part of the velocity that a frame of FLIP takes from the grid for it.
    fn blend(&self) -> f64 {
        0.0
    }

    /// How it makes particles faster.
    fn push(&self) -> Push {
        Push::default()
    }

    /// What of it is hardly meant among particles so far apart, metres, with its key first.
    fn lint(&self, _spacing: f64) -> Option<String> {
        None
    }

    /// Zones in which waves die.
    fn absorbs(&self) -> Option<Absorbs<'_>> {
        None
    }

    /// Waves that it makes.
    fn makes(&self) -> Option<Made> {
        None
    }

    /// What theory says of them in a gravity, m/s².
    fn waves(&self, _gravity: DVec3) -> Option<OpenWaves> {
        None
    }
}

/// Makes particles faster.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Push {
    /// By no more than this, m/s².
    pub(super) acceleration: f64,
    /// And by no more than this in all, m/s.
    pub(super) speed: f64,
}

impl Push {
    /// The most that a particle gains in so many seconds, m/s.
    pub(super) fn gained(self, seconds: f64) -> f64 {
        (self.acceleration * seconds).min(self.speed)
    }
}

/// Zones in which waves die.
pub(super) struct Absorbs<'a> {
    pub(super) zone: Zone<'a>,
    /// Of the longest, s.
    pub(super) period: f64,
    /// What a zone's length is at least, of their length.
    pub(super) least: f64,
}

/// Gives the list of effects, in the order in which they act, to a macro.
macro_rules! with_effects {
    ($callback:ident) => {
        $callback! { viscosity, vorticity_confinement, drag, absorbing_zone, generation_zone }
    };
}
pub(crate) use with_effects;

macro_rules! effects {
    ($($name:ident),+ $(,)?) => {
        $(pub mod $name;)+

        /// The effects that a scene names; what is `None` does not exist.
        #[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
        #[serde(deny_unknown_fields)]
        pub struct Effects {
            $(
                #[doc = concat!("`effects.", stringify!($name), "`.")]
                #[serde(default, skip_serializing_if = "Option::is_none")]
                pub $name: Option<$name::Settings>,
            )+
        }

        impl Effects {
            /// Keys of all effects.
            pub const NAMES: &[&str] = &[$(stringify!($name)),+];

            /// Each with its own keys.
            pub(super) const KEYS: &[Key] = &[$(
                Key::inline(stringify!($name), <$name::Settings as Effect>::KEYS)
                    .absent()
                    .about(<$name::Settings as Effect>::ABOUT)
            ),+];

            /// Refuses settings that do not fit into the scene.
            pub(super) fn check(&self, doc: &Document<'_>, around: &Surroundings<'_>) -> Result<(), SceneError> {
                $(self.$name.iter().try_for_each(|settings| settings.check(doc, around))?;)+
                Ok(())
            }

            /// Those that are solved between two projections, by their key; a grid that projects another solver's velocities has them alone.
            pub fn between_projections(&self) -> (Self, Option<String>) {
                let mut all = Self::default();
                let mut key = None;
                $(
                    if let Some((settings, own)) = self.$name.as_ref().and_then(|it| Some((it, it.between_projections()?))) {
                        all.$name = Some(settings.clone());
                        key = Some(format!("effects.{}.{own}", stringify!($name)));
                    }
                )+
                (all, key)
            }

            /// Part of the velocity that a frame of FLIP takes from the grid, of each of the named effects.
            pub(super) fn blends(&self) -> Vec<f64> {
                let mut blends = Vec::new();
                $(blends.extend(self.$name.as_ref().map(Effect::blend));)+
                blends
            }

            /// How the named effects make particles faster, all at once.
            pub(super) fn push(&self) -> Push {
                let mut all = Push::default();
                $(
                    let push = self.$name.as_ref().map(Effect::push).unwrap_or_default();
                    all.acceleration += push.acceleration;
                    all.speed += push.speed;
                )+
                all
            }

            /// What of the named effects is hardly meant among particles so far apart, metres.
            pub(super) fn lints(&self, spacing: f64) -> Vec<String> {
                let mut lints = Vec::new();
                $(lints.extend(self.$name.as_ref().and_then(|settings| settings.lint(spacing)));)+
                lints
            }

            /// Zones of the named effects in which waves die, by the effect's name.
            pub(super) fn absorbing(&self) -> Vec<(&'static str, Absorbs<'_>)> {
                let mut zones = Vec::new();
                $(zones.extend(self.$name.as_ref().and_then(Effect::absorbs).map(|zone| (stringify!($name), zone)));)+
                zones
            }

            /// Waves that the named effects make.
            pub(super) fn made(&self) -> Vec<Made> {
                let mut made = Vec::new();
                $(made.extend(self.$name.as_ref().and_then(Effect::makes));)+
                made
            }

            /// What theory says of the waves of the first of the named effects that makes any, in a gravity, m/s².
            pub fn waves(&self, gravity: DVec3) -> Option<OpenWaves> {
                None$(.or_else(|| self.$name.as_ref()?.waves(gravity)))+
            }
        }
    };
}

with_effects!(effects);
