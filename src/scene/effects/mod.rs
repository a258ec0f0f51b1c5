//! Effects that a scene may name under `[effects]`: one entry in a list, and one
//! file in each crate.
//!
//! An effect's file here holds its settings and their properties. Its keys are in a file of that
//! name in `files::effects`, its contribution to each solver in `solve::effects`, the `f64`
//! reference passes in `reference`, and the comparison of the two in `check`.

pub mod zone;

use glam::DVec3;

use super::{lint::Made, open_waves::Waves};
use swell_domain::open_waves::OpenWaves;
use zone::Zone;

/// Properties of an effect's settings.
pub(super) trait Effect {
    /// Returns the part of the effect that acts on PBF's projection grid as it does on FLIP's.
    fn on_projection(&self) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// Whether the effect is solved on the grid between two projections. Such an effect also
    /// enforces no-slip walls.
    fn acts_between_projections(&self) -> bool {
        false
    }

    /// Whether the effect uses PBF's neighbours, at the positions after the velocity update.
    fn looks_at_neighbors(&self) -> bool {
        false
    }

    /// Part of the velocity that a frame of FLIP takes from the grid on behalf of this effect.
    fn blend(&self) -> f64 {
        0.0
    }

    /// Acceleration of particles by the effect.
    fn push(&self) -> Push {
        Push::default()
    }

    /// Speed that energy released by the effect may give to water, m/s; the budget allows for it.
    fn frees(&self, _: Grain) -> f64 {
        0.0
    }

    /// Longest stable substep, s.
    fn longest_step(&self, _: Grain) -> f64 {
        f64::INFINITY
    }

    /// Warning for legal but suspicious settings, beginning with the key.
    fn lint(&self, _: Grain) -> Option<String> {
        None
    }

    /// Zones in which the effect absorbs waves.
    fn absorbs(&self) -> Option<Absorbs<'_>> {
        None
    }

    /// Waves that the effect generates, with their key.
    fn generates(&self) -> Option<(&'static str, &Waves)> {
        None
    }
}

/// Scales by which the numbers of an effect are judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grain {
    /// Density of the water, kg/m³.
    pub density: f64,
    /// Magnitude of gravity, m/s².
    pub gravity: f64,
    /// Particle spacing, metres.
    pub spacing: f64,
    /// Edge of a cell of the pressure grid, metres.
    pub cell: f64,
}

/// Bounds on the acceleration of particles by an effect.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Push {
    /// Largest acceleration, m/s².
    pub acceleration: f64,
    /// Largest total gain of speed, m/s.
    pub speed: f64,
}

impl Push {
    /// Returns the largest gain of speed in `seconds`, m/s.
    pub(super) fn gained(self, seconds: f64) -> f64 {
        (self.acceleration * seconds).min(self.speed)
    }
}

/// Wave-absorbing zones of an effect.
pub(super) struct Absorbs<'a> {
    pub(super) zone: Zone<'a>,
    /// Longest period of the waves that they absorb, s.
    pub(super) period: f64,
    /// Least length of a zone in wavelengths of that period.
    pub(super) least: f64,
}

/// Passes the list of effects, in the order in which they act, to a macro.
#[doc(hidden)]
#[macro_export]
macro_rules! with_effects {
    ($callback:ident) => {
        $callback! {
            viscosity, vorticity_confinement, drag, absorbing_zone, generation_zone, surface_tension
        }
    };
}
pub use crate::with_effects;

macro_rules! effects {
    ($($name:ident),+ $(,)?) => {
        $(pub mod $name;)+

        /// Settings of the effects that a scene names; all others are `None`.
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

            /// Returns the name of the first enabled effect that is no zone of waves.
            pub fn beside_zones(&self) -> Option<&'static str> {
                let zones: [(bool, &'static str); Self::NAMES.len()] = [$((
                    self.$name.as_ref().is_some_and(|it| {
                        Effect::absorbs(it).is_none() && Effect::generates(it).is_none()
                    }),
                    stringify!($name),
                )),+];
                let other = zones.into_iter().find(|(is_other, _)| *is_other);
                other.map(|(_, name)| name)
            }

            /// Returns whether an effect is solved between two projections.
            pub fn act_between_projections(&self) -> bool {
                false$(|| self.$name.as_ref().is_some_and(Effect::acts_between_projections))+
            }

            /// Returns whether an effect uses PBF's neighbours, at the positions after the
            /// velocity update.
            pub fn look_at_neighbors(&self) -> bool {
                false$(|| self.$name.as_ref().is_some_and(Effect::looks_at_neighbors))+
            }

            /// Returns the PIC blend of each enabled effect per frame of FLIP.
            pub(super) fn blends(&self) -> Vec<f64> {
                let mut blends = Vec::new();
                $(blends.extend(self.$name.as_ref().map(Effect::blend));)+
                blends
            }

            /// Returns the sum of the accelerations of all enabled effects.
            pub fn push(&self) -> Push {
                let mut all = Push::default();
                $(
                    let push = self.$name.as_ref().map(Effect::push).unwrap_or_default();
                    all.acceleration += push.acceleration;
                    all.speed += push.speed;
                )+
                all
            }

            /// Returns the speed that energy released by the enabled effects may
            /// give to water, m/s.
            pub fn frees(&self, grain: Grain) -> f64 {
                let mut all = 0.0;
                $(all += self.$name.as_ref().map_or(0.0, |settings| settings.frees(grain));)+
                all
            }

            /// Returns the longest substep stable with the enabled effects, s, and the name of the
            /// effect that limits it; infinite if none does.
            pub(super) fn longest_step(&self, grain: Grain) -> (f64, &'static str) {
                let mut least = (f64::INFINITY, "");
                $(
                    let longest = self
                        .$name
                        .as_ref()
                        .map_or(f64::INFINITY, |settings| settings.longest_step(grain));
                    if longest < least.0 {
                        least = (longest, stringify!($name));
                    }
                )+
                least
            }

            /// Returns the part of the effects that acts on PBF's projection grid.
            pub(super) fn on_projection(&self) -> Self {
                Self { $($name: self.$name.as_ref().and_then(Effect::on_projection)),+ }
            }

            /// Returns the warnings of the enabled effects for legal but suspicious settings.
            pub(super) fn lints(&self, grain: Grain) -> Vec<String> {
                let mut lints = Vec::new();
                $(lints.extend(self.$name.as_ref().and_then(|settings| settings.lint(grain)));)+
                lints
            }

            /// Returns the wave-absorbing zones with the names of their effects.
            pub(super) fn absorbing(&self) -> Vec<(&'static str, Absorbs<'_>)> {
                let mut zones = Vec::new();
                $(zones.extend(
                    self.$name
                        .as_ref()
                        .and_then(Effect::absorbs)
                        .map(|zone| (stringify!($name), zone)),
                );)+
                zones
            }

            /// Returns the waves of the first enabled effect that generates any, with their key.
            pub fn generated(&self) -> Option<(&'static str, &Waves)> {
                None$(.or_else(|| self.$name.as_ref()?.generates()))+
            }

            /// Returns what lints have to know of the generated waves.
            pub(super) fn made(&self) -> Option<Made> {
                let (key, waves) = self.generated()?;
                Some(waves.made(key.to_owned()))
            }

            /// Returns the theory of the generated waves for a gravity, m/s².
            pub fn waves(&self, gravity: DVec3) -> Option<OpenWaves> {
                Some(self.generated()?.1.by(gravity.length()))
            }
        }
    };
}

with_effects!(effects);
