//! Effects that a scene may name under `[effects]`: one word in a list, one file here, and one a reference solver.
//!
//! An effect's file here holds its settings, their keys, and what it adds to the plan of each solver. Its
//! passes bind buffers by name and run in order: of PBF after the velocity update, of FLIP on the grid
//! before the projection. Their f64 twins stand in a file of the same name in `reference`.

use super::key::Key;
use crate::gpu::program::{BufferSpec, PassSpec};

/// What an effect adds to the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct EffectPlan {
    /// Key under `[effects]`.
    pub name: &'static str,
    /// In the order in which they run.
    pub passes: Vec<PassSpec>,
    /// Beyond what the solver has anyway.
    pub buffers: Vec<BufferSpec>,
    /// Part of the velocity that a frame takes from the grid for it; of FLIP alone.
    pub blend: f64,
}

/// Gives the list of effects, in the order in which they act, to a macro.
macro_rules! with_effects {
    ($callback:ident) => {
        $callback!(viscosity, vorticity_confinement);
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
            pub(super) const KEYS: &[Key] = &[
                $(Key::inline(stringify!($name), $name::KEYS).absent().about($name::ABOUT)),+
            ];

            /// What the named effects add for `particles` particles.
            pub fn plans(&self, particles: usize) -> Vec<EffectPlan> {
                let mut plans = Vec::new();
                $(
                    if let Some(settings) = &self.$name {
                        let (passes, buffers) = settings.plan(particles);
                        plans.push(EffectPlan { name: stringify!($name), passes, buffers, blend: 0.0 });
                    }
                )+
                plans
            }

            /// What the named effects add to FLIP with so many cells in its arrays.
            pub fn flip_plans(&self, cells: usize) -> Vec<EffectPlan> {
                let mut plans = Vec::new();
                $(
                    if let Some(settings) = &self.$name {
                        let (passes, buffers, blend) = settings.flip_plan(cells);
                        plans.push(EffectPlan { name: stringify!($name), passes, buffers, blend });
                    }
                )+
                plans
            }
        }
    };
}

with_effects!(effects);
