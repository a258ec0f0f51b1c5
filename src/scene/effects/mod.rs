//! Effects that a scene may name under `[effects]`: one word in a list, and a file in each room.
//!
//! An effect's file here holds its settings and their keys. What it adds to each solver stands in a file of the
//! same name in `solve::effects`, its f64 twins in `reference`, and what holds the two against each other in `check`.

pub mod zone;

use glam::DVec3;

use super::{WaveMaker, document::Document, error::SceneError, key::Key, lint::Made};
use swell_domain::{bounds::Bounds, open_waves::OpenWaves};
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
    /// Whether the solver makes velocities free of divergence on a grid.
    pub(super) has_projection: bool,
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

    /// What of it acts on the grid that makes PBF's velocities free of divergence, as it does on FLIP's.
    fn on_projection(&self) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// Whether it is solved on the grid between two projections; it then holds water to no-slip walls.
    fn acts_between_projections(&self) -> bool {
        false
    }

    /// Whether it looks at PBF's neighbours, at the places that the velocity update leaves.
    fn looks_at_neighbors(&self) -> bool {
        false
    }

    /// Part of the velocity that a frame of FLIP takes from the grid for it.
    fn blend(&self) -> f64 {
        0.0
    }

    /// How it makes particles faster.
    fn push(&self) -> Push {
        Push::default()
    }

    /// Speed that what it sets free may give to water, m/s: a budget allows for it.
    fn frees(&self, _: Grain) -> f64 {
        0.0
    }

    /// The longest substep that it is stable in, s.
    fn longest_step(&self, _: Grain) -> f64 {
        f64::INFINITY
    }

    /// What of it is hardly meant, with its key first.
    fn lint(&self, _: Grain) -> Option<String> {
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

/// What an effect's numbers are judged by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Grain {
    /// Of the water, kg/m³.
    pub(super) density: f64,
    /// Magnitude, m/s².
    pub(super) gravity: f64,
    /// Between particles, metres.
    pub(super) spacing: f64,
    /// Edge of a cell of the grid that the pressure is found on, metres.
    pub(super) cell: f64,
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
#[doc(hidden)]
#[macro_export]
macro_rules! with_effects {
    ($callback:ident) => {
        $callback! { viscosity, vorticity_confinement, drag, absorbing_zone, generation_zone, surface_tension }
    };
}
pub use crate::with_effects;

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

            /// Whether one is solved between two projections.
            pub fn act_between_projections(&self) -> bool {
                false$(|| self.$name.as_ref().is_some_and(Effect::acts_between_projections))+
            }

            /// Whether one looks at PBF's neighbours, at the places that the velocity update leaves.
            pub fn look_at_neighbors(&self) -> bool {
                false$(|| self.$name.as_ref().is_some_and(Effect::looks_at_neighbors))+
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

            /// Speed that what the named effects set free may give to water, m/s.
            pub(super) fn frees(&self, grain: Grain) -> f64 {
                let mut all = 0.0;
                $(all += self.$name.as_ref().map_or(0.0, |settings| settings.frees(grain));)+
                all
            }

            /// The longest substep that the named effects are stable in, s, with the name of the one that says so; infinite where none
            /// does.
            pub(super) fn longest_step(&self, grain: Grain) -> (f64, &'static str) {
                let mut least = (f64::INFINITY, "");
                $(
                    let longest = self.$name.as_ref().map_or(f64::INFINITY, |settings| settings.longest_step(grain));
                    if longest < least.0 {
                        least = (longest, stringify!($name));
                    }
                )+
                least
            }

            /// What of them acts on the grid that makes PBF's velocities free of divergence.
            pub(super) fn on_projection(&self) -> Self {
                Self { $($name: self.$name.as_ref().and_then(Effect::on_projection)),+ }
            }

            /// What of the named effects is hardly meant.
            pub(super) fn lints(&self, grain: Grain) -> Vec<String> {
                let mut lints = Vec::new();
                $(lints.extend(self.$name.as_ref().and_then(|settings| settings.lint(grain)));)+
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
